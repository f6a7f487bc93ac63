# SPDX-License-Identifier: Apache-2.0
"""Roles of the rows of a recording: which rows show the force law over position, and which only wait.

A recording is a motion. Its information on a force over position is in the distance that the tool travels,
not in the number of rows: a tool that waits repeats one position, and its force changes with time, not with
position. A row is a wait if the tool moves less, since the rows before, than a twentieth of what it moves
nearby.
"""

from __future__ import annotations

from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from ..._core.model import play
from ..._typing import Float1D, Int8Vector
from ...recording import Recording
from ...recording.motion import (
    LEAST_STROKE_ROWS,
    TURN_NOISE,
    TURN_STEPS,
    noise_of,
    resolution_of,
    strokes_from_order,
)
from .limits import FORCE_RESOLUTION


class Role(IntEnum):
    """What a row of a recording shows."""

    MOVING = 0
    """The tool moves in contact or close to it, or the order of rows shows no motion: the row is fitted"""
    APPROACH = 1
    """The tool moves without contact, further from the object than it presses into it"""
    REST = 2
    """The tool waits without contact, before, between or after the strokes"""
    HOLD = 3
    """The tool waits in contact"""


SLOW_RATIO = 0.05
"""Speed of a wait over the speed of the motion around it [-]. A hand that turns is slower than this in less
than 1 % of the time and of the travel."""

SECTIONS, LEAST_SECTION_ROWS = 16, 32
"""Number of sections of a recording, and least number of rows of a section, of which the one with the most
position noise decides: a position can have noise only while the tool waits."""

STEP = 0.0025
"""Distance over which a speed of the motion is taken, unless the noise needs more [share of the travel]."""

STEPS_AROUND = 8
"""Number of distances before a row, and after it, whose median speeds are the speed of the motion around
it."""

AIR_MARGIN = 1.0
"""Distance before the contact that is fitted, as a share of the travel in contact [-]: the force is the same
further away, however long the approach is."""

AIR_SHARE = 0.05
"""Share of the rows, those at the smallest positions, whose median force is that of the air [-]."""

AIR_BLOCKS = 500
"""Largest number of groups of neighbouring rows whose mean forces are compared with the force of the air."""

AIR_ERRORS = 4.0
"""Deviation of a mean force from that of the air at which there is contact [standard errors of both]."""

LEAST_WAIT = 0.01
"""Distance that the tool would travel during the shortest wait that is left out [share of the travel]: a
shorter one has no weight in a fit."""


def roles_of(recording: Recording, deepest: float | None = None) -> Int8Vector:
    """Returns the role of each row (n,) as the number of a :class:`Role`, from position and force in recorded
    order.

    `deepest` is the largest position of all recordings of the object, by default that of this one. A
    recording with further inputs, or whose rows are not in the order of a motion, has only moving rows.
    """
    role = np.full(len(recording), Role.MOVING, dtype=np.int8)
    motion = recording.motion
    if recording.input_names or strokes_from_order(motion.position) is None:
        return role
    waiting = waits(motion.position)[motion.rows]
    if waiting.all():
        return role
    position = recording.position
    contact = contact_at(position[~waiting], recording.force[~waiting])
    deepest = float(position.max()) if deepest is None else deepest
    role[position < contact - AIR_MARGIN * (deepest - contact)] = Role.APPROACH
    role[waiting] = np.where(position < contact, Role.REST, Role.HOLD)[waiting]
    return role


def unused_rows(role: Int8Vector, used: str = "fitted") -> str:
    """Returns a sentence on the rows of each role (n,) that are not fitted or compared."""
    reasons = {
        Role.APPROACH: "move far from the contact",
        Role.REST: "wait without contact",
        Role.HOLD: "wait in contact",
    }
    counts = {reason: int(np.count_nonzero(role == each)) for each, reason in reasons.items()}
    listed = ", ".join(f"{count} {reason}" for reason, count in counts.items() if count)
    return (
        f"{sum(counts.values())} of {len(role)} rows are not {used}, because they show no force over "
        f"position: {listed}."
    )


def contact_at(position: Float1D, force: Float1D) -> float:
    """Returns the smallest position at which the force of moving rows (n,) differs from that at the smallest
    positions by more than its noise: there the tool meets the object."""
    order = np.argsort(position, kind="stable")
    reach = float(np.ptp(force))
    if not reach > 0.0 or len(force) < LEAST_STROKE_ROWS:
        return float(position.min())
    force = (force - force.min()) / reach
    x, f = position[order], force[order]
    air = f[: max(2, int(AIR_SHARE * len(f)))]
    level = float(np.median(air))
    noise = max(noise_of(force), 0.5 * resolution_of(force), FORCE_RESOLUTION)
    starts = np.linspace(0, len(f), min(AIR_BLOCKS, len(f)), endpoint=False).astype(np.intp)
    rows = np.diff(starts, append=len(f))
    mean = np.add.reduceat(f, starts) / rows
    error = noise * np.sqrt(1.0 / rows + 1.0 / len(air))
    apart = np.flatnonzero(np.abs(mean - level) > AIR_ERRORS * error)
    return float(x[starts[apart[0]]] if len(apart) else x[-1])


def waits(position: Float1D) -> NDArray[np.bool_]:
    """Returns True (n,) for rows at which the tool waits; positions (n,) are in recorded order.

    The distance that the tool has travelled is that of a play operator as wide as the noise, which noise does
    not move. The speed around a row is the smaller one of the median speeds of `STEPS_AROUND` distances
    before it and after it, which a wait among them does not change.
    """
    x = (position - position.min()) / float(np.ptp(position))
    noise = max(map(noise_of, np.array_split(x, max(1, min(SECTIONS, len(x) // LEAST_SECTION_ROWS)))))
    band = max(TURN_NOISE * noise, TURN_STEPS * resolution_of(x))
    travelled = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(play(x, 0.5 * band, start=x[0]))))])
    step = max(STEP, 2.0 * band)
    if travelled[-1] <= 2 * STEPS_AROUND * step:
        return np.zeros(len(x), dtype=bool)
    # First and last row of each step of distance: interpolated, because a row can travel several steps.
    moved, at_row = np.unique(travelled, return_index=True)
    reached = np.interp(np.arange(0.0, travelled[-1], step), moved, at_row)
    rows = np.diff(reached, append=len(x) - 1.0)
    around = np.pad(rows, STEPS_AROUND, constant_values=np.nan)
    windows = np.lib.stride_tricks.sliding_window_view(around, STEPS_AROUND)
    typical = np.full(len(windows), np.nan)  # unknown at the start and at the end of the motion
    known = np.count_nonzero(np.isfinite(windows), axis=1)
    enough = known >= max(1, min(STEPS_AROUND // 2, len(rows) - 1))
    typical[enough] = np.nanmedian(windows[enough], axis=1)
    nearby = np.fmax(typical[: len(rows)], typical[-len(rows) :])
    nearby = np.maximum(np.nan_to_num(nearby, nan=1.0), np.finfo(float).tiny)
    speed = step / nearby[np.minimum((travelled / step).astype(np.int64), len(rows) - 1)]
    row = np.arange(len(x))
    first = np.maximum(row - np.maximum(np.ceil(2.0 * band / speed), 1.0).astype(np.int64), 0)
    slow = travelled - travelled[first] < SLOW_RATIO * speed * (row - first)
    slow[0] = slow[1]
    found = np.zeros(len(x), dtype=bool)
    for begin, end in np.flatnonzero(np.diff(slow, prepend=False, append=False)).reshape(-1, 2).tolist():
        # The tool stops between two rows: the last row that moves less than half of a step waits as well.
        stopped = begin > 1 and travelled[begin - 1] - travelled[begin - 2] < 0.5 * speed[begin - 1]
        first_row = begin - int(stopped)
        # One slow row is a turn between two rows.
        found[first_row:end] = (
            end - first_row > 1 and (end - first_row) * speed[begin:end].max() >= LEAST_WAIT
        )
    return found

# SPDX-License-Identifier: Apache-2.0
"""Roles of the rows of a recording: which rows show the force law over position, and which only wait.

A recording is a motion. Its information on a force over position is in the distance that the tool travels,
not in the number of rows: a tool that waits repeats one position, and its force changes with time, not with
position. A row is a wait if the tool moves less, since the rows before, than a twentieth of what it moves
nearby.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from enum import IntEnum

import numpy as np

from ..._typing import Float1D, Int8Vector
from ...recording import Recording
from ...recording.motion import LEAST_STROKE_ROWS, noise_of, resolution_of, waits
from .limits import FORCE_RESOLUTION, SIGNIFICANT_STANDARD_ERRORS


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


AIR_MARGIN = 1.0
"""Distance before the contact that is fitted, as a share of the travel in contact [-]: the force is the same
further away, however long the approach is."""


def roles_of(recording: Recording, deepest: float | None = None) -> Int8Vector:
    """Returns the role of each row (n,) as the number of a :class:`Role`, from position and force in recorded
    order.

    `deepest` is the largest position of all recordings of the object, by default that of this one. A
    recording with further inputs, or whose rows are not in the order of a motion, has only moving rows.
    """
    role = np.full(len(recording), Role.MOVING, dtype=np.int8)
    of_motion = None if recording.input_names else waits(recording.motion.position)
    if of_motion is None or (waiting := of_motion[recording.motion.rows]).all():
        return role
    position = recording.position
    contact = contact_at(position[~waiting], recording.force[~waiting])
    deepest = float(position.max()) if deepest is None else deepest
    role[position < contact - AIR_MARGIN * (deepest - contact)] = Role.APPROACH
    role[waiting] = np.where(position <= contact, Role.REST, Role.HOLD)[waiting]
    return role


ROLE_NAMES = {
    Role.MOVING: "move",
    Role.APPROACH: "approach",
    Role.REST: "wait in air",
    Role.HOLD: "wait in contact",
}
"""What the rows of each role do, for texts."""


def role_counts(role: Int8Vector) -> dict[str, int]:
    """Returns the number of rows of each role (n,) that occurs, by its name."""
    counts = np.bincount(role, minlength=len(Role)).tolist()
    return {name: counts[each] for each, name in ROLE_NAMES.items() if counts[each]}


def counts_text(counts: Mapping[str, int]) -> str:
    """Returns numbers of rows as text: "2186 move, 155 wait in contact"."""
    return ", ".join(f"{count} {name}" for name, count in counts.items())


def unused_rows(role: Int8Vector, used: str = "fitted") -> str:
    """Returns a sentence on the rows of each role (n,) that are not fitted or compared."""
    unused = role[role != Role.MOVING]
    return f"{len(unused)} of {len(role)} rows are not {used}: {counts_text(role_counts(unused))}."


def contact_at(position: Float1D, force: Float1D) -> float:
    """Returns the smallest position at which the force of moving rows (n,) differs from that at all smaller
    positions by more than its noise: there the tool meets the object. Without a difference it is the smallest
    position.

    Rows that are neighbours in position are compared in blocks, as many as each has rows.
    """
    order = np.argsort(position, kind="stable")
    reach = float(np.ptp(force))
    if not reach > 0.0 or len(force) < LEAST_STROKE_ROWS:
        return float(position.min())
    force = (force - force.min()) / reach
    noise = max(noise_of(force), 0.5 * resolution_of(force), FORCE_RESOLUTION)
    starts = np.linspace(0, len(force), math.isqrt(len(force)), endpoint=False).astype(np.intp)
    total, rows = np.add.reduceat(force[order], starts), np.diff(starts, append=len(force))
    air = np.cumsum(total)[:-1] / np.cumsum(rows)[:-1]
    error = noise * np.sqrt(1.0 / rows[1:] + 1.0 / np.cumsum(rows)[:-1])
    apart = np.flatnonzero(np.abs(total[1:] / rows[1:] - air) > SIGNIFICANT_STANDARD_ERRORS * error)
    # If the second block already differs from the first one, there is no air.
    return float(position[order][starts[1 + apart[0]] if len(apart) and apart[0] else 0])

# SPDX-License-Identifier: Apache-2.0
"""Sensors at the end of their range, and positions that stand still while the force goes on."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .._typing import Float1D
from ..verdict import Finding, usable
from .cells import Travel, amount
from .recording import Recording

LEAST_ROWS = 5
"""Rows that a clipped force or position needs."""

LEAST_POSITIONS = 3
"""Positions of a clipped force; a tool that rests has one."""

RATIO = 5.0
"""Rows at the extreme value over the rows at any value near it: a rounded force rarely has more than 3."""

NEAR = 0.1
"""Share of the force's range that is near the extreme."""

FLOOR = 0.2
"""Share of the largest |force| below which an extreme is that of a tool that touches nothing."""

FORCE_GOES_ON = 0.1
"""Share of the force's range by which the force changes while the position stands still."""

NOISE = 6.0
"""The same change over the noise of the force."""

STUCK_FORCE = 0.005
"""The same share where the position jumps afterwards."""

JUMP = 5.0
"""Step over the usual one with which a position that was stuck goes on."""


def saturation_findings(recording: Recording, travel: Travel) -> list[Finding]:
    """Findings on a clipped force, a clipped position, and a position that was stuck."""
    x, f = recording.position, recording.force
    reach = float(np.ptp(f))
    if not reach > 0.0:
        return []
    largest = float(np.max(np.abs(f)))
    found = []
    for value, name in ((float(f.max()), "largest"), (float(f.min()), "least")):
        near = f[np.abs(f - value) <= NEAR * reach]
        rows = np.flatnonzero(f == value)
        if abs(value) < FLOOR * largest or len(rows) < LEAST_ROWS:
            continue
        _, counts = np.unique(near, return_counts=True)
        others = np.delete(counts, -1 if name == "largest" else 0)
        few = others.max(initial=1)
        if len(rows) >= RATIO * few and len(np.unique(x[rows])) >= LEAST_POSITIONS:
            found.append(
                usable(
                    f"the {name} force, {amount(value, recording.units['force'])}, stands in {len(rows)} "
                    f"rows ({len(rows) / len(f):.2g} of all) while the position goes on from "
                    f"{x[rows].min():.4g} to {x[rows].max():.4g}: the force sensor or its converter is "
                    "probably clipped there; record with a larger force range or press less far"
                )
            )
    return [*found, *_standing(recording, travel, reach)]


def _standing(recording: Recording, travel: Travel, reach: float) -> list[Finding]:
    """Findings on a position that has the same value in many rows while the force goes on."""
    x, f = recording.position, recording.force
    noise = float(np.median(np.abs(np.diff(f)))) / 0.954
    bound = max(FORCE_GOES_ON * reach, NOISE * noise)
    unit = recording.units["position"]
    for value, name in ((travel.upper, "largest"), (travel.lower, "least")):
        rows = np.flatnonzero(x == value)
        if len(rows) >= max(LEAST_ROWS, RATIO * _usual_count(x, value, travel)):
            change = _change_inside(f, rows)
            if change > bound:
                return [
                    usable(
                        f"the {name} position, {amount(value, unit)}, stands in {len(rows)} rows while the "
                        f"force changes by {change:.3g} and comes back: the position sensor is probably "
                        "clipped there; record with a larger range of position"
                    )
                ]
    step = np.diff(x)
    moving = np.abs(step[step != 0.0])
    if not len(moving):
        return []
    usual = float(np.median(moving))
    bound = max(STUCK_FORCE * reach, NOISE * noise)
    edges = np.r_[0, np.flatnonzero(step != 0.0) + 1, len(x)]
    lengths = np.diff(edges)
    many = max(float(LEAST_ROWS), RATIO * float(np.median(lengths)))
    for k in np.flatnonzero(lengths >= many).tolist():
        start, stop = int(edges[k]), int(edges[k + 1])
        jump = abs(float(x[stop] - x[stop - 1])) if stop < len(x) else 0.0
        if jump > JUMP * usual and _range_of(f[start:stop]) > bound:
            return [
                usable(
                    f"the position stands still in rows {start} to {stop - 1}, then jumps by "
                    f"{amount(jump, unit)}, while the force changes by {_range_of(f[start:stop]):.3g}: the "
                    f"position sensor was probably stuck; use the rows before or after with --rows 0:{start} "
                    f"or --rows {stop}:{len(x)}"
                )
            ]
    return []


def _usual_count(x: Float1D, value: float, travel: Travel) -> float:
    """Rows at the values next to an extreme one."""
    near = x[(np.abs(x - value) <= NEAR * travel.length) & (x != value)]
    return float(np.median(np.unique(near, return_counts=True)[1])) if len(near) else 1.0


def _change_inside(f: Float1D, rows: NDArray[np.intp]) -> float:
    """Largest distance of the force inside a run of consecutive rows from both ends of the run.

    A hand that turns stands still while friction lets go: the force then ends elsewhere than it began, but
    lies between.
    """
    first = np.flatnonzero(np.diff(rows, prepend=-2) != 1)
    last = np.r_[first[1:], len(rows)] - 1
    force = f[rows]
    ends = force[first], force[last]
    above = np.maximum.reduceat(force, first) - np.maximum(*ends)
    below = np.minimum(*ends) - np.minimum.reduceat(force, first)
    return float(max(above.max(), below.max()))


def _range_of(values: Float1D) -> float:
    """Range of the inner 90 %."""
    low, high = np.percentile(values, (5.0, 95.0))
    return float(high - low)

# SPDX-License-Identifier: Apache-2.0
"""Gaps of a recording: positions of a stroke without rows, and samples that are missing in time."""

from __future__ import annotations

import numpy as np

from ..verdict import Finding, usable
from .cells import Travel, amount, sides
from .recording import Recording

LEAST_GAP = 0.02
"""Share of the travel from which an interval without rows is a gap."""

WIDER = 8.0
"""Width of a gap over the 90th percentile of the distances between neighbouring positions."""

END_GAP = 0.05
"""Share of the travel that one stroke may leave out at an end."""

LEAST_LOST = 0.05
"""Share of the duration from which missing samples are reported."""

TIME_GAP = 2.5
"""Steps of time above this many median ones are gaps."""


def gap_findings(recording: Recording, travel: Travel) -> list[Finding]:
    """Findings on gaps in position and in time."""
    return [*_position_gaps(recording, travel), *_time_gaps(recording)]


def _position_gaps(recording: Recording, travel: Travel) -> list[Finding]:
    if not travel.length > 0.0 or recording.input_names:
        return []
    side = sides(recording, travel)
    strokes = [(1, "press stroke"), (-1, "release stroke")] if recording.direction is not None else []
    found, told = [], set()
    for of, name in [(0, "recording"), *strokes]:
        rows = travel.inside if of == 0 else travel.inside & (side == of)
        at = np.unique(recording.position[rows])
        if len(at) < 10:
            continue
        apart = np.diff(at)
        bound = max(LEAST_GAP * travel.length, WIDER * float(np.percentile(apart, 90.0)))
        for k in np.flatnonzero(apart > bound).tolist():
            if (at[k], at[k + 1]) not in told:
                told.add((at[k], at[k + 1]))
                found.append(_gap(recording, travel, name, float(at[k]), float(at[k + 1])))
        if of and at[0] - travel.lower > END_GAP * travel.length:
            found.append(_gap(recording, travel, name, travel.lower, float(at[0])))
        if of and travel.upper - at[-1] > END_GAP * travel.length:
            found.append(_gap(recording, travel, name, float(at[-1]), travel.upper))
    return found


def _gap(recording: Recording, travel: Travel, name: str, start: float, stop: float) -> Finding:
    unit, share = recording.units["position"], (stop - start) / travel.length
    return usable(
        f"the {name} has no rows from {start:.4g} to {amount(stop, unit)}, {share:.0%} of the travel: the "
        "model is interpolated there; record this interval too"
    )


def _time_gaps(recording: Recording) -> list[Finding]:
    if recording.time is None or len(recording) < 3:
        return []
    steps = np.diff(recording.time)
    period = float(np.median(steps))
    gaps = steps[steps > TIME_GAP * period]
    duration = float(recording.time[-1] - recording.time[0])
    lost = float(np.sum(gaps - period)) / duration
    if lost < LEAST_LOST:
        return []
    many = "s" * (len(gaps) > 1)
    return [
        usable(
            f"time has {len(gaps)} gap{many}, the longest {gaps.max():.4g} s at a sample period of "
            f"{period:.4g} s; {lost:.0%} of the duration has no rows: samples were probably dropped, and "
            "velocity and hysteresis are not judged across a gap; record without dropped samples"
        )
    ]

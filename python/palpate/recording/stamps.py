# SPDX-License-Identifier: Apache-2.0
"""Times of rows that are stored faster than their clock steps, so that several rows have one time."""

from __future__ import annotations

import numpy as np

from .._typing import Float1D
from .motion import GAP_RATIO

MIN_REPEATED = 2
"""Least number of times that several rows have: a single one is an error of the file."""


def increases(time: Float1D) -> bool:
    """Returns True if the known times of (n,) increase."""
    return bool((np.diff(time[np.isfinite(time)]) > 0.0).all())


def between_steps(time: Float1D) -> tuple[Float1D, float]:
    """Returns times (n,) that increase between the steps of their clock, and its usual step. If less than
    `MIN_REPEATED` times repeat or one decreases, these are the given times and 0.

    The rows are evenly spaced along straight lines on which no row is further from its clock than a step;
    lines are split until this holds (Douglas & Peucker 1973). The rows before a pause of the recorder do not
    reach into it.
    """
    steps = np.diff(time, prepend=-np.inf)
    begins = np.flatnonzero(steps > 0.0)
    clock, ends = time[begins], np.append(begins[1:], len(time)) - 1
    if np.count_nonzero(ends > begins) < MIN_REPEATED or not (steps >= 0.0).all():
        return time, 0.0
    step = float(np.median(np.diff(clock)))
    paused = np.append(np.diff(clock) > GAP_RATIO * step, True) & (ends > begins)
    row = np.r_[begins, ends[paused]]
    order = np.argsort(row, kind="stable")
    row, at = row[order], np.r_[clock, clock[paused] + step][order]
    knots, sections = {0, len(row) - 1}, [(0, len(row) - 1)]
    while sections:
        first, last = sections.pop()
        line = np.interp(row[first : last + 1], row[[first, last]], at[[first, last]])
        away = np.abs(at[first : last + 1] - line)
        if away.max() > step:
            split = first + int(np.argmax(away))
            knots.add(split)
            sections += [(first, split), (split, last)]
    kept = sorted(knots)
    return np.interp(np.arange(len(time)), row[kept], at[kept]), step

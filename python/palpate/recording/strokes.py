# SPDX-License-Identifier: Apache-2.0
"""Strokes taken from the order of rows, for a recording that states no direction."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np

from .._typing import Float1D, Int8Vector
from .recording import Recording

TURN_SHARE = 0.02
"""Share of the travel by which the position must move back to count as a turn [-]."""

TURN_NOISE = 8.0
"""Standard deviations of the position's noise by which it must move back: noise alone does not [-]."""

TURN_STEPS = 1.5
"""Steps of a quantised position by which it must move back: jitter between two steps is no turn [-]."""

LARGEST_TURN = 0.4
"""Largest of these bounds, as a share of the travel: above it turns cannot be told from noise [-]."""

GRID = 8.0
"""Steps of that bound to which positions are rounded to find the turns."""

MOST_DIFFERENCES = 100_000
"""Differences of neighbouring rows from which the noise is estimated, at most about."""

LEAST_ROWS = 4
"""Fewer rows from one turn to the next are a jump, as where one stroke ends and the next begins anew."""

JUMPING_SHARE = 0.1
"""Share of the rows in jumps above which the rows are in no order [-]."""

HOLD_SHARE = 0.1
"""Share of a stroke's rows that the position must rest at its end to count as a hold [-]."""

HOLD_ROWS = 10
"""Fewest rows of a hold."""


def strokes_from_order(position: Float1D) -> Int8Vector | None:
    """Takes the direction of each row from the order of rows.

    A stroke ends at the row that first reaches the position from which it then moves back: by more than the
    noise, the resolution and 2 % of the travel.

    Parameters
    ----------
    position : (n,) array
        Positions in the order in which they were recorded, growing into the object.

    Returns
    -------
    (n,) array of int8 or None
        +1 into the object, -1 out of it, 0 in a hold at the end of a stroke. All rows have one direction if
        the position never turns back. None if the rows are in no order, or too few.
    """
    travel = float(np.ptp(position)) if len(position) > LEAST_ROWS else 0.0
    if not 0.0 < travel < np.inf:
        return None
    x = np.asarray((position - position.min()) / travel)
    noise = _noise(x)
    back = max(TURN_SHARE, TURN_NOISE * noise, TURN_STEPS * _resolution(x))
    if back > LARGEST_TURN:
        return None
    direction = np.zeros(len(x), dtype=np.int8)
    begin, jumping = 0, 0
    holds: list[slice] = []
    ends = _stroke_ends(x, back)
    for (end, sign), (next_end, _) in pairwise([*ends, (len(x) - 1, 0)]):
        around = x[begin : next_end + 1]
        reached = _rest(around, end - begin, 0.0)[0]
        if reached + 1 < LEAST_ROWS:
            jumping += reached
            begin += reached
            continue
        last = len(x) - 1 if end == ends[-1][0] else begin + reached
        direction[begin : last + 1] = sign
        near = min(TURN_NOISE * noise, 1.0)
        held, moving = _rest(around, reached, near)
        # A sinusoidal motion spends this share of a half-period within a distance of its end.
        slow_share = 2.0 * np.arccos(1.0 - 2.0 * near) / np.pi
        if moving - held >= max(HOLD_ROWS, (HOLD_SHARE + slow_share) * reached):
            holds.append(slice(begin + held, begin + moving + 1))
        begin = last + 1
    for hold in holds:
        direction[hold] = 0
    if jumping > JUMPING_SHARE * len(x) or not direction.any():
        return None
    return direction


def ordered_strokes(recording: Recording) -> Int8Vector | None:
    """Takes the direction of the rows (n,) of a recording from the order of all rows of its motion."""
    motion = recording.motion
    direction = strokes_from_order(motion.position)
    return None if direction is None else direction[motion.rows]


def turns_of(direction: Int8Vector) -> int:
    """Number of times that the direction (n,) changes its sign."""
    moving = direction[direction != 0]
    return int(np.count_nonzero(moving[1:] != moving[:-1]))


def _noise(x: Float1D) -> float:
    """Standard deviation of the noise, from third differences: turns and jumps are too few to matter."""
    differences = np.abs(x[3:] - x[:-3] - 3.0 * (x[2:-1] - x[1:-2]))
    return float(np.median(differences[:: max(1, len(x) // MOST_DIFFERENCES)]) / (0.6745 * math.sqrt(20.0)))


def _resolution(x: Float1D) -> float:
    """Smallest step from row to row, rounding errors left out."""
    steps = np.abs(np.diff(x))
    return float(np.min(steps[steps > 1e-9]))


def _stroke_ends(x: Float1D, back: float) -> list[tuple[int, int]]:
    """The row at which each stroke ends, and its direction; a stroke ends where x moves back by more."""
    # On a grid, few of the rows are local extremes, whatever the noise.
    grid = np.rint(x * (GRID / back))
    steps = np.diff(grid)
    moves = np.flatnonzero(steps)
    up = steps[moves] > 0.0
    rows = [0, *moves[1:][up[1:] != up[:-1]].tolist(), len(x) - 1]
    ends: list[tuple[int, int]] = []
    low = high = (0, float(grid[0]))
    sign = 0
    for row, place in zip(rows, grid[rows].tolist(), strict=True):
        if place > high[1]:
            high = row, place
        if place < low[1]:
            low = row, place
        if sign <= 0 and place - low[1] > GRID:
            if sign < 0:
                ends.append((low[0], -1))
            sign, high = 1, (row, place)
        elif sign >= 0 and high[1] - place > GRID:
            if sign > 0:
                ends.append((high[0], 1))
            sign, low = -1, (row, place)
    ends.append((high[0], 1) if sign > 0 else (low[0], -1))
    exact: list[tuple[int, int]] = []
    start = 0
    for (_, sign), (stop, _) in pairwise([*ends, (len(x) - 1, 0)]):
        start += int(np.argmax(sign * x[start : stop + 1]))
        exact.append((start, sign))
    return exact


def _rest(x: Float1D, row: int, within: float) -> tuple[int, int]:
    """First and last row of the rows around one that stay within a distance of its position."""
    away = np.abs(x - x[row]) > within
    before, after = np.flatnonzero(away[:row]), np.flatnonzero(away[row:])
    first = int(before[-1]) + 1 if len(before) else 0
    last = row + int(after[0]) - 1 if len(after) else len(x) - 1
    return first, last

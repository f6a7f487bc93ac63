# SPDX-License-Identifier: Apache-2.0
"""Rows that repeat the previous one, and wrong readings: values far from those before and after them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..._typing import Float1D
from ..motion import TURN_STEPS, strokes_from_order

if TYPE_CHECKING:
    from ..recording import Recording

WRONG_RATIO = 8.0
"""Deviation of a value from its neighbours above which the value is a wrong reading [typical changes between
successive rows nearby]."""

LEAST_WRONG = 0.01
"""Smallest deviation of a wrong reading [share of the range of the column]: a hand does not feel less."""

MOST_WRONG_SHARE = 0.1
"""Share of the rows above which deviating values are not wrong readings [-]: so many belong to the object."""

LOCAL_ROWS = 8
"""Number of rows before a row, and after it, whose typical change is that of the motion nearby."""

NEIGHBOUR_ROWS = 3
"""Number of rows before a row, and after it, with whose median value it is compared."""


REPEATED_ROWS_SHARE = 1.0 / 3.0
"""Share of rows that equal the previous row, above which they are repeated [-]: a coarse sensor gives fewer
equal rows."""

HELD_SHARE = 0.8
"""Share of the values of a slower sensor that occur in several successive rows [-]: a coarse sensor gives
more single rows."""


def repeated_rows(recording: Recording) -> NDArray[np.bool_]:
    """Returns True (n,) for rows that repeat the reading of a sensor that is slower than the recorder: only
    the first row with a reading was measured, and the others are late."""
    columns = [recording.position, recording.force, *recording.inputs.T]
    columns += [] if recording.direction is None else [recording.direction]
    again = np.zeros(len(recording), dtype=bool)
    again[1:] = np.logical_and.reduce([column[1:] == column[:-1] for column in columns])
    again &= again.mean() > REPEATED_ROWS_SHARE
    # A further input, such as the place of a press, may keep its value while the tool moves.
    sensors = recording.position, recording.force
    held, slowest = max(((_rows_held(each), each) for each in sensors), key=lambda each: each[0])
    index = np.arange(len(again))
    begins = np.maximum.accumulate(np.where(np.diff(slowest, prepend=np.nan) != 0.0, index, 0))
    return np.asarray(again | ((index - begins) % held > 0))


def _rows_held(values: Float1D) -> int:
    """Returns the number of rows for which a slower sensor keeps a value (n,); 1 for a sensor that is not
    slower. The values of a coarse sensor mostly change by one step."""
    steps = np.abs(np.diff(values))
    rows = np.diff(np.flatnonzero(steps))
    steps = steps[steps > 0.0]
    if len(rows) < LOCAL_ROWS or np.median(steps) <= TURN_STEPS * steps.min():
        return 1
    return 1 + int(np.median(rows)) if np.mean(rows > 1) >= HELD_SHARE else 1


@np.errstate(over="ignore", invalid="ignore")  # huge values, refused later, may overflow
def wrong_readings(
    motion: Float1D,
    position: Float1D,
    force: Float1D,
    inputs: Sequence[Float1D] | NDArray[np.float64] = (),
    residual: Float1D | None = None,
) -> NDArray[np.bool_]:
    """Returns True (n,) for rows with a wrong reading of position (n,), force (n,) or a further input (n,).

    A wrong reading is outside the interval between the median values of the rows before it and after it, so
    that no row of a steep wall or of a click is one. The distance is compared with the changes from row to
    row nearby. Several wrong readings side by side are outside the range of all others. At the largest and
    smallest positions a wall may be touched by a single row. Rows that are not in the order of a motion have
    no neighbours, and no wrong readings. `motion` (m,) is the position of all rows in recorded order, of
    which these rows can be a part. A residual (n,), the force minus that of a model, is compared in place of
    the force: it does not change along a steep part.
    """
    found = np.zeros(len(force), dtype=bool)
    if len(force) <= 2 * LOCAL_ROWS or strokes_from_order(motion) is None:
        return found
    seen = force if residual is None else residual
    for values, shown, at_ends in (
        (position, position, True),
        *((each, each, True) for each in inputs),
        (seen, force, False),
    ):
        reach = np.subtract(*np.quantile(shown[~found], (1.0 - MOST_WRONG_SHARE, MOST_WRONG_SHARE)))
        found |= _deviating(values, position, ~found, at_ends, float(reach))
    return found if found.mean() <= MOST_WRONG_SHARE else np.zeros(len(force), dtype=bool)


def _deviating(
    values: Float1D, position: Float1D, given: NDArray[np.bool_], at_ends: bool, reach: float
) -> NDArray[np.bool_]:
    """Returns True (n,) for the given rows whose value deviates from those before and after them. `reach` is
    the range of the measured quantity.

    First the values are found that are further from all others than these are from each other: several of
    them hide each other from their neighbours. All others are compared with few neighbours.
    """
    found = np.zeros(len(values), dtype=bool)

    def inner(rows: NDArray[np.intp], others: NDArray[np.intp]) -> NDArray[np.bool_]:
        x, of_others = position[rows], position[others]
        return np.asarray(at_ends | ((x >= of_others.min()) & (x < of_others.max())))

    while len(rows := np.flatnonzero(given & ~found)) > 2 * LOCAL_ROWS:
        wrong = _apart(values[rows], LOCAL_ROWS) > reach
        if not wrong.any():
            break
        found[rows[wrong]] = True
    for begin, end in np.flatnonzero(np.diff(found, prepend=False, append=False)).reshape(-1, 2).tolist():
        found[begin:end] &= 2 * (end - begin) <= LOCAL_ROWS  # more rows move the medians as well
    rows, far = np.flatnonzero(given & ~found), np.flatnonzero(found)
    rest = values[rows]
    found[far] = inner(far, rows) & (np.abs(values[far] - np.median(rest)) > np.ptp(rest))
    while len(rows := np.flatnonzero(given & ~found)) > 2 * LOCAL_ROWS:
        changes = np.pad(np.abs(np.diff(values[rows])), LOCAL_ROWS, mode="reflect")
        nearby = np.median(np.lib.stride_tricks.sliding_window_view(changes, LOCAL_ROWS), axis=1)
        nearby = np.maximum(nearby[: len(rows)], nearby[-len(rows) :])
        usual = np.maximum(nearby, float(np.median(np.abs(np.diff(values[rows])))))
        wrong = _apart(values[rows], NEIGHBOUR_ROWS) > np.maximum(WRONG_RATIO * usual, LEAST_WRONG * reach)
        if not at_ends:  # few rows on one side can be those of a steep part
            wrong[:NEIGHBOUR_ROWS] = wrong[-NEIGHBOUR_ROWS:] = False
        if wrong.any():
            wrong &= inner(rows, rows[~wrong])
        if not wrong.any():
            break
        found[rows[wrong]] = True
    return found


def _apart(values: Float1D, count: int) -> Float1D:
    """Returns the distance of each value (n,) from the interval between the median of `count` values before
    it and that of `count` values after it."""
    around = np.pad(values, count, mode="edge")
    medians = np.median(np.lib.stride_tricks.sliding_window_view(around, count), axis=1)
    before, after = medians[: len(values)].copy(), medians[-len(values) :].copy()
    # The first and the last row have no rows on one side: the change of the nearest rows continues there.
    before[0] = after[0] + WRONG_RATIO * (after[0] - after[count])
    after[-1] = before[-1] + WRONG_RATIO * (before[-1] - before[-1 - count])
    return np.maximum(values - np.maximum(before, after), np.minimum(before, after) - values)

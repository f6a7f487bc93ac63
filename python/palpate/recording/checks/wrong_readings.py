# SPDX-License-Identifier: Apache-2.0
"""Rows that repeat the previous one, and wrong readings: values far from those before and after them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..._typing import Float1D
from ..motion import TURN_STEPS, resolution_of, strokes_from_order

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
    slower. The values of a coarse sensor mostly change to a neighbouring one; those of a slower sensor at a
    constant speed change by one distance too, but other strokes have values between them."""
    steps = np.abs(np.diff(values))
    rows = np.diff(np.flatnonzero(steps))
    if len(rows) < LOCAL_ROWS:
        return 1
    scale = float(np.abs(values).max())
    if np.median(steps[steps > 0.0]) / scale <= TURN_STEPS * resolution_of(np.sort(values / scale)):
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
    row nearby; one step of the display is not a wrong reading, and no row of a peak over several rows is one.
    Several of them side by side are outside the range of all others. At the largest and smallest positions a
    wall may be touched by a single row. A position in the first or last rows is right if the force there
    deviates as well. Rows that are not in the order of a motion have no neighbours, and
    none is wrong. `motion` (m,) is the position of all rows in recorded order, of which these rows can be a
    part.

    A residual (n,), the force minus that of a model, is compared in place of the values: it does not change
    along a steep part. It must also be far larger than the residuals of other strokes in the same direction
    at the same position, where an error of the model occurs again. Successive rows must not be between those
    before and after them: where a force lets go, rows of one of several strokes are.
    """
    found = np.zeros(len(force), dtype=bool)
    if len(force) <= 2 * LOCAL_ROWS or strokes_from_order(motion) is None:
        return found

    if residual is None:
        for values in (position, *inputs):
            found |= _deviating(values, values, position, ~found, at_ends=True)
        for end in np.s_[:NEIGHBOUR_ROWS], np.s_[-NEIGHBOUR_ROWS:]:
            if found[end].any():  # a motion that begins or ends at speed changes the force as well
                given = ~found
                given[end] = True
                found[end] &= not (found & _deviating(force, force, position, given, at_ends=True))[end].any()
    found |= _deviating(force if residual is None else residual, force, position, ~found, at_ends=False)
    if residual is None:
        found |= _of_one_value(force, found) & (position < position.max())
    if found.mean() > MOST_WRONG_SHARE:
        return np.zeros(len(force), dtype=bool)
    if residual is not None and found.any():
        found[found] = np.abs(residual[found]) > WRONG_RATIO * _of_other_strokes(residual, position, found)
        several = np.convolve(found, (1, 0, 1), "same")[found] > 0
        found[found] = ~several | (_beyond_neighbours(force, found) > _reach_and_least(force)[1])
    return found


def _of_one_value(force: Float1D, wrong: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Returns True (n,) for further rows with a force that several wrong rows (n,) have: a sensor that fails
    gives one value, often 0, also where this is near the right one."""
    values, count = np.unique(force[wrong], return_counts=True)
    again, rows = np.zeros(len(force), dtype=bool), np.flatnonzero(~wrong)
    around, rest = force[[rows[:-2], rows[2:]]], force[rows[1:-1]]
    beyond = np.maximum(rest - around.max(axis=0), around.min(axis=0) - rest)
    again[rows[1:-1]] = np.isin(rest, values[count > 1]) & (beyond > _reach_and_least(force[rows])[1])
    return again


def _beyond_neighbours(values: Float1D, rows: NDArray[np.bool_]) -> Float1D:
    """Returns how far the values (k,) of the rows (n,) are outside the interval between those of the nearest
    other rows before and after them; below 0 inside it."""
    others, at = np.flatnonzero(~rows), np.flatnonzero(rows)
    after = np.searchsorted(others, at)
    around = values[others[[np.maximum(after - 1, 0), np.minimum(after, len(others) - 1)]]]
    return np.asarray(np.maximum(values[at] - around.max(axis=0), around.min(axis=0) - values[at]))


def _of_other_strokes(residual: Float1D, position: Float1D, rows: NDArray[np.bool_]) -> Float1D:
    """Returns the usual size (k,) of the residual (n,) of the other strokes in the same direction, at the
    positions of k of the rows (n,); 0 where there are none."""
    side, x = strokes_from_order(position), position[rows]
    if side is None:
        return np.zeros(len(x))
    number = np.cumsum(np.diff(side, prepend=0) != 0)
    found = np.full((number[-1] + 1, len(x)), np.nan)
    for stroke in np.unique(number[side != 0]):
        at = np.flatnonzero(number == stroke)
        at = at[np.argsort(position[at], kind="stable")]
        above = np.searchsorted(position[at], x)
        others = (side[rows] == side[at[0]]) & (number[rows] != stroke) & (above > 0) & (above < len(at))
        around = at[[above[others] - 1, above[others]]]
        found[stroke, others] = np.abs(residual[around]).max(axis=0)
    known = [column[np.isfinite(column)] for column in found.T]
    return np.array([np.median(each) if len(each) else 0.0 for each in known])


def _reach_and_least(values: Float1D) -> tuple[float, float]:
    """Returns the range of measured values (n,) without few wrong ones, and the least deviation of a wrong
    one, at least some steps of their display."""
    reach = float(np.subtract(*np.quantile(values, (1.0 - MOST_WRONG_SHARE, MOST_WRONG_SHARE))))
    steps = TURN_STEPS * resolution_of(values / reach) * reach if reach > 0.0 else 0.0
    return reach, max(LEAST_WRONG * reach, steps)


def _deviating(
    values: Float1D, measured: Float1D, position: Float1D, given: NDArray[np.bool_], *, at_ends: bool
) -> NDArray[np.bool_]:
    """Returns True (n,) for the given rows whose value deviates from those before and after them. `measured`
    (n,) are the readings to which the values belong.

    First the values are found that are further from all others than these are from each other: several of
    them hide each other from their neighbours. All others are compared with few neighbours.
    """
    found = np.zeros(len(values), dtype=bool)
    reach, least = _reach_and_least(measured[given])

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
        changes = np.abs(np.diff(values[rows]))
        around = np.pad(changes, LOCAL_ROWS, mode="reflect")
        nearby = np.median(np.lib.stride_tricks.sliding_window_view(around, LOCAL_ROWS), axis=1)
        nearby = np.maximum(nearby[: len(rows)], nearby[-len(rows) :])
        usual = np.maximum(nearby, float(np.median(changes)))
        wrong = _apart(values[rows], NEIGHBOUR_ROWS) > np.maximum(WRONG_RATIO * usual, least)
        if not at_ends:  # few rows on one side can be those of a steep part
            wrong[:NEIGHBOUR_ROWS] = wrong[-NEIGHBOUR_ROWS:] = False
        if wrong.any():
            wrong &= inner(rows, rows[~wrong])
            wrong[wrong] = ~_of_a_peak(values[rows], wrong)
        if not wrong.any():
            break
        found[rows[wrong]] = True
    return found


def _of_a_peak(values: Float1D, found: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Returns True (k,) for the k found rows (n,) to which the values (n,) rise and from which they fall over
    several rows: they change the same ways just before and behind, in sum at least as much."""
    changes = np.pad(np.diff(values), 2)
    begin, end = np.flatnonzero(np.diff(found, prepend=False, append=False)).reshape(-1, 2).T
    steps, around = changes[[begin + 1, end + 1]], changes[[begin, end + 2]]
    peak = (np.sign(steps) == np.sign(around)).all(axis=0)
    peak &= np.abs(steps).sum(axis=0) <= np.abs(around).sum(axis=0)
    return np.asarray(np.repeat(peak, end - begin))


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

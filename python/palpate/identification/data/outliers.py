# SPDX-License-Identifier: Apache-2.0
"""Handles wrong readings: drops isolated rows before the fit, and reduces the weight of rows far from the
model.

One wrong position at 10^6 times the travel puts all other rows into one position cell, in which no force over
position is resolved. A row is isolated if its value is separated from the values of all other rows by a gap
many times larger than their range, and if few rows, in short runs, have such values. A force can rise this
much at a wall that is touched briefly, so a force is isolated only if rows of ordinary force exist at smaller
and at larger positions.

Huber's loss is quadratic for a residual up to k standard deviations s and linear for a larger residual (Huber
1964). It is minimised by least squares with weights min(1, k s / |residual|), which are computed again after
each fit. s is computed from the median absolute residual, which outliers do not change. One row with a
residual of 10^4 standard deviations can still change the fit. So the first fit leaves out every row that is
far from the median of its neighbours. Later fits leave out the rows that are far from this median and from
the model.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from ..._typing import Float1D, Float2D
from ...errors import InputError
from ...recording import Recording
from ...recording.motion import strokes_from_order
from ...recording.units import UNSTATED_UNIT, Unit
from ...verdict import Finding, no, usable
from .limits import FORCE_RESOLUTION, standard_deviation

MOST_ISOLATED_SHARE = 0.01
"""Largest share of the rows that can be isolated: rows with a value far from the values of all other rows
[-]."""

LEAST_ROWS = 100
"""Number of rows below which only one row may be isolated, by a larger gap: in a table of few rows the
differences of values may grow by factors."""

ISOLATED_GAP_RATIO = 10.0
"""Ratio of the gap between isolated and other rows to the range of the other rows, above which the isolated
rows are dropped [-]."""

SPARSE_GAP_RATIO = 1000.0
"""Ratio of the gap to the range of the other rows above which a row is dropped from a recording of few rows
[-]."""

REPORTED_GAP_SHARE = 0.2
"""A gap between the values of isolated and other rows is reported from this share of the gap at which the
isolated rows are dropped [-]."""

LONGEST_RUN = 3
"""Largest number of successive isolated rows that are dropped; more successive rows can be a real motion."""

LEAST_OTHERS = 3
"""Least number of distinct values that the other rows must have for isolated rows to be dropped."""

MOST_SAMPLED_ROWS = 10_000
"""About this number of evenly spread rows gives the range of values without the largest and smallest 1 %."""

MOST_NAMED_ROWS = 3
"""Largest number of isolated rows or outliers that a finding lists with row number or position."""


def without_wrong_readings(
    recordings: Sequence[Recording],
) -> tuple[list[Recording], list[Finding], list[str]]:
    """Returns the recordings without isolated rows and wrong readings, findings on the isolated rows, and
    notes on the wrong readings."""
    kept, notes = list(recordings), list[str]()
    for number, recording in enumerate(kept):
        wrong = wrong_readings(recording)
        if not wrong.any():
            continue
        rows = np.flatnonzero(wrong)
        position, force = recording.file_unit("position"), recording.file_unit("force")
        named = ", ".join(
            f"row {row}: {force.text(recording.force[row])} at {position.text(recording.position[row])}"
            for row in rows[:MOST_NAMED_ROWS]
        )
        more = ", ..." if len(rows) > MOST_NAMED_ROWS else ""
        where = f"recording {number + 1}: " if len(kept) > 1 else ""
        notes.append(
            f"{where}{len(rows)} of {len(recording)} rows are wrong readings and were dropped: {named}{more}."
        )
        kept[number] = recording.without(wrong)
    kept, findings = without_isolated(kept)
    return kept, findings, notes


@np.errstate(over="ignore", invalid="ignore")  # huge values, refused later, may overflow
def without_isolated(recordings: Sequence[Recording]) -> tuple[list[Recording], list[Finding]]:
    """Returns the recordings without isolated rows, and findings on the isolated rows."""
    counts = [len(recording) for recording in recordings]
    position = np.concatenate([recording.position for recording in recordings])
    force = np.concatenate([recording.force for recording in recordings])
    columns = [("position", position)]
    for index, name in enumerate(recordings[0].input_names):
        columns.append((name, np.concatenate([recording.inputs[:, index] for recording in recordings])))
    dropped = np.zeros(len(position), dtype=bool)
    findings: list[Finding] = []
    for name, values in columns:
        dropped |= _judged(name, values, ~dropped, None, findings, recordings[0].file_unit(name))
    dropped |= _judged("force", force, ~dropped, position, findings, recordings[0].file_unit("force"))
    if not dropped.any():
        return list(recordings), findings
    apart = np.split(dropped, np.cumsum(counts)[:-1])
    return [
        recording.without(rows) if rows.any() else recording
        for recording, rows in zip(recordings, apart, strict=True)
    ], findings


def isolated(
    values: Float1D, gap: float, most: float, count: Float1D | None = None, width: float = 0.0
) -> NDArray[np.bool_]:
    """Returns True (n,) for isolated rows: at most `most` rows, separated by `gap` times the range of the
    others.

    Each value represents `count` (n,) rows, whose values spread over `width`.
    """
    far = np.abs(values - _median(values, count))
    order = np.argsort(far, kind="stable")
    outside = np.cumsum(np.ones(len(values)) if count is None else count[order][::-1])
    first = max(len(values) - 1 - int(np.searchsorted(outside, most, side="right")), 0)
    ranges = np.maximum.accumulate(values[order]) - np.minimum.accumulate(values[order])
    others = np.maximum(ranges[first:-1], width)
    beyond = np.flatnonzero((np.diff(far[order])[first:] > gap * others) & (others > 0.0))
    found = np.zeros(len(values), dtype=bool)
    if len(beyond):
        found[order[first + int(beyond[0]) + 1 :]] = True
        if count is None and len(np.unique(values[~found])) < LEAST_OTHERS:
            found[:] = False
    return found


def refuse_isolated(position: Float1D, count: Float1D, width: float) -> None:
    """Refuses positions of cells (m,), each of `count` rows and of a width, if a few rows are isolated.

    Raises
    ------
    InputError
        Some rows are isolated; the message names their positions.
    """
    total = float(count.sum())
    apart = isolated(position, ISOLATED_GAP_RATIO, MOST_ISOLATED_SHARE * total, count, width)
    if not apart.any():
        return
    low, high = float(position[~apart].min()) - width, float(position[~apart].max()) + width
    named = ", ".join(f"{value:.4g}" for value in position[apart][:MOST_NAMED_ROWS])
    raise InputError(
        f"{int(count[apart].sum())} of {int(total)} rows have a position ({named}) far outside the range of "
        f"the other rows, {low:.4g} to {high:.4g}. They are likely wrong readings: remove them, or identify "
        "without --out-of-core, which drops them"
    )


def _median(values: Float1D, count: Float1D | None) -> float:
    """Returns the median of values (n,) that each represent `count` (n,) rows."""
    if count is None:
        return float(np.median(values))
    order = np.argsort(values, kind="stable")
    return float(values[order[np.searchsorted(np.cumsum(count[order]), 0.5 * count.sum())]])


def _judged(
    name: str,
    values: Float1D,
    given: NDArray[np.bool_],
    position: Float1D | None,
    findings: list[Finding],
    unit: Unit,
) -> NDArray[np.bool_]:
    """Returns True (n,) for rows to drop because of isolated values, among the `given` rows; adds
    findings."""
    found = np.zeros(len(values), dtype=bool)
    if not _stretched(values):
        return found
    rows = np.flatnonzero(given)
    sparse = len(rows) < LEAST_ROWS
    gap, most = (
        (SPARSE_GAP_RATIO, 1) if sparse else (ISOLATED_GAP_RATIO, int(MOST_ISOLATED_SHARE * len(rows)))
    )
    if len(rows) <= LEAST_OTHERS + 1:
        return found
    for limit, drop in ((gap, True), (REPORTED_GAP_SHARE * gap, False)):
        apart = isolated(values[rows], limit, most)
        if position is not None:
            apart &= _bracketed(position[rows], apart)
        if not apart.any():
            continue
        here, others = rows[apart], values[rows[~apart]]
        count, ratio = len(here), _gap(values[here], others)
        drop = drop and _longest_run(apart) <= LONGEST_RUN
        found[here] = drop
        named = ", ".join(f"row {row} at {unit.text(values[row])}" for row in here[:MOST_NAMED_ROWS])
        more = ", ..." if count > MOST_NAMED_ROWS else ""
        result = (
            "They are likely wrong readings and were dropped"
            if drop
            else f"They extend the range of {name}. If they are wrong readings, remove them"
        )
        findings.append(
            usable(
                f"{count} of {len(rows)} rows ({named}{more}) have a {name} outside the range of the others, "
                f"{unit.interval(others.min(), others.max())}, by {ratio:.3g} times its width. "
                f"{result}"
            )
        )
        break
    return found


def _stretched(values: Float1D) -> bool:
    """True if values (n,) are few, or if their range is so much larger than that of most values that some may
    be isolated."""
    low, high = np.quantile(
        values[:: max(1, len(values) // MOST_SAMPLED_ROWS)], (MOST_ISOLATED_SHARE, 1.0 - MOST_ISOLATED_SHARE)
    )
    return len(values) < LEAST_ROWS or float(
        np.ptp(values)
    ) > REPORTED_GAP_SHARE * ISOLATED_GAP_RATIO * float(high - low)


def _gap(values: Float1D, others: Float1D) -> float:
    """Returns the largest distance of values from the range of `others`, divided by this range [-]."""
    low, high = float(others.min()), float(others.max())
    return float(np.maximum(values - high, low - values).max()) / (high - low)


def _bracketed(position: Float1D, apart: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Returns True (n,) for each row whose position is between the positions of two rows that are not
    isolated."""
    others = position[~apart]
    return np.asarray((position > others.min()) & (position < others.max()))


def _longest_run(rows: NDArray[np.bool_]) -> int:
    """Returns the largest number of successive rows that are True."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], rows.astype(np.int8), [0]])))
    return int((edges[1::2] - edges[::2]).max(initial=0))


WRONG_RATIO = 8.0
"""Deviation of a value from its neighbours above which the value is a wrong reading [typical changes between
successive rows nearby]."""

LEAST_WRONG = 0.01
"""Smallest deviation of a wrong reading [share of the range of the column]: a hand does not feel less."""

MOST_ROUNDS = 4
"""Largest number of times that wrong readings are searched, each time without those found before."""

MOST_WRONG_SHARE = 0.1
"""Share of the rows above which deviating values are not wrong readings [-]: so many belong to the object."""


@np.errstate(over="ignore", invalid="ignore")  # huge values, refused later, may overflow
def wrong_readings(recording: Recording) -> NDArray[np.bool_]:
    """Returns True (n,) for rows with a wrong reading of position or force.

    A wrong reading is outside the interval between the median values of the rows before it and after it, so
    that no row of a steep wall or of a click is one. The distance is compared with the changes from row to
    row nearby. At the largest and smallest positions a wall may be touched by a single row. A recording
    whose rows are not in the order of a motion has none.
    """
    found = np.zeros(len(recording), dtype=bool)
    few = len(recording) <= 2 * LOCAL_ROWS or len(recording.input_names) > 0
    if few or strokes_from_order(recording.motion.position) is None:
        return found
    for values, at_ends in ((recording.position, True), (recording.force, False)):
        found |= _deviating(values, recording.position, ~found, at_ends)
    return found if found.mean() <= MOST_WRONG_SHARE else np.zeros(len(recording), dtype=bool)


LOCAL_ROWS = 8
"""Number of rows before a row, and after it, whose typical change is that of the motion nearby."""


def _deviating(
    values: Float1D, position: Float1D, given: NDArray[np.bool_], at_ends: bool
) -> NDArray[np.bool_]:
    """Returns True (n,) for the given rows whose value deviates from those before and after them."""
    found = np.zeros(len(values), dtype=bool)
    floor = LEAST_WRONG * float(np.subtract(*np.quantile(values[given], (0.99, 0.01))))
    for _ in range(MOST_ROUNDS):
        rows = np.flatnonzero(given & ~found)
        v, x = values[rows], position[rows]
        around = np.pad(v, NEIGHBOUR_ROWS, mode="edge")
        windows = np.lib.stride_tricks.sliding_window_view(around, NEIGHBOUR_ROWS)
        before, after = (np.median(each, axis=1) for each in (windows[: len(v)], windows[-len(v) :]))
        # The first and the last row have no rows on one side: the change of the nearest rows continues there.
        before[0] = after[0] + WRONG_RATIO * (after[0] - after[NEIGHBOUR_ROWS])
        after[-1] = before[-1] + WRONG_RATIO * (before[-1] - before[-1 - NEIGHBOUR_ROWS])
        apart = np.maximum(v - np.maximum(before, after), np.minimum(before, after) - v)
        changes = np.pad(np.abs(np.diff(v)), LOCAL_ROWS, mode="reflect")
        nearby = np.median(np.lib.stride_tricks.sliding_window_view(changes, LOCAL_ROWS), axis=1)
        usual = np.maximum(np.maximum(nearby[: len(v)], nearby[-len(v) :]), float(np.median(changes)))
        wrong = apart > np.maximum(WRONG_RATIO * usual, floor)
        if not at_ends and wrong.any():
            ordinary = x[~wrong]
            wrong &= (x >= ordinary.min()) & (x < ordinary.max())
        if not wrong.any():
            break
        found[rows[wrong]] = True
    return found


HUBER_THRESHOLD = 2.0
"""Residual at which Huber's loss becomes linear [standard deviations]: keeps 99 % of the efficiency of least
squares on data without outliers."""

OUTLIER_STANDARD_DEVIATIONS = 8.0
"""Difference of a recorded force from the median of the neighbouring rows, and from the force of the model,
above which its row is dropped [standard deviations]."""

NEIGHBOUR_ROWS = 3
"""Number of previous rows, and of next rows, whose median force is compared with the force of a row."""

MOST_FITS = 4
"""Largest number of fits with Huber's loss, each with new weights of the rows."""

SETTLED_WEIGHT_CHANGE = 1e-3
"""Mean change of the weights of the rows below which no further fit is needed [-]."""

MOST_OUTLIER_SHARE = 0.2
"""Share of dropped rows above which the model is unfit [-]: so many rows cannot be outliers."""


def from_neighbours(
    box: Float2D, force: Float1D, side: Float1D | None, trusted: NDArray[np.bool_]
) -> Float1D:
    """Returns the force of each row minus the median force of its trusted neighbours (n,).

    Neighbours are adjacent rows in recorded order, or in order of position, on the same stroke if `side` (n,)
    is given. The order with the smaller differences is used: neighbours in position can be on different
    strokes, and a table can be shuffled. Of the three rows before and the three rows after, the group with
    the closer median is used, so that a step of the force is not an outlier. With several inputs, the six
    nearest rows are the neighbours.
    """
    known = np.flatnonzero(trusted)
    if box.shape[1] > 1:
        near = known[np.asarray(cKDTree(box[known]).query(box, k=2 * NEIGHBOUR_ROWS + 1)[1])[:, 1:]]
        return np.asarray(force - np.median(force[near], axis=1))
    keys = (box[:, 0],) if side is None else (box[:, 0], side)
    found = []
    for order in (np.arange(len(force)), np.lexsort(keys)):
        place = np.empty(len(force), dtype=np.intp)
        place[order] = np.arange(len(force))
        sequence = order[trusted[order]]
        before = np.searchsorted(place[sequence], place, side="left")
        after = np.searchsorted(place[sequence], place, side="right")
        apart = [
            force - np.median(force[sequence[np.clip(first[:, None] + step, 0, len(sequence) - 1)]], axis=1)
            for first, step in (
                (before, -np.arange(1, NEIGHBOUR_ROWS + 1)),
                (after, np.arange(NEIGHBOUR_ROWS)),
            )
        ]
        found.append(np.where(np.abs(apart[0]) < np.abs(apart[1]), *apart))
    return min(found, key=standard_deviation)


def suspects(box: Float2D, force: Float1D, side: Float1D | None, weight: Float1D | None) -> NDArray[np.bool_]:
    """Returns True (n,) for rows with a force far from the median of their neighbours; rows of weight 0 are
    no neighbours."""
    given = np.ones(len(force), dtype=bool) if weight is None else weight > 0.0
    low, high = np.quantile(force[given], (0.05, 0.95))
    found = np.zeros(len(force), dtype=bool)
    for _ in range(MOST_FITS):
        trusted, before = given & ~found, found
        if np.count_nonzero(trusted) <= 2 * NEIGHBOUR_ROWS + 1:
            break
        apart = from_neighbours(box, force, side, trusted)
        scale = max(standard_deviation(apart[trusted]), FORCE_RESOLUTION * float(high - low))
        found = given & (np.abs(apart) > OUTLIER_STANDARD_DEVIATIONS * scale)
        if np.array_equal(found, before):
            break
    return found


@dataclass(frozen=True)
class Robust:
    """Weights of the rows for the last fit, and the rows that are dropped as outliers."""

    weight: Float1D
    """(n,) weights of the rows for the last fit"""
    outliers: NDArray[np.bool_]
    """(n,) True for dropped rows"""
    note: str

    def findings(self, residual: Float1D, force_unit: Unit = UNSTATED_UNIT) -> list[Finding]:
        """Returns a finding on the dropped rows; `residual` (n,) has the residuals of all rows."""
        count = int(np.count_nonzero(self.outliers))
        if not count:
            return []
        share = count / len(self.outliers)
        judge = no if share > MOST_OUTLIER_SHARE else usable
        largest = float(np.abs(residual[self.outliers]).max())
        return [
            judge(
                f"{count} rows ({100 * share:.2g} %) differ by more than {OUTLIER_STANDARD_DEVIATIONS:g} "
                "standard deviations from the model and from their neighbours, at most by "
                f"{force_unit.text(largest)}. They are likely wrong readings and were dropped; the error "
                "is that of the other rows"
            )
        ]


def robust_weights(
    fit: Callable[[Float1D], Float1D],
    first: Float1D,
    force: Float1D,
    weight: Float1D | None,
    suspect: NDArray[np.bool_],
) -> Robust:
    """Returns the weights of the rows for the last fit.

    Parameters
    ----------
    fit : callable
        Returns the modelled force (n,) for given weights of the rows.
    first : (n,)
        Modelled force of a fit without the rows of `suspect`.
    force, weight
        Forces (n,), samples that each row represents (n,) or None.
    suspect : (n,)
        True for rows that may be outliers.
    """
    given = np.ones(len(force)) if weight is None else weight
    modelled, share = first, np.where(suspect, 0.0, 1.0)
    for _ in range(MOST_FITS):
        residual = np.abs(force - modelled)
        scale = standard_deviation(residual[given > 0.0])
        before = share
        share = np.minimum(1.0, HUBER_THRESHOLD * scale / np.maximum(residual, np.finfo(float).tiny))
        share[suspect & (residual > OUTLIER_STANDARD_DEVIATIONS * scale)] = 0.0
        if scale == 0.0 or np.abs(share - before).mean() <= SETTLED_WEIGHT_CHANGE:
            break
        modelled = fit(given * share)
    outliers = (share == 0.0) & (given > 0.0)
    far = int(np.count_nonzero(share < 0.5))
    note = (
        f"{far} rows differ by more than {2 * HUBER_THRESHOLD:g} standard deviations from the model and have "
        f"less weight; {np.count_nonzero(outliers)} of them were dropped."
    )
    return Robust(given * share, outliers, note)

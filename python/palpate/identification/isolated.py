# SPDX-License-Identifier: Apache-2.0
"""Single rows far outside the range of all others: wrong readings of position, of another input, or of force.

One position at 10^6 times the travel moves all other rows into one cell, and nothing can be resolved there. A
row is isolated if few rows lie beyond a gap many times larger than the range of all others, in short runs of
the recording. A force may rise that much at a wall that is touched briefly; so a force is isolated only where
rows of ordinary force lie at smaller and at larger positions.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from .._typing import Float1D
from ..errors import InputError
from ..recording import Recording
from ..verdict import Finding, usable

FEW = 0.01
"""Largest share of the rows that may be isolated [-]"""

LEAST_ROWS = 100
"""Rows below which only one row may be isolated, by a larger gap: sparse tables may be spaced by factors."""

GAP = 10.0
"""Ratio of the gap to the range of the other rows above which rows are dropped [-]"""

SPARSE_GAP = 1000.0
"""The same for a recording of few rows [-]"""

STRETCHED = 0.2
"""Ratio of a gap that is reported, to one at which rows are dropped [-]"""

LONGEST_RUN = 3
"""Rows in succession that a wrong reading may last."""

LEAST_OTHERS = 3
"""Distinct values that the other rows must have."""

SAMPLED = 10_000
"""Rows, evenly spread, that show the range of most values."""

NAMED = 3
"""Rows that a finding names."""


@np.errstate(over="ignore", invalid="ignore")  # a range may exceed the largest number; it is refused later
def without_isolated(recordings: Sequence[Recording]) -> tuple[list[Recording], list[Finding]]:
    """The recordings without isolated rows, and findings on these rows."""
    counts = [len(recording) for recording in recordings]
    position = np.concatenate([recording.position for recording in recordings])
    force = np.concatenate([recording.force for recording in recordings])
    columns = [("position", position)]
    for index, name in enumerate(recordings[0].input_names):
        columns.append((name, np.concatenate([recording.inputs[:, index] for recording in recordings])))
    dropped = np.zeros(len(position), dtype=bool)
    findings: list[Finding] = []
    for name, values in columns:
        dropped |= _judged(name, values, ~dropped, None, findings)
    dropped |= _judged("force", force, ~dropped, position, findings)
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
    """At most so many rows (n,) beyond a gap so many times larger than the range of the others.

    Each value stands for count (n,) rows that spread over a width.
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
    """Refuse sums over cells (m,) of a width, each of count rows, if few rows stretch the range of all.

    Raises
    ------
    InputError
        Names the positions of these rows.
    """
    total = float(count.sum())
    apart = isolated(position, GAP, FEW * total, count, width)
    if not apart.any():
        return
    low, high = float(position[~apart].min()) - width, float(position[~apart].max()) + width
    named = ", ".join(f"{value:.4g}" for value in position[apart][:NAMED])
    raise InputError(
        f"{int(count[apart].sum())} of {int(total)} rows have a position ({named}) far outside the "
        f"others' range, {low:.4g} to {high:.4g}. They are likely wrong readings: remove them, or "
        "identify in memory, which leaves them out"
    )


def _median(values: Float1D, count: Float1D | None) -> float:
    """Median of values (n,) that each stand for count (n,) rows."""
    if count is None:
        return float(np.median(values))
    order = np.argsort(values, kind="stable")
    return float(values[order[np.searchsorted(np.cumsum(count[order]), 0.5 * count.sum())]])


def _judged(
    name: str, values: Float1D, given: NDArray[np.bool_], position: Float1D | None, findings: list[Finding]
) -> NDArray[np.bool_]:
    """Rows (n,) to be dropped for their values, among the given ones; adds findings."""
    found = np.zeros(len(values), dtype=bool)
    if not _stretched(values):
        return found
    rows = np.flatnonzero(given)
    sparse = len(rows) < LEAST_ROWS
    gap, most = (SPARSE_GAP, 1) if sparse else (GAP, int(FEW * len(rows)))
    if len(rows) <= LEAST_OTHERS + 1:
        return found
    for limit, drop in ((gap, True), (STRETCHED * gap, False)):
        apart = isolated(values[rows], limit, most)
        if position is not None:
            apart &= _bracketed(position[rows], apart)
        if not apart.any():
            continue
        here, others = rows[apart], values[rows[~apart]]
        count, ratio = len(here), _gap(values[here], others)
        drop = drop and _longest_run(apart) <= LONGEST_RUN
        found[here] = drop
        named = ", ".join(f"row {row} at {values[row]:.4g}" for row in here[:NAMED])
        more = ", ..." if count > NAMED else ""
        result = (
            "They were left out as wrong readings"
            if drop
            else f"They stretch the range of {name}. If they are wrong readings, remove them"
        )
        findings.append(
            usable(
                f"{count} of {len(rows)} rows ({named}{more}) have a {name} outside the others' range, "
                f"{others.min():.4g} to {others.max():.4g}, by {ratio:.3g} times its width. {result}"
            )
        )
        break
    return found


def _stretched(values: Float1D) -> bool:
    """True if the range is so much larger than that of most values (n,) that rows may be isolated."""
    low, high = np.quantile(values[:: max(1, len(values) // SAMPLED)], (FEW, 1.0 - FEW))
    return len(values) < LEAST_ROWS or float(np.ptp(values)) > STRETCHED * GAP * float(high - low)


def _gap(values: Float1D, others: Float1D) -> float:
    """Largest distance of values from the range of the others, in widths of that range."""
    low, high = float(others.min()), float(others.max())
    return float(np.maximum(values - high, low - values).max()) / (high - low)


def _bracketed(position: Float1D, apart: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Rows (n,) that have others, not apart, at smaller and at larger positions."""
    others = position[~apart]
    return np.asarray((position > others.min()) & (position < others.max()))


def _longest_run(rows: NDArray[np.bool_]) -> int:
    """Rows in succession, at most."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], rows.astype(np.int8), [0]])))
    return int((edges[1::2] - edges[::2]).max(initial=0))

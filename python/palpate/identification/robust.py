# SPDX-License-Identifier: Apache-2.0
"""Outliers: rows far from the others are weighed down, and wrong readings are left out.

Huber's loss is quadratic up to k standard deviations of the residual and linear beyond (Huber 1964). It is
minimised by least squares with weights min(1, k s / |residual|), which are found again after each fit; s
comes from the median absolute residual, which outliers do not move.

A linear loss still lets one row of 10^4 standard deviations decide. So the first fit leaves out every row
that is far from the median of its neighbours, and later fits leave out those of them that are also far from
the model. A row that only the model misses, such as a click that it has not learned yet, keeps its weight.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from .._typing import Float1D, Float2D
from ..verdict import Finding, no, usable
from .rung import Rung

BEND = 2.0
"""k: on data without outliers 99 % of the efficiency of least squares is kept."""

FAR = 8.0
"""Standard deviations from the neighbours, and from the model, beyond which a row is left out [-]"""

NEIGHBOURS = 3
"""Rows before a row, and after it, whose median it is compared with."""

RESOLVED = 2.0**-16
"""Share of the force's range below which no difference from the neighbours counts."""

ROUNDS = 4
"""Fits with ever better weights."""

SETTLED = 1e-3
"""Mean change of the weights below which they are good."""

MOST_LEFT_OUT = 0.2
"""Share of the rows left out above which they are no outliers, and the model is unfit."""


def standard_deviation(residual: Float1D) -> float:
    """Standard deviation of normal residuals (n,), from the median of their absolute values."""
    return 1.4826 * float(np.median(np.abs(residual)))


def from_neighbours(
    box: Float2D, force: Float1D, side: Float1D | None, trusted: NDArray[np.bool_]
) -> Float1D:
    """Force less the median of its trusted neighbours (n,).

    Neighbours are those in recorded order, or those in position, on the same stroke where side (n,) says it.
    The closer ones of the two are taken: a recorded motion may go through hysteresis, and a table may be
    shuffled. Of the three rows before and the three rows after, those with the closer median count: a step is
    no outlier.
    """
    known = np.flatnonzero(trusted)
    if box.shape[1] > 1:
        near = known[np.asarray(cKDTree(box[known]).query(box, k=2 * NEIGHBOURS + 1)[1])[:, 1:]]
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
            for first, step in ((before, -np.arange(1, NEIGHBOURS + 1)), (after, np.arange(NEIGHBOURS)))
        ]
        found.append(np.where(np.abs(apart[0]) < np.abs(apart[1]), *apart))
    return min(found, key=standard_deviation)


def suspects(box: Float2D, force: Float1D, side: Float1D | None, weight: Float1D | None) -> NDArray[np.bool_]:
    """Rows (n,) far from the median of their neighbours; rows of weight 0 are no neighbours."""
    given = np.ones(len(force), dtype=bool) if weight is None else weight > 0.0
    low, high = np.quantile(force[given], (0.05, 0.95))
    found = np.zeros(len(force), dtype=bool)
    for _ in range(ROUNDS):
        trusted, before = given & ~found, found
        if np.count_nonzero(trusted) <= 2 * NEIGHBOURS + 1:
            break
        apart = from_neighbours(box, force, side, trusted)
        scale = max(standard_deviation(apart[trusted]), RESOLVED * float(high - low))
        found = given & (np.abs(apart) > FAR * scale)
        if np.array_equal(found, before):
            break
    return found


@dataclass(frozen=True)
class Robust:
    """Weights of the rows, and which rows count in the error."""

    weight: Float1D
    """(n,) for the last fit"""
    outliers: NDArray[np.bool_]
    """(n,) rows that were left out"""
    note: str

    def findings(self, residual: Float1D) -> list[Finding]:
        """A finding on the rows that were left out, with their residuals (n,) among all."""
        count = int(np.count_nonzero(self.outliers))
        if not count:
            return []
        share = count / len(self.outliers)
        judge = no if share > MOST_LEFT_OUT else usable
        largest = float(np.abs(residual[self.outliers]).max())
        return [
            judge(
                f"{count} rows ({share:.2g} of all) lie more than {FAR:g} standard deviations from the model "
                f"and from their neighbours, the farthest by {largest:.3g}: they were left out as wrong "
                "readings, and the error is that of the other rows"
            )
        ]


def robust_weights(
    fit: Callable[[Float1D], Rung],
    first: Rung,
    box: Float2D,
    force: Float1D,
    weight: Float1D | None,
    suspect: NDArray[np.bool_],
) -> Robust:
    """Weights of the rows for a last fit.

    Parameters
    ----------
    fit : callable
        The rung for given weights.
    first : Rung
        The rung without the rows that are suspect.
    box, force, weight
        Positions in the unit box (n, d), forces (n,), samples that each row stands for (n,) or None.
    suspect : (n,)
        Rows that may be left out.
    """
    given = np.ones(len(force)) if weight is None else weight
    rung, share = first, np.where(suspect, 0.0, 1.0)
    for _ in range(ROUNDS):
        residual = np.abs(force - rung.modelled(box))
        scale = standard_deviation(residual[given > 0.0])
        before = share
        share = np.minimum(1.0, BEND * scale / np.maximum(residual, np.finfo(float).tiny))
        share[suspect & (residual > FAR * scale)] = 0.0
        if scale == 0.0 or np.abs(share - before).mean() <= SETTLED:
            break
        rung = fit(given * share)
    outliers = (share == 0.0) & (given > 0.0)
    far = int(np.count_nonzero(share < 0.5))
    note = (
        f"{far} rows farther than {2 * BEND:g} standard deviations were weighed down, "
        f"{np.count_nonzero(outliers)} of them left out"
    )
    return Robust(given * share, outliers, note)

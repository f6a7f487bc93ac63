# SPDX-License-Identifier: Apache-2.0
"""Rows that are held out while a network grows, to judge it on data that it was not fitted to."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..._core.model import wavelet_columns
from ..._typing import Float1D, Float2D
from ...verdict import FORCE_FLOOR, FORCE_JND

EVERY = 5
"""One row of so many is kept back."""

BLOCKS = 50
"""A motion is kept back in stretches, of which there are so many in all: neighbours in time are no news."""

TRIM = 0.1
"""Share of the groups at each end that a robust gain leaves out."""

MOST_ROWS = 20_000
"""More fresh rows than this are thinned out evenly: they tell no more."""


@dataclass(frozen=True)
class HeldOutRows:
    """Rows of a recording in the unit box that a problem was not made of."""

    positions: Float2D
    """(k, d)"""
    force: Float1D
    side: Float1D | None

    @staticmethod
    def of(
        positions: Float2D, force: Float1D, side: Float1D | None, rows: NDArray[np.bool_]
    ) -> "HeldOutRows":
        index = np.flatnonzero(rows)
        index = index[:: max(1, -(-len(index) // MOST_ROWS))]
        return HeldOutRows(
            np.ascontiguousarray(positions[index]), force[index], None if side is None else side[index]
        )

    def errors(self, readings: Float2D, alpha: Float2D, beta: Float2D) -> Float1D:
        """Force less the network's (k,), from its readings of g (and h): (1 or 2, 1 + d + N)."""
        columns = np.concatenate(
            [
                np.ones((len(self.force), 1)),
                self.positions,
                wavelet_columns(self.positions, alpha, beta),
            ],
            axis=1,
        )
        channels = columns @ readings.T
        modelled = channels[:, 0] if self.side is None else channels[:, 0] + self.side * channels[:, -1]
        return np.asarray(self.force - modelled)

    def felt(self, errors: Float1D) -> Float1D:
        """Errors (k,) in just noticeable differences: 7 % of the local force, or the floor."""
        return np.asarray(errors / np.maximum(FORCE_JND * np.abs(self.force), self._floor))

    @property
    def _floor(self) -> float:
        return float(FORCE_FLOOR * np.abs(self.force).max()) or 1.0


def held_out_rows(n: int, starts: Sequence[int] | None) -> NDArray[np.bool_]:
    """Which of n rows are fresh (n,): stretches of a motion, where starts tell it; else single rows."""
    index = np.arange(n)
    if starts is None or n < EVERY * BLOCKS:
        return np.asarray(index % EVERY == EVERY // 2)
    return np.asarray(index * BLOCKS // n % EVERY == EVERY // 2)


def inside(rows: Float2D, others: Float2D) -> NDArray[np.bool_]:
    """Rows (k, d) that lie within the range of other rows (m, d) in every input: True where they do (k,)."""
    if len(others) == 0:
        return np.zeros(len(rows), dtype=np.bool_)
    within: NDArray[np.bool_] = (rows >= others.min(axis=0)) & (rows <= others.max(axis=0))
    return np.asarray(within.all(axis=1))


def gain(below: Float1D, above: Float1D, *, trim: float = 0.0) -> tuple[float, float]:
    """Fall of the mean squared error from errors below (k,) to above (k,) as a share, and its standard error.

    The rows are taken in BLOCKS groups, so that errors that belong together count once. With trim, this share
    of the groups is left out at both ends: where the error grows most and where it falls most.
    """
    square = np.array([below * below, above * above])
    groups = np.array([part.mean(axis=1) for part in np.array_split(square, min(BLOCKS, len(below)), axis=1)])
    if trim:
        cut = int(np.ceil(trim * len(groups)))
        order = np.argsort(groups[:, 1] - groups[:, 0], kind="stable")
        groups = groups[order[cut : len(groups) - cut]]
    before, after = groups.mean(axis=0)
    if before == 0.0:
        return 0.0, 0.0
    ratio = after / before
    scatter = (groups[:, 1] - ratio * groups[:, 0]) / before
    return float(1.0 - ratio), float(scatter.std() / np.sqrt(max(len(groups) - 1, 1)))

# SPDX-License-Identifier: Apache-2.0
"""Rows of a fit, compressed to one weighted row for each position, and held-out rows.

An encoder repeats its positions. For w samples y_k at one position x the least squares of the paper's eq. 4
needs only w, the mean force and `within`, the sum of squared differences from the mean force: sum_k (y_k -
f(x))^2 = w (mean y - f(x))^2 + within. Positions that do not repeat are gathered in cells; a cell is replaced
by its mean position and mean force. The error of this is of second order in the cell width. The part of
`within` that the slope of the force across the cell explains is removed, so that the remainder measures
noise. With many inputs a grid of narrow cells has too many cells; then a part of the rows, evenly spread over
the recording, represents all rows.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..._typing import Float1D, Float2D
from ...verdict import FORCE_FLOOR, force_jnd
from .limits import NO_LIMITS, RowLimits, distinct_rows, evenly_spread

SIDE_LEVELS = 16
"""Number of cell widths of the direction state over [-1, 1]. The first and the last cell have their centres
at -1 and +1, the values during a stroke."""

POOLED_CELLS = 4
"""Number of neighbouring position cells that share one slope of the force; with several inputs at least 2 per
input."""

LEAST_CELLS_PER_AXIS = 8
"""Least number of cells along each input. With fewer cells, rows are dropped instead of gathered in cells."""


@dataclass(frozen=True)
class Compressed:
    """Weighted rows that represent a recording in every least-squares problem."""

    positions: Float2D
    """(m, d)"""
    force: Float1D
    """(m,) mean force of the samples of each row"""
    weight: Float1D
    """(m,) number of samples that each row represents"""
    side: Float1D | None
    """(m,) direction state s in [-1, 1]; None without hysteresis"""
    within: float
    """Sum of squared differences of the samples from the mean force of their row: no model of these inputs
    can reduce it"""
    samples: float
    """Number of represented rows of the recording, or the sum of their weights"""
    limits: RowLimits = NO_LIMITS
    """Limits of the information in the rows"""
    scatter: float = 0.0
    """Mean squared distance of the samples of a row from its position, along the first input"""

    def reweighted_to(self, samples: float) -> Compressed:
        """Returns the rows with weights scaled so that together they represent `samples` rows of the
        recording."""
        more = samples / self.samples
        return replace(self, weight=more * self.weight, within=more * self.within, samples=samples)


class Compressor:
    """Groups the rows of a recording by position, and compresses them with or without a direction state.

    More than `max_positions` distinct positions (n, d) are gathered in this number of cells of a regular
    grid. Each row represents `weight` (n,) samples, by default 1; one of weight 0 is left out. The sum of
    squared differences of the samples from the force of their row is `within`.
    """

    def __init__(
        self,
        positions: Float2D,
        force: Float1D,
        *,
        max_positions: int,
        weight: Float1D | None = None,
        within: float = 0.0,
        limits: RowLimits = NO_LIMITS,
    ) -> None:
        self._within, self._limits = within, limits
        self.kept = np.arange(len(force)) if weight is None else np.flatnonzero(weight > 0.0)
        """Indices of the recorded rows that are used: rows with a weight above 0, or an even selection of
        them."""
        self._key, self._per_axis = _position_key(positions[self.kept], max_positions)
        if 0 < self._per_axis < LEAST_CELLS_PER_AXIS:
            self.kept = self.kept[np.linspace(0, len(self.kept) - 1, max_positions).round().astype(np.int64)]
            self._key, self._per_axis = np.arange(max_positions), 0
        self._positions = positions[self.kept]
        self._force = force[self.kept]
        self._weight = np.ones(len(self._force)) if weight is None else weight[self.kept]

    def samples(self, only: NDArray[np.bool_]) -> float:
        """Returns the number of recorded rows that the used ones among the rows `only` (n,) represent."""
        return float(self._weight[only[self.kept]].sum())

    def rows(self, side: Float1D | None = None, share: NDArray[Any] | None = None) -> Compressed:
        """Returns compressed rows; rows in different cells of the direction state `side` (n,) are not merged.

        `share` (n,) from 0 to 1 multiplies the weights of the rows of the recording.
        """
        here = np.ones(len(self.kept)) if share is None else share[self.kept]
        on = here > 0
        cell, positions, force, weight = self._key[on], self._positions[on], self._force[on], self._weight[on]
        weight = weight * here[on]
        side = None if side is None else side[self.kept][on]
        within = self._within * float(weight.sum() / self._weight.sum())
        key = cell
        if side is not None:
            level = np.rint((side + 1.0) * (SIDE_LEVELS / 2)).astype(np.int64)
            key = cell + (int(cell.max()) + 1) * level
        group, count = _ranked(key, weight)
        x = np.column_stack([_mean(group, count, weight * column) for column in positions.T])
        y = _mean(group, count, weight * force)
        dy = force - y[group]
        merged_side = None
        ds = np.zeros_like(dy)
        if side is not None:
            merged_side = _mean(group, count, weight * side)
            ds = side - merged_side[group]
        dx = positions - x[group]
        if self._per_axis:
            # The rows of a cell and its neighbours share one slope for all direction states, so that the
            # slopes need the same degrees of freedom in all model classes.
            block = _pooled(cell, (self._per_axis,) * positions.shape[1], weight)
            dy = _without_slopes(dy, dx, block, weight)
            ds = _without_slopes(ds, dx, block, weight) if ds.any() else ds
        if ds.any():
            dy = _without_slopes(dy, ds[:, None], np.zeros_like(key), weight)
        within += float(dy @ (weight * dy))
        samples = float(weight.sum())
        scatter = float(weight @ dx[:, 0] ** 2) / samples
        return Compressed(x, y, count, merged_side, within, samples, self._limits, scatter)


def _pooled(cell: NDArray[np.int64], grid: tuple[int, ...], weight: Float1D) -> NDArray[np.int64]:
    """Returns for each row (n,) the number of the block of neighbouring cells that contains its cell."""
    together = max(2, round(POOLED_CELLS ** (1.0 / len(grid))))
    pooled = np.array(np.unravel_index(cell, grid)) // together
    return _ranked(np.ravel_multi_index(tuple(pooled), grid), weight)[0]


def _without_slopes(values: Float1D, over: Float2D, block: NDArray[np.int64], weight: Float1D) -> Float1D:
    """Returns values (n,) minus a linear function of the columns of `over` (n, d), fitted in each block
    (n,)."""
    d = over.shape[1]
    products = [[np.bincount(block, weight * a * b) for b in (*over.T, values)] for a in over.T]
    table = np.array(products).transpose(2, 0, 1)
    slope = np.einsum("bij,bj->bi", np.linalg.pinv(table[:, :, :d], hermitian=True), table[:, :, d])
    return np.asarray(values - np.einsum("nj,nj->n", slope[block], over))


def _position_key(positions: Float2D, max_positions: int) -> tuple[NDArray[np.int64], int]:
    """Returns the group number of each row, and the number of cells along each axis; 0 if each group is one
    position."""
    d = positions.shape[1]
    if d == 1:
        distinct = np.unique(positions[:, 0])
        if len(distinct) <= max_positions:
            return np.searchsorted(distinct, positions[:, 0]), 0
    elif all(len(np.unique(column)) <= max_positions for column in positions.T):
        chosen, key, _ = distinct_rows(positions)
        if len(chosen) <= max_positions:
            return key, 0
    per_axis = max(2, round(max_positions ** (1.0 / d)))
    low, reach = positions.min(axis=0), np.ptp(positions, axis=0)
    scale = np.divide(per_axis, reach, out=np.zeros_like(reach), where=reach > 0)
    cell = np.minimum((positions - low) * scale, per_axis - 1).astype(np.int64)
    return np.ravel_multi_index(tuple(cell.T), (per_axis,) * d), per_axis


def _ranked(key: NDArray[np.int64], weight: Float1D) -> tuple[NDArray[np.int64], Float1D]:
    """Returns consecutive group numbers (n,), and the weight of each group (groups,)."""
    count = np.bincount(key, weight).astype(np.float64)
    rank = np.cumsum(count > 0) - 1
    return rank[key], np.asarray(count[count > 0], dtype=np.float64)


def _mean(group: NDArray[np.int64], count: Float1D, weighted: Float1D) -> Float1D:
    return np.asarray(np.bincount(group, weighted) / count)


SEAM_SHARE = 0.02
"""Share of the repeat length of a periodic force law, at each of its two ends, whose rows are copied to the
opposite end for the fit [-]."""


def around_seam(rows: Compressed) -> Compressed:
    """Copies the rows of a periodic model near each end of the period to the opposite end.

    A row and its copy share the weight. Wavelets near one end are then fitted to the rows of both ends.
    """
    x = rows.positions[:, 0]
    first, last = np.flatnonzero(x < SEAM_SHARE), np.flatnonzero(x >= 1.0 - SEAM_SHARE)
    index = np.concatenate([last, np.arange(len(x)), first])
    shift = np.repeat([-1.0, 0.0, 1.0], [len(last), len(x), len(first)])
    shared = np.zeros(len(x), dtype=np.bool_)
    shared[first] = shared[last] = True
    return replace(
        rows,
        positions=rows.positions[index] + shift[:, None],
        force=rows.force[index],
        weight=np.where(shared, 0.5, 1.0)[index] * rows.weight[index],
        side=None if rows.side is None else rows.side[index],
    )


HELD_OUT_EVERY = 5
"""One of five rows, or one of five sections of the recording, is held out."""

SECTIONS = 50
"""Number of sections of a recording, of which every fifth is held out as a whole: adjacent samples are
correlated. Of very long recordings as many sections are fitted."""


@dataclass(frozen=True)
class HeldOutRows:
    """Held-out rows; positions in the unit box."""

    positions: Float2D
    """(k, d)"""
    force: Float1D
    side: Float1D | None

    @staticmethod
    def of(positions: Float2D, force: Float1D, side: Float1D | None, rows: NDArray[np.bool_]) -> HeldOutRows:
        index = evenly_spread(np.flatnonzero(rows))
        return HeldOutRows(
            np.ascontiguousarray(positions[index]), force[index], None if side is None else side[index]
        )

    def in_jnd(self, errors: Float1D) -> Float1D:
        """Returns errors (k,) in just noticeable differences: 7 % of the local force, at least 1 % of the
        largest force."""
        floor = float(FORCE_FLOOR * np.abs(self.force).max()) or 1.0
        return np.asarray(errors / force_jnd(self.force, floor))


def held_out_rows(n: int, starts: Sequence[int] | None) -> NDArray[np.bool_]:
    """Returns the held-out rows (n,): sections of the recording if the starts of motions are given and rows
    suffice, else single rows."""
    index = np.arange(n)
    if starts is None or n < HELD_OUT_EVERY * SECTIONS:
        return np.asarray(index % HELD_OUT_EVERY == HELD_OUT_EVERY // 2)
    return np.asarray(index * SECTIONS // n % HELD_OUT_EVERY == HELD_OUT_EVERY // 2)


def inside(rows: Float2D, others: Float2D) -> NDArray[np.bool_]:
    """Returns True (k,) for rows (k, d) within the range of other rows (m, d) in every input."""
    if len(others) == 0:
        return np.zeros(len(rows), dtype=np.bool_)
    within: NDArray[np.bool_] = (rows >= others.min(axis=0)) & (rows <= others.max(axis=0))
    return np.asarray(within.all(axis=1))

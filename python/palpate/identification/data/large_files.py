# SPDX-License-Identifier: Apache-2.0
"""What least squares needs of a recording that does not fit into memory, block by block.

A block of rows becomes a summary: for each cell of position and each stroke the count, the mean position and
force, and the sums of squares and products about them. Two summaries merge into one that stands for both
(Chan, Golub and LeVeque 1979), so cells hold what one pass over all rows would have put there, to rounding.

Cells are single positions while these are few, else intervals [k 2^level, (k + 1) 2^level): cells of one
level nest in those of the next, and no range has to be known before. The summary of a block depends on its
rows alone and blocks are merged in their order, whoever made them: the result is the same to the last bit.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from importlib import import_module
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from ..._typing import Float1D, Float2D
from ...errors import InputError
from .compression import POOLED_CELLS

MOST_CELLS = 8192
"""Cells of position that are kept apart: as fine as identification ever asks for."""

SCATTER_ROWS = 16
"""Neighbouring cells in which the force of single rows is compared with one line."""


@dataclass(frozen=True)
class Summary:
    """Sums over the rows of each cell; arrays (m,), in rising order of cell, then side."""

    level: int | None
    """Cells are 2^level wide [position], or single positions where it is None"""
    cell: Float1D
    """The cell's number, or the position itself"""
    side: NDArray[np.int8]
    """+1 into the object, -1 out of it, 0 neither or not known"""
    count: Float1D
    position: Float1D
    """Mean"""
    force: Float1D
    """Mean"""
    xx: Float1D
    """Sum of squares of position about its mean"""
    xy: Float1D
    yy: Float1D
    lower: float
    """Least position of all rows"""
    upper: float

    @property
    def rows(self) -> float:
        """How many rows it stands for."""
        return float(self.count.sum())

    @property
    def variance(self) -> float:
        """Population variance of the force over all rows."""
        mean = np.average(self.force, weights=self.count)
        between = float(self.count @ (self.force - mean) ** 2)
        return (between + float(self.yy.sum())) / self.rows

    @property
    def correlation(self) -> float:
        """Of position and force over all rows; 0 where one of them is constant."""
        dx = self.position - np.average(self.position, weights=self.count)
        dy = self.force - np.average(self.force, weights=self.count)
        xx = float(self.count @ (dx * dx) + self.xx.sum())
        xy = float(self.count @ (dx * dy) + self.xy.sum())
        return xy / math.sqrt(xx * self.variance * self.rows) if xx * self.variance > 0.0 else 0.0

    @property
    def within(self) -> float:
        """Sum of squares of the force within cells that no slope across them explains [force^2]."""
        if self.level is None:
            return float(self.yy.sum())
        _, group = np.unique(np.floor(self.cell / POOLED_CELLS), return_inverse=True)
        xx, xy = np.bincount(group, self.xx), np.bincount(group, self.xy)
        explained = np.divide(xy * xy, xx, out=np.zeros_like(xx), where=xx > 0)
        return max(float(self.yy.sum() - explained.sum()), 0.0)

    @property
    def scatter(self) -> float:
        """Standard deviation of the force about one line in each interval of SCATTER_ROWS cells [force]."""
        group = np.argsort(np.argsort(self.position, kind="stable")) // SCATTER_ROWS
        total = np.bincount(group, self.count)
        dx, dy = (
            values - (np.bincount(group, self.count * values) / total)[group]
            for values in (self.position, self.force)
        )
        xx = np.bincount(group, self.xx + self.count * dx * dx)
        xy = np.bincount(group, self.xy + self.count * dx * dy)
        yy = np.bincount(group, self.yy + self.count * dy * dy)
        explained = np.divide(xy * xy, xx, out=np.zeros_like(xx), where=xx > 0)
        return float(np.sqrt(max(float(yy.sum() - explained.sum()), 0.0) / self.rows))


def summarise(
    position: Float1D, force: Float1D, side: NDArray[np.int8] | None, most_cells: int = MOST_CELLS
) -> Summary:
    """The summary of one block of rows, at least one."""
    side = np.zeros(len(position), dtype=np.int8) if side is None else side
    lower, upper = float(position.min()), float(position.max())
    level = None
    # as many distinct positions in the first rows already: no need to sort the others
    if len(np.unique(position[: 4 * most_cells])) > most_cells or len(np.unique(position)) > most_cells:
        level = _level_for(lower, upper, most_cells)
    cell = position if level is None else np.floor(np.ldexp(position, -level))
    ones, zeros = np.ones(len(position)), np.zeros(len(position))
    columns = np.array([ones, position, force, zeros, zeros, zeros])
    return _grouped(level, cell, side, columns, lower, upper)


def merged(first: Summary, second: Summary, most_cells: int = MOST_CELLS) -> Summary:
    """One summary for the rows of both."""
    lower, upper = min(first.lower, second.lower), max(first.upper, second.upper)
    levels = [summary.level for summary in (first, second) if summary.level is not None]
    both = _joined(first, second, max(levels) if levels else None, lower, upper)
    if both.level is None and len(np.unique(both.cell)) > most_cells:
        both = _joined(first, second, _level_for(lower, upper, most_cells), lower, upper)
    # a coarser level that the range asks for, not the number of cells in use: gaps may be filled later
    if both.level is not None and (needed := _level_for(lower, upper, most_cells)) > both.level:
        both = _joined(first, second, needed, lower, upper)
    return both


def _level_for(lower: float, upper: float, most_cells: int) -> int:
    """The finest level at which the range takes no more than most_cells cells (and the one it begins in)."""
    return math.ceil(math.log2(max(upper - lower, np.finfo(float).tiny) / most_cells))


def _joined(first: Summary, second: Summary, level: int | None, lower: float, upper: float) -> Summary:
    parts = (first, second)
    cell = np.concatenate([_at_level(part, level) for part in parts])
    side = np.concatenate([part.side for part in parts])
    names = ("count", "position", "force", "xx", "xy", "yy")
    columns = np.array([np.concatenate([getattr(part, name) for part in parts]) for name in names])
    return _grouped(level, cell, side, columns, lower, upper)


def _at_level(summary: Summary, level: int | None) -> Float1D:
    """The summary's cells, numbered at a level no finer than its own."""
    if level is None:
        return summary.cell
    if summary.level is None:
        return np.asarray(np.floor(np.ldexp(summary.cell, -level)))
    return np.asarray(np.floor(np.ldexp(summary.cell, summary.level - level)))


def _grouped(
    level: int | None, cell: Float1D, side: NDArray[np.int8], columns: Float2D, lower: float, upper: float
) -> Summary:
    """Columns (6, k), count, means of x and y, xx, xy, yy, gathered by cell and side."""
    distinct, place = np.unique(cell, return_inverse=True)
    key = 3 * place.astype(np.int64) + (side + 1)
    used, group = np.unique(key, return_inverse=True)
    count, x, y, xx, xy, yy = columns
    total = np.bincount(group, count)
    # means about a value of the group itself: no digits are lost to a large offset
    first = np.zeros(len(used), dtype=np.int64)
    first[group[::-1]] = np.arange(len(group))[::-1]
    x0, y0 = x[first], y[first]
    mean_x = x0 + np.bincount(group, count * (x - x0[group])) / total
    mean_y = y0 + np.bincount(group, count * (y - y0[group])) / total
    dx, dy = x - mean_x[group], y - mean_y[group]
    return Summary(
        level=level,
        cell=distinct[used // 3],
        side=(used % 3 - 1).astype(np.int8),
        count=np.asarray(total, dtype=np.float64),
        position=mean_x,
        force=mean_y,
        xx=np.asarray(np.bincount(group, xx + count * dx * dx), dtype=np.float64),
        xy=np.asarray(np.bincount(group, xy + count * dx * dy), dtype=np.float64),
        yy=np.asarray(np.bincount(group, yy + count * dy * dy), dtype=np.float64),
        lower=lower,
        upper=upper,
    )


Item = TypeVar("Item")

Result = TypeVar("Result")


def in_order(
    work: Callable[[Item], Result],
    items: Sequence[Item],
    *,
    jobs: int = 1,
    scheduler: str | None = None,
    done: Callable[[int], None] = lambda count: None,
) -> Iterator[Result]:
    """work(item) of every item, in their order.

    Parameters
    ----------
    work : callable
        Its result must depend on the item alone: then nobody can tell from the results who did the work.
    items : sequence
        What a worker is sent.
    jobs : int
        Processes of this machine, through joblib; 1: this process.
    scheduler : str, optional
        Address of a Dask scheduler, such as "tcp://host:8786": joblib hands the same work to it. Work that a
        lost worker had is done again by another.
    done : callable
        Told how many items are done, whenever one is.

    Raises
    ------
    InputError
        joblib or Dask is not installed, or no scheduler answers there.
    """
    if scheduler is None and jobs == 1:
        for count, item in enumerate(items, start=1):
            yield work(item)
            done(count)
        return
    joblib = _needed("joblib")
    with ExitStack() as stack:
        if scheduler is not None:
            client = stack.enter_context(_client(scheduler))
            stack.enter_context(joblib.parallel_config(backend="dask", client=client))
        parallel = joblib.Parallel(n_jobs=-1 if scheduler else jobs, return_as="generator")
        for count, result in enumerate(parallel(joblib.delayed(work)(item) for item in items), start=1):
            yield result
            done(count)


def _needed(name: str) -> Any:
    try:
        return import_module(name)
    except ImportError:
        raise InputError(
            f"work in several processes needs {name}: install it with pip install palpate[parallel]"
        ) from None


def _client(scheduler: str) -> Any:
    distributed = _needed("distributed")
    try:
        return distributed.Client(scheduler, timeout="10s", set_as_default=False)
    except (OSError, ValueError, TimeoutError) as error:
        raise InputError(f"no Dask scheduler answers at {scheduler}: {error}") from None

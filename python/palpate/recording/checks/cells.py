# SPDX-License-Identifier: Apache-2.0
"""Recording to check, and its rows by position cell and stroke."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..._core.model import play
from ..._typing import Float1D

if TYPE_CHECKING:
    from ..recording import Recording

MOST_CELLS = 64
"""Largest number of equal intervals (cells) of the positions of a recording, and of points of a curve."""

LEAST_ROWS_PER_CELL = 8
"""Mean number of rows for each stroke and position cell; it sets the number of cells of a short recording."""

LEAST_COMPARED_ROWS = 3
"""The mean force of a stroke in a position cell is used if the cell has at least this number of its rows."""

PLAY_RADIUS_SHARE = 0.02
"""Play radius that separates the strokes, as a share of the distance between least and largest position.

After a reversal, the rows of the first two play radii belong to no stroke.
"""


@dataclass(frozen=True)
class Checked:
    """Recording to check, with the facts that several checks need."""

    recording: Recording
    attracts: bool = False
    """True if the object is stated to attract the tool"""

    @cached_property
    def lower(self) -> float:
        """Smallest position"""
        return float(self.recording.position.min())

    @cached_property
    def upper(self) -> float:
        """Largest position"""
        return float(self.recording.position.max())

    @property
    def travel(self) -> float:
        return self.upper - self.lower

    @cached_property
    def cells(self) -> CellRows | None:
        """Rows by position cell, without the rows at which the tool waits; None for several inputs, or if too
        few rows belong to a stroke."""
        if self.recording.input_names:
            return None
        moving = self.recording.motion.moving
        cells = cell_rows(self.recording.without(~moving))
        return None if cells is None else replace(cells, row=np.flatnonzero(moving)[cells.row])


@dataclass(frozen=True)
class CellRows:
    """Rows of a recording by position cell. A cell holds rows of one stroke at nearly the same position."""

    row: NDArray[np.intp]
    """(k,) indices, in the recording, of the rows that are compared, ascending"""
    cell: NDArray[np.intp]
    """(k,) index of the position cell of each row; rows of a release have the index plus `cells`"""
    cells: int
    """Number of position cells"""
    press: Float1D
    """(m,) mean force of the press, at m rising positions where both strokes have rows"""
    release: Float1D
    """(m,) mean force of the release at these positions"""

    @property
    def loop(self) -> Float1D:
        """(m,) press minus release force"""
        return self.press - self.release


def cell_rows(recording: Recording) -> CellRows | None:
    """Returns the rows of a recording by position cell, or None if too few rows belong to a stroke."""
    lower, travel = float(recording.position.min()), float(np.ptp(recording.position))
    side = sides(recording)
    row = np.flatnonzero(side)
    if not travel > 0.0 or len(row) < 8 * LEAST_ROWS_PER_CELL:
        return None
    cells = min(len(row) // (2 * LEAST_ROWS_PER_CELL), MOST_CELLS)
    x, f, release = recording.position[row], recording.force[row], side[row] < 0
    at = np.minimum((cells * ((x - lower) / travel)).astype(np.intp), cells - 1)
    cell = at + cells * release
    count = np.bincount(cell, minlength=2 * cells)
    used = np.maximum(count, 1)
    mean_x, mean_f = np.bincount(cell, x, 2 * cells) / used, np.bincount(cell, f, 2 * cells) / used
    curves: list[tuple[Float1D, Float1D]] = []
    for of in (slice(0, cells), slice(cells, None)):
        compared = count[of] >= LEAST_COMPARED_ROWS
        curves.append((mean_x[of][compared], mean_f[of][compared]))
    (press_x, press_f), (release_x, release_f) = curves
    press, released = np.empty(0), np.empty(0)
    if len(press_x) and len(release_x):
        shared = (release_x >= press_x[0]) & (release_x <= press_x[-1])
        press, released = np.interp(release_x, press_x, press_f)[shared], release_f[shared]
    return CellRows(row, cell, cells, press, released)


def sides(recording: Recording) -> NDArray[np.int8]:
    """Returns the direction of each row (n,): +1 for a press, -1 for a release, 0 if unknown."""
    if recording.direction is not None and recording.direction.any():
        return recording.direction
    radius = PLAY_RADIUS_SHARE * float(np.ptp(recording.position))
    if not radius > 0.0:
        return np.zeros(len(recording), dtype=np.int8)
    state = (recording.position - play(recording.position, radius)) / radius
    return (state > 0.99).astype(np.int8) - (state < -0.99).astype(np.int8)


def inner_range(values: Float1D) -> float:
    """Returns the difference between the 95th and the 5th percentile of values (n,)."""
    low, high = np.percentile(values, (5.0, 95.0))
    return float(high - low)

# SPDX-License-Identifier: Apache-2.0
"""Rows of a recording by position cell and stroke, for checks that compare rows of the same position."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .._core.model import play
from .._typing import Float1D
from .recording import Recording

MOST_ROWS = 100_000
"""Rows that the comparison of cells uses; more are thinned out evenly."""

CELLS = 64
"""Position cells at most."""

ROWS_A_CELL = 8
"""Rows that a cell of one stroke holds on average, at least."""

ROWS_TO_COMPARE = 3
"""Rows that a cell of one stroke needs to be compared with another."""

PLAY_SHARE = 0.02
"""Play radius over the travel: a motion back by less does not end a stroke."""

TAIL = 0.5
"""Percentage of the rows at each end that may be spikes of the position."""


def amount(value: float, unit: str) -> str:
    """A value with its unit, for sentences; without one where the unit is not stated."""
    return f"{value:.4g} {unit}".rstrip()


@dataclass(frozen=True)
class Travel:
    """Range of the position without spikes, and the rows inside it."""

    lower: float
    upper: float
    inside: NDArray[np.bool_]
    """(n,)"""

    @property
    def length(self) -> float:
        return self.upper - self.lower

    @staticmethod
    def of(position: Float1D) -> Travel:
        """The range of all rows that lie within half a travel of the inner 99 % of the rows."""
        low, high = np.percentile(position, (TAIL, 100.0 - TAIL))
        margin = 0.5 * (high - low)
        inside = (position >= low - margin) & (position <= high + margin)
        kept = position[inside]
        return Travel(float(kept.min()), float(kept.max()), inside)


@dataclass(frozen=True)
class CellRows:
    """Rows by cell. A cell holds rows of one stroke at nearly the same position."""

    row: NDArray[np.intp]
    """(k,) the rows used, in their order"""
    cell: NDArray[np.intp]
    """(k,) position cell, + `cells` in rows of a stroke out of the object"""
    place: Float1D
    """(k,) position inside the cell, in cells: 0 to 1"""
    residual: Float1D
    """(k,) force minus the mean curve of the row's stroke"""
    cells: int
    """Position cells"""
    loop: Float1D
    """(m,) press minus release force, where both are known"""
    loop_error: Float1D
    """(m,) standard error of `loop`"""


def cell_rows(recording: Recording, travel: Travel) -> CellRows | None:
    """The rows by cell; None where too few rows move."""
    side = sides(recording, travel)
    row = np.flatnonzero(travel.inside & (side != 0))
    row = row[:: max(1, -(-len(row) // MOST_ROWS))]
    if not travel.length > 0.0 or len(row) < 8 * ROWS_A_CELL:
        return None
    cells = min(len(row) // (2 * ROWS_A_CELL), CELLS)
    x, f, release = recording.position[row], recording.force[row], side[row] < 0
    place = cells * ((x - travel.lower) / travel.length)
    at = np.minimum(place.astype(np.intp), cells - 1)
    cell = at + cells * release
    count = np.bincount(cell, minlength=2 * cells)
    used = np.maximum(count, 1)
    mean_x, mean_f = np.bincount(cell, x, 2 * cells) / used, np.bincount(cell, f, 2 * cells) / used
    residual = np.zeros_like(f)
    curves: list[tuple[Float1D, Float1D, Float1D]] = []
    for rows, of in ((~release, slice(0, cells)), (release, slice(cells, None))):
        known = count[of] >= ROWS_TO_COMPARE
        curve = mean_x[of][known], mean_f[of][known]
        if known.any():
            residual[rows] = f[rows] - np.interp(x[rows], *curve)
        scatter = np.bincount(cell, residual**2, 2 * cells)[of][known]
        curves.append((*curve, np.sqrt(scatter) / count[of][known]))
    (press_x, press_f, press_error), (release_x, release_f, release_error) = curves
    loop, error = np.empty(0), np.empty(0)
    if len(press_x) and len(release_x):
        shared = (release_x >= press_x[0]) & (release_x <= press_x[-1])
        loop = np.interp(release_x, press_x, press_f)[shared] - release_f[shared]
        error = np.hypot(np.interp(release_x, press_x, press_error), release_error)[shared]
    return CellRows(row, cell, place - at, residual, cells, loop, error)


def sides(recording: Recording, travel: Travel) -> NDArray[np.int8]:
    """(n,) +1 in rows of a stroke into the object, -1 out of it, 0 where it is not known."""
    if recording.direction is not None and recording.direction.any():
        return recording.direction
    if not travel.length > 0.0:
        return np.zeros(len(recording), dtype=np.int8)
    radius = PLAY_SHARE * travel.length
    position = np.clip(recording.position, travel.lower, travel.upper)
    state = (position - play(position, radius)) / radius
    return (state > 0.99).astype(np.int8) - (state < -0.99).astype(np.int8)

# SPDX-License-Identifier: Apache-2.0
"""Steepest slope of a force law, its place, and the recorded rows that support it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from .._core.model import ForceModel
from .._typing import Float1D
from ..recording.units import Unit

if TYPE_CHECKING:
    from .model import Model

_POSITIONS = 4001
"""Number of positions of the domain at which the slope is computed [-]"""

ROWS_KEY = "rows_at_steepest_slope"
"""Key in the notes of a model file: the number of recorded rows on the steepest part of the force"""


@dataclass(frozen=True)
class SteepestSlope:
    """Largest rising slope of a force over position, inside the domain, or its steepest fall."""

    slope: float
    """[N/m or N*m/rad], < 0 for a fall"""
    position: float
    """[m or rad]"""
    stroke: str
    """press or release; empty if the force does not depend on the direction"""
    low: float
    high: float
    """Ends of the steep part about `position`, where the slope is above half the steepest [m or rad]"""

    @classmethod
    def of(cls, model: ForceModel, *, falling: bool = False) -> SteepestSlope | None:
        """Returns the steepest slope of a model; None if the force depends on more than position and
        direction, or does not rise, or fall."""
        if model.dimension > 1 or not model.of_position:
            return None
        x = np.linspace(float(model.lower[0]), float(model.upper[0]), _POSITIONS)
        sides = (1.0, -1.0) if model.hysteretic else (None,)
        slopes = np.array(
            [model.slope(x, direction=None if side is None else np.full(len(x), side)) for side in sides]
        )
        sign = -1.0 if falling else 1.0
        stroke, at = np.unravel_index(np.argmax(sign * slopes), slopes.shape)
        along = sign * slopes[stroke]
        if not along[at] > 0.0:
            return None
        ends = np.flatnonzero(along < 0.5 * along[at])
        before, after = ends[ends < at], ends[ends > at]
        return cls(
            float(sign * along[at]),
            float(x[at]),
            ("press", "release")[stroke] if model.hysteretic else "",
            float(x[before[-1]] if len(before) else x[0]),
            float(x[after[0]] if len(after) else x[-1]),
        )

    def rows(self, position: Float1D, side: Float1D | None) -> NDArray[np.bool_]:
        """Returns a mask (n,) of the rows on the steep part: at positions (n,) in its stroke.

        Parameters
        ----------
        position : (n,) array
            Positions [m or rad]; those of a periodic force in its period.
        side : (n,) array or None
            Directions, +1 press and -1 release.
        """
        inside = (position >= self.low) & (position <= self.high)
        if not self.stroke or side is None:
            return np.asarray(inside)
        return np.asarray(inside & (side == (1.0 if self.stroke == "press" else -1.0)))

    def place(self, position_unit: str) -> str:
        """Returns position and stroke in words: "0.0031 m of the press"."""
        at = Unit.of_si(position_unit).text(self.position)
        return f"{at} of the {self.stroke}" if self.stroke else at

    def text(self, model: Model) -> str:
        """Returns the slope, its place and, if it rises and the model file has it, the number of rows
        there."""
        position, force = model.units["position"], model.units["force"]
        unit = f" {force}/{position}" if position and force else ""
        rows = model.notes.get(ROWS_KEY) if self.slope > 0.0 else None
        counted = f", known from {rows} row{'' if rows == 1 else 's'}" if isinstance(rows, int) else ""
        return f"{float(f'{self.slope:.3g}'):g}{unit} at {self.place(position)}{counted}"

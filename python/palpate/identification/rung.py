# SPDX-License-Identifier: Apache-2.0
"""A rung of the ladder: one solution of a problem over compressed rows, and what it costs."""

from dataclasses import dataclass

import numpy as np

from .._core.model import wavelet_curvature_columns
from .._typing import Float1D, Float2D
from .compression import Compressed, binning_error
from .fresh import FreshRows
from .growth import fresh_deviance
from .hysteresis_input import HysteresisInput
from .options import IdentifyOptions
from .separable import SeparableProblem, Solution
from .stopping import ON_FRESH_ROWS

BINNING_SHARE = 0.05
"""Error that cells of positions may add, as a share of the RMS error; above it the cells are halved."""

ALL = slice(None)
"""Every row."""


@dataclass(frozen=True)
class Rung:
    """A candidate model."""

    name: str
    rows: Compressed
    problem: SeparableProblem
    solution: Solution
    n_parameters: int
    stop_reason: str
    strokes: HysteresisInput | None = None
    """The hysteresis input, where the rung has one"""

    @property
    def side(self) -> Float1D | None:
        """(n,) hysteresis input of every row of the recording."""
        return None if self.strokes is None else self.strokes.side

    @property
    def play_radius(self) -> float | None:
        """[box]"""
        return None if self.strokes is None else self.strokes.play_radius

    @property
    def rmse(self) -> float:
        return self.problem.rmse(self.solution)

    def criterion(self, options: IdentifyOptions) -> float:
        """What the stopping rule says of it: the smaller the better."""
        fresh = self.problem.fresh
        if fresh is not None and options.criterion in ON_FRESH_ROWS:
            return fresh_deviance(options.criterion, fresh, self.problem.fresh_errors(self.solution, fresh))
        return self.problem.deviance(options.criterion, self.solution.rss, self.n_parameters)

    def fresh_errors(self, kept: SeparableProblem, fresh: FreshRows) -> Float1D:
        """Errors (k,) on fresh rows once the linear unknowns are those of the kept rows."""
        if self.name == "constant":
            (block,) = kept.blocks
            root = block.channels[:, 0]
            return np.asarray(fresh.force - block.target @ root / (root @ root))
        kept.prior = self.problem.prior
        return kept.fresh_errors(kept.solve(self.solution.basis), fresh)

    def cells_too_wide(self) -> bool:
        """Whether gathering positions in cells may have moved the fit by more than it should."""
        if not self.rows.spread.any():
            return False
        basis, weights = self.solution.basis, self.solution.coefficients[:, 1 + self.problem.dimension :]
        bends = wavelet_curvature_columns(self.rows.positions, basis.alpha, basis.beta)
        curvature = np.column_stack([np.abs(bend @ weights.T).max(axis=1) for bend in bends])
        return binning_error(self.rows, curvature) > BINNING_SHARE * self.problem.resolved_rmse(self.solution)

    def modelled(self, positions: Float2D, rows: slice = ALL) -> Float1D:
        """The rung's force at every row (n,), or at some, positions (n, d) in the unit box."""
        return self._modelled(positions[rows], None if self.side is None else self.side[rows])

    def parts_at(self, positions: Float2D) -> tuple[Float1D, Float1D]:
        """g and h (k,) of a rung with hysteresis at positions (k, d) in the unit box."""
        middle = self._modelled(positions, np.zeros(len(positions)))
        return middle, self._modelled(positions, np.ones(len(positions))) - middle

    def _modelled(self, positions: Float2D, side: Float1D | None) -> Float1D:
        readings = self.problem.readout @ self.solution.coefficients
        rows = FreshRows(positions, np.zeros(len(positions)), side)
        return -rows.errors(readings, self.solution.basis.alpha, self.solution.basis.beta)

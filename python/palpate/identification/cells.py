# SPDX-License-Identifier: Apache-2.0
"""Are the cells that positions are gathered in fine enough for what was fitted to them?"""

import numpy as np

from .. import _core
from .compression import Compressed, binning_error
from .separable import SeparableProblem, Solution

BINNING_SHARE = 0.05
"""Error that cells of positions may add, as a share of the RMS error; above it the cells are halved."""

MOST_HALVINGS = 3
"""Times that cells are halved at most."""


def cells_too_wide(problem: SeparableProblem, rows: Compressed, solution: Solution) -> bool:
    """Whether gathering positions in cells may have moved the fit by more than it should."""
    if not rows.spread.any():
        return False
    basis, weights = solution.basis, solution.coefficients[:, 1 + problem.dimension :]
    bends = _core.wavelet_curvature_columns(rows.positions, basis.alpha, basis.beta)
    curvature = np.column_stack([np.abs(bend @ weights.T).max(axis=1) for bend in bends])
    return binning_error(rows, curvature) > BINNING_SHARE * problem.rmse(solution)

# SPDX-License-Identifier: Apache-2.0
"""How far one series is from another, and whether what is left is noise."""

from __future__ import annotations

import numpy as np

from .._typing import Float1D


def root_mean_square(values: Float1D) -> float:
    """RMS of the values, in their unit."""
    return float(np.sqrt(np.mean(np.square(values))))


def normalised(rmse: float, reference: Float1D) -> float:
    """NRMSE: `rmse` over the population standard deviation of the reference.

    A reference that does not vary has no spread to compare with: the result is then 0 for no error, else
    infinity.
    """
    spread = float(np.std(reference))
    if spread == 0:
        return 0.0 if rmse == 0 else np.inf
    return rmse / spread


def lag_one_autocorrelation(residual: Float1D) -> float:
    """sum e_k e_{k+1} / sum e_k^2: 0 for white residuals, towards 1 where neighbours err alike."""
    power = float(residual @ residual)
    return 0.0 if power == 0 else float(residual[:-1] @ residual[1:]) / power


def durbin_watson(residual: Float1D) -> float:
    """sum (e_k - e_{k-1})^2 / sum e_k^2 (Durbin and Watson 1950): 2 for white residuals, towards 0 where
    neighbours err alike."""
    power = float(residual @ residual)
    return 2.0 if power == 0 else float(np.sum(np.diff(residual) ** 2)) / power

# SPDX-License-Identifier: Apache-2.0
"""Correlation of residuals in time, and the variance of sums of correlated values (Newey and West 1987)."""

from __future__ import annotations

import numpy as np

from ..._typing import Float1D


def independent_share(residual: Float1D, n_parameters: int = 0) -> float:
    """Returns the share of independent residuals (n,) from the correlation of neighbours.

    A fit of many parameters to few rows lowers this correlation; the lost part is about n_parameters / n.
    """
    power = float(residual @ residual)
    rho = float(residual[1:] @ residual[:-1]) / power if power > 0.0 else 0.0
    rho += n_parameters / len(residual)
    rho = min(max(rho, 0.0), 0.99)
    return (1.0 - rho) / (1.0 + rho)


def _window(n: int) -> Float1D:
    """Returns the weights of autocovariances (Bartlett window) for n values."""
    longest = max(1, min(n // 4, 10 + int(8.0 * n ** (1.0 / 3.0))))
    return np.asarray(1.0 - np.arange(longest) / longest)


def _autocovariance(values: Float1D, most: int) -> Float1D:
    """Returns the sums of products of values (n,) at distances 0 to most - 1."""
    n = len(values)
    size = 1 << (n + most).bit_length()
    spectrum = np.fft.rfft(values, size)
    return np.asarray(np.fft.irfft(spectrum * np.conj(spectrum), size)[:most])


def long_run_variance(score: Float1D) -> float:
    """Returns the variance of the sum of a correlated score (n,)."""
    window = _window(len(score))
    products = _autocovariance(score, len(window))
    return float(products[0] + 2.0 * window[1:] @ products[1:])


def long_run_variance_of_product(regressor: Float1D, residual: Float1D) -> float:
    """Returns the variance of the sum of regressor times residual (n,), for a residual whose correlation is
    the same everywhere."""
    window = _window(len(residual))
    of_residual = _autocovariance(residual, len(window)) / len(residual)
    of_regressor = _autocovariance(regressor, len(window))
    products = of_residual * of_regressor
    return float(products[0] + 2.0 * window[1:] @ products[1:])

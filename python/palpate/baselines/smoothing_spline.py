# SPDX-License-Identifier: Apache-2.0
"""Cubic smoothing spline over position."""

from __future__ import annotations

import warnings
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import UnivariateSpline

from .._typing import Float1D, Float2D
from .estimator import best_of, merged

SMOOTHINGS = (30.0, 10.0, 5.0, 3.0, 2.0, 1.5, 1.2, 1.1, 1.0, 0.9, 0.8)


@dataclass
class SmoothingSpline:
    """The cubic spline with the fewest knots whose squared error stays below a multiple of the noise.

    FITPACK's algorithm (Dierckx 1975): knots are added where the error is largest until
    sum_k (y_k - f(x_k))^2 <= smoothing * n * sigma^2. The noise sigma^2 is how each row differs from the mean
    of its neighbours along x, taken by the median, so that jumps do not count. Outside its ends the spline
    holds its last value.

    Parameters
    ----------
    smoothing : float, optional
        Multiple of the noise that the spline may leave; without it the one that predicts held-out rows best.
    """

    smoothing: float | None = None

    def fit(self, X: Float2D, y: Float1D) -> SmoothingSpline:
        """Fit to the first column of X (n, d), the position, and y (n,)."""
        multiple = self.smoothing or best_of(
            SMOOTHINGS, lambda smoothing, A, b: SmoothingSpline(smoothing).fit(A, b), X, y
        )
        x, mean, count = merged(X[:, 0], y)
        if len(x) < 5:
            raise ValueError(f"a cubic spline needs 5 positions; there are {len(x)}")
        # of what the spline may leave, the scatter of rows that share a position is not its to remove
        scatter = float(np.sum((y - mean[np.searchsorted(x, X[:, 0])]) ** 2))
        allowed = max(multiple * len(y) * _noise(X[:, 0], y) - scatter, 0.0)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # FITPACK warns where it stops at the most knots it may have
            self.spline_ = UnivariateSpline(x, mean, w=np.sqrt(count), s=allowed, k=3, ext=3)
        interior = len(self.spline_.get_knots()) - 2
        self.n_parameters_ = len(self.spline_.get_coeffs()) + interior
        return self

    def predict(self, X: Float2D) -> Float1D:
        """Force (n,) at the rows of X."""
        return np.asarray(self.spline_(X[:, 0]))


def _noise(x: Float1D, y: Float1D) -> float:
    """Variance of the noise of y from neighbours along x."""
    along = y[np.argsort(x, kind="stable")]
    apart = (along[1:-1] - 0.5 * (along[:-2] + along[2:])) ** 2 / 1.5
    # 0.455 is the median of a squared standard normal; forces of coarse resolution have a median of 0
    return max(float(np.median(apart)) / 0.455, 0.01 * float(np.mean(apart)), np.finfo(float).tiny)

# SPDX-License-Identifier: Apache-2.0
"""Baselines that are a curve over position: a lookup table and a cubic smoothing spline."""

from __future__ import annotations

import warnings
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import UnivariateSpline, make_lsq_spline

from .._typing import Float1D, Float2D
from .estimator import best_of, merged

SIZES = (2, 4, 8, 12, 16, 24, 32, 48, 64, 96, 128, 192, 256, 384, 512)

SMOOTHINGS = (30.0, 10.0, 5.0, 3.0, 2.0, 1.5, 1.2, 1.1, 1.0, 0.9, 0.8)


@dataclass
class LookupTable:
    """Forces at evenly spaced positions, straight lines between them; least squares for the forces.

    f(x) = (1 - t) f_i + t f_(i+1), t = (x - x_i) / (x_(i+1) - x_i). Outside its ends the table holds them.

    Parameters
    ----------
    size : int, optional
        Entries; without it the number that predicts held-out rows best.
    """

    size: int | None = None

    def fit(self, X: Float2D, y: Float1D) -> LookupTable:
        """Fit to the first column of X (n, d), the position, and y (n,)."""
        size = self.size or best_of(SIZES, lambda entries, A, b: LookupTable(entries).fit(A, b), X, y)
        x, mean, count = merged(X[:, 0], y)
        # entries that no row lies between would be free: leave out those
        entries = np.linspace(x[0], x[-1], size)
        cell = np.clip(np.searchsorted(entries, x, side="right") - 1, 0, size - 2)
        held = np.isin(np.arange(size - 1), cell)
        entries = entries[np.concatenate([[True], held[:-1] | held[1:], [True]])]
        while True:
            try:
                knots = np.concatenate([[x[0]], entries, [x[-1]]])
                spline = make_lsq_spline(x, mean, knots, k=1, w=np.sqrt(count))
                break
            except (ValueError, np.linalg.LinAlgError):
                if len(entries) == 2:
                    raise
                entries = entries[np.unique(np.r_[0 : len(entries) : 2, len(entries) - 1])]
        self.positions_, self.forces_ = entries, np.asarray(spline.c)
        self.n_parameters_ = len(entries)
        return self

    def predict(self, X: Float2D) -> Float1D:
        """Force (n,) at the rows of X."""
        return np.asarray(np.interp(X[:, 0], self.positions_, self.forces_))


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

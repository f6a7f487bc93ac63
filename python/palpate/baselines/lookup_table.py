# SPDX-License-Identifier: Apache-2.0
"""Lookup table with linear interpolation: what most renderings of a measured force are."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import make_lsq_spline

from .._typing import Float1D, Float2D
from .estimator import best_of, merged

SIZES = (2, 4, 8, 12, 16, 24, 32, 48, 64, 96, 128, 192, 256, 384, 512)


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

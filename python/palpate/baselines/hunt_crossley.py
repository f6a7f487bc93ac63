# SPDX-License-Identifier: Apache-2.0
"""Contact after Hunt and Crossley: a power of the depth, with damping that grows with it."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np
from scipy.optimize import least_squares

from .._typing import Float1D, Float2D

MOST_ROWS = 20_000
"""Rows that are fitted; of more, evenly spread ones."""

EXPONENTS = (0.5, 6.0)
"""Range of the exponent."""


@dataclass
class HuntCrossley:
    """F = k d^p (1 + lambda v) + F_0 with the depth d = max(x - x_0, 0) (Hunt and Crossley 1975).

    k, k lambda and F_0 are linear once x_0 and p are given, so only those two are searched for, from several
    starts. Velocity takes part where X holds it.
    """

    def fit(self, X: Float2D, y: Float1D) -> HuntCrossley:
        """Fit to X (n, 1 to 3), position and velocity, and y (n,)."""
        X = X[:, :2]
        step = -(-len(y) // MOST_ROWS)
        rows, force = X[::step], y[::step]
        low, high = float(rows[:, 0].min()), float(rows[:, 0].max())
        self.reach_ = max(high - low, np.finfo(float).tiny)

        def residual(unknown: Float1D) -> Float1D:
            return np.asarray(self._linear(rows, force, unknown)[1])

        outcomes = [
            least_squares(
                residual,
                (low + share * self.reach_, exponent),
                bounds=((low - self.reach_, EXPONENTS[0]), (high - 1e-3 * self.reach_, EXPONENTS[1])),
                x_scale=(self.reach_, 1.0),
                max_nfev=60,
            )
            for share, exponent in product((0.0, 0.3, 0.6), (1.0, 2.0))
        ]
        best = min(outcomes, key=lambda outcome: float(outcome.cost))
        self.contact_, self.exponent_ = float(best.x[0]), float(best.x[1])
        self.parameters_ = self._linear(rows, force, best.x)[0]
        self.n_parameters_ = 2 + len(self.parameters_)
        return self

    def predict(self, X: Float2D) -> Float1D:
        """Force (n,) at the rows of X."""
        unknown = np.array([self.contact_, self.exponent_])
        return np.asarray(self._columns(X[:, :2], unknown) @ self.parameters_)

    def _linear(self, X: Float2D, y: Float1D, unknown: Float1D) -> tuple[Float1D, Float1D]:
        """F_0, k and k lambda for given contact and exponent, and the residuals they leave."""
        columns = self._columns(X, unknown)
        norm = np.maximum(np.linalg.norm(columns, axis=0), np.finfo(float).tiny)
        found = np.linalg.lstsq(columns / norm, y, rcond=None)[0] / norm
        return found, columns @ found - y

    def _columns(self, X: Float2D, unknown: Float1D) -> Float2D:
        contact, exponent = unknown
        spring = (np.maximum(X[:, :1] - contact, 0.0) / self.reach_) ** exponent
        return np.concatenate([np.ones((len(X), 1)), spring, spring * X[:, 1:]], axis=1)

# SPDX-License-Identifier: Apache-2.0
"""Parameters of tissue by least squares: inertia, damping, stiffness with nonlinear terms."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .._typing import Float1D, Float2D


@dataclass
class TissueParameters:
    """F = m a + B v + k_1 x + k_2 x^2 + ... + k_p x^p + F_0, all parameters from one linear least squares.

    After Scilingo, De Rossi, Bicchi and Iacconi (1997), who identified tissue grasped by instrumented forceps
    in this way. Velocity and acceleration take part where X holds them.

    Parameters
    ----------
    order : int
        p, the highest power of the position.
    """

    order: int = 3

    def fit(self, X: Float2D, y: Float1D) -> TissueParameters:
        """Fit to X (n, 1 to 3), position, velocity, acceleration, and y (n,)."""
        self.scale_ = np.maximum(np.abs(X).max(axis=0), np.finfo(float).tiny)
        self.parameters_ = np.linalg.lstsq(self._columns(X), y, rcond=None)[0]
        self.n_parameters_ = len(self.parameters_)
        return self

    def predict(self, X: Float2D) -> Float1D:
        """Force (n,) at the rows of X."""
        return np.asarray(self._columns(X) @ self.parameters_)

    def _columns(self, X: Float2D) -> Float2D:
        X = X / self.scale_
        powers = X[:, :1] ** np.arange(self.order + 1)
        return np.concatenate([powers, X[:, 1:]], axis=1)

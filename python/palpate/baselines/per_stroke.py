# SPDX-License-Identifier: Apache-2.0
"""Two single-valued estimators for an object whose press and release differ."""

from __future__ import annotations

from copy import deepcopy
from dataclasses import dataclass

import numpy as np

from .._typing import Float1D, Float2D
from .estimator import Estimator


@dataclass
class PerStroke:
    """One copy of an estimator for each stroke.

    The last column of X is the stroke: above 0 press, below 0 release.

    Parameters
    ----------
    estimator
        What is fitted to each stroke; it is copied.
    passive : bool
        Where release would lie above press, by which a loop gains energy, both are their mean.
    """

    estimator: Estimator
    passive: bool = False

    def fit(self, X: Float2D, y: Float1D) -> PerStroke:
        """Fit one copy to the press rows of X (n, d) and one to the release rows."""
        press = X[:, -1] > 0
        self.press_ = deepcopy(self.estimator).fit(X[press, :-1], y[press])
        self.release_ = deepcopy(self.estimator).fit(X[~press, :-1], y[~press])
        self.n_parameters_ = self.press_.n_parameters_ + self.release_.n_parameters_
        return self

    def predict(self, X: Float2D) -> Float1D:
        """Force (n,) at the rows of X."""
        press = X[:, -1] > 0
        if self.passive:
            above, below = (each.predict(X[:, :-1]) for each in (self.press_, self.release_))
            half = 0.5 * np.maximum(above - below, 0.0)
            return np.asarray(0.5 * (above + below) + np.where(press, half, -half))
        force = np.empty(len(X))
        force[press] = self.press_.predict(X[press, :-1])
        force[~press] = self.release_.predict(X[~press, :-1])
        return force

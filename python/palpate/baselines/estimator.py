# SPDX-License-Identifier: Apache-2.0
"""Interface of the baselines, how each chooses its own setting, and one for objects with two strokes."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from copy import deepcopy
from dataclasses import dataclass
from typing import Protocol, TypeVar

import numpy as np

from .._typing import Float1D, Float2D

HELD_OUT = 5
"""Of the rows to fit, every fifth chooses a setting that is not given."""

C = TypeVar("C")


class Estimator(Protocol):
    """fit and predict as in scikit-learn."""

    n_parameters_: int
    """Every fitted real number, known after fit"""

    def fit(self, X: Float2D, y: Float1D) -> Estimator:
        """Learn from X (n, d) and y (n,)."""

    def predict(self, X: Float2D) -> Float1D:
        """(n,) at the rows of X (n, d)."""


def best_of(
    candidates: Iterable[C], fitted: Callable[[C, Float2D, Float1D], Estimator], X: Float2D, y: Float1D
) -> C:
    """The simplest candidate that is within one standard error of the best on every fifth row, held out.

    Candidates stand in order, the simplest first; one that cannot be fitted is out. This is what a competent
    user does before comparing: no method is shown with a setting that suits it badly.
    """
    kept = np.arange(len(y)) % HELD_OUT != HELD_OUT - 1
    if kept.all():
        return next(iter(candidates))
    tried: list[tuple[float, float, C]] = []
    for candidate in candidates:
        try:
            trial = fitted(candidate, X[kept], y[kept])
        except (ValueError, np.linalg.LinAlgError):
            continue
        square = (trial.predict(X[~kept]) - y[~kept]) ** 2
        if np.isfinite(square).all():
            tried.append((float(square.mean()), float(square.std() / np.sqrt(len(square))), candidate))
    if not tried:
        raise ValueError("no setting of this method can be fitted to these rows")
    least, uncertain, _ = min(tried, key=lambda one: one[0])
    return next(candidate for error, _, candidate in tried if error <= least + uncertain)


def merged(x: Float1D, y: Float1D) -> tuple[Float1D, Float1D, Float1D]:
    """Distinct positions in rising order, the mean of y at each, and how many rows it stands for."""
    distinct, place, count = np.unique(x, return_inverse=True, return_counts=True)
    return distinct, np.bincount(place, y) / count, count.astype(np.float64)


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

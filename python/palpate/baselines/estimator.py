# SPDX-License-Identifier: Apache-2.0
"""The one face of the baselines, and how each chooses its own setting."""

from __future__ import annotations

from collections.abc import Callable, Iterable
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

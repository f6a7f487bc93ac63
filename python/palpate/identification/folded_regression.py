# SPDX-License-Identifier: Apache-2.0
"""Least squares of a filtered force on velocity, acceleration and the columns of a force law."""

from collections.abc import Sequence

import numpy as np

from .._typing import Float1D, Float2D
from .gram import solve_gram
from .separable import TINY
from .stopping import CRITERIA

FOLDS = 10
"""Stretches of the recording that are fresh in turn."""

NAMES = ("damping", "mass")
"""What multiplies the columns v and a."""


class FoldedRegression:
    """Least squares of a filtered force on filtered columns, any choice of them, fold by fold.

    No mean squared error below `least` counts: no sensor sees it.
    """

    def __init__(
        self, table: Float2D, folds: Float1D, independent: float, two_sided: bool, least: float
    ) -> None:
        self._independent, self._least = independent, least
        self._grams = np.array([table[folds == fold].T @ table[folds == fold] for fold in range(FOLDS)])
        self._rows = np.bincount(folds.astype(np.int64), minlength=FOLDS)
        n_static = table.shape[1] - 3
        self._single = n_static // 2 if two_sided else n_static
        self._n_static = n_static

    def value(self, two_sided: bool, names: Sequence[str], criterion: str) -> float:
        """Criterion of the regression on these columns."""
        columns = self._columns(two_sided, names)
        gram = self._grams.sum(axis=0)
        rss = _rss(gram, columns, self._solution(gram, columns))
        share = max(rss / self._rows.sum(), self._least, TINY)
        p = min(len(columns), int(self._independent) - 2)
        return self._independent * float(np.log(share)) + CRITERIA[criterion](self._independent, p)

    def solved(self, two_sided: bool, names: Sequence[str]) -> list[float]:
        """The coefficients of these names."""
        columns = self._columns(two_sided, names)
        return [float(value) for value in self._solution(self._grams.sum(axis=0), columns)[: len(names)]]

    def fresh_gain(
        self, two_sided: bool, without: Sequence[str], with_it: Sequence[str]
    ) -> tuple[float, float]:
        """Fall of the squared error in folds that were left out of the fit, as a share, and its error."""
        errors = np.array(
            [
                [self._left_out(fold, self._columns(two_sided, names)) for fold in range(FOLDS)]
                for names in (without, with_it)
            ]
        )
        before, after = errors.mean(axis=1)
        scatter = errors[1] - after / before * errors[0]
        return float(1.0 - after / before), float(scatter.std(ddof=1) / before / np.sqrt(FOLDS))

    def _left_out(self, fold: int, columns: list[int]) -> float:
        kept = self._grams.sum(axis=0) - self._grams[fold]
        return _rss(self._grams[fold], columns, self._solution(kept, columns))

    def _columns(self, two_sided: bool, names: Sequence[str]) -> list[int]:
        """Columns of the table: target, v, a, then those of f (and of s)."""
        static = self._n_static if two_sided else self._single
        return [1 + NAMES.index(name) for name in names] + list(range(3, 3 + static))

    @staticmethod
    def _solution(gram: Float2D, columns: list[int]) -> Float1D:
        return solve_gram(gram[np.ix_(columns, columns)], gram[columns, 0])


def _rss(gram: Float2D, columns: list[int], solution: Float1D) -> float:
    """Residual sum of squares of a solution on the rows of a Gram matrix whose column 0 is the target."""
    quadratic = solution @ gram[np.ix_(columns, columns)] @ solution
    return max(float(gram[0, 0] - 2.0 * solution @ gram[columns, 0] + quadratic), 0.0)

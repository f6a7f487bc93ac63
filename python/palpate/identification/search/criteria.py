# SPDX-License-Identifier: Apache-2.0
"""When is a network large enough? Criteria that weigh the error against the number of fitted numbers.

All are written as a deviance, n ln(RSS/n) plus a price for the p fitted parameters, so that their
differences compare: BIC (Schwarz 1978), AICc (Hurvich & Tsai 1989), GCV (Craven & Wahba 1979, as
n ln of the score), FPE (Akaike 1970, as n ln of the score). The smallest value wins.

Two rules judge on held-out rows instead, and need no price. "fresh" takes the smallest network
whose error there is within one standard error of the least (Breiman et al. 1984); "perceptual" the smallest
whose error there is not felt: RMS of the error over 7 % of the local force, or 1 % of the largest, below 1.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar

import numpy as np

from ..._typing import Float1D
from ...errors import InputError
from ..data.held_out import HeldOutRows
from ..network.separable import TINY, SeparableProblem, Solution

CRITERIA: dict[str, Callable[[float, int], float]] = {
    "bic": lambda n, p: p * math.log(n),
    "aicc": lambda n, p: 2.0 * p + 2.0 * p * (p + 1) / (n - p - 1) if p < n - 1 else math.inf,
    "gcv": lambda n, p: -2.0 * n * math.log1p(-p / n) if p < n else math.inf,
    "fpe": lambda n, p: n * math.log((n + p) / (n - p)) if p < n else math.inf,
    "fresh": lambda n, p: 0.0,
    "perceptual": lambda n, p: 0.0,
}
"""Name of the criterion to its price of p parameters on n samples."""

ON_HELD_OUT_ROWS = ("fresh", "perceptual")
"""The criteria whose error is that on held-out rows."""


def deviance(criterion: str, rss: float, n: float, p: int) -> float:
    """Value of a criterion: n ln(rss/n) + price(n, p); rss in force squared, over all n samples.

    For "perceptual" rss is in just noticeable differences squared, so that 0 is what is just not felt.
    """
    return n * math.log(rss / n) + CRITERIA[criterion](n, p)


def standard_error(n: float) -> float:
    """Standard error of n ln(MSE) over n samples of normal noise: n sqrt(2/n)."""
    return math.sqrt(2.0 * n)


def enough(criterion: str, value: float) -> bool:
    """True if no larger network is needed."""
    return criterion == "perceptual" and value <= 0.0


def choice(criterion: str, values: Sequence[float], n: float) -> int:
    """Index of the network to take, from the values of ever larger networks."""
    least = min(values)
    limit = {"fresh": least + standard_error(n), "perceptual": max(0.0, least)}.get(criterion, least)
    return next(index for index, value in enumerate(values) if value <= limit)


def criterion_of(
    problem: SeparableProblem, solution: Solution, name: str, n_parameters: int | None = None
) -> float:
    """Value of a criterion for a solution: the smaller the better.

    Without n_parameters those of the problem and the basis are counted.

    Raises
    ------
    InputError
        The criterion judges on held-out rows, and the problem has none.
    """
    if name in ON_HELD_OUT_ROWS:
        rows = problem.held_out
        if rows is None:
            raise InputError(f"criterion is {name!r}, but no rows were held out to judge on")
        return held_out_deviance(name, rows, problem.errors(solution, rows))
    p = problem.n_parameters(len(solution.basis)) if n_parameters is None else n_parameters
    share = problem.limits.independent
    return deviance(name, share * problem.total(solution.rss), problem.independent, p)


def held_out_deviance(criterion: str, rows: HeldOutRows, errors: Float1D) -> float:
    """Criterion of a network that leaves these errors on held-out rows."""
    counted = rows.felt(errors) if criterion == "perceptual" else errors
    smallest = (1e-12 * float(np.ptp(rows.force))) ** 2 * len(counted)
    return deviance(criterion, max(float(counted @ counted), smallest, TINY), len(counted), 0)


Reporter = Callable[[str, int], None]
"""Receives the model class that is tried and the number of wavelets."""

_reporter: ContextVar[Reporter | None] = ContextVar("reporter", default=None)


@contextmanager
def reporting_to(reporter: Reporter) -> Iterator[None]:
    """Report every network that is tried in this context."""
    token = _reporter.set(reporter)
    try:
        yield
    finally:
        _reporter.reset(token)


def report(model_class: str, n_wavelets: int) -> None:
    """Report a network that is tried now."""
    if (reporter := _reporter.get()) is not None:
        reporter(model_class, n_wavelets)

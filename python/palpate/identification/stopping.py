# SPDX-License-Identifier: Apache-2.0
"""When is a network large enough? Criteria that weigh the error against the number of fitted numbers.

All are written as a deviance, n ln(RSS/n) plus a price for the p fitted parameters, so that their
differences compare: BIC (Schwarz 1978), AICc (Hurvich & Tsai 1989), GCV (Craven & Wahba 1979, as
n ln of the score), FPE (Akaike 1970, as n ln of the score). The smallest value wins.

Two rules judge on rows that were kept back instead, and need no price. "fresh" takes the smallest network
whose error there is within one standard error of the least (Breiman et al. 1984); "perceptual" the smallest
whose error there is not felt: RMS of the error over 7 % of the local force, or 1 % of the largest, below 1.
"""

import math
from collections.abc import Callable, Sequence

CRITERIA: dict[str, Callable[[float, int], float]] = {
    "bic": lambda n, p: p * math.log(n),
    "aicc": lambda n, p: 2.0 * p + 2.0 * p * (p + 1) / (n - p - 1) if p < n - 1 else math.inf,
    "gcv": lambda n, p: -2.0 * n * math.log1p(-p / n) if p < n else math.inf,
    "fpe": lambda n, p: n * math.log((n + p) / (n - p)) if p < n else math.inf,
    "fresh": lambda n, p: 0.0,
    "perceptual": lambda n, p: 0.0,
}
"""Name of the criterion to its price of p parameters on n samples."""

ON_FRESH_ROWS = ("fresh", "perceptual")
"""The criteria whose error is that on rows that were kept back."""


def deviance(criterion: str, rss: float, n: float, p: int) -> float:
    """Value of a criterion: n ln(rss/n) + price(n, p); rss in force squared, over all n samples.

    For "perceptual" rss is in just noticeable differences squared, so that 0 is what is just not felt.
    """
    return n * math.log(rss / n) + CRITERIA[criterion](n, p)


def standard_error(n: float) -> float:
    """Standard error of n ln(MSE) over n samples of normal noise: n sqrt(2/n)."""
    return math.sqrt(2.0 * n)


def enough(criterion: str, value: float) -> bool:
    """Whether no larger network can be wanted."""
    return criterion == "perceptual" and value <= 0.0


def choice(criterion: str, values: Sequence[float], n: float) -> int:
    """Which of the values of ever larger networks is to be taken."""
    least = min(values)
    limit = {"fresh": least + standard_error(n), "perceptual": max(0.0, least)}.get(criterion, least)
    return next(index for index, value in enumerate(values) if value <= limit)

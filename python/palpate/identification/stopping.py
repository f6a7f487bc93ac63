# SPDX-License-Identifier: Apache-2.0
"""When is a network large enough? Criteria that weigh the error against the number of fitted numbers.

All are written as a deviance, n ln(RSS/n) plus a price for the p fitted parameters, so that their
differences compare: BIC (Schwarz 1978), AICc (Hurvich & Tsai 1989), GCV (Craven & Wahba 1979, as
n ln of the score), FPE (Akaike 1970, as n ln of the score). The smallest value wins.
"""

import math
from collections.abc import Callable

CRITERIA: dict[str, Callable[[float, int], float]] = {
    "bic": lambda n, p: p * math.log(n),
    "aicc": lambda n, p: 2.0 * p + 2.0 * p * (p + 1) / (n - p - 1) if p < n - 1 else math.inf,
    "gcv": lambda n, p: -2.0 * n * math.log1p(-p / n) if p < n else math.inf,
    "fpe": lambda n, p: n * math.log((n + p) / (n - p)) if p < n else math.inf,
}
"""Name of the criterion to its price of p parameters on n samples."""


def deviance(criterion: str, rss: float, n: float, p: int) -> float:
    """Value of a criterion: n ln(rss/n) + price(n, p); rss in force squared, over all n samples."""
    return n * math.log(rss / n) + CRITERIA[criterion](n, p)

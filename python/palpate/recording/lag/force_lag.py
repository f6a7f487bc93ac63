# SPDX-License-Identifier: Apache-2.0
"""Lag of a recorded force behind its position: estimate, interval, or the reason why it is not known."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

LONGEST_LAG_S = 0.1
"""Longest lag of a force that is searched and advised to be corrected [s]"""

LONGEST_LEAD_S = 0.02
"""Longest time by which a force may be ahead of its position in the search [s]. A lag near 0 then has an
interval on both sides of 0."""

LAG_DIGITS = 5
"""Number of decimals to which a lag in seconds is rounded before it is corrected: 10 microseconds."""

NORMAL_QUANTILE = 1.96
"""Half width of the 95 % confidence interval of a normal variable [standard deviations]."""

SAMPLING_ERROR = 0.03
"""Standard error of a lag from positions between two samples, which are interpolated [sample periods]."""

UNKNOWN_CURE = (
    "record slow and fast strokes of an object with a sharp bend, such as a key switch, on the same machine, "
    "and give its lag as a number"
)
"""Text of the cure if a recording does not determine the lag of its force."""


@dataclass(frozen=True)
class ForceLag:
    """Time by which the force of a recording is late, with its 95 % confidence interval."""

    late_s: float
    """Estimate [s]; NaN if there is none"""
    lower_s: float
    upper_s: float
    source: str
    """Part of the recording on which the estimate is based, in words"""
    reason: str = ""
    """Reason why the lag is not known, in words; empty if it is known"""

    @property
    def known(self) -> bool:
        """True if the recording determines the lag: the interval is narrow."""
        return not self.reason

    @property
    def is_late(self) -> bool:
        """True if the lag is known and the whole interval is above 0."""
        return self.known and self.lower_s > 0.0

    def record(self) -> dict[str, Any]:
        """Returns the lag as numbers and text for a model file."""
        numbers = (self.late_s, self.lower_s, self.upper_s)
        late, lower, upper = (number if self.known else None for number in numbers)
        return {"late_s": late, "lower_s": lower, "upper_s": upper, "text": str(self)}

    def __str__(self) -> str:
        if not self.known:
            return f"not known: {self.reason}"
        interval = f"95 %: {1e3 * self.lower_s:.3g} to {1e3 * self.upper_s:.3g} ms, from {self.source}"
        if self.late_s < 0.0:
            return f"the force is {-1e3 * self.late_s:.3g} ms ahead of the position ({interval})"
        return f"the force is {1e3 * self.late_s:.3g} ms late ({interval})"


def unknown(reason: str) -> ForceLag:
    """Returns a lag that the data does not determine, with the reason."""
    return ForceLag(math.nan, math.nan, math.nan, "", reason)

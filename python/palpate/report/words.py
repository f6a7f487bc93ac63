# SPDX-License-Identifier: Apache-2.0
"""Numbers with units as text."""

from __future__ import annotations

from datetime import datetime, timezone

import numpy as np

from ..plotting.look import Scale, scale_for


def amount(value: float, unit: str) -> str:
    """Returns a value in SI as text with the SI prefix of the charts: "3.3 mN"."""
    if not np.isfinite(value):
        return str(value)
    scale = scale_for(unit, value)
    return f"{scale.factor * value:.4g} {_symbol(scale)}".rstrip()


def interval(low: float, high: float, unit: str) -> str:
    """Returns an interval of two values in SI as text with one SI prefix: "0.1 to 4 mm"."""
    scale = scale_for(unit, low, high)
    return f"{scale.factor * low:.4g} to {scale.factor * high:.4g} {_symbol(scale)}".rstrip()


def percent(share: float) -> str:
    """Returns a share as text in percent."""
    return f"{100.0 * share:.3g} %"


def counted(number: int, thing: str) -> str:
    """Returns a number of things as text: "1 wavelet", "2 wavelets"."""
    return f"{number} {thing}" if number == 1 else f"{number} {thing}s"


def date_text(seconds: float) -> str:
    """Returns seconds since 1970 as date and time."""
    return f"{datetime.fromtimestamp(seconds, timezone.utc):%Y-%m-%d %H:%M} UTC"


def _symbol(scale: Scale) -> str:
    return scale.unit.replace("*", "·")

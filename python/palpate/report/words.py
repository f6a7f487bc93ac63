# SPDX-License-Identifier: Apache-2.0
"""Numbers with units as text."""

from __future__ import annotations

import numpy as np

from ..plotting.look import scale_for


def amount(value: float, unit: str) -> str:
    """Returns a value in SI as text with the SI prefix of the charts: "3.3 mN"."""
    if not np.isfinite(value):
        return str(value)
    scale = scale_for(unit, value)
    return f"{scale.factor * value:.4g} {scale.unit.replace('*', chr(0xB7))}".rstrip()


def percent(share: float) -> str:
    """Returns a share as text in percent."""
    return f"{100.0 * share:.3g} %"

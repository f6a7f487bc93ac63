# SPDX-License-Identifier: Apache-2.0
"""Lag of a recorded force behind its position."""

from .estimate import LARGEST_ERROR_S, lag_of
from .force_lag import LAG_DIGITS, LONGEST_LAG_S, UNKNOWN_CURE, ForceLag

__all__ = ["LAG_DIGITS", "LARGEST_ERROR_S", "LONGEST_LAG_S", "UNKNOWN_CURE", "ForceLag", "lag_of"]

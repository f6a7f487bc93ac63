# SPDX-License-Identifier: Apache-2.0
"""Verification of a model: on fresh recordings row by row, in closed loop, and against another model."""

from .closed_loop import ClosedLoop, force_driven, motion_driven
from .metrics import Stroke, compare
from .uncertainty import Uncertainty, uncertainty
from .verification import Verification, columns_of, verify

__all__ = [
    "ClosedLoop",
    "Stroke",
    "Uncertainty",
    "Verification",
    "columns_of",
    "compare",
    "force_driven",
    "motion_driven",
    "uncertainty",
    "verify",
]

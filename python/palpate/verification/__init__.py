# SPDX-License-Identifier: Apache-2.0
"""Verify a model: on fresh recordings row by row, and in closed loop."""

from .closed_loop import ClosedLoop, force_driven, motion_driven
from .verification import Verification, verify

__all__ = ["ClosedLoop", "Verification", "force_driven", "motion_driven", "verify"]

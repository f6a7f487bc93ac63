# SPDX-License-Identifier: Apache-2.0
"""From a model to a force that is rendered: how, on what device, and how far off it is."""

from .bench import Bench, bench_for, sweeping_hand
from .comparison import Comparison, compare_structures
from .plan import Plan, explicit_slope_limit, play_radius_for
from .simulation import ForceError, describe, force_at, force_error, simulate

__all__ = [
    "Bench",
    "Comparison",
    "ForceError",
    "Plan",
    "bench_for",
    "compare_structures",
    "describe",
    "explicit_slope_limit",
    "force_at",
    "force_error",
    "play_radius_for",
    "simulate",
    "sweeping_hand",
]

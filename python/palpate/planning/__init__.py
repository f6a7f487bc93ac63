# SPDX-License-Identifier: Apache-2.0
"""From a model to a force that is rendered: how, on what device, and how far off it is."""

from .._core import Bench, Certificate, Inequality, explicit_slope_limit
from .bench import bench_for
from .comparison import Comparison, compare_structures
from .device_profile import EXAMPLES, DeviceProfile, example_profiles, profile_file
from .plan import Plan
from .simulation import ForceError, describe, force_at, force_error, simulate
from .slope_limit import Loss

__all__ = [
    "EXAMPLES",
    "Bench",
    "Certificate",
    "Comparison",
    "DeviceProfile",
    "ForceError",
    "Inequality",
    "Loss",
    "Plan",
    "bench_for",
    "compare_structures",
    "describe",
    "example_profiles",
    "explicit_slope_limit",
    "force_at",
    "force_error",
    "profile_file",
    "simulate",
]

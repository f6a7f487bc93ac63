# SPDX-License-Identifier: Apache-2.0
"""From a model to a force that is rendered: how, on what device, and how far off it is."""

from .. import _core
from .._core.rendering import Scheme, explicit_slope_limit
from .._core.simulation import Hand, TestRig
from .._core.stability import Certificate, Inequality
from ..arguments import named_arguments
from .comparison import Comparison, compare_structures
from .device_profile import EXAMPLES, DeviceProfile, example_profiles, profile_file
from .plan import ACCEPTED_FORCE_ERROR, Plan
from .simulation import ForceError, describe, force_at, force_error, force_range, judge, rig_for, simulate
from .static_error import StaticForceError

__all__ = [
    "ACCEPTED_FORCE_ERROR",
    "EXAMPLES",
    "Certificate",
    "Comparison",
    "DeviceProfile",
    "ForceError",
    "Hand",
    "Inequality",
    "Plan",
    "Scheme",
    "StaticForceError",
    "TestRig",
    "compare_structures",
    "describe",
    "example_profiles",
    "explicit_slope_limit",
    "force_at",
    "force_error",
    "force_range",
    "judge",
    "profile_file",
    "rig_for",
    "simulate",
]

for _compiled in (Hand, Scheme, _core.device.DeviceProfile):
    named_arguments(_compiled)

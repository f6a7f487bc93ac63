# SPDX-License-Identifier: Apache-2.0
"""Planning and simulation: how a model is rendered on a device.

Model and device -> candidate structures, the simplest first (`candidates`, with `limited_network` if the
device is too weak) -> certificate -> `Plan` with its force error, or the reasons of the refusal with the
device property that must be better. `search` runs these steps. `simulation` renders a plan in virtual time.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from .. import _core
from .._core.device import AdmittanceDisplay, HeldLine, OnDevice
from .._core.rendering import HeldSlope, Scheme, explicit_slope_limit
from .._core.simulation import AccountUse, Hand, TestRig
from .._core.stability import Certificate, Inequality
from ..arguments import named_arguments
from .device_profile import EXAMPLES, DeviceProfile, example_profiles, mechanical_units, profile_file
from .plan import ACCEPTED_FORCE_ERROR, Plan, StaticForceError, describe
from .simulation import (
    Comparison,
    ForceError,
    compare_structures,
    force_at,
    force_error,
    force_range,
    hand_for,
    judge,
    rig_for,
    simulate,
)

if TYPE_CHECKING:
    from .compensation import Ripple, compensate, friction_of, ripple_left

__all__ = [
    "ACCEPTED_FORCE_ERROR",
    "EXAMPLES",
    "AccountUse",
    "AdmittanceDisplay",
    "Certificate",
    "Comparison",
    "DeviceProfile",
    "ForceError",
    "Hand",
    "HeldLine",
    "HeldSlope",
    "Inequality",
    "OnDevice",
    "Plan",
    "Ripple",
    "Scheme",
    "StaticForceError",
    "TestRig",
    "compare_structures",
    "compensate",
    "describe",
    "example_profiles",
    "explicit_slope_limit",
    "force_at",
    "force_error",
    "force_range",
    "friction_of",
    "hand_for",
    "judge",
    "mechanical_units",
    "profile_file",
    "rig_for",
    "ripple_left",
    "simulate",
]

for _compiled in (Hand, Scheme, HeldLine, HeldSlope, OnDevice, AdmittanceDisplay, _core.device.DeviceProfile):
    named_arguments(_compiled)


def __getattr__(name: str) -> Any:
    """Returns a name of `compensation`, which is loaded late because it loads the identification."""
    if name in ("Ripple", "compensate", "friction_of", "ripple_left"):
        return getattr(import_module(".compensation", __name__), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")

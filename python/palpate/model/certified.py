# SPDX-License-Identifier: Apache-2.0
"""Plan and certificate as they stand in a model file, and as the core knows them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from .._core.device import DeviceProfile
from .._core.model import ForceModel
from .._core.rendering import Scheme
from .._core.stability import Certificate, ForceBounds, Inequality
from ..errors import InputError

_DEVICE = (
    "id",
    "position_unit",
    "period_s",
    "jitter_s",
    "inertia",
    "viscous_damping",
    "coulomb_friction",
    "encoder_step",
    "force_step",
    "delay_s",
    "force_limit",
)
_BOUNDS = (
    "slope_min",
    "slope_max",
    "steepest",
    "sliding",
    "loss_min",
    "loss_max",
    "loss_per_play",
    "mean_force",
    "drag",
)
_INEQUALITY = ("id", "left", "right")


def device_record(device: DeviceProfile) -> dict[str, Any]:
    """A device profile by the names of its fields."""
    return {name: getattr(device, name) for name in _DEVICE}


def certificate_record(certificate: Certificate) -> dict[str, Any]:
    """A certificate as it stands in a model file."""
    return {
        "fingerprint": certificate.fingerprint,
        "model": certificate.model,
        "structure": certificate.scheme.structure,
        "device": device_record(certificate.device),
        "bounds": {name: getattr(certificate.bounds, name) for name in _BOUNDS},
        "inequalities": [
            {name: getattr(line, name) for name in _INEQUALITY} for line in certificate.inequalities
        ],
        "verdict": certificate.verdict,
        "longest_period_s": certificate.longest_period_s,
    }


def scheme_of(plan: Mapping[str, Any]) -> Scheme:
    """The scheme of a plan that stands in a model file."""
    given: dict[str, float] = {}
    if plan["coupling"] is not None:
        given["coupling_stiffness"] = plan["coupling"]["stiffness"]
        given["coupling_damping"] = plan["coupling"]["damping"]
    if plan["inertia"] is not None:
        given["mass"] = plan["inertia"]["mass"]
        given["damping"] = plan["inertia"]["damping"]
    return Scheme(
        structure=plan["structure"],
        compensated=plan["compensated"],
        play_radius=plan["play_radius"] or 0.0,
        predict=plan["predict"] or 0,
        **given,
    )


def checked_certificate(
    model: ForceModel, plan: Mapping[str, Any], certificate: Mapping[str, Any]
) -> Certificate:
    """The certificate of a model file, computed again from the model and found the same.

    Raises
    ------
    InputError
        It says what the model and the device do not give: the field, its value, what would be right.
    """
    stored = Certificate(
        scheme=scheme_of(plan),
        device=DeviceProfile(**certificate["device"]),
        model=certificate["model"],
        bounds=ForceBounds(**certificate["bounds"], hysteresis=model.hysteretic),
        inequalities=[Inequality(**line) for line in certificate["inequalities"]],
        verdict=certificate["verdict"],
        longest_period_s=certificate["longest_period_s"],
        fingerprint=certificate["fingerprint"],
    )
    try:
        return stored.check(model)
    except ValueError as error:
        raise InputError(str(error)) from None

# SPDX-License-Identifier: Apache-2.0
"""Static force error of a plan: the force felt at rest minus the identified force."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from .._core.model import ForceModel
from .._core.rendering import Scheme
from .._core.simulation import motion_driven
from .._typing import Float1D, Float2D

SAMPLES = 1001
"""Positions over the domain [-]"""


NETWORK = (
    "alpha",
    "beta",
    "weight",
    "linear",
    "bias",
    "weight_hysteresis",
    "linear_hysteresis",
    "bias_hysteresis",
)
"""Arguments of a force model that make its network"""

_DOMAIN = ("lower", "upper", "below", "above", "period", "play_radius", "of_velocity")
"""The other arguments"""


@dataclass(frozen=True)
class StaticForceError:
    """Felt minus identified force at rest, over the domain and both strokes.

    A limited network and a soft coupling are counted; damping, delay and encoder steps are not.
    """

    largest: float
    """Largest absolute value [force]"""
    rms: float
    """[force]"""
    share: float
    """`largest` over the range of the identified force [-]"""
    rms_share: float
    """`rms` over the population standard deviation of the identified force [-]"""


def static_force_error(identified: ForceModel, rendered: ForceModel, scheme: Scheme) -> StaticForceError:
    """Force error at rest where `rendered` is rendered by a scheme in place of `identified`.

    Parameters
    ----------
    identified, rendered : ForceModel
        Of one position, on the same domain; or the same model of position and velocity.
    scheme : Scheme
        A coupling makes the rendered force softer: K_c f' / (K_c + f') is felt in place of f'.
    """
    exact = scheme.compensated or not scheme.has_coupling
    if exact and rendered is identified:
        return StaticForceError(0.0, 0.0, 0.0, 0.0)
    x = np.linspace(identified.lower[0], identified.upper[0], SAMPLES)
    wanted = strokes(identified, x)
    felt = strokes(rendered, x) if exact else _behind_coupling(rendered, scheme, x)
    error = felt - wanted
    largest, rms = float(np.abs(error).max()), float(np.sqrt(np.mean(error**2)))
    return StaticForceError(
        largest, rms, _share(largest, float(np.ptp(wanted)), wanted), _share(rms, float(wanted.std()), wanted)
    )


def with_network(model: ForceModel, **changes: Any) -> ForceModel:
    """A force model with other arguments; what is not given stays."""
    return ForceModel(**{name: getattr(model, name) for name in (*NETWORK, *_DOMAIN)} | changes)


def network_of(model: ForceModel) -> dict[str, Any]:
    """The network of a model as it stands in a model file."""
    return {name: np.asarray(getattr(model, name)).tolist() for name in NETWORK}


def strokes(model: ForceModel, x: Float1D) -> Float2D:
    """(1, n) the force, or (2, n) pressing and releasing."""
    sides = (1.0, -1.0) if model.hysteretic else (None,)
    return np.array([model.force(x, direction=side) for side in sides])


def _share(error: float, size: float, force: Float2D) -> float:
    """Error over the size of the force; over the largest |force| where the force is constant."""
    size = size or float(np.abs(force).max())
    return 0.0 if error == 0.0 else error / size if size else math.inf


def _behind_coupling(model: ForceModel, scheme: Scheme, x: Float1D) -> Float2D:
    """Force (k, n) of each stroke at a handle that rests at x, from the load line of a massless object."""
    at_rest = Scheme(structure="massless", coupling_stiffness=scheme.coupling_stiffness, coupling_damping=0.0)
    return np.array([motion_driven(stroke, at_rest, x, 1.0)["force"] for stroke in _single_strokes(model)])


def _single_strokes(model: ForceModel) -> list[ForceModel]:
    """Models without hysteresis, one for each stroke: f, or g + h and g - h."""
    if not model.hysteretic:
        return [model]
    names = ("weight", "linear", "bias")
    plain = {"play_radius": None, **{f"{name}_hysteresis": None for name in names}}
    return [
        with_network(
            model,
            **plain,
            **{name: getattr(model, name) + side * getattr(model, f"{name}_hysteresis") for name in names},
        )
        for side in (1.0, -1.0)
    ]

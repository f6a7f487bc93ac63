# SPDX-License-Identifier: Apache-2.0
"""A simulated bench for a model: the device, coupling and hand that go with its units and its size."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from .._core import DeviceProfile, Hand, Scheme, motion_driven
from .._typing import Float1D
from ..model import Model
from .plan import play_radius_for

_KNOB_TRAVEL = 0.5
"""Travel of a scene that suits the default knob [rad]."""

_MARGIN = 0.01
"""Share of the travel that the hand leaves free at either end, for its overshoot."""

_HELD_SHARE = 0.8
"""Share of the force limit that the hand presses for: harder structures and damping need the rest."""

_RAMP_SAMPLES = 1001
"""Steps of a slow motion through the domain."""

_STIFFER_THAN_SCENE = 2.0
"""Stiffness of the hand over that of the straight line through the scene, so that it reaches the far end."""


@dataclass(frozen=True)
class Bench:
    """A simulated device with a hand on it, and how large its numbers are beside the default knob's."""

    device: DeviceProfile
    hand: Hand
    stiffness_scale: float
    """[model's force per position] over [N*m/rad] of the default knob"""

    def scheme(self, model: Model, **fields: Any) -> Scheme:
        """A scheme whose numbers, unless given, are the core's defaults in this bench's scale.

        `coupling_stiffness`, `coupling_damping`, `mass` and `damping` are given in the model's own units; a
        None counts as not given.
        """
        default = Scheme()
        numbers: dict[str, Any] = {
            name: getattr(default, name) * self.stiffness_scale
            for name in ("coupling_stiffness", "coupling_damping", "mass", "damping")
        }
        numbers["play_radius"] = play_radius_for(model, self.device)
        numbers.update((name, value) for name, value in fields.items() if value is not None)
        return Scheme(**numbers)


def bench_for(model: Model) -> Bench:
    """The simulated bench on which a model is tried.

    An angle is tried on the core's default knob. For any other unit (millimetres of a keyswitch, micrometres
    under an AFM tip) it is the same knob as a scale model: lengths and forces are multiplied so that travel
    and largest force stand to the device as in the knob's own scene, times stay as they are.
    """
    knob = DeviceProfile()
    if model.units["position"] == "rad":
        return Bench(knob, sweeping_hand(model, knob), 1.0)
    lower, upper = float(model.lower[0]), float(model.upper[0])
    length = (upper - lower) / _KNOB_TRAVEL
    force = 1.05 * _largest_force(model) / knob.force_limit
    stiffness = force / length
    device = DeviceProfile(
        id=f"{knob.id}, scaled",
        period_s=knob.period_s,
        inertia=knob.inertia * stiffness,
        viscous_damping=knob.viscous_damping * stiffness,
        coulomb_friction=knob.coulomb_friction * force,
        encoder_step=knob.encoder_step * length,
        force_step=knob.force_step * force,
        delay_samples=knob.delay_samples,
        force_limit=knob.force_limit * force,
        position_unit="m",
    )
    return Bench(device, sweeping_hand(model, device, scale=stiffness), stiffness)


def sweeping_hand(model: Model, device: DeviceProfile, *, scale: float = 1.0) -> Hand:
    """A hand that leads the handle through the domain of a model and not beyond it, whatever the structure.

    The hand is a spring to a moving point, which has to run ahead of the handle by the felt force over the
    hand's stiffness. Behind a coupling less force is felt, so the point runs ahead by what is felt there: a
    harder structure is pressed a little less far, and none is extrapolated.

    Parameters
    ----------
    model : Model
        A model of one position.
    device : DeviceProfile
        Whose force limit bounds the sweep.
    scale : float
        Stiffness of the bench over that of the default knob.
    """
    default = Hand()
    lower, upper = float(model.lower[0]), float(model.upper[0])
    travel = upper - lower
    pressed = min(_largest_force(model), device.force_limit)
    stiffness = max(default.stiffness * scale, _STIFFER_THAN_SCENE * pressed / travel)
    soft = Scheme(
        coupling_stiffness=Scheme().coupling_stiffness * scale,
        coupling_damping=0.0,
        play_radius=play_radius_for(model, device),
    )
    inwards = np.linspace(lower + _MARGIN * travel, upper - _MARGIN * travel, _RAMP_SAMPLES)

    def target(ramp: Float1D) -> float:
        """Where the hand must aim for the handle to come to rest at the end of a slow motion, or before it
        where the device could not hold the force.
        """
        felt = motion_driven(model, soft, ramp, device.period_s)["force"]
        held = np.flatnonzero(np.abs(felt) <= _HELD_SHARE * device.force_limit)
        last = held[-1] if held.size else -1
        return float(ramp[last] + felt[last] / stiffness)

    ends = target(inwards[::-1]), target(inwards)
    return Hand(
        stiffness=stiffness,
        damping=default.damping * scale,
        lower=min(ends),
        upper=max(ends),
        frequency_hz=default.frequency_hz,
    )


def _largest_force(model: Model) -> float:
    positions = np.linspace(model.lower[0], model.upper[0], 1001)
    pressing = _sliding_force(model, positions, np.ones_like(positions))
    releasing = _sliding_force(model, positions, -np.ones_like(positions))
    largest = float(max(np.abs(pressing).max(), np.abs(releasing).max()))
    return largest if largest > 0.0 else 1.0


def _sliding_force(model: Model, position: Float1D, direction: Float1D) -> Float1D:
    force: Float1D = model.force(position, direction=direction if model.hysteretic else None)
    return force

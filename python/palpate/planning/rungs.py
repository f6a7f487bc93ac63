# SPDX-License-Identifier: Apache-2.0
"""The rungs of the plan, the simplest first. Each proposes a certified plan, or says why it does not."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

from .._core.device import DeviceProfile
from .._core.rendering import Scheme, compensated_share
from .._core.stability import balancing_shift, certify, force_bounds, steepest_stick
from ..model import Model
from .choices import (
    LONGEST_PLAY,
    SPARE,
    coupling_for,
    explicit_scheme,
    play_radius_for,
    renderable_slopes,
    usual_play_radius,
)
from .plan import Plan
from .slope_limit import limit_slopes, scale_loss, sliding_slopes
from .static_error import static_force_error

_COUPLING_DAMPING = 0.2
"""Coupling damping of a structure with mass where nothing else sets it [share of the device's damping]"""

_WIDER_PLAY = 1.02
"""Play radius that is tried where the one that was computed is just refused, over that [-]"""

_NOT_LIMITED = "the model is to be rendered as it was identified"

_PREDICTIONS = (1, 2, 4, 8, 16)
"""Samples tried for a prediction. Few react faster, with less force error; many need less damping [-]"""

_LATE_TICK = 1.25
"""Time between two samples for which a chosen prediction must hold, unless none is certified that long
[longest time between samples of the device]"""

_LEAST_LOSS = 1.0 / 64.0
"""Smallest share of the loss h that is still worth rendering [-]"""


@dataclass(frozen=True)
class Wishes:
    """What was asked for, in the model's units."""

    coupling: bool = False
    coupling_stiffness: float | None = None
    coupling_damping: float | None = None
    mass: float | None = None
    damping: float | None = None
    play_radius: float | None = None
    predict: int | None = None
    """Samples of the prediction; 0: none; None: chosen"""
    limited: bool = True
    """Whether a limited network may be rendered in place of the identified one"""

    @property
    def dynamic(self) -> bool:
        """Whether the object has mass or damping besides its force."""
        return bool(self.mass) or bool(self.damping)

    def why_not_static(self) -> str:
        parts = [
            f"a {word} of {value:.4g}"
            for word, value in (("mass", self.mass), ("damping", self.damping))
            if value
        ]
        return f"the object has {' and '.join(parts)}, which it would leave out"


Outcome = Plan | str


def direct(model: Model, device: DeviceProfile, wishes: Wishes) -> Outcome:
    """The model as it was identified."""
    if wishes.dynamic:
        return wishes.why_not_static()
    if wishes.coupling:
        return "a coupling was asked for"
    plan = Plan(model, _direct_scheme(model, device, wishes)).certified_for(device)
    if not (plan.certificate and plan.certificate.refused and _chooses_play(model, wishes)):
        return _predicted(plan, device, wishes)
    # Bounds of the sum g' + h / r can be wider than the sum of the bounds, from which r was chosen.
    longest = LONGEST_PLAY * float(model.upper[0] - model.lower[0])
    wider = min(_WIDER_PLAY * plan.scheme.play_radius, longest)
    scheme = Scheme(structure="direct", play_radius=wider, predict=plan.scheme.predict)
    again = Plan(model, scheme).certified_for(device)
    return _predicted(plan if again.certificate and again.certificate.refused else again, device, wishes)


def direct_limited(model: Model, device: DeviceProfile, wishes: Wishes) -> Outcome:
    """The nearest force that the device can render."""
    if wishes.dynamic:
        return wishes.why_not_static()
    if wishes.coupling:
        return "a coupling was asked for"
    if not wishes.limited:
        return _NOT_LIMITED
    if wishes.predict:
        return _only_direct(wishes)
    low, high = renderable_slopes(device, model=model)
    if high <= 0.0:
        return _no_slope(device)
    limited = (
        _hysteresis_limited(_balanced(model, device), device, wishes)
        if model.hysteretic
        else _within(model, low, high, device)
    )
    if limited is None:
        return f"no network was found whose slopes lie between {low:.4g} and {high:.4g}"
    plan = Plan(model, _direct_scheme(limited, device, wishes), limited=limited).certified_for(device)
    return _predicted(plan, device, wishes)


def massless(model: Model, device: DeviceProfile, wishes: Wishes) -> Outcome:
    """The model behind a coupling whose spring has been taken out of it, slopes limited as that asks."""
    if wishes.dynamic:
        return wishes.why_not_static()
    if not wishes.coupling:
        return "no coupling was asked for, and none makes a steeper slope possible"
    damping = wishes.coupling_damping or 0.0
    stiffness = wishes.coupling_stiffness
    radius = wishes.play_radius or usual_play_radius(model, device)
    low, high = renderable_slopes(device)
    if stiffness is None:
        static = damping == 0.0 and not model.hysteretic
        falling = 0.0 if static else max(0.0, -force_bounds(model, radius).slope_min)
        stiffness = coupling_for(device, damping, falling)
        if static:
            stiffness = min(stiffness, SPARE * high)
    if stiffness <= 0.0:
        return _no_slope(device)
    scheme = Scheme(
        structure="massless",
        coupling_stiffness=stiffness,
        coupling_damping=damping,
        compensated=not model.hysteretic,
        play_radius=radius,
    )
    if model.hysteretic:
        return Plan(model, scheme).certified_for(device)
    highest = compensated_share * stiffness
    balanced = _balanced(model, device)
    low, high = low if damping == 0.0 else -math.inf, min(highest, high)
    if not wishes.limited and not (balanced is model and _fits(model, low, high)):
        return _NOT_LIMITED
    limited = _within(balanced, low, high, device)
    if limited is None:
        return f"no network was found whose slopes lie below {highest:.4g} = {compensated_share} K_c"
    return Plan(model, scheme, limited=None if limited is model else limited).certified_for(device)


def implicit(model: Model, device: DeviceProfile, wishes: Wishes) -> Outcome:
    """The model with its mass behind a coupling, backward Euler."""
    return _with_mass("implicit", model, device, wishes)


def energy_consistent(model: Model, device: DeviceProfile, wishes: Wishes) -> Outcome:
    """The same, stepped so that it stores exactly what it is given: for forces that fall steeply."""
    return _with_mass("energy-consistent", model, device, wishes)


def explicit(model: Model, device: DeviceProfile, wishes: Wishes) -> Outcome:
    """The paper's structure: stable at best."""
    if wishes.predict:
        return _only_direct(wishes)
    radius = wishes.play_radius or usual_play_radius(model, device)
    scheme = explicit_scheme(
        force_bounds(model, radius, device.force_limit),
        device,
        mass=wishes.mass,
        damping=wishes.damping,
        coupling_stiffness=wishes.coupling_stiffness,
        coupling_damping=wishes.coupling_damping,
        play_radius=radius,
    )
    return Plan(model, scheme).certified_for(device)


Rung = Callable[[Model, DeviceProfile, Wishes], Outcome]


def _of_position(rung: Rung) -> Rung:
    """The rung, refused to a force of velocity."""

    def guarded(model: Model, device: DeviceProfile, wishes: Wishes) -> Outcome:
        if not model.of_velocity:
            return rung(model, device, wishes)
        return "of a force of position and velocity no bound is known but for direct rendering as it is"

    return guarded


RUNGS: Mapping[str, Rung] = {
    "direct": direct,
    "direct, slope limited": _of_position(direct_limited),
    "massless": _of_position(massless),
    "implicit": _of_position(implicit),
    "energy-consistent": _of_position(energy_consistent),
    "explicit": _of_position(explicit),
}


def _only_direct(wishes: Wishes) -> str:
    return f"it has no prediction of the model as it was identified, and predict is {wishes.predict}"


def _predicted(plan: Plan, device: DeviceProfile, wishes: Wishes) -> Plan:
    """The same plan with the fewest samples of prediction that are certified; without where none are.

    A prediction spends damping, and with it the time that a tick may be late: it must leave `_LATE_TICK`, or
    what there is without it. Where nothing is certified without a prediction, any that is certified is taken.
    """
    assert plan.certificate is not None
    if wishes.predict is not None or plan.model.of_velocity:
        return plan
    enough = min(_LATE_TICK * device.longest_period_s, plan.certificate.longest_period_s)
    scheme = plan.scheme
    for samples in _PREDICTIONS:
        ahead = Scheme(structure="direct", play_radius=scheme.play_radius, predict=samples)
        proposed = replace(plan, scheme=ahead).certified_for(device)
        found = proposed.certificate
        if found is not None and found.certified and found.longest_period_s >= enough:
            return proposed
    return plan


def _no_slope(device: DeviceProfile) -> str:
    return (
        f"the device can hold no slope at all: friction {device.coulomb_friction:.4g}, damping "
        f"{device.viscous_damping:.4g}, encoder step {device.encoder_step:.4g}, "
        f"force step {device.force_step:.4g}"
    )


def _chooses_play(model: Model, wishes: Wishes) -> bool:
    return model.hysteretic and not wishes.play_radius and model.play_radius is None


def _direct_scheme(model: Model, device: DeviceProfile, wishes: Wishes) -> Scheme:
    radius = wishes.play_radius or 0.0
    if _chooses_play(model, wishes):
        travel = float(model.upper[0] - model.lower[0])
        radius = min(play_radius_for(model, device), LONGEST_PLAY * travel)
    return Scheme(structure="direct", play_radius=radius, predict=wishes.predict or 0)


def _within(model: Model, low: float, high: float, device: DeviceProfile) -> Model | None:
    """The model itself where its slopes lie within limits, else the nearest that does; balanced."""
    limited = model if _fits(model, low, high) else limit_slopes(model, low, high)
    return None if limited is None else _balanced(limited, device)


def _fits(model: Model, low: float, high: float) -> bool:
    found = sliding_slopes(model)
    return found[0] >= low and found[1] <= high


def _balanced(model: Model, device: DeviceProfile) -> Model:
    """The model, shifted if it repeats: limited by the device, its force must not push on average."""
    shift = balancing_shift(model, device.force_limit)
    return model.with_network(bias=model.bias + shift) if shift else model


def _hysteresis_limited(model: Model, device: DeviceProfile, wishes: Wishes) -> Model:
    """Slopes limited so that a stick has room, or less of the loss h, whichever loses less; else both."""

    def holds(candidate: Model) -> bool:
        scheme = _direct_scheme(candidate, device, wishes)
        return not certify(candidate, scheme, device).refused

    def as_much_loss_as_holds(candidate: Model) -> Model:
        kept, refused = 0.0, 1.0
        for _ in range(10):
            share = 0.5 * (kept + refused)
            scaled = _balanced(scale_loss(candidate, share), device)
            kept, refused = (share, refused) if holds(scaled) else (kept, share)
        return _balanced(scale_loss(candidate, max(kept, _LEAST_LOSS)), device)

    radius = wishes.play_radius or model.play_radius
    if radius is None:
        radius = LONGEST_PLAY * float(model.upper[0] - model.lower[0])
    stick = min(force_bounds(model, radius).loss_per_play, steepest_stick(device))
    limited = _within(model, *renderable_slopes(device, stick, model), device) or model
    found = [limited if holds(limited) else as_much_loss_as_holds(limited)]
    if limited is not model and holds(_balanced(scale_loss(model, _LEAST_LOSS), device)):
        found.append(as_much_loss_as_holds(model))
    exact = Scheme(structure="direct")
    return min(found, key=lambda candidate: static_force_error(model, candidate, exact).rms)


def _with_mass(structure: str, model: Model, device: DeviceProfile, wishes: Wishes) -> Outcome:
    if not wishes.dynamic:
        return "the object has no mass or damping of its own"
    if not wishes.mass:
        return "the object has damping but no mass; give one with mass"
    damping = wishes.coupling_damping
    if damping is None:
        damping = _COUPLING_DAMPING * device.viscous_damping
    stiffness = wishes.coupling_stiffness
    if stiffness is None:
        stiffness = coupling_for(device, damping)
    if stiffness <= 0.0:
        return f"the device's damping {device.viscous_damping:.4g} holds no coupling"
    scheme = Scheme(
        structure=structure,
        coupling_stiffness=stiffness,
        coupling_damping=damping,
        mass=wishes.mass,
        damping=wishes.damping or 0.0,
        play_radius=wishes.play_radius or usual_play_radius(model, device),
    )
    return Plan(model, scheme).certified_for(device)

# SPDX-License-Identifier: Apache-2.0
"""Candidate structures for a model on a device, the simplest first. Each structure is certified or
refused."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

from .._core.device import DeviceProfile
from .._core.model import ForceModel
from .._core.portable import ExportedModel
from .._core.rendering import (
    Scheme,
    cells_in_motion,
    compensated_share,
    default_play_radius,
    most_slope_cells,
)
from .._core.simulation import account_use
from .._core.stability import (
    Certificate,
    admittance_scheme,
    certify,
    certify_with_account,
    explicit_scheme,
    force_bounds,
    line_for,
    passive_shift,
    steepest_stick,
    stiffest_coupling,
    usual_coupling_share,
    with_force_error,
)
from ..verdict import FORCE_JND
from .device_profile import mechanical_units
from .limited_network import (
    LONGEST_PLAY,
    limit_slopes,
    play_radius_for,
    renderable_slopes,
    scale_hysteresis,
    sliding_slopes,
)
from .plan import LIMITED, static_force_error, with_network

_COUPLING_DAMPING_SHARE = 0.2
"""Default coupling damping of the implicit and energy-consistent structures [share of the device's
damping]"""

_PLAY_ENLARGEMENT = 1.02
"""Play radius that is tried if the computed play radius is refused [share of the computed radius]"""

_PREDICTION_SAMPLES = (1, 2, 4, 8, 16)
"""Numbers of previous samples that are tried for a prediction [-]. Few samples give less delay and force
error; many need less damping"""

_LATE_TICK_PERIODS = 1.25
"""Time between two samples for which the prediction of a plan must be certified; if no rendering is, less is
accepted [longest time between samples of the device]
"""

_FASTEST_STROKES_S = (0.02, 0.06, 0.2)
"""Times in which the fastest certified motion of a tangent crosses the domain [s]. A faster motion ends the
run; the first time that is certified is taken"""

_LEAST_HYSTERESIS = 1.0 / 64.0
"""Least factor by which a plan may multiply the hysteresis h to make it renderable [-]"""


_ACCOUNT_RATIOS = (4.0, 3.0, 2.0, 1.5)
"""Tried slopes of a rendering that the energy account holds, the steepest first [slopes of a proof]. Above 4
the account acts in ordinary presses"""

_MOST_ACTING = 0.01
"""Share of the ticks of simulated presses in which the energy account may act [-]"""


@dataclass(frozen=True)
class Candidate:
    """Model to be rendered, its structure with settings, and the certificate of both on a device."""

    rendered: ForceModel
    certificate: Certificate

    @property
    def scheme(self) -> Scheme:
        return self.certificate.scheme


@dataclass(frozen=True)
class Refusal:
    """Reason why a structure cannot render a model."""

    reason: str


@dataclass(frozen=True)
class Task:
    """Model, device, and the caller's requirements in the model's units."""

    model: ForceModel
    device: DeviceProfile
    coupling: bool = False
    coupling_stiffness: float | None = None
    coupling_damping: float | None = None
    mass: float | None = None
    object_damping: float | None = None
    """Object damping B_o of the caller or of the model [force*s/position]"""
    model_mass: float = 0.0
    """Mass of the model, the least mass of the object on an admittance display [force*s^2/position]"""
    model_damping: float = 0.0
    """Damping of the model, the least damping of the object on an admittance display [force*s/position]"""
    play_radius: float | None = None
    predict: int | None = None
    """Number of previous position samples that the prediction uses. 0: no prediction; None: chosen by the
    plan"""
    energy_account: bool = True
    """True if the energy account may hold a rendering that is not proved"""
    may_limit: bool = True
    """True if a network with limited slopes may be rendered in place of the identified model"""

    @property
    def dynamic(self) -> bool:
        """True if the object has mass or damping in addition to its force over position."""
        return bool(self.mass) or bool(self.object_damping)

    @property
    def chooses_play(self) -> bool:
        """True if neither the caller nor the model gives a play radius."""
        return self.model.hysteretic and not self.play_radius and self.model.play_radius is None

    @property
    def longest_play(self) -> float:
        """Largest play radius that a plan may choose [position]."""
        return LONGEST_PLAY * float(self.model.upper[0] - self.model.lower[0])

    @property
    def usual_play(self) -> float:
        """The caller's play radius, or the usual play radius for the device; 0 if the model needs none
        [position]."""
        return self.play_radius or default_play_radius(self.model, self.device.encoder_step)

    def certified(self, scheme: Scheme, rendered: ForceModel | None = None) -> Candidate:
        """Returns the structure and settings for the model, or for a network in its place, with the
        certificate."""
        rendered = rendered or self.model
        certificate = certify(rendered, scheme, self.device)
        if certificate.certified and self.device.renderer == "device":
            of_program = _certified_program(certificate, rendered)
            certificate = certificate if of_program.certified else of_program
        return Candidate(rendered, certificate)

    def direct_scheme(self, rendered: ForceModel) -> Scheme:
        """Returns the direct structure. If the plan chooses the play radius, it is the narrowest that is
        certified for the network."""
        radius = self.play_radius or 0.0
        if self.chooses_play:
            radius = min(play_radius_for(rendered, self.device), self.longest_play)
        return Scheme(structure="direct", play_radius=radius, predict=self.predict or 0)

    def not_static(self) -> Refusal | None:
        """Refuses a structure without mass for an object with mass or damping."""
        if not self.dynamic:
            return None
        mass, damping, _ = mechanical_units(self.device.position_unit)
        parts = [
            f"a {word} of {value:.4g} {unit}"
            for word, value, unit in (("mass", self.mass, mass), ("damping", self.object_damping, damping))
            if value
        ]
        return Refusal(f"the object has {' and '.join(parts)}, which this structure cannot render")

    def not_direct(self) -> Refusal | None:
        """Refuses direct rendering for an object with mass or damping, or if a coupling is required."""
        return self.not_static() or (
            Refusal("a coupling is required, and this structure has no coupling") if self.coupling else None
        )

    def only_direct(self) -> Refusal | None:
        """Refuses a prediction that the caller requires; a plan can add one to any direct rendering."""
        if not self.predict:
            return None
        return Refusal(
            f"predict is {self.predict}: a required prediction is possible only in direct rendering of the "
            "identified model"
        )


def _certified_program(certificate: Certificate, rendered: ForceModel) -> Certificate:
    """Returns the certificate of the exported program in single precision, which a motor controller runs; if
    the structure or the model cannot be exported, returns `certificate`."""
    device = certificate.device
    try:
        program = ExportedModel(
            rendered,
            certificate.scheme,
            encoder_step=device.encoder_step,
            period_s=device.period_s,
            force_limit=device.force_limit,
        )
    except ValueError:
        return certificate
    return with_force_error(certificate, program.rendering_error)


_NOT_LIMITED = Refusal("the identified model must be rendered without changes")
"""Reason to refuse a structure that would change the model."""


def _direct(task: Task) -> Candidate | Refusal:
    """Renders the identified model without changes."""
    if refusal := task.not_direct():
        return refusal
    found = task.certified(task.direct_scheme(task.model))
    if found.certificate.refused and task.chooses_play:
        # The proved bounds of the slope g' + h / r can be wider than the sum of the bounds of g' and h / r,
        # from which the play radius r was computed.
        wider = min(_PLAY_ENLARGEMENT * found.scheme.play_radius, task.longest_play)
        again = task.certified(_direct_with(wider, found.scheme.predict))
        found = found if again.certificate.refused else again
    return _predicted(found, task)


def _direct_limited(task: Task) -> Candidate | Refusal:
    """Renders directly the force law nearest to the model that the device can render."""
    if refusal := task.not_direct():
        return refusal
    if not task.may_limit:
        return _NOT_LIMITED
    if refusal := task.only_direct():
        return refusal
    low, high = renderable_slopes(task.device, model=task.model)
    if high <= 0.0:
        return _no_slope(task.device)
    limited = (
        _hysteresis_limited(_balanced(task.model, task.device), task)
        if task.model.hysteretic
        else _within(task.model, low, high, task.device)
    )
    if limited is None:
        unit = _slope_unit(task.device)
        return Refusal(f"no network with slopes between {low:.4g} and {high:.4g} {unit} was found")
    return _predicted(task.certified(task.direct_scheme(limited), limited), task)


def _held(task: Task) -> Candidate | Refusal:
    """Renders directly, held by the energy account, with the steepest slopes at which the account acts in
    less than 1 % of the ticks of simulated presses."""
    if refusal := task.not_direct() or task.only_direct():
        return refusal
    if not task.may_limit:
        return _NOT_LIMITED
    if not task.energy_account:
        return Refusal("the energy account is switched off")
    if task.device.renderer == "device":
        return Refusal("the program on a motor controller has no energy account")
    refusal = _no_slope(task.device)
    if renderable_slopes(task.device, model=task.model)[1] <= 0.0:
        return refusal
    for ratio in _ACCOUNT_RATIOS:
        # The slopes that are proved on this device are `ratio` times those that are proved on the true device
        stronger = replace(task, device=_times(task.device, ratio), predict=0)
        found = _direct(stronger)
        if isinstance(found, Refusal) or found.certificate.refused:
            found = _direct_limited(stronger)
        if isinstance(found, Refusal):
            refusal = found
            continue
        certificate = found.certificate
        if not certificate.refused:
            certificate = certify_with_account(found.rendered, found.scheme, task.device)
        if certificate.refused:
            refusal = Refusal(certificate.reason)
            continue
        share = account_use(found.rendered, found.scheme, task.device).share
        if share < _MOST_ACTING:
            return Candidate(found.rendered, certificate)
        refusal = Refusal(
            f"with {ratio:g} times the proved slopes the energy account acts in {100.0 * share:.3g} % of the "
            f"ticks of simulated presses, must be below {100.0 * _MOST_ACTING:g} %"
        )
    return refusal


def _tangent(task: Task) -> Candidate | Refusal:
    """Renders the identified model by lines that the controller of the device holds between two commands,
    certified for the fastest motions of `_FASTEST_STROKES_S` that hold."""
    if refusal := task.not_direct() or task.only_direct():
        return refusal
    model, device = task.model, task.device
    if device.held_line is None:
        return Refusal("the controller of the device does not hold a line")
    travel = float(model.upper[0] - model.lower[0])
    least = max(travel * cells_in_motion / most_slope_cells, 8.0 * device.encoder_step)
    for stroke_s in _FASTEST_STROKES_S:
        motion = max(travel * device.period_s / stroke_s, least)
        line = line_for(model, device, motion, task.usual_play)
        found = task.certified(Scheme(structure="tangent", play_radius=task.usual_play, line=line))
        if found.certificate.certified:
            break
    return found


def _massless(task: Task) -> Candidate | Refusal:
    """Renders the model as a massless virtual object behind a coupling. A model without hysteresis has
    limited slopes and is compensated for the spring of the coupling."""
    if refusal := task.not_static():
        return refusal
    if not task.coupling:
        return Refusal("no coupling is required, and a coupling does not allow steeper slopes")
    model, device = task.model, task.device
    coupling_damping = task.coupling_damping or 0.0
    stiffness = task.coupling_stiffness
    low, high = (-math.inf, math.inf) if model.hysteretic else renderable_slopes(device)
    if stiffness is None:
        static = coupling_damping == 0.0 and not model.hysteretic
        falling = 0.0 if static else max(0.0, -force_bounds(model, task.usual_play).slope_min)
        stiffness = stiffest_coupling(coupling_damping=coupling_damping, falling=falling, device=device)
        if static:
            stiffness = min(stiffness, usual_coupling_share * high)
    if stiffness <= 0.0:
        return _no_slope(device)
    scheme = Scheme(
        structure="massless",
        coupling_stiffness=stiffness,
        coupling_damping=coupling_damping,
        compensated=not model.hysteretic,
        play_radius=task.usual_play,
    )
    if model.hysteretic:
        return task.certified(scheme)
    highest = compensated_share * stiffness
    balanced = _balanced(model, device)
    low, high = low if coupling_damping == 0.0 else -math.inf, min(highest, high)
    if not task.may_limit and not (balanced is model and _fits(model, low, high)):
        return _NOT_LIMITED
    limited = _within(balanced, low, high, device)
    if limited is None:
        unit = _slope_unit(task.device)
        return Refusal(
            f"no network with slopes below {highest:.4g} {unit} = {compensated_share} K_c was found"
        )
    return task.certified(scheme, limited)


def _with_mass(structure: str, task: Task) -> Candidate | Refusal:
    """Renders the model with its mass behind a coupling."""
    if not task.dynamic:
        return Refusal("the object has no mass and no damping")
    if not task.mass:
        return Refusal("the object has damping but no mass: give mass")
    coupling_damping = task.coupling_damping
    if coupling_damping is None:
        coupling_damping = _COUPLING_DAMPING_SHARE * task.device.viscous_damping
    stiffness = task.coupling_stiffness
    if stiffness is None:
        stiffness = stiffest_coupling(coupling_damping=coupling_damping, falling=0.0, device=task.device)
    if stiffness <= 0.0:
        _, unit, _ = mechanical_units(task.device.position_unit)
        return Refusal(
            f"device damping is {task.device.viscous_damping:.4g} {unit}: too small for any coupling"
        )
    return task.certified(
        Scheme(
            structure=structure,
            coupling_stiffness=stiffness,
            coupling_damping=coupling_damping,
            mass=task.mass,
            object_damping=task.object_damping or 0.0,
            play_radius=task.usual_play,
        )
    )


def _explicit(task: Task) -> Candidate | Refusal:
    """Renders with the explicit structure of the paper, which can be certified as stable, but not as
    passive."""
    if refusal := task.only_direct():
        return refusal
    scheme = explicit_scheme(
        force_bounds(task.model, task.usual_play, task.device.force_limit),
        task.device,
        mass=task.mass,
        object_damping=task.object_damping,
        coupling_stiffness=task.coupling_stiffness,
        coupling_damping=task.coupling_damping,
        play_radius=task.usual_play,
    )
    return task.certified(scheme)


ADMITTANCE_STRUCTURES = ("implicit", "explicit", "energy-consistent")
"""Structures of an admittance display, in the order in which they are chosen"""


def on_admittance_display(task: Task) -> list[Candidate]:
    """Returns the object with each structure on an admittance display, the best first.

    A structure is better if it is certified. The first in the order of `ADMITTANCE_STRUCTURES` is chosen
    unless another one needs less damping by more than the just noticeable difference of a force.
    """
    bounds = force_bounds(task.model, task.usual_play)
    found = [
        task.certified(
            admittance_scheme(
                bounds,
                structure,
                task.device,
                mass=task.model_mass,
                object_damping=task.model_damping,
                fixed_mass=task.mass,
                fixed_damping=task.object_damping,
                play_radius=task.usual_play,
            )
        )
        for structure in ADMITTANCE_STRUCTURES
    ]
    proved = [each for each in found if not each.certificate.refused]
    least = min((each.scheme.object_damping for each in proved), default=0.0)
    noticed = least * (1.0 + FORCE_JND)
    return sorted(found, key=lambda each: (each.certificate.refused, each.scheme.object_damping > noticed))


Propose = Callable[[Task], Candidate | Refusal]
"""Returns the certified or refused candidate of a structure, or the reason why it does not apply."""


def _of_position(propose: Propose) -> Propose:
    """Returns the candidate structure with a refusal of forces that depend on velocity or have a memory."""

    def guarded(task: Task) -> Candidate | Refusal:
        if task.model.memory is not None:
            return Refusal(
                "the force has a memory: only direct rendering of the identified model has known bounds"
            )
        if not task.model.of_velocity:
            return propose(task)
        return Refusal(
            "the force depends on velocity: only direct rendering of the identified model has known bounds"
        )

    return guarded


@dataclass(frozen=True)
class CandidateStructure:
    """A structure that a plan can choose."""

    use: str
    """Rendering or purpose of the structure, in a few words"""
    propose: Propose
    applies: Callable[[Task], bool] = lambda task: True
    """Returns False for a device that cannot have the structure, which is then not mentioned"""
    reduces_error: bool = False
    """True if the structure is also tried when the force error of a proved rendering is not accepted, and is
    chosen if its own is smaller"""


CANDIDATES: Mapping[str, CandidateStructure] = {
    "direct": CandidateStructure("the identified model", _direct),
    "tangent": CandidateStructure(
        "the identified model, if the controller of the device holds lines",
        _of_position(_tangent),
        applies=lambda task: task.device.held_line is not None,
    ),
    LIMITED: CandidateStructure(
        "the nearest force that the device can render", _of_position(_direct_limited)
    ),
    "direct, held by the energy account": CandidateStructure(
        "a steeper force, if the force error of the proved one is not accepted",
        _of_position(_held),
        reduces_error=True,
    ),
    "massless": CandidateStructure(
        "behind a virtual coupling, if a coupling is required", _of_position(_massless)
    ),
    "implicit": CandidateStructure(
        "if the object has mass or damping", _of_position(lambda task: _with_mass("implicit", task))
    ),
    "energy-consistent": CandidateStructure(
        "if the force falls too steeply for implicit",
        _of_position(lambda task: _with_mass("energy-consistent", task)),
    ),
    "explicit": CandidateStructure("stable, but not certified as passive", _of_position(_explicit)),
}
"""Candidate structures in the order in which they are tried"""


def _direct_with(play_radius: float, predict: int) -> Scheme:
    return Scheme(structure="direct", play_radius=play_radius, predict=predict)


def _predicted(found: Candidate, task: Task) -> Candidate:
    """Adds the certified prediction with the fewest samples; returns `found` if no prediction is certified or
    the caller chose the samples.

    A prediction needs damping, which shortens the allowed time between samples. This time must be at least
    `_LATE_TICK_PERIODS`, or the allowed time without prediction. If direct rendering is certified only with a
    prediction, every certified prediction is allowed.
    """
    if task.predict is not None or not task.model.of_position:
        return found
    enough = min(_LATE_TICK_PERIODS * task.device.longest_period_s, found.certificate.longest_period_s)
    for samples in _PREDICTION_SAMPLES:
        ahead = task.certified(_direct_with(found.scheme.play_radius, samples), found.rendered)
        if ahead.certificate.certified and ahead.certificate.longest_period_s >= enough:
            return ahead
    return found


def _no_slope(device: DeviceProfile) -> Refusal:
    _, damping, force = mechanical_units(device.position_unit)
    return Refusal(
        f"the device can render no slope: device friction {device.coulomb_friction:.4g} {force}, "
        f"device damping {device.viscous_damping:.4g} {damping}, encoder step {device.encoder_step:.4g} "
        f"{device.position_unit}, force step {device.force_step:.4g} {force}"
    )


def _times(device: DeviceProfile, ratio: float) -> DeviceProfile:
    """Returns the device that renders slopes that are `ratio` times as steep."""
    names = ("viscous_damping", "coulomb_friction", "force_step")
    return DeviceProfile(**device.to_dict() | {name: ratio * getattr(device, name) for name in names})


def _slope_unit(device: DeviceProfile) -> str:
    _, _, force = mechanical_units(device.position_unit)
    return f"{force}/{device.position_unit}"


def _within(model: ForceModel, low: float, high: float, device: DeviceProfile) -> ForceModel | None:
    """Returns the model if its slopes are within limits, else the nearest model with limited slopes, or
    None."""
    limited = model if _fits(model, low, high) else limit_slopes(model, low, high)
    return None if limited is None else _balanced(limited, device)


def _fits(model: ForceModel, low: float, high: float) -> bool:
    found = sliding_slopes(model)
    return found[0] >= low and found[1] <= high


def _balanced(model: ForceModel, device: DeviceProfile) -> ForceModel:
    """Adds a constant to the force of a periodic model, so that the limited force gives no energy over a
    period."""
    shift = passive_shift(model, device.force_limit)
    return with_network(model, bias=model.bias + shift) if shift else model


def _hysteresis_limited(model: ForceModel, task: Task) -> ForceModel:
    """Limits the slopes or reduces the hysteresis h, whichever gives the smaller force error; does both if
    needed."""

    def holds(candidate: ForceModel) -> bool:
        return not task.certified(task.direct_scheme(candidate), candidate).certificate.refused

    def scaled(candidate: ForceModel, share: float) -> ForceModel:
        return _balanced(scale_hysteresis(candidate, share), task.device)

    def most_hysteresis_that_holds(candidate: ForceModel) -> ForceModel:
        kept, refused = 0.0, 1.0
        for _ in range(10):
            share = 0.5 * (kept + refused)
            kept, refused = (share, refused) if holds(scaled(candidate, share)) else (kept, share)
        return scaled(candidate, max(kept, _LEAST_HYSTERESIS))

    radius = task.play_radius or model.play_radius or task.longest_play
    stick = min(force_bounds(model, radius).loss_per_play, steepest_stick(task.device))
    limited = _within(model, *renderable_slopes(task.device, stick, model), task.device) or model
    found = [limited if holds(limited) else most_hysteresis_that_holds(limited)]
    if limited is not model and holds(scaled(model, _LEAST_HYSTERESIS)):
        found.append(most_hysteresis_that_holds(model))
    exact = Scheme(structure="direct")
    return min(found, key=lambda candidate: static_force_error(model, candidate, exact).rms)

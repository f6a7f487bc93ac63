# SPDX-License-Identifier: Apache-2.0
"""Simulation of a plan on a simulated device, and its force error."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from .. import _core
from .._core.device import DeviceProfile
from .._core.rendering import Scheme
from .._core.simulation import Hand, TestRig, motion_driven, smallest_domain_share, tolerated_change
from .._core.status import Status
from .._typing import Float1D
from ..arguments import instance_of, real_of
from ..errors import InputError
from ..model import Model
from ..recording import Recording
from ..recording.units import COLUMN_SUFFIX, Unit
from ..verdict import Finding, Verdict, no, usable
from .plan import Plan, describe, rounded

START = "handle_start"
MIDDLE = "handle_middle"
END = "handle_end"
"""Column names, without unit, of the true handle position at the start, in the middle and at the end of a
tick."""
MEAN_APPLIED = "mean_applied"
"""Column name, without unit, of the mean force over a tick; with a delay of a fraction of a tick two forces
act in one tick."""

_GRID = 1001
"""Number of positions, and of velocities, at which the force range is computed [-]"""
_TOLERATED_ERROR_SHARE = 0.02
"""Largest force error without a finding [share of the force range]"""

_HELD_SHARE = 0.8
"""Largest felt force against which the simulated hand presses [share of the force limit]; the rest is for
coupling and damping"""

_DOMAIN_MARGIN = 0.01
"""Part of the domain at each end that the simulated hand leaves out [share of the domain]"""

_COMPENSATED_DAMPING_RATIO = 0.25
"""Coupling damping of the compensated structure divided by that of the other structures [-]; the share
(f'/K_c)^2 of this damping is felt."""

_COMPARED_PREDICTION = 4
"""Number of previous position samples that a prediction uses in a comparison of structures [-]"""

_NAMES = {int(value): name for name, value in Status.__members__.items()}
"""Maps the value of a status to its name."""


def rig_for(model: Model) -> TestRig:
    """Returns the test rig for a model: the default knob, scaled to the model unless its position is an
    angle, and a hand that moves it through the model's domain."""
    return _core.simulation.rig_for(model, is_angle=model.units["position"] == "rad")


def hand_for(plan: Plan, device: DeviceProfile) -> Hand:
    """Returns a simulated hand that moves the handle through the domain of a model while a plan is rendered.

    On an admittance display the hand has the largest stiffness and damping of the profile.

    Near the ends of the domain 1 % is left out, because the handle overshoots. The hand stops where the felt
    force would exceed 80 % of the force limit of the device.
    """
    usual = rig_for(plan.model).hand
    if (display := device.admittance) is not None and display.hand_stiffness > 0.0:
        usual = Hand(
            stiffness=display.hand_stiffness,
            damping=display.hand_damping,
            lower=usual.lower,
            upper=usual.upper,
            frequency_hz=usual.frequency_hz,
        )
    x, _, at_rest = plan.forces_at_rest()
    margin = _DOMAIN_MARGIN * (x[-1] - x[0])
    held = np.abs(at_rest).max(axis=0) <= _HELD_SHARE * device.force_limit
    inside = np.flatnonzero(held & (x >= x[0] + margin) & (x <= x[-1] - margin))
    if not len(inside):
        return usual
    first, last = inside[0], inside[-1]
    # The handle stops where the force of the hand's spring equals the felt force and the device friction. At
    # the lower end the felt force is the mean of both strokes, because the overshoot reverses the hysteresis.
    friction = device.coulomb_friction
    ends = sorted(
        (
            x[first] + (at_rest.mean(axis=0)[first] - friction) / usual.stiffness,
            x[last] + (at_rest[0][last] + friction) / usual.stiffness,
        )
    )
    return Hand(
        stiffness=usual.stiffness,
        damping=usual.damping,
        lower=ends[0],
        upper=ends[1],
        frequency_hz=usual.frequency_hz,
    )


def holding_hand(plan: Plan, position: float) -> Hand:
    """Returns a simulated hand that pulls the handle to a position and then does not move.

    After the object has relaxed, the handle is at this position.
    """
    low, high = plan.model.lower[0], plan.model.upper[0]
    if not low <= position <= high:
        raise InputError(f"the held position is {position:g}: must be from {low:g} to {high:g}, the domain")
    usual = rig_for(plan.model).hand
    x, _, at_rest = plan.forces_at_rest()
    target = position + float(np.interp(position, x, at_rest[0])) / usual.stiffness
    return Hand(stiffness=usual.stiffness, damping=usual.damping, lower=target, upper=target)


def simulate(
    plan: Plan,
    device: DeviceProfile,
    hand: Hand,
    duration: float,
    progress: Callable[[int], None] | None = None,
) -> Recording:
    """Renders a plan in closed loop and virtual time, with simulated device, hand and controller.

    The handle starts at rest at 0, or at the end of the model's domain that is nearest to it. A plan that the
    energy account holds is limited by it, every other plan by the force limit only. On an admittance display
    the force is that of the hand on the handle, which moves the object.

    Parameters
    ----------
    plan : Plan
        The plan to render.
    device : DeviceProfile
        The simulated device.
    hand : Hand
        The simulated hand that moves it.
    duration : float
        Simulated time [s]; at most 3 600 000 periods of the device.
    progress : callable, optional
        Called about ten times a second with the number of ticks.

    Returns
    -------
    Recording
        Encoder position, force of the device, and time. It can be identified and verified like any recording.
        Further columns are the true handle position at the start, in the middle and at the end of each tick,
        and the position of the environment. Others are the commanded force, the mean force over the tick, the
        number of evaluations, the status as a word, and 1 if the model was extrapolated, else 0.

    Raises
    ------
    InputError
        The structure would diverge on this device, the certificate is for another device, or a number is out
        of range.
    """
    instance_of("plan", plan, Plan, "make one with palpate.plan")
    instance_of("device", device, DeviceProfile, "make one with palpate.DeviceProfile")
    instance_of("hand", hand, Hand, "make one with palpate.Hand")
    duration = real_of("duration", duration)
    plan.check_for(device)
    start = float(np.clip(0.0, plan.model.lower[0], plan.model.upper[0]))
    trace = _core.simulation.simulate(
        plan.rendered,
        plan.scheme,
        device,
        hand,
        duration,
        start_position=start,
        energy_account=plan.held_by_account,
        progress=progress,
    )
    recording = Recording.from_arrays(
        trace["position"],
        trace["applied"],
        trace["time_s"],
        units=plan.model.units,
        metadata={
            "simulated": "yes: device, hand and controller; nothing here was measured",
            "structure": describe(plan.scheme),
            "device": repr(device),
            "hand": repr(hand),
        },
    )
    position, force = (_suffix(plan.model.units[role]) for role in ("position", "force"))
    return replace(
        recording,
        columns={
            f"{START}{position}": trace["handle_start"],
            f"{MIDDLE}{position}": trace["handle_middle"],
            f"{END}{position}": trace["handle_end"],
            f"environment_position{position}": trace["environment_position"],
            f"commanded{force}": trace["force"],
            f"{MEAN_APPLIED}{force}": trace["mean_applied"],
            "evaluations": trace["evaluations"].astype(np.float64),
            "extrapolated": np.asarray(trace["extrapolated"], dtype=np.float64),
            "status": np.array([_NAMES[value] for value in trace["status"]], dtype=object),
        },
    )


@dataclass(frozen=True)
class ForceError:
    """Rendered minus identified force at the handle's true position: RMS over all ticks [N*m or N], and work
    [J]."""

    end: float
    """RMS force error at the end of the tick in which the force is held; a force that is predicted for a
    later position makes this error smaller"""
    instant: float
    """RMS of the held force minus the force at the position from the start of the tick; without delay, only
    the effects of structure and encoder"""
    mean: float
    """RMS over all ticks of the mean force error in each tick"""
    band: float
    """RMS of the error of the mean force over each tick, only its frequencies below 50 Hz: the part that a
    hand can follow"""
    work: float
    """Work of the force error over the whole time [J]; negative if the rendering absorbs less energy than the
    identified model"""


def force_error(plan: Plan, rendered: Recording) -> ForceError:
    """Returns the errors of a simulated rendering against the identified model, at the true handle position.

    With F the force of the device, x the true motion and T the period, the error of the mean over tick k is
    the integral of F(t) - f(x(t)) over the tick, divided by T. The error below 50 Hz is the sequence of these
    errors after a low-pass filter without phase shift.

    Parameters
    ----------
    plan : Plan
        The rendered plan.
    rendered : Recording
        From :func:`simulate`.
    """
    suffix = _suffix(plan.model.units["position"])
    period = rendered.sample_period
    if period is None:
        raise InputError(
            "the rendering has one tick: the force error needs at least 2; simulate a longer time"
        )
    errors = _core.simulation.force_error(
        plan.model,
        plan.scheme.play_radius,
        start=rendered.columns[f"{START}{suffix}"],
        middle=rendered.columns[f"{MIDDLE}{suffix}"],
        end=rendered.columns[f"{END}{suffix}"],
        applied=rendered.force,
        mean_applied=rendered.columns[f"{MEAN_APPLIED}{_suffix(plan.model.units['force'])}"],
        period_s=period,
    )
    return ForceError(**errors)


def force_range(plan: Plan) -> float:
    """Returns the range of the model's force over its domain, both strokes included [N*m or N]."""
    lower, upper = plan.model.domain
    if plan.model.of_velocity:
        axes = [np.linspace(low, high, _GRID) for low, high in zip(lower, upper, strict=True)]
        force = plan.model.predict(np.stack([axis.ravel() for axis in np.meshgrid(*axes)], axis=1))
    elif plan.model.memory is not None:
        force = plan.model.force(np.linspace(lower[0], upper[0], _GRID))
    else:
        sweep = np.linspace(lower[0], upper[0], _GRID)
        force = force_at(plan, np.concatenate([sweep, sweep[::-1]]))
    return float(np.ptp(force))


def covered_text(plan: Plan, device: DeviceProfile, rendered: Recording) -> str:
    """Returns the positions that the simulated handle reached, as a share of the domain, in words."""
    lower, upper = float(plan.model.lower[0]), float(plan.model.upper[0])
    low, high = float(rendered.position.min()), float(rendered.position.max())
    inside = max(0.0, min(high, upper) - max(low, lower)) / (upper - lower)
    reached = Unit.of_si(plan.model.units["position"]).interval(low, high)
    text = f"{reached}, {100.0 * inside:.3g} % of the domain"
    return f"{text}; {_held_text(plan, device)}" if _needed_limit(plan) > device.force_limit else text


def _needed_limit(plan: Plan) -> float:
    """Returns the force limit with which the simulated hand moves the handle through the whole domain."""
    return plan.largest_at_rest / _HELD_SHARE


def _held_text(plan: Plan, device: DeviceProfile) -> str:
    limit = Unit.of_si(plan.model.units["force"]).text(device.force_limit)
    return f"the hand presses with at most {100.0 * _HELD_SHARE:g} % of the force limit of {limit}"


def judge(plan: Plan, rendered: Recording, error: ForceError, device: DeviceProfile | None = None) -> Verdict:
    """Judges a simulated rendering by its force error, its motion and its ticks.

    Parameters
    ----------
    plan : Plan
        The rendered plan.
    rendered : Recording
        From :func:`simulate`.
    error : ForceError
        From :func:`force_error`.
    device : DeviceProfile, optional
        The simulated device. Default: that of the certificate of the plan, if it has one.
    """
    device = plan.certificate.device if device is None and plan.certificate is not None else device
    status = Counter(rendered.columns["status"])
    ticks = len(rendered)
    if failed := status["NonFinite"]:
        return Verdict((no(f"the rendering diverged: {failed} of {ticks} ticks had no finite force"),))
    lower, upper = float(rendered.position.min()), float(rendered.position.max())
    position_unit = Unit.of_si(plan.model.units["position"])
    if not rendered.force.any():
        still = no(f"every force was zero: the handle stayed at {position_unit.interval(lower, upper)}")
        return Verdict((still,))
    domain = float(plan.model.upper[0]) - float(plan.model.lower[0])
    covered = (upper - lower) / domain
    findings: list[Finding] = []
    if lower == upper:
        findings.append(no("the handle did not move: simulate a longer time, or a stiffer hand"))
    elif covered < smallest_domain_share:
        cure = "simulate a longer time"
        if device is not None and (least := _needed_limit(plan)) > device.force_limit:
            limit = rounded(math.ceil, least)
            force_unit = Unit.of_si(plan.model.units["force"])
            cure = f"{_held_text(plan, device)}, so use a device of at least {force_unit.text(limit)}"
        findings.append(
            usable(
                f"the handle covered {100 * covered:.3g} % of the model's domain, at least "
                f"{100 * smallest_domain_share:.3g} % are needed: {cure}"
            )
        )
    span = force_range(plan)
    share = error.end / span if span > 0 else 0.0
    if share > _TOLERATED_ERROR_SHARE:
        level = no if share > plan.accept_force_error else usable
        findings.append(
            level(
                f"the RMS force error in motion is {100 * share:.3g} % of the object's force range, above "
                f"{100 * _TOLERATED_ERROR_SHARE:.3g} %: "
                + (
                    "the damping of the virtual object is felt; a faster servo, a shorter delay or a softer "
                    "hand needs less"
                    if plan.certificate is not None and plan.certificate.device.admittance is not None
                    else "choose a structure with palpate plan, or a stiffer coupling"
                    if plan.limited is None
                    else "the device is too weak for the object, so the plan limits the slopes of the force"
                )
            )
        )
    outside = int(rendered.columns["extrapolated"].sum())
    unsolved = status["MaxIterations"] + status["NotUnique"]
    for count, sentence in (
        (outside, "were outside the domain of the model: identify the model over a larger range"),
        (unsolved, "had no unique solution of the load line: choose the structure with palpate plan"),
        (status["Limited"], "limited the force to that of the device: a stronger device is needed"),
        (
            status["EnergyLimited"],
            "limited the force by the energy account: choose a device with more damping",
        ),
    ):
        if count > tolerated_change * ticks:
            findings.append(usable(f"{count} of {ticks} ticks ({100 * count / ticks:.3g} %) {sentence}"))
    return Verdict(tuple(findings))


def force_at(plan: Plan, position: Float1D, period_s: float | None = None) -> Float1D:
    """Returns the force of the identified model along a motion, without structure or coupling.

    Play state and velocity are included.

    Parameters
    ----------
    plan : Plan
        Model and play radius.
    position : (n,) array
        Positions of a motion, in order of time [rad or m].
    period_s : float, optional
        Time between positions [s]; only a force that depends on velocity or has a
        memory needs it.

    Returns
    -------
    (n,) array
        Force [N*m or N].
    """
    if period_s is None and not plan.model.of_position:
        raise InputError(
            "period_s is None: must be given for a force that depends on velocity or has a memory"
        )
    exact = Scheme(structure="direct", play_radius=plan.scheme.play_radius)
    force: Float1D = motion_driven(plan.model, exact, position, period_s or 1.0)["force"]
    return force


@dataclass(frozen=True)
class Comparison:
    """One structure of a comparison: the recording of its rendering, or the reason of its refusal."""

    scheme: Scheme
    recording: Recording | None
    error: ForceError | None
    refused: str | None
    """Reason why the structure was refused, in one sentence; None if it was rendered"""

    @property
    def name(self) -> str:
        return describe(self.scheme)


def compare_structures(model: Model, rig: TestRig, duration: float) -> tuple[Comparison, ...]:
    """Renders a model with each structure except energy-consistent, and measures its force error.

    The order is that of the usual force errors: direct, with and without prediction; massless
    behind a coupling, with the coupling's spring subtracted from the model; massless. Implicit with mass
    alone, implicit with the damping of the explicit structure, and explicit follow. A structure that does not
    suit the model or the device is refused with its reason.

    Parameters
    ----------
    model : Model
        A model of one position.
    rig : TestRig
        Device, hand and coupling, from :func:`rig_for`.
    duration : float
        Simulated time of each rendering [s].
    """
    quarter = _COMPENSATED_DAMPING_RATIO * rig.scheme(model).coupling_damping
    schemes = (
        rig.scheme(model, structure="direct", predict=_COMPARED_PREDICTION),
        rig.scheme(model, structure="direct"),
        rig.scheme(model, structure="massless", compensated=True, coupling_damping=quarter),
        rig.scheme(model, structure="massless"),
        rig.scheme(model, structure="implicit", object_damping=0.0),
        rig.scheme(model, structure="implicit"),
        rig.scheme(model, structure="explicit"),
    )
    return tuple(_render(model, scheme, rig.device, rig.hand, duration) for scheme in schemes)


def _render(model: Model, scheme: Scheme, device: DeviceProfile, hand: Hand, duration: float) -> Comparison:
    try:
        plan = Plan(model, scheme)
        recording = simulate(plan, device, hand, duration)
    except InputError as error:
        return Comparison(scheme, None, None, str(error))
    return Comparison(scheme, recording, force_error(plan, recording), None)


def _suffix(unit: str) -> str:
    return f"_{COLUMN_SUFFIX[unit]}" if unit else ""

# SPDX-License-Identifier: Apache-2.0
"""Search for the plan of a model: the first certified candidate structure, or the device property that is too
weak."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import Any, Literal

import numpy as np

from .._core.device import DeviceProfile
from .._core.device import on_device as timed_on_device
from .._core.model import ForceModel
from .._core.rendering import most_prediction_taps
from .._core.stability import stiffest_hand
from ..arguments import instance_of, real_of
from ..errors import InputError
from ..model import Model
from ..model.steepest_slope import SteepestSlope
from .candidates import CANDIDATES, Candidate, Refusal, Task, on_admittance_display
from .device_profile import find_profile, mechanical_units, require_unit
from .limited_network import renderable_slopes, sliding_bounds, sliding_slopes
from .plan import (
    ACCEPTED_FORCE_ERROR,
    SAMPLES,
    Plan,
    network_of,
    require_force,
    rounded,
    static_force_error,
    strokes,
    with_network,
)

_FORCE_UNIT = {"rad": "N*m", "m": "N"}
"""Maps the position unit of a device to its force unit."""


def plan(
    model: Model,
    device: DeviceProfile | str | os.PathLike[str],
    *,
    on_device: float | None = None,
    coupling: bool = False,
    coupling_stiffness: float | None = None,
    coupling_damping: float | None = None,
    mass: float | None = None,
    object_damping: float | None = None,
    play_radius: float | None = None,
    predict: int | Literal["auto", "off"] = "auto",
    accept_force_error: float = ACCEPTED_FORCE_ERROR,
    energy_account: bool = True,
) -> Plan:
    """Chooses the first candidate structure that is not refused for a model on a device.

    ``palpate plan --help`` lists the candidate structures in the order in which they are tried. Missing
    numbers are chosen from the device. On an admittance display, such as a force-feedback pedal, the object
    always has mass and damping. The implicit structure is chosen unless another one needs noticeably less
    damping.

    Parameters
    ----------
    model : Model
        A model of one position, or of position and velocity; a plan in it is ignored.
    device : DeviceProfile, str or path
        A profile in the model's unit, the name of an example profile, or the path of a TOML file.
    on_device : float, optional
        Rate at which the motor controller of the device runs the model itself [Hz]. Period, delay and jitter
        are then those of the controller, from the table ``on_device`` of the profile. Default: the host
        renders, with the period, delay and jitter of the profile.
    coupling : bool
        Renders through a virtual coupling even if none is needed.
    coupling_stiffness, coupling_damping : float, optional
        K_c and B_c [force/position, force*s/position]; either implies `coupling`.
    mass, object_damping : float, optional
        Mass and damping of the object [force*s^2/position, force*s/position]. Default: those of the model. 0
        removes them. On an admittance display the default is the least damping and mass that are proved for
        every hand of the profile, at least those of the model.
    play_radius : float, optional
        r of a model with hysteresis [position].
    predict : int, "auto" or "off"
        Samples used to predict the position half a sample ahead, for direct rendering. It compensates the
        mean delay of a held force, half a sample. "auto" chooses the fewest of 1, 2, 4, 8 and 16 that are
        certified for a tick that is late by a quarter of a period; "off" is 0.
    accept_force_error : float
        Largest accepted difference of the felt from the identified force, as a share of the range of the
        identified force.
    energy_account : bool
        If the force error of the proved rendering is not accepted, also tries slopes up to 4 times the proved
        ones, held by the energy account, and takes the smaller error.

    Returns
    -------
    Plan
        Read its ``verdict`` first. It is "no" if the force error is larger than accepted, or if every
        structure is refused; in the latter case the plan is the last candidate with a certificate. Its
        certificate lists all inequalities.

    Raises
    ------
    InputError
        An argument has a wrong type or value, or the model cannot be rendered at all, or not on a device of
        this unit.
    """
    instance_of("model", model, Model, "make one with palpate.identify or palpate.load_model")
    device = find_profile(device)
    if on_device is not None:
        device = timed_on_device(device, real_of("on_device", on_device))
    for name, value in {
        "coupling_stiffness": coupling_stiffness,
        "coupling_damping": coupling_damping,
        "mass": mass,
        "object_damping": object_damping,
        "play_radius": play_radius,
        "accept_force_error": accept_force_error,
    }.items():
        _require_number(name, value)
    samples = _samples_of(predict)
    require_unit(device, model)
    if model.units["force"] not in ("", _FORCE_UNIT[device.position_unit], "A"):
        raise InputError(
            f"the force unit of the model is {model.units['force']}: must be "
            f"{_FORCE_UNIT[device.position_unit]}, that of the device {device.id}"
        )
    require_force(model)
    if device.admittance is not None:
        if coupling or coupling_stiffness is not None or coupling_damping is not None or samples:
            raise InputError(
                f"{device.id} is an admittance display: it has no virtual coupling and no prediction"
            )
        return _on_admittance_display(
            model, device, mass, object_damping, play_radius, accept_force_error=accept_force_error
        )
    task = Task(
        with_network(model),
        device,
        coupling=coupling or coupling_stiffness is not None or coupling_damping is not None,
        coupling_stiffness=coupling_stiffness,
        coupling_damping=coupling_damping,
        mass=model.mass if mass is None else mass,
        object_damping=model.damping if object_damping is None else object_damping,
        play_radius=play_radius,
        predict=samples,
        energy_account=energy_account,
    )
    if model.of_velocity and (task.coupling or task.dynamic):
        raise InputError(
            "the model has position and velocity as inputs: it can only be rendered directly, without "
            "coupling, mass and damping"
        )
    if model.memory is not None and (task.coupling or task.dynamic):
        raise InputError(
            "the model has a memory: it can only be rendered directly, without coupling, mass and damping"
        )
    if samples and (not model.of_position or task.coupling or task.dynamic):
        raise InputError(
            f"predict is {samples}: must be 0 (off) with a coupling, mass, damping, velocity input or "
            "memory; a prediction is certified only for direct rendering of a force of position"
        )
    chosen, refused = choose(task, accept_force_error)
    identified = chosen.rendered is task.model
    planned = Plan(
        model,
        chosen.scheme,
        chosen.certificate,
        refused,
        None if identified else model.with_network(**network_of(chosen.rendered)),
        accept_force_error,
    )
    stable_only = not (chosen.certificate.certified or chosen.certificate.refused)
    too_weak = chosen.certificate.refused or _error(task, chosen) > accept_force_error
    if stable_only or too_weak:
        planned = replace(planned, needs=needed(task, accept_force_error, certified=stable_only))
    elif planned.limited is not None:
        planned = replace(planned, needs=_wider_play(task))
    return planned


def _on_admittance_display(
    model: Model,
    device: DeviceProfile,
    mass: float | None,
    object_damping: float | None,
    play_radius: float | None,
    *,
    accept_force_error: float,
) -> Plan:
    """Returns the plan with the least object damping on an admittance display."""
    if not model.of_position:
        raise InputError(
            f"{device.id} is an admittance display: it renders a force of position alone, without velocity "
            "input or memory"
        )
    if mass == 0.0:
        raise InputError("mass is 0: must be > 0 on an admittance display")
    task = Task(
        with_network(model),
        device,
        mass=mass,
        object_damping=object_damping,
        model_mass=model.mass or 0.0,
        model_damping=model.damping or 0.0,
        play_radius=play_radius,
    )
    chosen, *others = on_admittance_display(task)
    _, unit, _ = mechanical_units(device.position_unit)
    refused = tuple(
        f"{each.scheme.structure}: "
        + (
            each.certificate.reason
            if each.certificate.refused
            else f"needs an object damping of {each.scheme.object_damping:.4g} {unit}; "
            f"{chosen.scheme.structure} needs {chosen.scheme.object_damping:.4g} {unit}"
        )
        for each in others
    )
    needs = ""
    if chosen.certificate.refused:
        stiffest = stiffest_hand(chosen.certificate.bounds, chosen.scheme, device)
        freed = replace(task, mass=None, object_damping=None)
        least = on_admittance_display(freed)[0].scheme
        needs = (
            f"needs an object damping of at least {least.object_damping:.4g} {unit} (has "
            f"{chosen.scheme.object_damping:.4g}) with a mass of {least.mass:.4g}"
        )
        if stiffest > 0.0:
            assert device.admittance is not None
            needs += (
                f", or a hand of at most {_down(stiffest):g} {_slope_unit(device)} (has "
                f"{device.admittance.hand_stiffness:.4g})"
            )
    return Plan(model, chosen.scheme, chosen.certificate, refused, None, accept_force_error, needs)


def choose(task: Task, accept_force_error: float) -> tuple[Candidate, tuple[str, ...]]:
    """Returns the candidate for a task that is not refused, and the refused structures with their reasons.

    If all are refused, returns the last candidate with a certificate. `accept_force_error` is the largest
    accepted force error [share of the range].
    """
    refused: list[str] = []
    chosen: Candidate | None = None
    found = ""
    for name, candidate in CANDIDATES.items():
        if not candidate.applies(task):
            continue
        if found and not (candidate.reduces_error and _error(task, chosen) > accept_force_error):
            continue
        outcome = candidate.propose(task)
        if isinstance(outcome, Refusal) or outcome.certificate.refused:
            refused.append(f"{name}: {_reason(outcome)}")
            chosen = outcome if isinstance(outcome, Candidate) and not found else chosen
            continue
        if found:
            before, after = _error(task, chosen), _error(task, outcome)
            keeps = before <= after
            refused.append(
                f"{name if keeps else found}: the largest force error at rest is "
                f"{100.0 * max(before, after):.3g} % of the range, and "
                f"{100.0 * min(before, after):.3g} % with {found if keeps else name}"
            )
            if keeps:
                continue
        chosen, found = outcome, name
    assert chosen is not None  # at least one of the direct and the explicit structure always applies
    return chosen, tuple(refused)


def _error(task: Task, candidate: Candidate | None) -> float:
    """Returns the force error of a candidate, as a share of the range of the identified force."""
    assert candidate is not None
    return static_force_error(task.model, candidate.rendered, candidate.scheme).share


def _reason(outcome: Candidate | Refusal) -> str:
    return outcome.reason if isinstance(outcome, Refusal) else outcome.certificate.reason


def _samples_of(predict: object) -> int | None:
    """Returns the number of previous position samples that a prediction uses, or None if the plan chooses
    it."""
    if predict in ("auto", "off"):
        return None if predict == "auto" else 0
    if isinstance(predict, int) and not isinstance(predict, bool) and 0 <= predict <= most_prediction_taps:
        return predict
    raise InputError(f'predict is {predict!r}: must be "auto", "off" or 0 to {most_prediction_taps}')


def _require_number(name: str, value: object) -> None:
    if value is None and name != "accept_force_error":
        return
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise InputError(f"{name} is {value!r}: must be a number")
    if not (math.isfinite(value) and value >= 0.0):
        raise InputError(f"{name} is {float(value):g}: must be a finite number >= 0")


_AMPLE_DOUBLINGS = (40.0, 14.0, 8.0)
"""Number of doublings of a device property after which it is large enough for any model [-]; more can make an
explicit structure diverge"""

_BISECTIONS = 15
"""Number of bisections that find the least sufficient value of a device property within 0.1 % [-]"""

_FASTEST_HZ = 60_000.0
"""Highest advised rate [Hz]: the highest PWM rate of the example motor controllers (moteus r4)"""

_FASTEST_HOST_HZ = 10_000.0
"""Rate above which only a motor controller can run the model, not a host computer [Hz]"""

_MOST_IMPROVED = 20.0
"""Largest advised factor between a property of another device of the same kind and this device [-]"""

_LONGEST_TRAVEL_M = 0.3
"""Longest travel of a desktop device that is advised for a scaled recording [m]"""

Fits = Callable[[DeviceProfile], bool]
"""Function that returns True if a model can be rendered on a device."""


@dataclass(frozen=True)
class _Property:
    """A property of a device that can be improved."""

    improved: Callable[[DeviceProfile, float], DeviceProfile]
    """Function that returns the device with this property improved by a factor, rounded to three digits"""
    text: Callable[[DeviceProfile], str]
    """Function that returns, in words, the requirement that an improved device just meets"""
    is_realistic: Callable[[DeviceProfile], bool]
    """Function that returns True if a device of the same kind can have the improved property"""


def needed(task: Task, accept_force_error: float, *, certified: bool) -> str:
    """Returns the device property that a model needs: "needs device damping b >= 6.07 N*s/m (has 0.05)".

    If no realistic device property is sufficient, the text states the slope that the device renders, the
    need at the highest rate, and the scale of an object that the device renders. The text is empty if no
    property helps, or no realistic one for a force of position and velocity.

    Parameters
    ----------
    task : Task
        The model as it was identified, the device that is too weak, and the caller's requirements.
    accept_force_error : float
        Largest force error that is accepted [share of the range].
    certified : bool
        True if a plan that is only stable is not enough.
    """
    if wider := _wider_play(task):
        return wider
    names = _candidates(task)
    device = task.device
    task = replace(task, may_limit=False, predict=task.predict or 0)

    @cache  # improvements are rounded, so devices repeat
    def fits(changed: DeviceProfile) -> bool:
        for name in names:
            outcome = CANDIDATES[name].propose(replace(task, device=changed))
            if isinstance(outcome, Refusal) or outcome.certificate.refused:
                continue
            if certified and not outcome.certificate.certified:
                return False
            error = static_force_error(task.model, outcome.rendered, outcome.scheme)
            return error.share <= accept_force_error
        return False

    device_damping, friction, rate, controller_rate, encoder = _properties(task.model, device)
    for short, *others in (
        ((device_damping,), (controller_rate,), (rate,)),
        ((friction,), (encoder,)),
        ((device_damping, friction), (controller_rate, encoder), (rate, encoder)),
    ):
        strong = _improved(device, short, fits)
        if strong is None:
            continue
        realistic = []
        for properties in (short, *others):
            found = strong if properties is short else _improved(device, properties, fits)
            if found is not None and all(each.is_realistic(found) for each in properties):
                realistic.append(" and ".join(each.text(found) for each in properties))
        if realistic:
            return f"needs {', or '.join(realistic)}"
        if task.model.of_velocity:  # its slope may be low; the refused inequality states the limit
            return ""
        at_limit = rate.improved(device, _FASTEST_HZ * device.period_s)
        stronger = _improved(at_limit, short, fits)
        need = "" if stronger is None else " and ".join(each.text(stronger) for each in short)
        return _too_steep(task, need, _improved(device, (_SCALE,), fits))
    return ""


def _wider_play(task: Task) -> str:
    """Returns the least play radius with which the identified model is proved in direct rendering, if the
    caller or the model gives a smaller one; else an empty text."""
    given = task.play_radius or task.model.play_radius
    if not given or task.coupling or task.dynamic or not task.model.hysteretic:
        return ""
    free = replace(task, model=with_network(task.model, play_radius=None), play_radius=None)
    found = CANDIDATES["direct"].propose(free)
    if isinstance(found, Refusal) or not found.certificate.certified:
        return ""
    radius, unit = rounded(math.ceil, found.scheme.play_radius), task.device.position_unit
    return (
        f"needs a play radius of {radius:g} {unit} (has {given:.3g}): give --play-radius {radius:g}, and "
        f"after a reversal the force changes over {2.0 * radius:.3g} {unit}"
    )


def _too_steep(task: Task, need: str, scaled: DeviceProfile | None) -> str:
    """Returns the reason why no realistic device of this kind renders an object, and the scale that helps.

    `need` is the device property that is needed at the highest rate. `scaled` is the device in units in which
    it renders the object.
    """
    device, model = task.device, task.model
    _, _, force = mechanical_units(device.position_unit)
    position = device.position_unit
    low, high = sliding_slopes(model)
    falling = -low > high
    steepest, rendered = low if falling else high, renderable_slopes(device)[0 if falling else 1]
    x = np.linspace(model.lower[0], model.upper[0], SAMPLES)
    force_at_x = strokes(model, x)
    place = SteepestSlope.of(model, falling=falling)
    slope_unit = f"{force}/{position}"
    sentences = [
        f"is too steep for this device: its slope is {'down' if falling else 'up'} to "
        f"{_plain(steepest)} {slope_unit}{'' if place is None else f' at {place.place(position)}'}, and the "
        f"device renders {_plain(rendered)} {slope_unit} at {1.0 / device.period_s:.6g} Hz"
    ]
    if need:
        sentences.append(
            f"Even at {_FASTEST_HZ:g} Hz, the highest rate of motor controllers, it needs {need}"
        )
    if scaled is not None:
        factor = scaled.inertia / device.inertia
        weaker = max(math.sqrt(factor), float(np.abs(force_at_x).max()) / device.force_limit)
        longer = max(factor / weaker, 1.0)
        force_range, travel = float(np.ptp(force_at_x)) / weaker, float(x[-1] - x[0]) * longer
        result = f"a travel of {travel:.2g} {position} and a force range of {force_range:.2g} {force}"
        if position == "m" and travel > _LONGEST_TRAVEL_M:
            cannot = f"needs more than the {_LONGEST_TRAVEL_M:g} m of a desktop device"
        elif force_range < device.coulomb_friction:
            cannot = f"cannot be felt above the device friction of {device.coulomb_friction:.3g} {force}"
        else:
            cannot = ""
        sentences += (
            [
                f"The slope must be {_plain(factor)} times smaller",
                f"A scaled recording with {result} {cannot}",
                "Use a device with more damping",
            ]
            if cannot
            else [
                f"Scale the recording so that the slope is {_plain(factor)} times smaller: position times "
                f"{longer:.3g} and force times {1.0 / weaker:.3g} give {result}",
                "Or use a device with more damping",
            ]
        )
    return ". ".join(sentences)


def _plain(value: float) -> str:
    """Returns a number with three digits; below 1e6 without an exponent."""
    return f"{float(f'{value:.3g}'):g}"


def _candidates(task: Task) -> tuple[str, ...]:
    """Returns the candidate structures that render the identified model and meet the requirements."""
    if task.dynamic:
        return tuple(CANDIDATES)  # structures without mass refuse an object with mass or damping
    if task.coupling:
        return ("massless", "explicit") if task.model.hysteretic else ("massless",)
    return ("direct",)


def _scaled(device: DeviceProfile, factor: float) -> DeviceProfile:
    """Returns the device for an object whose force is divided by a factor, in the units of the object."""
    names = ("inertia", "viscous_damping", "coulomb_friction", "force_step", "force_limit")
    return _changed(device, **{name: factor * getattr(device, name) for name in names})


_SCALE = _Property(_scaled, lambda on: "", lambda on: True)


def _fastest_on_device(device: DeviceProfile) -> float:
    """Returns a high rate of a model on the motor controller [Hz].

    Returns 0 if the profile does not state its timing, or if the model already runs there.
    """
    if device.on_device is None or device.renderer is not None:
        return 0.0
    rate = min(_FASTEST_HZ, device.on_device.highest_rate_hz or _FASTEST_HZ)
    while rate * device.period_s >= 1.0:
        try:
            timed_on_device(device, rate)
        except ValueError:  # the delay of the controller has too many periods at this rate
            rate *= 0.5
        else:
            return rate
    return 0.0


def _properties(
    model: ForceModel, device: DeviceProfile
) -> tuple[_Property, _Property, _Property, _Property, _Property]:
    """Returns damping, friction, rate of the host, rate of the motor controller and encoder of the device as
    properties that can be improved."""
    _, damping, force = mechanical_units(device.position_unit)
    position = device.position_unit
    steepest = max(sliding_bounds(model).steepest, 1e-9)
    # A property that is 0 cannot be doubled: start with a value far below the need of the model.
    b = device.viscous_damping or 1e-3 * device.longest_period_s * steepest
    f_c = device.coulomb_friction or 1e-3 * (device.encoder_step * steepest + device.force_step) or 1e-9

    def faster(on: DeviceProfile, factor: float) -> DeviceProfile:
        rate = rounded(math.ceil, factor / device.period_s)
        jitter_s = device.jitter_s / (rate * device.period_s)
        delay_s = device.delay_s / (rate * device.period_s)
        # A host that is faster than the loop of the controller sends forces instead of lines
        loop = on.held_line
        slower = loop is not None and loop.period_s > 1.0 / rate
        return _changed(
            on,
            period_s=1.0 / rate,
            jitter_s=jitter_s,
            delay_s=delay_s,
            held_line=None if slower else loop,
        )

    fastest = _fastest_on_device(device)

    def on_controller(on: DeviceProfile, factor: float) -> DeviceProfile:
        rate = min(rounded(math.ceil, factor / device.period_s), fastest)
        return timed_on_device(on, rate) if fastest else on

    shorter = [name for name, value in (("jitter", device.jitter_s), ("delay", device.delay_s)) if value]
    in_proportion = f" with {' and '.join(shorter)} in proportion" if shorter else ""

    def rate_text(on: DeviceProfile) -> str:
        rate = 1.0 / on.period_s
        return f"a rate of {rate:g} Hz{in_proportion}" + (
            ", which only motor controllers reach" if rate > _FASTEST_HOST_HZ else ""
        )

    return (
        _Property(
            lambda on, factor: _changed(on, viscous_damping=rounded(math.ceil, factor * b)),
            lambda on: (
                f"device damping b >= {on.viscous_damping:.3g} {damping} (has {device.viscous_damping:.3g})"
            ),
            lambda on: not 0.0 < _MOST_IMPROVED * device.viscous_damping < on.viscous_damping,
        ),
        _Property(
            lambda on, factor: _changed(on, coulomb_friction=rounded(math.ceil, factor * f_c)),
            lambda on: (
                f"device friction f_c >= {on.coulomb_friction:.3g} {force} "
                f"(has {device.coulomb_friction:.3g})"
            ),
            lambda on: not 0.0 < _MOST_IMPROVED * device.coulomb_friction < on.coulomb_friction,
        ),
        _Property(faster, rate_text, lambda on: 1.0 / on.period_s <= _FASTEST_HZ * (1.0 + 1e-9)),
        _Property(
            on_controller,
            lambda on: f"the model on the motor controller (--on-device {1.0 / on.period_s:g})",
            lambda on: fastest > 0.0,
        ),
        _Property(
            lambda on, factor: _changed(on, encoder_step=rounded(math.floor, device.encoder_step / factor)),
            lambda on: f"an encoder step of {on.encoder_step:.3g} {position}",
            lambda on: on.encoder_step * _MOST_IMPROVED >= device.encoder_step,
        ),
    )


def _improved(device: DeviceProfile, properties: Sequence[_Property], fits: Fits) -> DeviceProfile | None:
    """Returns the device with the least sufficient improvement of these properties, or None."""

    def after(doublings: Sequence[float]) -> DeviceProfile:
        changed = device
        for each, number in zip(properties, doublings, strict=True):
            changed = each.improved(changed, 2.0**number)
        return changed

    found = next(
        (
            ample
            for ample in ([number] * len(properties) for number in _AMPLE_DOUBLINGS)
            if fits(after(ample))
        ),
        None,
    )
    if found is None:
        return None
    for k in range(len(properties)):
        low, high = 0.0, found[k]
        for _ in range(_BISECTIONS):
            middle = 0.5 * (low + high)
            enough = fits(after([*found[:k], middle, *found[k + 1 :]]))
            low, high = (low, middle) if enough else (middle, high)
        found[k] = high
    return after(found)


def _down(value: float) -> float:
    """Rounds down to three digits."""
    return rounded(math.floor, value)


def _slope_unit(device: DeviceProfile) -> str:
    return f"{_FORCE_UNIT[device.position_unit]}/{device.position_unit}"


def _changed(device: DeviceProfile, **fields: Any) -> DeviceProfile:
    return DeviceProfile(**device.to_dict() | fields)

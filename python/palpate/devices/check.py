# SPDX-License-Identifier: Apache-2.0
"""Check of a device: measurements, observations, and the verdict on rendering force with it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from .._core.device import DeviceProfile as CoreProfile
from ..errors import InputError
from ..model import Model
from ..planning import DeviceProfile, mechanical_units
from ..verdict import Verdict
from .measuring import Progress, measure
from .observations import Observation, compare, interruption, observe_at_rest
from .pushes import Mechanics, Push, push_response
from .servo import ServoEstimate, measure_servo

NO_FORCE_SHARE = 0.7
"""Share of the duration of a check with pushes in which no force is sent [-]"""

PUSH_FORCE_SHARE = 0.005
"""Force by which the check pushes the handle [share of the device's force limit]"""

_FRICTION_ADVICE = (
    "take the hand off the handle and check for 10 s; if the friction exceeds the force of the pushes, state "
    "the friction with --coulomb-friction"
)
_NO_FRICTION_ADVICE = (
    "a certificate of direct rendering needs device friction above 0, because the encoder has steps"
)
_SHORTEST_DURATION_S = 2.0
"""Least duration of a check [s]; in this time the handle must be moved and must be at rest"""
_REOPENING_S = 0.01
"""Duration for which the device is opened again after a fault, without force [s]"""
_DELAY_MARGIN_PERIODS = 0.05
"""Time added to the measured delay of the device, because the clocks of host and device drift [periods]"""
_LEAST_SIGN_STEPS = 5.0
"""Displacement of the handle by a push that is needed to judge the sign of the force [encoder steps]"""
_LEAST_SIGN_ERRORS = 3.0
"""Mean displacement by pushes that is needed to judge the sign of the force [standard errors of the mean]"""
_FORCE_SIGN = "sign of the force"
"""Name of the observation on the sign of the device's force"""
_SERVO_TOLERANCE = 0.05
"""Accepted difference of a measured position servo from its profile, in addition to the error of the
measurement [share of the value, or of the period for the delay]"""
_SIMULATED_FRICTION_SHARE = 0.002
"""Coulomb friction of the simulated device [share of the device's largest force]"""


@dataclass(frozen=True)
class Check:
    """Result of a check of a device: observations, measured numbers and verdict."""

    device: str
    observations: tuple[Observation, ...]
    numbers: Mapping[str, float | None]
    base: CoreProfile
    """Properties that the device itself states; its inertia, damping and friction are not used."""
    coulomb_friction: float | None = None
    """Coulomb friction of the device that the user states [N or N*m]"""

    @property
    def suitable(self) -> bool:
        """True if no observed property of the device is wrong."""
        return all(each.right is not False for each in self.observations)

    @property
    def may_push(self) -> bool:
        """True if the device may push the handle: no wrong property forbids force. A late host is allowed."""
        return not any(each.right is False and each.forbids_force for each in self.observations)

    @property
    def verdict(self) -> Verdict:
        """Verdict on the device: no if an observation is wrong, usable if a property was not observed."""
        return Verdict(tuple(each.finding for each in self.observations if each.finding))

    def profile(self) -> DeviceProfile:
        """Returns the measured device.

        The friction is a lower bound, as a certificate requires. Encoder step, force step and force limit are
        those that the device states.

        Raises
        ------
        InputError
            The mechanics were not measured, or a wrong property forbids force.
        """
        if not self.may_push:
            raise InputError(
                "this device gets no profile: its check found a wrong property that makes force unsafe; "
                "correct that property first"
            )
        inertia, damping = self.numbers["inertia"], self.numbers["viscous_damping"]
        friction = self.numbers["coulomb_friction_at_least"]
        if inertia is None or damping is None or friction is None:
            raise InputError(
                "a profile needs inertia, damping and friction: check a free handle without load "
                "for 10 s with --push; if the friction exceeds the pushes, state it with --coulomb-friction "
                "(in Python coulomb_friction)"
            )
        period, jitter, delay = self.numbers["period_s"], self.numbers["jitter_s"], self.numbers["delay_s"]
        assert period is not None
        assert jitter is not None
        return DeviceProfile(
            **self.base.to_dict()
            | {
                "jitter_s": max(0.0, period + jitter - self.base.period_s),
                "inertia": inertia,
                "viscous_damping": damping,
                "coulomb_friction": friction,
                "delay_s": delay or 0.0,
            }
        )

    def profile_notes(self) -> tuple[str, ...]:
        """States how each number of the profile was obtained: measured, stated by the device, or assumed."""
        stated = self.coulomb_friction is not None
        friction = "stated, not measured" if stated else "measured minus its uncertainty, a lower bound"
        delay = "measured" if self.numbers["delay_s"] is not None else "not measured; assumed to be 0"
        return (
            f"{self.device}, measured by palpate check-device.",
            "inertia, viscous_damping: measured by pushes. period_s: stated by the device. "
            "jitter_s: measured.",
            f"coulomb_friction: {friction}.",
            f"delay_s: {delay}.",
            "encoder_step, force_step, force_limit: stated by the device, not measured.",
        )


def check_device(
    device: str = "simulated",
    *,
    object: Model | None = None,
    transducer: bool = True,
    duration_s: float = 10.0,
    rate_hz: float = 1000.0,
    push: bool = False,
    profile: DeviceProfile | None = None,
    model: Model | None = None,
    coulomb_friction: float | None = None,
    wait_s: float | None = None,
    progress: Progress | None = None,
) -> Check:
    """Measures a device for some seconds and judges it.

    First the device is disabled, and its rate, lost samples and encoder are measured. The user moves the
    handle against an object, and the signs of velocity and transducer are compared with the positions. A
    reversed motor cannot be detected while the drive is disabled. With `push`, and only if no wrong property
    forbids force, the drive is therefore enabled and pushes the free handle to both sides. Half a percent of
    its force shows the sign of the force, the delay, inertia, damping and friction. A wrong sign prevents a
    profile, so nothing is certified for the device.

    Parameters
    ----------
    device : str
        Name of the device, in one of the forms that ``palpate devices`` lists.
    object : Model, optional
        The object mounted on the simulated device.
    transducer : bool
        True if the simulated device has a force transducer.
    duration_s, rate_hz : float
        Total duration [s] and sampling rate [Hz]; a USB device has its own rate.
    push : bool
        True if the device may push.
    profile : DeviceProfile, optional
        The expected device. With the profile of an admittance display, a chirp of commands measures delay and
        lag of the position servo in place of the rest.
    model : Model, optional
        Model with a certificate, which is checked for this device.
    coulomb_friction : float, optional
        Friction of the device if it is known and cannot be measured [N or N*m]; a lower bound.
    wait_s : float, optional
        Longest wait for an answer of the device [s].
    progress : callable, optional
        Called ten times a second with ticks, position, force and samples lost.

    Raises
    ------
    InputError
        The device cannot be used, or there is nothing to compare with. The message gives the reason.
    """
    if duration_s < _SHORTEST_DURATION_S:
        raise InputError(f"duration_s is {duration_s:g}, must be at least {_SHORTEST_DURATION_S:g}")
    if coulomb_friction is not None and not 0.0 <= coulomb_friction < math.inf:
        raise InputError(f"coulomb_friction is {coulomb_friction:g}, must be a finite number >= 0")
    expected = _expected(profile, model)
    if profile is not None and profile.admittance is not None:
        if device != "simulated":
            raise InputError(
                f"profile is that of the admittance display {profile.id}: its servo is measured on "
                f"the device 'simulated', not on '{device}'; of a real display, give commands and positions "
                "to palpate.devices.identify_servo"
            )
        return judge_servo(profile, measure_servo(profile, duration_s))
    common: dict[str, Any] = {
        "object": object,
        "transducer": transducer,
        "rate_hz": rate_hz,
        "wait_s": wait_s,
        "progress": progress,
        "keep": True,
        "lowest_rate_share": 0.0,  # a low rate of the control loop is reported, it does not end the check
        "friction_share": _SIMULATED_FRICTION_SHARE,
    }
    summary = _measured(device, duration_s=duration_s * (NO_FORCE_SHARE if push else 1.0), **common)
    check = judge(summary)
    if not push:
        check = _with(
            check, Observation(_FORCE_SIGN, "not measured", None, "check a free handle with --push")
        )
    elif not check.may_push:
        text = "not measured: no force is sent while another property is wrong"
        check = _with(check, Observation(_FORCE_SIGN, text))
    else:
        force = PUSH_FORCE_SHARE * check.base.force_limit
        check = replace(check, coulomb_friction=coulomb_friction)
        pushes = _measured(device, duration_s=duration_s * (1.0 - NO_FORCE_SHARE), push=force, **common)
        if pushes["orderly"]:
            response = push_response(pushes["kept"], check.base.encoder_step, coulomb_friction)
            check = with_pushes(check, response)
        else:
            text = "not measured: the pushes were interrupted"
            check = _with(check, interruption(pushes), Observation(_FORCE_SIGN, text))
    compared = tuple(compare(other, check.numbers, name=name) for name, other in expected.items())
    return _with(check, *compared)


def _measured(device: str, **settings: Any) -> dict[str, Any]:
    """Measures the device. After a fault, ``fault`` in the summary says why it cannot be opened again."""
    summary = measure(device, **settings)
    if not summary["orderly"]:
        try:
            measure(device, **{**settings, "push": None, "duration_s": _REOPENING_S})
        except InputError as error:
            summary["fault"] = str(error)
    return summary


def _with(check: Check, *added: Observation) -> Check:
    return replace(check, observations=(*check.observations, *added))


def judge(summary: Mapping[str, Any]) -> Check:
    """Judges a device from measurements without force.

    Parameters
    ----------
    summary : mapping
        A summary of :func:`measure`: ``kept`` holds the ticks, ``profile`` the device's stated properties.
    """
    base = summary["profile"]
    ticks = summary["kept"]
    steps = np.diff(ticks["device_time"])[np.diff(ticks["sequence"].astype(np.int64)) == 1]
    period = float(steps.mean()) if steps.size else base.period_s
    numbers: dict[str, float | None] = {
        "rate_hz": summary["rate_hz"],
        "period_s": period,
        "jitter_s": float(steps.max()) - period if steps.size else 0.0,
        "lost_samples": float(summary["lost_samples"]),
        "repeated_samples": float(summary["repeated_samples"]),
        "encoder_step": base.encoder_step,
        "force_limit": base.force_limit,
        "delay_s": None,
        "inertia": None,
        "viscous_damping": None,
        "coulomb_friction": None,
        "coulomb_friction_at_least": None,
        **{f"period_{name}": value for name, value in summary["period"].items()},
    }
    observations = observe_at_rest(summary)
    if summary.get("device_model"):
        observations.append(Observation("model on the device", f"fingerprint {summary['device_model']}"))
    if "round_trip" in summary:
        delay_us = summary["delay"]
        delay_s = 1e-6 * delay_us["p999_us"] + _DELAY_MARGIN_PERIODS * base.period_s
        numbers["delay_s"] = delay_s
        for each in ("round_trip", "delay"):
            numbers.update({f"{each}_{name}": value for name, value in summary[each].items()})
        observations.append(
            Observation(
                "delay",
                f"{1e6 * delay_s:.0f} us from a position sample to its force (median "
                f"{delay_us['p50_us']:.0f} us, 99.9 % below {delay_us['p999_us']:.0f} us)",
            )
        )
    return Check(summary["device"], tuple(observations), numbers, base)


def judge_servo(profile: DeviceProfile, servo: ServoEstimate) -> Check:
    """Compares the measured position servo of an admittance display with its profile.

    A certificate needs at least the true delay and lag, so a profile is wrong if it states less than the
    measured values minus their errors. A difference above the errors and 5 % is wrong in both directions.
    """
    display = profile.admittance
    assert display is not None
    error = servo.delay_error_s + _SERVO_TOLERANCE * profile.period_s
    delay = Observation(
        "delay",
        f"{1e3 * servo.delay_s:.4g} ± {1e3 * servo.delay_error_s:.1g} ms from a command to the motion, "
        f"{1e3 * profile.delay_s:.4g} ms in the profile",
        abs(servo.delay_s - profile.delay_s) <= error,
        "set delay_s of the profile to the measured value, and plan again",
    )
    words = "the servo moves at once"
    if servo.bandwidth_hz is not None:
        words = f"bandwidth {servo.bandwidth_hz:.4g} ± {servo.bandwidth_error_hz:.1g} Hz"
        if servo.damping is not None:
            words += f", damping ratio {servo.damping:.3g} ± {servo.damping_error:.1g}"
    pairs = (
        (servo.bandwidth_hz, display.servo_bandwidth_hz, servo.bandwidth_error_hz),
        (servo.damping, display.servo_damping, servo.damping_error),
    )
    agrees = all(
        (measured is None) == (stated is None)
        and (
            measured is None or stated is None or abs(measured - stated) <= error + _SERVO_TOLERANCE * stated
        )
        for measured, stated, error in pairs
    )
    lag = Observation(
        "servo",
        f"{words}, lag {1e3 * servo.lag_s:.3g} ms",
        agrees,
        "set servo_bandwidth_hz and servo_damping of the profile to the measured values, and plan again",
    )
    numbers: dict[str, float | None] = {
        "delay_s": servo.delay_s,
        "delay_error_s": servo.delay_error_s,
        "servo_bandwidth_hz": servo.bandwidth_hz,
        "servo_bandwidth_error_hz": servo.bandwidth_error_hz,
        "servo_damping": servo.damping,
        "servo_damping_error": servo.damping_error,
        "lag_s": servo.lag_s,
        "residual": servo.residual,
        "inertia": None,
        "viscous_damping": None,
        "coulomb_friction_at_least": None,
    }
    return Check(f"{profile.id} (simulated: no device moves)", (delay, lag), numbers, profile)


def with_pushes(check: Check, push: Push) -> Check:
    """Returns the check with the results of the pushes: sign and delay of the force, and the mechanics."""
    observations = [*check.observations, _sign(push, check.base.encoder_step, check.base.position_unit)]
    numbers = dict(check.numbers)
    if push.delay_samples is not None and numbers["delay_s"] is None:
        numbers["delay_s"] = push.delay_samples * check.base.period_s
        observations.append(
            Observation("delay", f"{push.delay_samples} samples from a position to its force")
        )
    mechanics = push.mechanics
    if mechanics is None:
        observations.append(
            Observation("friction", f"not measured: {push.mechanics_problem}", None, _FRICTION_ADVICE)
        )
    else:
        numbers["inertia"], numbers["viscous_damping"] = mechanics.inertia, mechanics.damping
        numbers["coulomb_friction"] = mechanics.friction
        numbers["coulomb_friction_at_least"] = mechanics.friction_lower_bound
        observations += _mechanics(mechanics, check)
    return replace(check, observations=tuple(observations), numbers=numbers)


def _mechanics(mechanics: Mechanics, check: Check) -> list[Observation]:
    units = mechanical_units(check.base.position_unit)
    least = mechanics.friction_lower_bound
    if check.coulomb_friction is not None:
        friction = Observation("friction", f"{least:.3g} {units[2]}, stated by the user and not measured")
    elif least > 0.0:
        friction = Observation(
            "friction", f"{mechanics.friction:.3g} {units[2]}, at least {least:.3g} {units[2]}"
        )
    else:
        text = f"not found; at most {3.0 * mechanics.friction_standard_error:.1g} {units[2]}"
        friction = Observation("friction", text, None, _NO_FRICTION_ADVICE)
    text = f"inertia {mechanics.inertia:.3g} {units[0]}, damping {mechanics.damping:.3g} {units[1]}"
    return [Observation("mechanics", text), friction]


def _sign(push: Push, step: float, unit: str) -> Observation:
    """Returns the observation of the sign of the force: did pushes move the handle in the right direction?"""
    text = (
        f"a push moved the handle by {push.displacement:.3g} {unit} "
        f"(standard error {push.standard_error:.1g} {unit})"
    )
    if (
        abs(push.displacement) < max(_LEAST_SIGN_STEPS * step, _LEAST_SIGN_ERRORS * push.standard_error)
        or push.displacement == 0.0
    ):
        advice = (
            f"a push must move the handle by {_LEAST_SIGN_STEPS:g} encoder steps and "
            f"{_LEAST_SIGN_ERRORS:g} standard errors at least: take the hand off the handle"
        )
        return Observation(_FORCE_SIGN, f"not clear: {text}", None, advice)
    if push.displacement < 0.0:
        text = f"reversed: {text} in the wrong direction"
    elif not push.reported_sign_agrees:
        text = "reversed: the device reports a force of the opposite sign of the command"
    else:
        text = f"correct: {text}"
    return Observation(
        _FORCE_SIGN,
        text,
        push.displacement > 0.0 and push.reported_sign_agrees,
        "exchange two wires of the motor, or reverse the motor's sign in the firmware; do not enable force",
        True,
    )


def _expected(profile: DeviceProfile | None, model: Model | None) -> dict[str, CoreProfile]:
    """Returns the expected properties of the device by their source: a device profile, or the model's
    certificate."""
    devices: dict[str, CoreProfile] = {} if profile is None else {"profile": profile}
    if model is not None:
        if model.certificate is None:
            raise InputError("the model has no certificate; make one with `palpate plan`")
        devices["certificate"] = CoreProfile(**model.certificate["device"])
    return devices

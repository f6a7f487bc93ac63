# SPDX-License-Identifier: Apache-2.0
"""Observations of a device: stream, encoder and signs without force, and an expected profile."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from .._core.device import DeviceProfile
from .._typing import Float1D
from ..verdict import Finding, no, usable

_RATE_TOLERANCE = 0.01
"""Largest accepted error of the loop's rate [share of the requested rate]"""
_CLOCK_TOLERANCE = 0.005
"""Largest accepted error of the device's clock [share of the period]; a quartz clock has a far smaller one"""
_LARGEST_PERIOD_RATIO = 2.0
"""Largest accepted 99.9th percentile of the measured periods of the control loop [requested periods]."""
_LARGEST_LOST_SHARE = 1e-3
"""Largest accepted share of lost and repeated samples from the device [-]."""
_LARGEST_NOISE_STEPS = 2.0
"""Largest accepted RMS noise of the encoder while the handle is at rest [encoder steps]."""
_REST_DURATION_S = 0.1
"""A device check is divided into pieces of this duration, to find a piece with the handle at rest [s]."""
_LEAST_MOTION_STEPS = 50.0
"""Motion of the handle that is needed to judge the signs of velocity and force sensor [encoder steps]."""
_VELOCITY_SAMPLES = 50
"""Number of samples between two positions whose difference is compared with the reported velocity."""
_VELOCITY_TOLERANCE = 0.25
"""Largest accepted error of the reported velocity [share of the velocity from the positions]"""
_LEAST_CORRELATION = 0.3
"""|Correlation| of force and position that is needed to judge the sign of the force sensor [-]."""

_STEP_TOLERANCE = 0.01
"""Accepted difference of the encoder step, and accepted deficit of the force limit [share of the expected
values]"""
_DAMPING_TOLERANCE = 0.1
"""Measured damping and friction may be less than expected by this share of the expected values [-]."""

_TOO_LITTLE_MOTION = f"the handle moved by less than {_LEAST_MOTION_STEPS:g} encoder steps"
_CABLE_ADVICE = "try another cable, another port, or no hub"


@dataclass(frozen=True)
class Observation:
    """One examined property of a device: its name, the result and advice."""

    name: str
    text: str
    right: bool | None = None
    """True: the device's property is right; False: it is wrong; None: it was not judged"""
    advice: str = ""
    forbids_force: bool = False
    """True if no force may be sent to the device while this property is wrong"""
    detail: bool = False
    """True if a summary shows the property only when it is wrong"""

    @property
    def finding(self) -> Finding | None:
        """Finding on the property for a verdict; None if it is right, or was not judged and has no advice."""
        if self.right or (self.right is None and not self.advice):
            return None
        return (usable if self.right is None else no)(
            f"{self.name}: {self.text}" + (f" ({self.advice})" if self.advice else "")
        )


def observe_at_rest(summary: Mapping[str, Any]) -> list[Observation]:
    """Judges rate, clock, losses, encoder and signs from the `summary` of a measurement without force."""
    ticks, wanted = summary["kept"], summary["wanted_rate_hz"]
    step = summary["profile"].encoder_step
    observations = [
        _rate(summary["rate_hz"], wanted),
        _period(summary["period"], wanted),
        _clock(ticks, wanted),
        _losses(summary),
        _encoder(ticks["position"], step, summary["profile"].position_unit, wanted),
        _velocity(ticks, step),
    ]
    if not summary["orderly"]:
        observations.insert(0, interruption(summary))
    if "round_trip" in summary:
        observations.append(Observation("round trip", _percentiles(summary["round_trip"]), detail=True))
    if "malformed" in summary:
        counts = {
            "malformed": "malformed packets",
            "stalls": "stalls",
            "bus_errors": "bus errors",
            "timeouts": "timeouts",
            "skipped_commands": "skipped commands",
        }
        observations.append(
            Observation(
                "USB errors",
                ", ".join(f"{summary[name]} {words}" for name, words in counts.items()),
                not (summary["malformed"] or summary["stalls"] or summary["bus_errors"]),
                f"malformed packets, stalls and bus errors must be 0: {_CABLE_ADVICE}",
                detail=True,
            )
        )
    if summary["transducer"]:
        observations.append(_transducer(ticks["position"], ticks["measured"], step))
    return observations


def interruption(summary: Mapping[str, Any]) -> Observation:
    """Returns the observation of a measurement that a fault has ended: the fault, or advice without one."""
    fault = summary.get("fault", "")
    text = f"{fault} ({summary['ended']})" if fault else summary["ended"]
    return Observation("interruption", text, False, "" if fault else _CABLE_ADVICE, True)


def _percentiles(durations: Mapping[str, float]) -> str:
    names = {"p50_us": "median", "p99_us": "99 % below", "p999_us": "99.9 % below", "max_us": "longest"}
    return ", ".join(f"{name} {durations[key]:.0f} us" for key, name in names.items())


def _rate(rate_hz: float, wanted: float) -> Observation:
    return Observation(
        "rate",
        f"{rate_hz:.1f} Hz of {wanted:g} Hz",
        bool(abs(rate_hz / wanted - 1.0) <= _RATE_TOLERANCE),
        f"the rate must be within {_RATE_TOLERANCE:.0%} of {wanted:g} Hz: close other programs, or give the "
        "loop real-time priority",
    )


def _period(period: Mapping[str, float], wanted: float) -> Observation:
    longest_us = _LARGEST_PERIOD_RATIO * 1e6 / wanted
    return Observation(
        "period",
        _percentiles(period),
        period["p999_us"] <= longest_us,
        f"99.9 % of the periods must be below {longest_us:.0f} us: close other programs, or give the loop "
        "real-time priority",
        detail=True,
    )


def _clock(ticks: Mapping[str, Any], wanted: float) -> Observation:
    """Judges the time between consecutive samples on the device's clock."""
    steps = np.diff(ticks["device_time"])[np.diff(ticks["sequence"].astype(np.int64)) == 1]
    if not steps.size:
        return Observation("device clock", "no two consecutive samples arrived", False, _CABLE_ADVICE)
    mean = float(steps.mean())
    return Observation(
        "device clock",
        f"{1e6 * mean:.1f} us per sample, spread {1e6 * float(steps.std()):.1f} us",
        bool(abs(mean * wanted - 1.0) <= _CLOCK_TOLERANCE),
        f"the mean must be within {_CLOCK_TOLERANCE:.1%} of {1e6 / wanted:.1f} us: the firmware does not "
        "keep its stated rate",
        detail=True,
    )


def _losses(summary: Mapping[str, Any]) -> Observation:
    lost, repeated, ticks = (summary[name] for name in ("lost_samples", "repeated_samples", "ticks"))
    return Observation(
        "samples",
        f"{lost} lost and {repeated} repeated of {ticks}",
        bool(lost + repeated <= _LARGEST_LOST_SHARE * ticks),
        f"at most {_LARGEST_LOST_SHARE:.1%} of the samples may be lost or repeated: {_CABLE_ADVICE}",
    )


def _encoder(position: Float1D, step: float, unit: str, rate_hz: float) -> Observation:
    """Judges the least noise of the encoder over all pieces. A parabola removes the hand's drift."""
    length = max(10, round(_REST_DURATION_S * rate_hz))
    pieces = position[: len(position) // length * length].reshape(-1, length)
    if not len(pieces):
        return Observation("encoder", "not measured: too few samples", None, "check for longer")
    drift = np.vander(np.linspace(-1.0, 1.0, length), 3)
    residual = pieces.T - drift @ np.linalg.lstsq(drift, pieces.T, rcond=None)[0]
    noise = float(np.sqrt((residual**2).mean(axis=0)).min())
    in_steps = noise / step if step > 0.0 else 0.0
    return Observation(
        "encoder",
        f"step {step:.4g} {unit}, noise at rest {in_steps:.2f} steps RMS, moved by "
        f"{np.ptp(position):.4g} {unit}",
        in_steps <= _LARGEST_NOISE_STEPS,
        f"noise must be at most {_LARGEST_NOISE_STEPS:g} steps: hold the handle still for one second; "
        "check the cable and the ground of the encoder",
        True,
    )


def _velocity(ticks: Mapping[str, Any], step: float) -> Observation:
    """Judges sign and size of the reported velocity; with a wrong sign damping adds energy."""
    name = "velocity"
    position, time, velocity = (np.asarray(ticks[key]) for key in ("position", "device_time", "velocity"))
    if np.ptp(position) < _LEAST_MOTION_STEPS * step or len(position) < 2 * _VELOCITY_SAMPLES:
        return Observation(
            name, f"not measured: {_TOO_LITTLE_MOTION}", None, "move the handle during the check"
        )
    displacements = position[_VELOCITY_SAMPLES:] - position[:-_VELOCITY_SAMPLES]
    integrated = np.concatenate(([0.0], np.cumsum(0.5 * (velocity[1:] + velocity[:-1]) * np.diff(time))))
    reported_motion = integrated[_VELOCITY_SAMPLES:] - integrated[:-_VELOCITY_SAMPLES]
    share = float(displacements @ reported_motion) / float(displacements @ displacements)
    return Observation(
        name,
        f"{share:.2f} times the velocity from the positions",
        abs(share - 1.0) <= _VELOCITY_TOLERANCE,
        f"the ratio of both velocities must be within {_VELOCITY_TOLERANCE:.0%} of 1; a negative ratio is a "
        "reversed sign: correct the firmware; do not enable force",
        share <= 0.0,
    )


def _transducer(position: Float1D, measured: Float1D, step: float) -> Observation:
    """Judges the sign of the transducer: the force of a pressed object grows with position."""
    name = "sign of the transducer"
    if np.ptp(position) < _LEAST_MOTION_STEPS * step or np.ptp(measured) == 0.0:
        return Observation(
            name,
            f"not measured: {_TOO_LITTLE_MOTION}, or the force was constant",
            None,
            "move the handle against an object during the check",
        )
    correlation = float(np.corrcoef(position, measured)[0, 1])
    if abs(correlation) < _LEAST_CORRELATION:
        return Observation(
            name,
            "the sign of the transducer is not clear, because the correlation of force and position is "
            f"{correlation:.2f}",
            None,
            "press a plain spring with the handle and check the device again; the correlation must be above "
            f"{_LEAST_CORRELATION:g}",
        )
    return Observation(
        name,
        f"{'correct' if correlation > 0.0 else 'reversed'}: correlation of force and position "
        f"{correlation:.2f}",
        correlation > 0.0,
        "the correlation must be positive when an object is pressed: reverse the sign of the encoder or the "
        "transducer; do not enable force",
        True,
    )


def compare(expected: DeviceProfile, measured: Mapping[str, float | None], *, name: str) -> Observation:
    """Judges if a measured device is at least as good as the expected device.

    Parameters
    ----------
    expected : DeviceProfile
        The profile, or the device of a certificate.
    measured : mapping
        ``period_s``, ``jitter_s``, ``delay_s``, ``encoder_step``, ``force_limit``,
        ``viscous_damping``, ``coulomb_friction`` of the device; None if a number was not measured.
    name : str
        Name of the observation.
    """
    period, jitter = measured["period_s"], measured["jitter_s"]
    delay, damping = measured["delay_s"], measured["viscous_damping"]
    friction = measured["coulomb_friction"]
    step, limit = measured["encoder_step"], measured["force_limit"]
    assert period is not None
    assert jitter is not None
    assert step is not None
    assert limit is not None
    longest = expected.period_s + expected.jitter_s
    wrong = []
    if period > expected.period_s * (1.0 + _CLOCK_TOLERANCE) or period + jitter > longest * (
        1.0 + _CLOCK_TOLERANCE
    ):
        wrong.append(
            f"longest period {1e6 * (period + jitter):.0f} us, expected at most {1e6 * longest:.0f} us"
        )
    if delay is not None and delay > expected.delay_s:
        wrong.append(f"delay {1e6 * delay:.0f} us, expected at most {1e6 * expected.delay_s:.0f} us")
    if step > expected.encoder_step * (1.0 + _STEP_TOLERANCE):
        wrong.append(f"encoder step {step:.4g}, expected at most {expected.encoder_step:.4g}")
    if limit < expected.force_limit * (1.0 - _STEP_TOLERANCE):
        wrong.append(f"largest force {limit:.4g}, expected at least {expected.force_limit:.4g}")
    if damping is not None and damping < expected.viscous_damping * (1.0 - _DAMPING_TOLERANCE):
        wrong.append(f"damping {damping:.3g}, expected at least {expected.viscous_damping:.3g}")
    if friction is not None and friction < expected.coulomb_friction * (1.0 - _DAMPING_TOLERANCE):
        wrong.append(f"friction {friction:.3g}, expected at least {expected.coulomb_friction:.3g}")
    measured_by_name = {"delay": delay, "damping": damping, "friction": friction}
    not_measured = [word for word, value in measured_by_name.items() if value is None]
    agreement = "agrees with the measurement" + (
        f" (not measured: {', '.join(not_measured)})" if not_measured else ""
    )
    return Observation(
        name,
        "; ".join(wrong) if wrong else f"{expected.id}: {agreement}",
        not wrong,
        "write a profile with check-device --push --write-profile, and plan the model with it",
    )

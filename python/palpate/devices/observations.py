# SPDX-License-Identifier: Apache-2.0
"""Observations of a device: stream, encoder and signs without force, and an expected profile."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from .._core.device import DeviceProfile
from .._typing import Float1D
from ..verdict import Finding, no, usable

_RATE_TOLERANCE = 0.01
_CLOCK_TOLERANCE = 0.005
_LATEST_PERIOD = 2.0
"""Largest p99.9 of the period over the requested period."""
_LOST_SHARE = 1e-3
_QUIET_STEPS = 2.0
"""Largest RMS of the encoder at rest [encoder steps]."""
_REST_S = 0.1
"""Length of a piece in which a handle may be at rest [s]."""
_MOVED_STEPS = 50.0
"""Least motion of the handle that gives reliable signs [encoder steps]."""
_VELOCITY_SAMPLES = 50
"""Number of samples over which a displacement is compared with a velocity."""
_VELOCITY_TOLERANCE = 0.25
_CLEAR = 0.3
"""Least correlation of force and position for a clear sign."""

_STEP_TOLERANCE = 0.01
_DAMPING_TOLERANCE = 0.1
"""Share by which measured damping and friction may be below the expected ones, because of noise."""

_CABLE = "try another cable, another port, or no hub"


@dataclass(frozen=True)
class Observation:
    """One examined property of a device."""

    name: str
    text: str
    right: bool | None = None
    """True: right; False: wrong; None: not judged"""
    advice: str = ""
    forbids_force: bool = False
    """True if a wrong property forbids any force"""
    detail: bool = False
    """True if a summary shows it only when it is wrong"""

    @property
    def finding(self) -> Finding | None:
        """Finding for a verdict; None if the observation is right or needs no advice."""
        if self.right or (self.right is None and not self.advice):
            return None
        return (usable if self.right is None else no)(
            f"{self.name}: {self.text}" + (f" ({self.advice})" if self.advice else "")
        )


def observe_at_rest(listened: Mapping[str, Any]) -> list[Observation]:
    """Judges a summary of `measure` with its ticks, measured without force."""
    ticks, wanted = listened["kept"], listened["wanted_rate_hz"]
    step = listened["profile"].encoder_step
    observations = [
        _rate(listened["rate_hz"], wanted),
        _period(listened["period"], wanted),
        _clock(ticks, wanted),
        _losses(listened),
        _encoder(ticks["position"], step, wanted),
        _velocity(ticks, step),
    ]
    if not listened["orderly"]:
        observations.insert(0, Observation("stream", listened["ended"], False, _CABLE, True))
    if "round_trip" in listened:
        observations.append(Observation("round trip", _percentiles(listened["round_trip"]), detail=True))
    if "malformed" in listened:
        counts = ("malformed", "stalls", "bus_errors", "timeouts", "skipped_commands")
        observations.append(
            Observation(
                "wire",
                ", ".join(f"{listened[name]} {name.replace('_', ' ')}" for name in counts),
                not (listened["malformed"] or listened["stalls"] or listened["bus_errors"]),
                _CABLE,
                detail=True,
            )
        )
    if listened["transducer"]:
        observations.append(_transducer(ticks["position"], ticks["measured"], step))
    return observations


def _percentiles(durations: Mapping[str, float]) -> str:
    names = {"p50_us": "p50", "p99_us": "p99", "p999_us": "p99.9", "max_us": "max"}
    return ", ".join(f"{name} {durations[key]:.0f} us" for key, name in names.items())


def _rate(rate_hz: float, wanted: float) -> Observation:
    return Observation(
        "rate",
        f"{rate_hz:.1f} Hz of {wanted:g} Hz",
        bool(abs(rate_hz / wanted - 1.0) <= _RATE_TOLERANCE),
        "close other programs, or give the loop real-time priority",
    )


def _period(period: Mapping[str, float], wanted: float) -> Observation:
    return Observation(
        "period",
        _percentiles(period),
        period["p999_us"] <= _LATEST_PERIOD * 1e6 / wanted,
        "give the loop real-time priority, or a quieter machine",
        detail=True,
    )


def _clock(ticks: Mapping[str, Any], wanted: float) -> Observation:
    """Judges the device's clock between consecutive samples."""
    steps = np.diff(ticks["device_time"])[np.diff(ticks["sequence"].astype(np.int64)) == 1]
    if not steps.size:
        return Observation("clock of the device", "no two samples in a row", False, _CABLE)
    mean = float(steps.mean())
    return Observation(
        "clock of the device",
        f"{1e6 * mean:.1f} us a sample, spread {1e6 * float(steps.std()):.1f} us",
        bool(abs(mean * wanted - 1.0) <= _CLOCK_TOLERANCE),
        f"it should be {1e6 / wanted:.1f} us: its firmware is not what it says",
        detail=True,
    )


def _losses(listened: Mapping[str, Any]) -> Observation:
    lost, repeated, ticks = (listened[name] for name in ("lost_samples", "repeated_samples", "ticks"))
    return Observation(
        "samples",
        f"{lost} lost and {repeated} repeated of {ticks}",
        bool(lost + repeated <= _LOST_SHARE * ticks),
        _CABLE,
    )


def _encoder(position: Float1D, step: float, rate_hz: float) -> Observation:
    """Judges the noise in the quietest piece. A parabola is subtracted, because hands drift."""
    length = max(10, round(_REST_S * rate_hz))
    pieces = position[: len(position) // length * length].reshape(-1, length)
    if not len(pieces):
        return Observation("encoder", "too few samples", None, "check for longer")
    drift = np.vander(np.linspace(-1.0, 1.0, length), 3)
    left = pieces.T - drift @ np.linalg.lstsq(drift, pieces.T, rcond=None)[0]
    noise = float(np.sqrt((left**2).mean(axis=0)).min())
    in_steps = noise / step if step > 0.0 else 0.0
    return Observation(
        "encoder",
        f"step {step:.4g}, noise at its stillest {in_steps:.2f} steps RMS, moved by {np.ptp(position):.4g}",
        in_steps <= _QUIET_STEPS,
        "hold the handle still for a second; look at the encoder's cable and ground",
        True,
    )


def _velocity(ticks: Mapping[str, Any], step: float) -> Observation:
    """Compares the velocity with the displacement: damping of a wrong sign would give energy."""
    name = "sign of the velocity"
    position, time, velocity = (np.asarray(ticks[key]) for key in ("position", "device_time", "velocity"))
    if np.ptp(position) < _MOVED_STEPS * step or len(position) < 2 * _VELOCITY_SAMPLES:
        return Observation(name, "not seen", None, "move the handle while this runs")
    ways = position[_VELOCITY_SAMPLES:] - position[:-_VELOCITY_SAMPLES]
    integrated = np.concatenate(([0.0], np.cumsum(0.5 * (velocity[1:] + velocity[:-1]) * np.diff(time))))
    told = integrated[_VELOCITY_SAMPLES:] - integrated[:-_VELOCITY_SAMPLES]
    share = float(ways @ told) / float(ways @ ways)
    return Observation(
        name,
        f"{'right' if share > 0.0 else 'flipped'}: {share:.2f} of what the positions show",
        abs(share - 1.0) <= _VELOCITY_TOLERANCE,
        "its firmware measures it wrongly; do not enable force",
        share <= 0.0,
    )


def _transducer(position: Float1D, measured: Float1D, step: float) -> Observation:
    """Judges the sign of the transducer: the force of a pressed object grows with position."""
    name = "sign of the transducer"
    if np.ptp(position) < _MOVED_STEPS * step or np.ptp(measured) == 0.0:
        return Observation(name, "not seen", None, "move the handle against an object while this runs")
    correlation = float(np.corrcoef(position, measured)[0, 1])
    if abs(correlation) < _CLEAR:
        return Observation(name, f"not clear (correlation {correlation:.2f})", None, "press a plain spring")
    return Observation(
        name,
        "right" if correlation > 0.0 else f"flipped (correlation {correlation:.2f})",
        correlation > 0.0,
        "an object pulls where it should push: mirror the encoder or the transducer; do not enable force",
        True,
    )


def compare(expected: DeviceProfile, measured: Mapping[str, float | None], *, name: str) -> Observation:
    """Judges if a device is at least as good as the expected one.

    Parameters
    ----------
    expected : DeviceProfile
        The profile, or the device of a certificate.
    measured : mapping
        ``period_s``, ``jitter_s``, ``delay_s``, ``encoder_step``, ``force_limit``,
        ``viscous_damping``, ``coulomb_friction``; None if it was not measured.
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
            f"its period gets {1e6 * (period + jitter):.0f} us long, {1e6 * longest:.0f} us are counted on"
        )
    if delay is not None and delay > expected.delay_s:
        wrong.append(f"its delay is {1e6 * delay:.0f} us, {1e6 * expected.delay_s:.0f} us are counted on")
    if not math.isclose(step, expected.encoder_step, rel_tol=_STEP_TOLERANCE):
        wrong.append(f"its encoder step is {step:.4g}, {expected.encoder_step:.4g} is counted on")
    if limit < expected.force_limit * (1.0 - _STEP_TOLERANCE):
        wrong.append(f"its largest force is {limit:.4g}, {expected.force_limit:.4g} is counted on")
    if damping is not None and damping < expected.viscous_damping * (1.0 - _DAMPING_TOLERANCE):
        wrong.append(f"its damping is {damping:.3g}, {expected.viscous_damping:.3g} is counted on")
    if friction is not None and friction < expected.coulomb_friction * (1.0 - _DAMPING_TOLERANCE):
        wrong.append(f"its friction is {friction:.3g}, {expected.coulomb_friction:.3g} is counted on")
    seen = {"delay": delay, "damping": damping, "friction": friction}
    unseen = [word for word, value in seen.items() if value is None]
    held = "holds" + (f" as far as it was seen (not: {', '.join(unseen)})" if unseen else "")
    return Observation(
        name,
        "; ".join(wrong) if wrong else f"{expected.id}: {held}",
        not wrong,
        "plan the model again with the profile that check-device --push --write-profile writes",
    )

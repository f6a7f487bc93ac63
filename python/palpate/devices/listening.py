# SPDX-License-Identifier: Apache-2.0
"""What can be heard of a device that makes no force: timing, losses, encoder, the sign of its transducer."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from .._typing import Float1D
from .finding import Finding

_RATE_TOLERANCE = 0.01
_CLOCK_TOLERANCE = 0.005
_LATEST_PERIOD = 2.0
"""p99.9 of the period, over the period asked for."""
_LOST_SHARE = 1e-3
_QUIET_STEPS = 2.0
"""RMS of the encoder at rest, in its steps."""
_REST_S = 0.1
"""Length of a piece in which a handle may be at rest [s]."""
_MOVED_STEPS = 50.0
"""A handle that moved by less, in encoder steps, tells nothing of signs."""
_VELOCITY_SAMPLES = 50
"""Over which a way is compared with a velocity."""
_VELOCITY_TOLERANCE = 0.25
_CLEAR = 0.3
"""Correlation of force and position from which on a sign is clear."""

_CABLE = "try another cable, another port, or no hub"


def findings_at_rest(listened: Mapping[str, Any]) -> list[Finding]:
    """Judge a summary of `measure` with its ticks, taken at no force."""
    ticks, wanted = listened["kept"], listened["wanted_rate_hz"]
    step = listened["profile"].encoder_step
    findings = [
        _rate(listened["rate_hz"], wanted),
        _period(listened["period"], wanted),
        _clock(ticks, wanted),
        _losses(listened),
        _encoder(ticks["position"], step, wanted),
        _velocity(ticks, step),
    ]
    if not listened["orderly"]:
        findings.insert(0, Finding("stream", listened["ended"], False, _CABLE, True))
    if "round_trip" in listened:
        findings.append(Finding("round trip", _percentiles(listened["round_trip"])))
    if "malformed" in listened:
        counts = ("malformed", "stalls", "bus_errors", "timeouts", "skipped_commands")
        findings.append(
            Finding(
                "wire",
                ", ".join(f"{listened[name]} {name.replace('_', ' ')}" for name in counts),
                not (listened["malformed"] or listened["stalls"] or listened["bus_errors"]),
                _CABLE,
            )
        )
    if listened["transducer"]:
        findings.append(_transducer(ticks["position"], ticks["measured"], step))
    return findings


def _percentiles(durations: Mapping[str, float]) -> str:
    names = {"p50_us": "p50", "p99_us": "p99", "p999_us": "p99.9", "max_us": "max"}
    return ", ".join(f"{name} {durations[key]:.0f} us" for key, name in names.items())


def _rate(rate_hz: float, wanted: float) -> Finding:
    return Finding(
        "rate",
        f"{rate_hz:.1f} Hz of {wanted:g} Hz",
        bool(abs(rate_hz / wanted - 1.0) <= _RATE_TOLERANCE),
        "close other programs, or give the loop real-time priority",
    )


def _period(period: Mapping[str, float], wanted: float) -> Finding:
    return Finding(
        "period",
        _percentiles(period),
        period["p999_us"] <= _LATEST_PERIOD * 1e6 / wanted,
        "give the loop real-time priority, or a quieter machine",
    )


def _clock(ticks: Mapping[str, Any], wanted: float) -> Finding:
    """The device's own clock between samples that follow each other."""
    steps = np.diff(ticks["device_time"])[np.diff(ticks["sequence"].astype(np.int64)) == 1]
    if not steps.size:
        return Finding("clock of the device", "no two samples in a row", False, _CABLE)
    mean = float(steps.mean())
    return Finding(
        "clock of the device",
        f"{1e6 * mean:.1f} us a sample, spread {1e6 * float(steps.std()):.1f} us",
        bool(abs(mean * wanted - 1.0) <= _CLOCK_TOLERANCE),
        f"it should be {1e6 / wanted:.1f} us: its firmware is not what it says",
    )


def _losses(listened: Mapping[str, Any]) -> Finding:
    lost, repeated, ticks = (listened[name] for name in ("lost_samples", "repeated_samples", "ticks"))
    return Finding(
        "samples",
        f"{lost} lost and {repeated} repeated of {ticks}",
        bool(lost + repeated <= _LOST_SHARE * ticks),
        _CABLE,
    )


def _encoder(position: Float1D, step: float, rate_hz: float) -> Finding:
    """Noise in the stillest piece of the recording; a parabola is taken out, since hands drift."""
    length = max(10, round(_REST_S * rate_hz))
    pieces = position[: len(position) // length * length].reshape(-1, length)
    if not len(pieces):
        return Finding("encoder", "too few samples", None, "check for longer")
    drift = np.vander(np.linspace(-1.0, 1.0, length), 3)
    left = pieces.T - drift @ np.linalg.lstsq(drift, pieces.T, rcond=None)[0]
    noise = float(np.sqrt((left**2).mean(axis=0)).min())
    in_steps = noise / step if step > 0.0 else 0.0
    return Finding(
        "encoder",
        f"step {step:.4g}, noise at its stillest {in_steps:.2f} steps RMS, moved by {np.ptp(position):.4g}",
        in_steps <= _QUIET_STEPS,
        "hold the handle still for a second; look at the encoder's cable and ground",
        True,
    )


def _velocity(ticks: Mapping[str, Any], step: float) -> Finding:
    """The velocity beside the way that it should explain: damping of a wrong sign would give energy."""
    name = "sign of the velocity"
    position, time, velocity = (np.asarray(ticks[key]) for key in ("position", "device_time", "velocity"))
    if np.ptp(position) < _MOVED_STEPS * step or len(position) < 2 * _VELOCITY_SAMPLES:
        return Finding(name, "not seen", None, "move the handle while this runs")
    ways = position[_VELOCITY_SAMPLES:] - position[:-_VELOCITY_SAMPLES]
    integrated = np.concatenate(([0.0], np.cumsum(0.5 * (velocity[1:] + velocity[:-1]) * np.diff(time))))
    told = integrated[_VELOCITY_SAMPLES:] - integrated[:-_VELOCITY_SAMPLES]
    share = float(ways @ told) / float(ways @ ways)
    return Finding(
        name,
        f"{'right' if share > 0.0 else 'flipped'}: {share:.2f} of what the positions show",
        abs(share - 1.0) <= _VELOCITY_TOLERANCE,
        "its firmware measures it wrongly; do not enable force",
        share <= 0.0,
    )


def _transducer(position: Float1D, measured: Float1D, step: float) -> Finding:
    """An object that is pressed pushes back: its force grows with position, where it changes at all."""
    name = "sign of the transducer"
    if np.ptp(position) < _MOVED_STEPS * step or np.ptp(measured) == 0.0:
        return Finding(name, "not seen", None, "move the handle against an object while this runs")
    correlation = float(np.corrcoef(position, measured)[0, 1])
    if abs(correlation) < _CLEAR:
        return Finding(name, f"not clear (correlation {correlation:.2f})", None, "press a plain spring")
    return Finding(
        name,
        "right" if correlation > 0.0 else f"flipped (correlation {correlation:.2f})",
        correlation > 0.0,
        "an object pulls where it should push: mirror the encoder or the transducer; do not enable force",
        True,
    )

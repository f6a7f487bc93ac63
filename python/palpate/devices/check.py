# SPDX-License-Identifier: Apache-2.0
"""Whether a device is fit to render force: what was measured, and a verdict to paste anywhere."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from .._typing import Float1D
from ..errors import InputError
from ..model import Model
from .measuring import Progress, measure
from .push import Push, push_response

LISTENING_SHARE = 0.7
"""Share of the check in which the device only listens; the rest is for the pushes."""

PUSH_SHARE = 0.005
"""A push, over the largest force of the device."""

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


@dataclass(frozen=True)
class Finding:
    """One thing that was looked at: right, wrong, or (None) not to be judged."""

    name: str
    told: str
    right: bool | None = None
    advice: str = ""
    forbids_force: bool = False
    """Whether no force may follow where this is wrong."""


@dataclass(frozen=True)
class Check:
    """What a check found."""

    device: str
    findings: tuple[Finding, ...]
    numbers: dict[str, float | None] = field(default_factory=dict)

    @property
    def suitable(self) -> bool:
        """Whether nothing was wrong."""
        return all(finding.right is not False for finding in self.findings)

    @property
    def may_push(self) -> bool:
        """Whether what was heard allows a small force. A machine that is late only does."""
        return not any(finding.right is False and finding.forbids_force for finding in self.findings)

    @property
    def verdict(self) -> str:
        """One sentence: OK, or what is wrong and what to try."""
        wrong = [finding for finding in self.findings if finding.right is False]
        if not wrong:
            open_ends = [
                finding.name for finding in self.findings if finding.right is None and finding.advice
            ]
            rest = f"; not looked at: {', '.join(open_ends)}" if open_ends else ""
            return f"OK: {self.device} is fit to render force{rest}"
        return f"NOT SUITABLE: {self.device}: " + "; ".join(
            f"{finding.name} is {finding.told}: {finding.advice}" for finding in wrong
        )


def check_device(
    device: str = "simulated",
    *,
    object: Model | None = None,
    transducer: bool = True,
    duration_s: float = 10.0,
    rate_hz: float = 1000.0,
    push: bool = False,
    progress: Progress | None = None,
) -> Check:
    """Measure a device for some seconds and judge it.

    First the device only listens, with no force: its rate, its lost samples, its encoder, and, while somebody
    moves the handle against an object, the sign of its transducer. With `push`, and only where signs and
    encoder are right, it then pushes the handle, which nobody may hold, a little to either side: the sign of
    its force, its delay, its inertia and damping.

    Parameters
    ----------
    device : str
        ``simulated``.
    object : Model, optional
        What is mounted on the simulated device.
    transducer : bool
        Whether the simulated device has a force transducer.
    duration_s, rate_hz : float
        How long altogether [s], and how often [Hz].
    push : bool
        Whether it may push.
    progress : callable, optional
        Is told ten times a second: ticks, position, force.
    """
    if duration_s < 2.0:
        raise InputError(f"duration_s is {duration_s:g}, must be at least 2 to see anything")
    common: dict[str, Any] = {
        "object": object,
        "transducer": transducer,
        "rate_hz": rate_hz,
        "progress": progress,
        "keep": True,
    }
    listened = measure(device, duration_s=duration_s * (LISTENING_SHARE if push else 1.0), **common)
    check = judge(listened)
    if not push or not check.may_push:
        return check
    force = PUSH_SHARE * listened["force_limit"]
    pushed = measure(device, duration_s=duration_s * (1.0 - LISTENING_SHARE), push=force, **common)
    return with_pushes(check, push_response(pushed["kept"]), listened["encoder_step"])


def judge(listened: Mapping[str, Any]) -> Check:
    """Judge what was heard of a device at no force.

    Parameters
    ----------
    listened : mapping
        A summary of :func:`measure`, with its ticks under ``kept``.
    """
    ticks, wanted = listened["kept"], listened["wanted_rate_hz"]
    findings = [
        _rate(listened["rate_hz"], wanted),
        _period(listened["period"], wanted),
        _clock(ticks, wanted),
        _losses(listened),
        _encoder(ticks["position"], listened["encoder_step"], wanted),
    ]
    if listened["transducer"]:
        findings.append(_transducer(ticks["position"], ticks["measured"], listened["encoder_step"]))
    if not listened["orderly"]:
        findings.insert(0, Finding("the stream", listened["ended"], False, "try another cable or port", True))
    numbers = {
        "rate_hz": listened["rate_hz"],
        "lost_samples": float(listened["lost_samples"]),
        "repeated_samples": float(listened["repeated_samples"]),
        "encoder_step": listened["encoder_step"],
        "force_limit": listened["force_limit"],
        **{f"period_{name}": value for name, value in listened["period"].items()},
    }
    return Check(listened["device"], tuple(findings), numbers)


def with_pushes(check: Check, push: Push, encoder_step: float) -> Check:
    """Add what pushes showed to a check."""
    findings = [*check.findings]
    steps = push.moved / encoder_step if encoder_step > 0.0 else np.inf
    if abs(steps) < _MOVED_STEPS / 10.0:
        findings.append(
            Finding("sign of the force", f"not seen: the handle moved {steps:.1f} steps", None, "let it go")
        )
    else:
        findings.append(
            Finding(
                "sign of the force",
                "right"
                if push.moved > 0.0
                else f"flipped: a push moved the handle {-steps:.0f} steps against it",
                push.moved > 0.0,
                "swap two wires of the motor or mirror its sign in the firmware; do not enable force",
            )
        )
    if push.delay_samples is not None:
        findings.append(Finding("delay", f"{push.delay_samples} samples from command to force"))
    numbers: dict[str, float | None] = {
        "delay_samples": None if push.delay_samples is None else float(push.delay_samples),
        "inertia": push.inertia,
        "viscous_damping": push.damping,
    }
    if push.inertia is not None and push.damping is not None:
        findings.append(
            Finding("mechanics", f"inertia {push.inertia:.3g} kg*m^2, damping {push.damping:.3g} N*m*s/rad")
        )
    return Check(check.device, tuple(findings), {**check.numbers, **numbers})


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
        f"p50 {period['p50_us']:.0f} us, p99 {period['p99_us']:.0f} us, p99.9 {period['p999_us']:.0f} us, "
        f"max {period['max_us']:.0f} us",
        period["p999_us"] <= _LATEST_PERIOD * 1e6 / wanted,
        "give the loop real-time priority (palpate-control --priority), or a quieter machine",
    )


def _clock(ticks: Mapping[str, Float1D], wanted: float) -> Finding:
    """The device's own clock between samples that follow each other."""
    steps = np.diff(ticks["device_time"])[np.diff(ticks["sequence"].astype(np.int64)) == 1]
    if not steps.size:
        return Finding("clock of the device", "no two samples in a row", False, "try another cable or port")
    mean = float(steps.mean())
    return Finding(
        "clock of the device",
        f"{1e6 * mean:.1f} us a sample, spread {1e6 * float(steps.std()):.1f} us",
        bool(abs(mean * wanted - 1.0) <= _CLOCK_TOLERANCE),
        f"it should be {1e6 / wanted:.1f} us: ask for the device's own rate",
    )


def _losses(listened: Mapping[str, Any]) -> Finding:
    lost, repeated, ticks = (listened[name] for name in ("lost_samples", "repeated_samples", "ticks"))
    return Finding(
        "samples",
        f"{lost} lost and {repeated} repeated of {ticks}",
        bool(lost + repeated <= _LOST_SHARE * ticks),
        "try another cable, another port, or no hub",
    )


def _encoder(position: Float1D, step: float, rate_hz: float) -> Finding:
    """Noise in the stillest piece of the recording; a straight line is taken out, since hands drift."""
    length = max(10, round(_REST_S * rate_hz))
    pieces = position[: len(position) // length * length].reshape(-1, length)
    if not len(pieces):
        return Finding("encoder", "too few samples", None, "check for longer")
    line = np.polynomial.polynomial.polyvander(np.linspace(-1.0, 1.0, length), 2)
    left = pieces.T - line @ np.linalg.lstsq(line, pieces.T, rcond=None)[0]
    noise = float(np.sqrt((left**2).mean(axis=0)).min())
    in_steps = noise / step if step > 0.0 else 0.0
    return Finding(
        "encoder",
        f"step {step:.4g}, noise at its stillest {in_steps:.2f} steps RMS, moved by {np.ptp(position):.4g}",
        in_steps <= _QUIET_STEPS,
        "hold the handle still for a second, look at its cable and ground",
        True,
    )


def _transducer(position: Float1D, measured: Float1D, step: float) -> Finding:
    """An object that is pressed pushes back: its force grows with position, where it changes at all."""
    name = "sign of the transducer"
    if np.ptp(position) < _MOVED_STEPS * step or np.ptp(measured) == 0.0:
        return Finding(name, "not seen", None, "move the handle against an object while this runs")
    correlation = float(np.corrcoef(position, measured)[0, 1])
    if abs(correlation) < 0.3:
        return Finding(name, f"not clear (correlation {correlation:.2f})", None, "press a plain spring")
    return Finding(
        name,
        "right" if correlation > 0.0 else f"flipped (correlation {correlation:.2f})",
        correlation > 0.0,
        "the object pulls where it should push: mirror the encoder or the transducer; do not enable force",
        True,
    )

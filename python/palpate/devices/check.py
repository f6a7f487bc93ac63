# SPDX-License-Identifier: Apache-2.0
"""Whether a device is fit to render force: what was measured, and a verdict to paste anywhere."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from .._core import DeviceProfile as CoreProfile
from ..errors import InputError
from ..model import Model
from ..planning import DeviceProfile
from .finding import Finding
from .fitting import compare, profile_of
from .listening import findings_at_rest
from .measuring import Progress, measure
from .push import Push, push_response

LISTENING_SHARE = 0.7
"""Share of the check in which the device only listens; the rest is for the pushes."""

PUSH_SHARE = 0.005
"""A push, over the largest force of the device."""

_SHORTEST_S = 2.0
_DELAY_TOLERANCE = 0.25
"""Of a sample: what the clocks of host and device leave open."""
_SEEN_STEPS = 5.0
"""A push that moved the handle by less, in encoder steps, tells nothing."""
_SURE = 3.0
"""Standard errors that a push has to stand out by."""
_SIGN = "sign of the force"


@dataclass(frozen=True)
class Check:
    """What a check found."""

    device: str
    findings: tuple[Finding, ...]
    numbers: Mapping[str, float | None]
    base: CoreProfile
    """What the device says of itself, its mechanics apart."""

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
        if wrong:
            told = "; ".join(f"{finding.name}: {finding.told} ({finding.advice})" for finding in wrong)
            return f"NOT SUITABLE: {self.device}: {told}"
        unseen = [finding.name for finding in self.findings if finding.right is None and finding.advice]
        rest = f"; not seen: {', '.join(unseen)}" if unseen else ""
        return f"OK: {self.device} is fit to render force{rest}"

    def profile(self) -> DeviceProfile:
        """The device as it was measured; InputError where its mechanics were not, or a sign is wrong.

        What a certificate counts on is thereby a device whose motor was seen to push the right way.
        """
        if not self.may_push:
            raise InputError(f"there is no profile of a device that must not make force; {self.verdict}")
        return profile_of(self.base, self.numbers)


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
    wait_s: float | None = None,
    progress: Progress | None = None,
) -> Check:
    """Measure a device for some seconds and judge it.

    First the device only listens, disabled: its rate, its lost samples, its encoder, and, while somebody
    moves the handle against an object, the signs of its velocity and transducer against its positions. The
    sign of its motor shows in nothing that a disabled device says. With `push`, and only where the other
    signs and the encoder are right, it is therefore enabled and pushes the handle, which nobody need hold, a
    little to either side: half a percent of its force shows that sign, its delay, its inertia and damping.
    Where a sign is wrong there is no profile, and so nothing is certified for the device.

    Parameters
    ----------
    device : str
        ``simulated``, or ``usb[:SERIAL]``.
    object : Model, optional
        What is mounted on the simulated device.
    transducer : bool
        Whether the simulated device has a force transducer.
    duration_s, rate_hz : float
        How long altogether [s], and how often [Hz]; a USB device has its own rate.
    push : bool
        Whether it may push.
    profile : DeviceProfile, optional
        What the device is thought to be.
    model : Model, optional
        One with a certificate: whether that holds on this device.
    wait_s : float, optional
        How long a packet of a USB device is waited for [s].
    progress : callable, optional
        Is told ten times a second: ticks, position, force, samples lost.

    Raises
    ------
    InputError
        The device cannot be used, or there is nothing to compare with: with the reason.
    """
    if duration_s < _SHORTEST_S:
        raise InputError(f"duration_s is {duration_s:g}, must be at least {_SHORTEST_S:g} to see anything")
    counted_on = _counted_on(profile, model)
    common: dict[str, Any] = {
        "object": object,
        "transducer": transducer,
        "rate_hz": rate_hz,
        "wait_s": wait_s,
        "progress": progress,
        "keep": True,
        "lowest_rate_share": 0.0,  # a low rate is a finding, and no reason to stop
    }
    listened = measure(device, duration_s=duration_s * (LISTENING_SHARE if push else 1.0), **common)
    check = judge(listened)
    if not push:
        check = _with(check, Finding(_SIGN, "not looked at", None, "let it push a free handle: --push"))
    elif not check.may_push:
        check = _with(check, Finding(_SIGN, "not looked at: what was heard forbids any force"))
    else:
        force = PUSH_SHARE * check.base.force_limit
        pushed = measure(device, duration_s=duration_s * (1.0 - LISTENING_SHARE), push=force, **common)
        check = with_pushes(check, push_response(pushed["kept"]))
    compared = tuple(compare(other, check.numbers, name=name) for name, other in counted_on.items())
    return _with(check, *compared)


def _with(check: Check, *findings: Finding) -> Check:
    return replace(check, findings=(*check.findings, *findings))


def judge(listened: Mapping[str, Any]) -> Check:
    """Judge what was heard of a device at no force.

    Parameters
    ----------
    listened : mapping
        A summary of :func:`measure`, with its ticks under ``kept`` and the device's word under ``profile``.
    """
    base = listened["profile"]
    ticks = listened["kept"]
    steps = np.diff(ticks["device_time"])[np.diff(ticks["sequence"].astype(np.int64)) == 1]
    period = float(steps.mean()) if steps.size else base.period_s
    numbers: dict[str, float | None] = {
        "rate_hz": listened["rate_hz"],
        "period_s": period,
        "jitter_s": float(steps.max()) - period if steps.size else 0.0,
        "lost_samples": float(listened["lost_samples"]),
        "repeated_samples": float(listened["repeated_samples"]),
        "encoder_step": base.encoder_step,
        "force_limit": base.force_limit,
        "delay_samples": None,
        "inertia": None,
        "viscous_damping": None,
        **{f"period_{name}": value for name, value in listened["period"].items()},
    }
    findings = findings_at_rest(listened)
    if "round_trip" in listened:
        delay_us = listened["delay"]
        samples = max(0, math.ceil(1e-6 * delay_us["p999_us"] / base.period_s - _DELAY_TOLERANCE))
        numbers["delay_samples"] = float(samples)
        for told in ("round_trip", "delay"):
            numbers.update({f"{told}_{name}": value for name, value in listened[told].items()})
        findings.append(
            Finding(
                "delay",
                f"{samples} samples from a sample to its force: p50 {delay_us['p50_us']:.0f} us, "
                f"p99.9 {delay_us['p999_us']:.0f} us",
            )
        )
    return Check(listened["device"], tuple(findings), numbers, base)


def with_pushes(check: Check, push: Push) -> Check:
    """Add what pushes showed to a check."""
    findings = [*check.findings, _sign(push, check.base.encoder_step)]
    numbers = {**check.numbers, "inertia": push.inertia, "viscous_damping": push.damping}
    if push.delay_samples is not None and numbers["delay_samples"] is None:
        numbers["delay_samples"] = float(push.delay_samples)
        findings.append(Finding("delay", f"{push.delay_samples} samples from a sample to its force"))
    if push.inertia is not None and push.damping is not None:
        turns = check.base.position_unit == "rad"
        units = ("kg*m^2", "N*m*s/rad") if turns else ("kg", "N*s/m")
        findings.append(
            Finding(
                "mechanics", f"inertia {push.inertia:.3g} {units[0]}, damping {push.damping:.3g} {units[1]}"
            )
        )
    return replace(check, findings=tuple(findings), numbers=numbers)


def _sign(push: Push, step: float) -> Finding:
    """Whether pushes moved the handle the way that they should."""
    told = f"a push moved the handle by {push.moved:.3g}, {push.unsure:.1g} unsure"
    if abs(push.moved) < max(_SEEN_STEPS * step, _SURE * push.unsure) or push.moved == 0.0:
        return Finding(_SIGN, f"not seen: {told}", None, "let go of the handle")
    if push.moved < 0.0:
        told = f"flipped: {told} the wrong way"
    elif not push.obeyed:
        told = "flipped: the device says that it makes the opposite of what it is told to make"
    else:
        told = f"right: {told}"
    return Finding(
        _SIGN,
        told,
        push.moved > 0.0 and push.obeyed,
        "swap two wires of the motor or mirror its sign in the firmware; do not enable force",
        True,
    )


def _counted_on(profile: DeviceProfile | None, model: Model | None) -> dict[str, CoreProfile]:
    """What the device is compared with, by the name of the finding."""
    devices: dict[str, CoreProfile] = {} if profile is None else {"profile": profile}
    if model is not None:
        if model.certificate is None:
            raise InputError("the model has no certificate; make one with `palpate plan`")
        devices["certificate"] = CoreProfile(**model.certificate["device"])
    return devices

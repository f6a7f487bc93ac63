# SPDX-License-Identifier: Apache-2.0
"""Check of a device: measurements, findings and the verdict whether it is fit to render force."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from .._core.device import DeviceProfile as CoreProfile
from ..errors import InputError
from ..model import Model
from ..planning import DeviceProfile
from ..verdict import Verdict, no, usable
from .finding import Finding
from .fitting import compare, profile_of
from .listening import findings_at_rest
from .measuring import Progress, measure
from .mechanics import Mechanics
from .push import Push, push_response

LISTENING_SHARE = 0.7
"""Share of the check in which the device only listens; the rest is for the pushes."""

PUSH_SHARE = 0.005
"""A push, over the largest force of the device."""

_STATE_FRICTION = (
    "let go of the handle and check for 10 s; if the friction is above the pushes, state it with "
    "--coulomb-friction"
)
_NO_FRICTION = "without friction no certificate of direct rendering holds for an encoder with steps"
_SHORTEST_S = 2.0
_DELAY_MARGIN = 0.05
"""Added to the measured delay, because the clocks of host and device drift [periods]"""
_SEEN_STEPS = 5.0
"""A push that moved the handle by less, in encoder steps, tells nothing."""
_SURE = 3.0
"""Standard errors that a push has to stand out by."""
_SIGN = "sign of the force"
_SIMULATED_FRICTION = 0.002
"""Coulomb friction of the simulated device, a bearing's, over its largest force."""


@dataclass(frozen=True)
class Check:
    """What a check found."""

    device: str
    findings: tuple[Finding, ...]
    numbers: Mapping[str, float | None]
    base: CoreProfile
    """What the device says of itself, its mechanics apart."""
    coulomb_friction: float | None = None
    """Friction that was stated by the user [N or N*m]"""

    @property
    def suitable(self) -> bool:
        """Whether nothing was wrong."""
        return all(finding.right is not False for finding in self.findings)

    @property
    def may_push(self) -> bool:
        """Whether what was heard allows a small force. A machine that is late only does."""
        return not any(finding.right is False and finding.forbids_force for finding in self.findings)

    @property
    def verdict(self) -> Verdict:
        """The verdict on the device: no if a finding is wrong, usable if something was not seen."""
        return Verdict(
            tuple(
                (usable if finding.right is None else no)(
                    f"{finding.name}: {finding.told}" + (f" ({finding.advice})" if finding.advice else "")
                )
                for finding in self.findings
                if finding.right is False or (finding.right is None and finding.advice)
            )
        )

    def profile(self) -> DeviceProfile:
        """The device as it was measured.

        Raises
        ------
        InputError
            Its mechanics were not measured, or a sign is wrong.
        """
        if not self.may_push:
            raise InputError("there is no profile of a device that must not make force")
        return profile_of(self.base, self.numbers)

    def profile_notes(self) -> tuple[str, ...]:
        """For each number of the profile whether it was measured, stated or said by the device."""
        stated = self.coulomb_friction is not None
        friction = "stated, not measured" if stated else "measured, less its uncertainty: a lower bound"
        delay = "measured" if self.numbers["delay_s"] is not None else "not measured; assumed to be 0"
        return (
            f"{self.device}, measured by palpate check-device.",
            "inertia, viscous_damping: measured by pushes. period_s: said by the device. jitter_s: measured.",
            f"coulomb_friction: {friction}.",
            f"delay_s: {delay}.",
            "encoder_step, force_step, force_limit: said by the device, not measured.",
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
    coulomb_friction : float, optional
        Friction of the device, where it is known and cannot be measured [N or N*m]; a lower bound.
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
    if coulomb_friction is not None and not 0.0 <= coulomb_friction < math.inf:
        raise InputError(f"coulomb_friction is {coulomb_friction:g}, must be a finite number >= 0")
    counted_on = _counted_on(profile, model)
    common: dict[str, Any] = {
        "object": object,
        "transducer": transducer,
        "rate_hz": rate_hz,
        "wait_s": wait_s,
        "progress": progress,
        "keep": True,
        "lowest_rate_share": 0.0,  # a low rate is a finding, and no reason to stop
        "friction_share": _SIMULATED_FRICTION,
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
        push_seen = push_response(pushed["kept"], check.base.encoder_step, coulomb_friction)
        check = with_pushes(replace(check, coulomb_friction=coulomb_friction), push_seen)
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
        "delay_s": None,
        "inertia": None,
        "viscous_damping": None,
        "coulomb_friction": None,
        "coulomb_friction_at_least": None,
        **{f"period_{name}": value for name, value in listened["period"].items()},
    }
    findings = findings_at_rest(listened)
    if "round_trip" in listened:
        delay_us = listened["delay"]
        delay_s = 1e-6 * delay_us["p999_us"] + _DELAY_MARGIN * base.period_s
        numbers["delay_s"] = delay_s
        for told in ("round_trip", "delay"):
            numbers.update({f"{told}_{name}": value for name, value in listened[told].items()})
        findings.append(
            Finding(
                "delay",
                f"{1e6 * delay_s:.0f} us from a sample to its force: p50 "
                f"{delay_us['p50_us']:.0f} us, p99.9 {delay_us['p999_us']:.0f} us",
            )
        )
    return Check(listened["device"], tuple(findings), numbers, base)


def with_pushes(check: Check, push: Push) -> Check:
    """Add what pushes showed to a check."""
    findings = [*check.findings, _sign(push, check.base.encoder_step)]
    numbers = dict(check.numbers)
    if push.delay_samples is not None and numbers["delay_s"] is None:
        numbers["delay_s"] = push.delay_samples * check.base.period_s
        findings.append(Finding("delay", f"{push.delay_samples} samples from a sample to its force"))
    mechanics = push.mechanics
    if mechanics is None:
        findings.append(Finding("friction", f"not measured: {push.unseen}", None, _STATE_FRICTION))
    else:
        numbers["inertia"], numbers["viscous_damping"] = mechanics.inertia, mechanics.damping
        numbers["coulomb_friction"] = mechanics.friction
        numbers["coulomb_friction_at_least"] = mechanics.friction_at_least
        findings += _mechanics(mechanics, check)
    return replace(check, findings=tuple(findings), numbers=numbers)


def _mechanics(mechanics: Mechanics, check: Check) -> list[Finding]:
    turns = check.base.position_unit == "rad"
    units = ("kg*m^2", "N*m*s/rad", "N*m") if turns else ("kg", "N*s/m", "N")
    least = mechanics.friction_at_least
    found = [
        Finding(
            "mechanics",
            f"inertia {mechanics.inertia:.3g} {units[0]}, damping {mechanics.damping:.3g} {units[1]}",
        )
    ]
    if check.coulomb_friction is not None:
        found.append(Finding("friction", f"{least:.3g} {units[2]}, stated and not measured"))
    elif least > 0.0:
        told = f"{mechanics.friction:.3g} {units[2]}, at least {least:.3g}"
        found.append(Finding("friction", told))
    else:
        told = f"none was found, {3.0 * mechanics.friction_unsure:.1g} {units[2]} at most"
        found.append(Finding("friction", told, None, _NO_FRICTION))
    return found


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

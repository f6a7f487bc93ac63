# SPDX-License-Identifier: Apache-2.0
"""A device as it was measured, beside the one that is counted on: a profile, or that of a certificate."""

from __future__ import annotations

import math
from collections.abc import Mapping

from .._core.device import DeviceProfile as CoreProfile
from ..errors import InputError
from ..planning import DeviceProfile
from .finding import Finding

_CLOCK_TOLERANCE = 0.005
_STEP_TOLERANCE = 0.01
_DAMPING_TOLERANCE = 0.1
"""Measured damping and friction may be below those counted on by this share: noise is in them."""

Numbers = Mapping[str, float | None]


def compare(expected: CoreProfile, measured: Numbers, *, name: str) -> Finding:
    """Judge whether a device is at least as good as the one that is counted on.

    Parameters
    ----------
    expected : DeviceProfile
        The profile, or the device of a certificate.
    measured : mapping
        ``period_s``, ``jitter_s``, ``delay_s``, ``encoder_step``, ``force_limit``,
        ``viscous_damping``, ``coulomb_friction``; None where it was not measured.
    name : str
        Of the finding.
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
    return Finding(
        name,
        "; ".join(wrong) if wrong else f"{expected.id}: {held}",
        not wrong,
        "plan the model again with the profile that check-device --push --write-profile writes",
    )


def profile_of(base: CoreProfile, measured: Numbers) -> DeviceProfile:
    """The profile of a device as it was measured.

    Friction is a lower bound, which is what a certificate may count on; encoder, force step and force limit
    are what the device says.

    Raises
    ------
    InputError
        The mechanics were not measured.
    """
    inertia, damping = measured["inertia"], measured["viscous_damping"]
    friction = measured["coulomb_friction_at_least"]
    if inertia is None or damping is None or friction is None:
        raise InputError(
            "a profile needs inertia, damping and friction: push a handle that nobody holds and nothing is "
            "mounted on, for 10 s; if the friction is above the pushes, state it with --coulomb-friction (in "
            "Python coulomb_friction)"
        )
    period, jitter, delay = measured["period_s"], measured["jitter_s"], measured["delay_s"]
    assert period is not None
    assert jitter is not None
    return DeviceProfile(
        id=base.id,
        position_unit=base.position_unit,
        period_s=base.period_s,
        jitter_s=max(0.0, period + jitter - base.period_s),
        inertia=inertia,
        viscous_damping=damping,
        coulomb_friction=friction,
        encoder_step=base.encoder_step,
        force_step=base.force_step,
        delay_s=delay or 0.0,
        force_limit=base.force_limit,
    )

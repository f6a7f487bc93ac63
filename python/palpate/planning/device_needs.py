# SPDX-License-Identifier: Apache-2.0
"""Finds the least device properties with which a model is rendered as it was identified."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from .._core.device import DeviceProfile
from .._core.model import ForceModel
from .candidates import CANDIDATES, Refusal, Task
from .limited_network import sliding_bounds
from .static_error import static_force_error

_AMPLE = (40.0, 14.0, 8.0)
"""Doublings after which a property is ample; too many can make an explicit structure diverge [-]"""

_BISECTIONS = 15
"""Bisections of the doublings, for the least sufficient value within 0.1 % [-]"""

Fits = Callable[[DeviceProfile], bool]


@dataclass(frozen=True)
class _Property:
    """A property of a device that can be improved."""

    improved: Callable[[DeviceProfile, float], DeviceProfile]
    """The device with this property better by a factor, rounded to three digits"""
    text: Callable[[DeviceProfile], str]
    """The requirement that an improved device just meets, in words"""


def needed(task: Task, accept_force_error: float, *, certified: bool) -> str:
    """The device property that a model needs, for instance "needs b >= 6.07 N*s/m (has 0.005)".

    Empty where no property helps.

    Parameters
    ----------
    task : Task
        The model as it was identified, the device that is too weak, and the caller's requirements.
    accept_force_error : float
        Largest force error that is accepted [share of the range].
    certified : bool
        True if a plan that is only stable is not enough.
    """
    names = _candidates(task)
    device = task.device
    task = replace(task, may_limit=False, predict=task.predict or 0)

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

    def least(*properties: _Property) -> str:
        found = _improved(device, properties, fits)
        return "" if found is None else " and ".join(each.text(found) for each in properties)

    damping, friction, rate, encoder = _properties(task.model, device)
    for short, otherwise in (
        ((damping,), (rate,)),
        ((friction,), (encoder,)),
        ((damping, friction), (rate, encoder)),
    ):
        if need := least(*short):
            other = least(*otherwise)
            return f"needs {need}" + (f", or {other}" if other else "")
    if task.coupling_stiffness is not None:
        return f"needs another coupling stiffness than {task.coupling_stiffness:.4g}"
    return ""


def _candidates(task: Task) -> tuple[str, ...]:
    """The candidate structures that render the identified model as the caller requires."""
    if task.dynamic:
        return tuple(CANDIDATES)  # those without mass do not apply
    if task.coupling:
        return ("massless", "explicit") if task.model.hysteretic else ("massless",)
    return ("direct",)


def _properties(
    model: ForceModel, device: DeviceProfile
) -> tuple[_Property, _Property, _Property, _Property]:
    """Damping, friction, rate and encoder."""
    force, position = ("N*m", "rad") if device.position_unit == "rad" else ("N", "m")
    steepest = max(sliding_bounds(model).steepest, 1e-9)
    # A property that is 0 cannot be doubled: begin far below the need of the model.
    b = device.viscous_damping or 1e-3 * device.longest_period_s * steepest
    f_c = device.coulomb_friction or 1e-3 * (device.encoder_step * steepest + device.force_step) or 1e-9

    def faster(on: DeviceProfile, factor: float) -> DeviceProfile:
        rate = _rounded(math.ceil, factor / device.period_s)
        jitter_s = device.jitter_s / (rate * device.period_s)
        delay_s = device.delay_s / (rate * device.period_s)
        return _changed(on, period_s=1.0 / rate, jitter_s=jitter_s, delay_s=delay_s)

    shorter = [name for name, value in (("jitter", device.jitter_s), ("delay", device.delay_s)) if value]
    in_proportion = f" with {' and '.join(shorter)} in proportion" if shorter else ""
    return (
        _Property(
            lambda on, factor: _changed(on, viscous_damping=_rounded(math.ceil, factor * b)),
            lambda on: (
                f"b >= {on.viscous_damping:.3g} {force}*s/{position} (has {device.viscous_damping:.3g})"
            ),
        ),
        _Property(
            lambda on, factor: _changed(on, coulomb_friction=_rounded(math.ceil, factor * f_c)),
            lambda on: f"f_c >= {on.coulomb_friction:.3g} {force} (has {device.coulomb_friction:.3g})",
        ),
        _Property(faster, lambda on: f"a rate of {1.0 / on.period_s:.3g} Hz{in_proportion}"),
        _Property(
            lambda on, factor: _changed(on, encoder_step=_rounded(math.floor, device.encoder_step / factor)),
            lambda on: f"an encoder step of {on.encoder_step:.3g} {position}",
        ),
    )


def _improved(device: DeviceProfile, properties: Sequence[_Property], fits: Fits) -> DeviceProfile | None:
    """The device with the least improvement of these properties that fits; None where no improvement does."""

    def after(doublings: Sequence[float]) -> DeviceProfile:
        changed = device
        for each, number in zip(properties, doublings, strict=True):
            changed = each.improved(changed, 2.0**number)
        return changed

    found = next(
        (ample for ample in ([number] * len(properties) for number in _AMPLE) if fits(after(ample))), None
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


def _changed(device: DeviceProfile, **fields: float) -> DeviceProfile:
    return DeviceProfile(**device.to_dict() | fields)


def _rounded(towards: Callable[[float], int], value: float) -> float:
    """Three digits, so that the printed number is enough."""
    if value == 0.0:
        return 0.0
    unit = 10.0 ** (math.floor(math.log10(value)) - 2)
    return float(f"{towards(value / unit) * unit:.3g}")

# SPDX-License-Identifier: Apache-2.0
"""Render a plan on a simulated device, and say how far the rendered force is from the model's."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from .. import _core
from .._core import DeviceProfile, Hand, Scheme, Status
from .._typing import Float1D
from ..arguments import instance_of, real_of
from ..errors import InputError
from ..recording import Recording
from ..recording.units import COLUMN_SUFFIX
from ..verdict import Finding, Verdict, no, usable
from .plan import Plan

START = "handle_start"
END = "handle_end"
"""Stems of the columns with the true handle position when the encoder was read, and when the force ended."""

_GRID = 1001
"""Positions at which the force range is looked for."""
_TOLERATED_ERROR = 0.02
"""Force error over force range up to which nothing is said."""
_TOLERATED_TICKS = 0.01
"""Share of ticks that may be extrapolated, clipped or not solved."""
_SMALLEST_DOMAIN_SHARE = 0.1
"""Of the model's domain that the handle should cover."""

_NAMES = {int(value): name for name, value in Status.__members__.items()}


def simulate(
    plan: Plan,
    device: DeviceProfile,
    hand: Hand,
    duration: float,
    progress: Callable[[int], None] | None = None,
) -> Recording:
    """Render a plan in closed loop, in virtual time: device, hand and controller are simulated.

    The handle starts at rest at 0, or at the end of the model's domain that is nearest to it.

    Parameters
    ----------
    plan : Plan
        What is rendered.
    device : DeviceProfile
        The simulated device.
    hand : Hand
        The simulated hand that moves it.
    duration : float
        Simulated time [s]; at most 3 600 000 periods of the device.
    progress : callable, optional
        Called with the number of ticks about ten times a second.

    Returns
    -------
    Recording
        Position as the encoder reads it and force as the device applies it, with time, so that what was
        rendered can be identified and verified like anything else. Further columns: the handle's true
        position at the start and the end of each tick, the environment's position, the commanded force, the
        number of evaluations, the status as a word, and whether the model was extrapolated (1) or not (0).

    Raises
    ------
    InputError
        The structure is sure to diverge on this device, or a number is out of range.
    """
    instance_of("plan", plan, Plan, "make one with palpate.plan")
    instance_of("device", device, DeviceProfile, "make one with palpate.DeviceProfile")
    instance_of("hand", hand, Hand, "make one with palpate.Hand")
    duration = real_of("duration", duration)
    plan.check_for(device)
    start = float(np.clip(0.0, plan.model.lower[0], plan.model.upper[0]))
    try:
        trace = _core.simulate(
            plan.rendered, plan.scheme, device, hand, duration, start_position=start, progress=progress
        )
    except InputError:
        raise
    except ValueError as error:
        raise InputError(str(error)) from None
    recording = Recording.from_arrays(
        trace["position"],
        trace["applied"],
        trace["time_s"],
        units=plan.model.units,
        metadata={
            "simulated": "yes: device, hand and controller; nothing here was measured",
            "structure": describe(plan.scheme),
            "device": repr(device),
            "hand": repr(hand),
        },
    )
    position, force = (_suffix(plan.model.units[role]) for role in ("position", "force"))
    return replace(
        recording,
        columns={
            f"{START}{position}": trace["handle_start"],
            f"{END}{position}": trace["handle_end"],
            f"environment_position{position}": trace["environment_position"],
            f"commanded{force}": trace["force"],
            "evaluations": trace["evaluations"].astype(np.float64),
            "extrapolated": np.asarray(trace["extrapolated"], dtype=np.float64),
            "status": np.array([_NAMES[value] for value in trace["status"]], dtype=object),
        },
    )


@dataclass(frozen=True)
class ForceError:
    """RMS of rendered minus identified force at the handle, over all ticks [N*m or N]."""

    end: float
    """at the end of the tick that holds the force: what is felt, the hold included"""
    instant: float
    """at its sampling instant: what the structure and the encoder cost"""


def force_error(plan: Plan, rendered: Recording) -> ForceError:
    """How far a simulated rendering is from the identified model, felt at the handle's true position.

    Parameters
    ----------
    plan : Plan
        What was rendered.
    rendered : Recording
        From :func:`simulate`.
    """
    suffix = _suffix(plan.model.units["position"])
    start, end = rendered.columns[f"{START}{suffix}"], rendered.columns[f"{END}{suffix}"]
    period = rendered.sample_period
    if period is None:
        raise InputError("a rendering of one tick has no force error; simulate a longer time")
    at_end = force_at(plan, np.concatenate([start[:1], end]), period)[1:]
    at_start = force_at(plan, start, period)
    return ForceError(end=_rms(rendered.force - at_end), instant=_rms(rendered.force - at_start))


def force_range(plan: Plan) -> float:
    """Largest less smallest force of the model over its domain [N*m or N], both strokes included."""
    lower, upper = plan.model.domain
    if plan.model.of_velocity:
        axes = [np.linspace(low, high, _GRID) for low, high in zip(lower, upper, strict=True)]
        force = plan.model.predict(np.stack([axis.ravel() for axis in np.meshgrid(*axes)], axis=1))
    else:
        sweep = np.linspace(lower[0], upper[0], _GRID)
        force = force_at(plan, np.concatenate([sweep, sweep[::-1]]))
    return float(np.ptp(force))


def judge(plan: Plan, rendered: Recording, error: ForceError) -> Verdict:
    """Judge a simulated rendering by its force error, its motion and its ticks.

    Parameters
    ----------
    plan : Plan
        What was rendered.
    rendered : Recording
        From :func:`simulate`.
    error : ForceError
        From :func:`force_error`.
    """
    status = Counter(rendered.columns["status"])
    ticks = len(rendered)
    if failed := status["NonFinite"]:
        return Verdict((no(f"the rendering ran away: {failed} of {ticks} ticks had no finite force"),))
    lower, upper = float(rendered.position.min()), float(rendered.position.max())
    if not rendered.force.any():
        still = no(f"every force was zero: the handle stayed between {lower:.4g} and {upper:.4g}")
        return Verdict((still,))
    domain = float(plan.model.upper[0]) - float(plan.model.lower[0])
    covered = (upper - lower) / domain
    findings: list[Finding] = []
    if lower == upper:
        findings.append(no("the handle did not move: simulate a longer time, or a stiffer hand"))
    elif covered < _SMALLEST_DOMAIN_SHARE:
        findings.append(
            usable(f"the handle covered {100 * covered:.3g} % of the model's domain: simulate a longer time")
        )
    span = force_range(plan)
    share = error.end / span if span > 0 else 0.0
    if share > _TOLERATED_ERROR:
        level = no if share > plan.accept_force_error else usable
        findings.append(
            level(
                f"the force error is {100 * share:.3g} % of the object's force range: "
                "choose a structure with palpate plan, or a stiffer coupling"
            )
        )
    outside = int(rendered.columns["extrapolated"].sum())
    unsolved = status["MaxIterations"] + status["NotUnique"]
    for count, sentence in (
        (outside, "lay outside the model's data: identify the model over a larger range"),
        (unsolved, "did not solve the load line: choose the structure with palpate plan"),
        (status["Limited"], "clipped the force to the device's limit: a stronger device is needed"),
    ):
        if count > _TOLERATED_TICKS * ticks:
            findings.append(usable(f"{count} of {ticks} ticks ({100 * count / ticks:.3g} %) {sentence}"))
    return Verdict(tuple(findings))


def force_at(plan: Plan, position: Float1D, period_s: float | None = None) -> Float1D:
    """The identified force along a motion, without structure or coupling, play state and velocity included.

    Parameters
    ----------
    plan : Plan
        Model and play radius.
    position : (n,) array
        A motion, in order [rad or m].
    period_s : float, optional
        Time from each position to the next [s]; only a force of velocity needs it.

    Returns
    -------
    (n,) array
        Force [N*m or N].
    """
    if period_s is None and plan.model.of_velocity:
        raise InputError("the force depends on the velocity: period_s must be given")
    exact = Scheme(structure="direct", play_radius=plan.scheme.play_radius)
    force: Float1D = _core.motion_driven(plan.model, exact, position, period_s or 1.0)["force"]
    return force


def describe(scheme: Scheme) -> str:
    """A scheme in the words of the comparison: "implicit, m = 0.001, B_o = 0.5"."""
    words = [scheme.structure]
    if scheme.compensated:
        words.append("compensated")
    if scheme.structure in ("implicit", "explicit"):
        words += [f"m = {scheme.mass:.3g}", f"B_o = {scheme.damping:.3g}"]
    return ", ".join(words)


def _suffix(unit: str) -> str:
    return f"_{COLUMN_SUFFIX[unit]}" if unit else ""


def _rms(values: Float1D) -> float:
    return float(np.sqrt(np.mean(np.square(values))))

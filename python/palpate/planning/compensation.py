# SPDX-License-Identifier: Apache-2.0
"""Compensation of the cogging of a motor: its negative force, with the largest scale that is proved."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from .._core.device import DeviceProfile
from .._core.device import on_device as timed_on_device
from .._core.stability import passive_shift
from .._typing import Float1D
from ..arguments import instance_of, real_of
from ..errors import InputError
from ..model import Model
from ..model.model import COMPENSATION_KEY
from ..recording import Recording
from ..verification.prediction import predict
from .candidates import CANDIDATES, Candidate, Refusal, Task
from .device_profile import find_profile, require_unit
from .plan import SAMPLES, Plan, require_force, with_network
from .search import needed

_STRUCTURES = ("direct", "tangent")
"""Structures that render the negative of a force without a change of its shape, the simplest first"""

_STEP = 1e-3
"""Step of the scale [-]"""


def compensate(
    model: Model, device: DeviceProfile | str | os.PathLike[str], *, on_device: float | None = None
) -> Plan:
    """Plans the negative of the cogging of a motor, multiplied by the largest scale that is proved.

    The motor itself is a passive object with the force f of the model. The rendered force -s f cancels the
    share s of it. A hand cannot take energy out if the rendering of -s f is certified for itself, because
    the cogging of the motor only adds stored energy. Friction is not compensated: a force in the direction
    of the motion gives energy. The mean of f over a period is left out for the same reason.

    Parameters
    ----------
    model : Model
        Cogging of a motor, identified with a period.
    device : DeviceProfile, str or path
        As for :func:`palpate.plan`.
    on_device : float, optional
        Rate at which the motor controller computes the compensation [Hz]. Default: the host computes it.

    Returns
    -------
    Plan
        Its model is the compensation -s f, and ``plan.scale`` is s, at most 1. The verdict is "no" if no
        scale is proved.

    Raises
    ------
    InputError
        An argument has a wrong type or value, or the model has no period or more than one input.
    """
    instance_of("model", model, Model, "make one with palpate.identify or palpate.load_model")
    device = find_profile(device)
    if on_device is not None:
        device = timed_on_device(device, real_of("on_device", on_device))
    require_unit(device, model)
    require_force(model)
    if device.admittance is not None:
        raise InputError(f"{device.id} is an admittance display: it has no cogging that a hand feels")
    if COMPENSATION_KEY in model.notes:
        raise InputError("the model is a compensation already: give the identified model of the cogging")
    if model.period is None or model.dimension != 1 or not model.of_position:
        raise InputError(
            "the model has no period, so it is not the cogging of a motor: identify it with --period 360deg"
        )

    def task_of(scale: float) -> Task:
        # Without prediction, so that the scale also holds for a table in the controller
        rendered = with_network(_compensation(model, device, scale))
        return Task(rendered, device, may_limit=False, predict=0)

    found = {name: _largest(task_of, name) for name in _STRUCTURES if CANDIDATES[name].applies(task_of(1.0))}
    scale, chosen = max(found.values(), key=lambda each: each[0])
    refused = tuple(
        f"{name}: {candidate.certificate.reason if isinstance(candidate, Candidate) else candidate.reason}"
        for name, (share, candidate) in found.items()
        if share == 0.0
    )
    needs = "" if scale == 1.0 else needed(task_of(1.0), 0.0, certified=True)
    if not isinstance(chosen, Candidate):
        raise InputError(f"no scale of the compensation can be rendered: {'; '.join(refused)}")
    compensation = _compensation(model, device, scale or 1.0)
    return Plan(compensation, chosen.scheme, chosen.certificate, refused, needs=needs)


def _largest(task_of: Callable[[float], Task], structure: str) -> tuple[float, Candidate | Refusal]:
    """Returns the largest scale that is certified with a structure, with its candidate; a scale of 0 with the
    candidate or refusal of the whole compensation."""

    def proposed(scale: float) -> Candidate | Refusal:
        return CANDIDATES[structure].propose(task_of(scale))

    def holds(outcome: Candidate | Refusal) -> bool:
        return isinstance(outcome, Candidate) and outcome.certificate.certified

    whole = proposed(1.0)
    if holds(whole):
        return 1.0, whole
    low, high, found = 0, round(1.0 / _STEP), whole
    while high - low > 1:
        middle = (low + high) // 2
        outcome = proposed(middle * _STEP)
        low, high, found = (middle, high, outcome) if holds(outcome) else (low, middle, found)
    return low * _STEP, found


def _compensation(model: Model, device: DeviceProfile, scale: float) -> Model:
    """Returns the model of -scale f without friction, mass, damping and mean."""
    content = model.to_dict()
    network = content["network"]
    names = ("weight", "linear", "bias")
    network.update({name: (-scale * np.asarray(network[name])).tolist() for name in names})
    network.update({f"{name}_hysteresis": None for name in names})
    content.update(kind="position", inputs=["position"], play_radius=None, mass=None, damping=None)
    content.update(slope_bounds=None, plan=None, certificate=None)
    content.pop("band", None)
    content["notes"] = {**content["notes"], COMPENSATION_KEY: scale}
    found = Model.from_dict(content)
    network["bias"] += passive_shift(with_network(found), device.force_limit)
    return Model.from_dict(content)


def friction_of(model: Model) -> float:
    """Returns the mean friction over a period: half the difference of both directions [unit of the model]; 0
    without hysteresis."""
    if not model.hysteretic:
        return 0.0
    x = np.linspace(model.lower[0], model.upper[0], SAMPLES)
    return float(np.mean(np.asarray(model.force(x, direction=1.0)) - model.force(x, direction=-1.0)) / 2.0)


@dataclass(frozen=True)
class Ripple:
    """Ripple of a motor in a recording, before and after the compensation [unit of the force]."""

    recorded: float
    """RMS of the recorded force about the mean of its direction of motion"""
    left: float
    """The same with the compensation; contains the noise of the recording"""
    friction: float
    """Half the difference of the mean forces of both directions; 0 with one direction"""


def ripple_left(model: Model, scale: float, recording: Recording) -> Ripple:
    """Returns the ripple that a compensation leaves of the recorded force.

    The remaining force of a row is F - scale (f(x) - mean f), f being the mean of both directions. Lag is
    not included: the rows are taken at rest.

    Raises
    ------
    InputError
        The recording does not fit the model.
    """
    found = predict(model, recording)
    way: Float1D = np.ones(len(found.position))
    if found.side is not None:
        way = np.where(found.side >= 0.0, 1.0, -1.0)
    elif recording.direction is not None:
        way = np.where(recording.direction[found.rows] >= 0, 1.0, -1.0)
    side = 0.0 if model.hysteretic else None
    over_period = np.linspace(model.lower[0], model.upper[0], SAMPLES)
    mean = float(np.mean(model.force(over_period, direction=side)))
    cogging = np.asarray(model.force(found.position, direction=side)) - mean
    force = recording.force[found.rows]
    ways = np.unique(way)

    def about_means(values: Float1D) -> float:
        parts = [values[way == each] - values[way == each].mean() for each in ways]
        return float(np.sqrt(np.mean(np.concatenate(parts) ** 2)))

    means = [float(force[way == each].mean()) for each in ways]
    friction = 0.5 * (means[-1] - means[0]) if len(means) > 1 else 0.0
    return Ripple(about_means(force), about_means(force - scale * cogging), friction)

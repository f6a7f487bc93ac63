# SPDX-License-Identifier: Apache-2.0
"""The plan of a model on a device: the first candidate structure that is certified."""

from __future__ import annotations

import math
import os
from dataclasses import replace
from pathlib import Path
from typing import Literal

from .. import _core
from .._core.rendering import most_prediction_taps
from ..arguments import instance_of
from ..errors import InputError
from ..model import Model
from .candidates import CANDIDATES, Candidate, Refusal, Task
from .device_needs import needed
from .device_profile import DeviceProfile, example_profiles, profile_file
from .plan import ACCEPTED_FORCE_ERROR, Plan, require_force
from .static_error import network_of, with_network

_FORCE_UNIT = {"rad": "N*m", "m": "N"}


def plan(
    model: Model,
    device: _core.device.DeviceProfile | str | os.PathLike[str],
    *,
    coupling: bool = False,
    coupling_stiffness: float | None = None,
    coupling_damping: float | None = None,
    mass: float | None = None,
    damping: float | None = None,
    play_radius: float | None = None,
    predict: int | Literal["auto", "off"] = "auto",
    accept_force_error: float = ACCEPTED_FORCE_ERROR,
) -> Plan:
    """Chooses the simplest structure that is certified for a model on a device.

    ``palpate plan --help`` lists the candidate structures in the order in which they are tried. Numbers that
    are not given are chosen from the device.

    Parameters
    ----------
    model : Model
        A model of one position, or of position and velocity; a plan in it is ignored.
    device : DeviceProfile, str or path
        A profile in the model's unit, the name of an example profile, or the path of a TOML file.
    coupling : bool
        True: render through a virtual coupling, also where none is needed.
    coupling_stiffness, coupling_damping : float, optional
        K_c and B_c [force/position, force*s/position]; either requires a coupling.
    mass, damping : float, optional
        Mass and damping of the object [force*s^2/position, force*s/position]. Default: those of the model. 0
        leaves them out.
    play_radius : float, optional
        r of a model with hysteresis [position].
    predict : int, "auto" or "off"
        Samples used to predict the position half a sample ahead, for direct rendering: a force that is held
        for a sample is half a sample late on average. "auto" takes the fewest of 1, 2, 4, 8 and 16 that are
        certified for a tick that is late by a quarter of a period; "off" is 0.
    accept_force_error : float
        Largest difference of the felt from the identified force that is accepted, as a share of the range of
        the identified force.

    Returns
    -------
    Plan
        Read its ``verdict`` first. It is "no" if the force error is larger than accepted, or if no structure
        holds; the plan is then the last candidate. Its certificate states what was proved.

    Raises
    ------
    InputError
        An argument has a wrong type or value, or the model cannot be rendered at all, or not on a device of
        this unit.
    """
    instance_of("model", model, Model, "make one with palpate.identify or palpate.load_model")
    device = find_profile(device)
    for name, value in {
        "coupling_stiffness": coupling_stiffness,
        "coupling_damping": coupling_damping,
        "mass": mass,
        "damping": damping,
        "play_radius": play_radius,
        "accept_force_error": accept_force_error,
    }.items():
        _require_number(name, value)
    samples = _samples_of(predict)
    unit = model.units["position"]
    if unit not in ("", device.position_unit):
        raise InputError(
            f"the device {device.id} moves in {device.position_unit}, the model in {unit}; "
            f"a force over {unit} needs a device whose position_unit is {unit}"
        )
    if model.units["force"] not in ("", _FORCE_UNIT[device.position_unit], "A"):
        raise InputError(
            f"the device {device.id} makes {_FORCE_UNIT[device.position_unit]}, the model's force is in "
            f"{model.units['force']}"
        )
    require_force(model)
    task = Task(
        with_network(model),
        device,
        coupling=coupling or coupling_stiffness is not None or coupling_damping is not None,
        coupling_stiffness=coupling_stiffness,
        coupling_damping=coupling_damping,
        mass=model.mass if mass is None else mass,
        damping=model.damping if damping is None else damping,
        play_radius=play_radius,
        predict=samples,
    )
    if model.of_velocity and (task.coupling or task.dynamic):
        raise InputError(
            "a force of position and velocity is rendered directly: behind a coupling, or with a mass or "
            "damping beside it, no bound is known"
        )
    if samples and (model.of_velocity or task.coupling or task.dynamic):
        raise InputError(
            f"predict is {samples}: must be 0 (off) for a coupling, a mass, a damping or a force of "
            "velocity; a prediction is certified for direct rendering of a force of position"
        )
    refused: list[str] = []
    chosen: Candidate | None = None
    for name, candidate in CANDIDATES.items():
        outcome = candidate.propose(task)
        if isinstance(outcome, Refusal):
            refused.append(f"{name}: {outcome.reason}")
            continue
        chosen = outcome
        if not chosen.certificate.refused:
            break
        refused.append(f"{name}: {chosen.certificate.why}")
    assert chosen is not None  # the direct or the explicit structure always has a scheme
    identified = chosen.rendered is task.model
    planned = Plan(
        model,
        chosen.scheme,
        chosen.certificate,
        tuple(refused),
        None if identified else model.with_network(**network_of(chosen.rendered)),
        accept_force_error,
    )
    stable_only = not (chosen.certificate.certified or chosen.certificate.refused)
    if stable_only or planned.verdict.level == "no":
        planned = replace(planned, needs=needed(task, accept_force_error, certified=stable_only))
    return planned


def find_profile(device: _core.device.DeviceProfile | str | os.PathLike[str]) -> _core.device.DeviceProfile:
    """A device by object, by the name of an example profile, or by the path of its TOML file.

    Raises
    ------
    InputError
        It is none of these; the message names the argument, or file and field.
    """
    if isinstance(device, _core.device.DeviceProfile):
        return device
    if not isinstance(device, (str, os.PathLike)):
        raise InputError(
            f"device is a {type(device).__name__}: must be a DeviceProfile, the path of its TOML file, or "
            f"{_example_names()}"
        )
    file = profile_file(os.fspath(device))
    if not file.exists() and file == Path(file.name) and not file.suffix:
        raise InputError(
            f"device is '{device}': there is no such file, and no such example; {_example_names()}"
        )
    return DeviceProfile.load(file)


def _samples_of(predict: object) -> int | None:
    """Samples of a prediction, None where they are to be chosen."""
    if predict in ("auto", "off"):
        return None if predict == "auto" else 0
    if isinstance(predict, int) and not isinstance(predict, bool) and 0 <= predict <= most_prediction_taps:
        return predict
    raise InputError(f'predict is {predict!r}: must be "auto", "off" or 0 to {most_prediction_taps}')


def _example_names() -> str:
    return f"one of the examples {', '.join(example_profiles())}"


def _require_number(name: str, value: object) -> None:
    if value is None and name != "accept_force_error":
        return
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise InputError(f"{name} is {value!r}: must be a number")
    if not (math.isfinite(value) and value >= 0.0):
        raise InputError(f"{name} is {float(value):g}: must be a finite number >= 0")

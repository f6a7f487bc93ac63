# SPDX-License-Identifier: Apache-2.0
"""The model's force at every row of a recording, strokes and further inputs included."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .._typing import Float1D
from ..errors import InputError
from ..identification.hysteresis_input import HysteresisInput
from ..identification.inputs import input_columns
from ..model import Model
from ..recording import Recording
from ..recording.motion import acceleration, velocity

_UNSTATED = ""


@dataclass(frozen=True)
class Prediction:
    """The model's force at those rows of a recording where it says one."""

    rows: NDArray[np.bool_]
    """(n,) the rows of the recording that are used"""
    force: Float1D
    """(k,) the model's force there"""
    extrapolated: int
    """How many of them lie outside the model's domain"""
    notes: tuple[str, ...]


def predict(model: Model, recording: Recording) -> Prediction:
    """The model's force along a recording.

    A hysteresis model takes the recording's direction as s = +-1 and leaves out rows that have none; without
    a direction its play operator follows the positions in their order, if the model has a play radius.

    Raises
    ------
    InputError
        The recording lacks an input or a direction that the model needs, or is in other units.
    """
    require_same_units(model, recording.units)
    if model.mass is not None or model.damping is not None:
        return _moving(model, recording)
    return _static(model, recording)


def _moving(model: Model, recording: Recording) -> Prediction:
    """With what mass and damping add: m a + B v, from the recording's own time."""
    if recording.time is None:
        raise InputError(
            "the model has a mass or a damping, which act on acceleration and velocity: "
            "the recording needs time (--time NAME)"
        )
    static = _static(model, recording)
    total, known = np.zeros(len(recording)), np.ones(len(recording), dtype=bool)
    for value, derivative in ((model.damping, velocity), (model.mass, acceleration)):
        if value is not None:
            derived, here = derivative(recording)
            total, known = total + value * derived, known & here
    rows = static.rows & known
    force = (static.force + total[static.rows])[known[static.rows]]
    left_out = int(np.count_nonzero(static.rows & ~known))
    notes = (f"{left_out} rows at the ends and at gaps of time have no velocity and are left out",)
    outside = model.extrapolated(recording.position[rows])
    return Prediction(rows, force, int(np.count_nonzero(outside)), static.notes + notes)


def _static(model: Model, recording: Recording) -> Prediction:
    rows = np.ones(len(recording), dtype=bool)
    notes: tuple[str, ...] = ()
    if model.dimension > 1:
        X, rows = input_columns(recording, model.inputs)
        if not rows.any():
            raise InputError("no row of the recording has the velocity that the model needs")
        X = X[rows]
        outside = ((model.lower > X) | (model.upper < X)).any(axis=1)
        if left_out := int(np.count_nonzero(~rows)):
            notes = (f"{left_out} rows at the ends and at gaps of time have no velocity and are left out",)
        return Prediction(rows, model.predict(X), int(np.count_nonzero(outside)), notes)
    if not model.hysteretic:
        force = model.force(recording.position)
    elif recording.direction is not None:
        rows = recording.direction != 0
        if not rows.any():
            raise InputError("no row of the recording has a direction, which the model needs")
        force = model.force(recording.position[rows], direction=recording.direction[rows].astype(float))
        if left_out := int(np.count_nonzero(~rows)):
            notes = (f"{left_out} rows without a direction (pause, hold) are left out",)
    elif model.play_radius is not None:
        known = HysteresisInput.of_play([recording.position], model.play_radius).known
        rows = known if known.any() else rows
        force = model.force(recording.position[rows], play=model.play(recording.position)[rows])
        notes = ("there is no direction: the play operator follows the positions",)
        if left_out := int(np.count_nonzero(~rows)):
            notes += (f"{left_out} rows before the motion has covered the play are left out",)
    else:
        raise InputError(
            "the model differs between press and release: the recording needs a direction "
            "(--direction NAME), or the model a play radius"
        )
    outside = model.extrapolated(recording.position[rows])
    return Prediction(rows, force, int(np.count_nonzero(outside)), notes)


def require_same_units(model: Model, units: Mapping[str, str]) -> None:
    """Refuse a recording in other units than the model's; units that are not stated fit all."""
    for role in ("position", "force"):
        ours, theirs = model.units[role], units[role]
        if ours != theirs and _UNSTATED not in (ours, theirs):
            hint = "; give --torque-constant-Nm-per-A for the one in A" if "A" in (ours, theirs) else ""
            raise InputError(f"the model's {role} is in {ours}, the recording's in {theirs}{hint}")

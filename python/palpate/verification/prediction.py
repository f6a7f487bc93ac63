# SPDX-License-Identifier: Apache-2.0
"""Force of a model at every row of a recording, strokes and further inputs included."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from .._core.rendering import Scheme, default_play_radius, structure_names
from .._typing import Float1D
from ..errors import InputError
from ..identification.data.rows import input_columns
from ..identification.data.strokes import HysteresisInput
from ..model import Model
from ..recording import Recording
from ..recording.conversion import Motion
from ..recording.motion import (
    derivative,
    gaps_of,
    ordered_strokes,
    states_its_order,
    turns_of,
)
from ..recording.roles import Role, roles_of, unused_rows

NO_VELOCITY = "{} rows at the ends and at gaps of time have no velocity and are not compared."
"""Note on rows without velocity, with their number."""

_UNSTATED = ""
"""Empty text, used as the unit if a recording or a model does not state its unit."""

_STRUCTURE = "structure"
"""Key in the metadata of a flight record; its value is the name of the rendered structure."""

_OBJECT_POSITION = "environment_position"
"""Column name, without unit, of the position of the virtual object."""


@dataclass(frozen=True)
class Prediction:
    """Force of a model at the rows of a recording for which the model can compute a force."""

    rows: NDArray[np.bool_]
    """(n,) True for the rows of the recording that are used"""
    force: Float1D
    """(k,) force of the model at the used rows"""
    extrapolated: NDArray[np.bool_]
    """(j,) True where the force is extrapolated, for the used rows at which the tool moves; a wait repeats
    one position"""
    notes: tuple[str, ...]
    position: Float1D
    """(k,) positions at which the force was computed"""
    side: Float1D | None = None
    """(k,) direction state in [-1, 1]; None for a model without hysteresis"""
    over_time: bool = False
    """True if the force depends on the earlier positions, because the model has a memory"""
    without_motion: int = 0
    """Number of rows at which the tool waits or is far from the object, or that are dropped"""


def predict(model: Model, recording: Recording, *, play_radius: float | None = None) -> Prediction:
    """Returns the model's force along a recording.

    If model or flight record have a play radius, and the rows are in the order of a motion, the play operator
    follows their positions: near a turn, s = +-1 is not the state that the model was identified with.
    Otherwise s = +-1 is the direction of the recording, or of the order of rows; rows without direction are
    left out. A memory follows the positions over the time of the recording, from rest. The play radius is the
    first one available of: `play_radius`, the radius of the flight record, of the model, of its plan, or 1 %
    of the travel. A flight record behind a virtual coupling is compared at the position of the virtual
    object, except a compensated one. A flight record with prediction is compared at the predicted position.

    Raises
    ------
    InputError
        The recording lacks an input that the model needs, or is in other units; the radius is not above 0.
    """
    require_same_units(model, recording.units)
    if play_radius is not None and not (math.isfinite(play_radius) and play_radius > 0.0):
        raise InputError(f"play_radius is {play_radius}: must be a finite number > 0")
    notes: tuple[str, ...] = ()
    if play_radius is None:
        recording, notes = with_strokes(model, recording)
    moving = model.mass is not None or model.damping is not None
    found = (_moving if moving else _static)(model, recording, play_radius)
    found = _informative(model, recording, found)
    return replace(found, notes=notes + found.notes)


def _informative(model: Model, recording: Recording, found: Prediction) -> Prediction:
    """Leaves out the rows that show no force over position, as the identification does.

    A wait is compared with a model with memory, except in the air below its domain.
    """
    role = roles_of(recording)
    moving = compared = role == Role.MOVING
    if model.memory is not None:
        inside = recording.position >= model.lower[0]
        compared = moving | (np.isin(role, (Role.HOLD, Role.REST)) & inside)
    kept, moves = compared[found.rows], moving[found.rows]
    if not moves.any():
        return found
    notes = () if kept.all() else (unused_rows(np.where(compared, Role.MOVING, role), "compared"),)
    return replace(
        found,
        rows=found.rows & compared,
        force=found.force[kept],
        extrapolated=found.extrapolated[moves],
        notes=found.notes + notes,
        without_motion=int(np.count_nonzero(~compared)),
        position=found.position[kept],
        side=None if found.side is None else found.side[kept],
    )


def _extrapolated(model: Model, position: Float1D) -> NDArray[np.bool_]:
    """Returns True (n,) for positions outside the domain of a model of one position, except where the tool
    has left the object: there the model states a force of zero."""
    below = (position < model.lower[0]) & (model.below == "free")
    above = (position > model.upper[0]) & (model.above == "free")
    return np.asarray(model.extrapolated(position) & ~(below | above))


def _moving(model: Model, recording: Recording, play_radius: float | None) -> Prediction:
    """Adds the force of mass and damping, m a + B v, with acceleration a and velocity v from the time of the
    recording."""
    if recording.time is None:
        raise InputError(
            "the recording has no time, which the mass or damping of the model needs: give --time NAME"
        )
    static = _static(model, recording, play_radius)
    total, known = np.zeros(len(recording)), np.ones(len(recording), dtype=bool)
    for order, value in enumerate((model.damping, model.mass), start=1):
        if value is not None:
            derived, here = derivative(recording, order)
            total, known = total + value * derived, known & here
    rows = static.rows & known
    force = (static.force + total[static.rows])[known[static.rows]]
    left_out = int(np.count_nonzero(static.rows & ~known))
    notes = (NO_VELOCITY.format(left_out),) if left_out else ()
    position = recording.position[rows]
    side = None if static.side is None else static.side[known[static.rows]]
    return Prediction(rows, force, _extrapolated(model, position), static.notes + notes, position, side)


def _static(model: Model, recording: Recording, play_radius: float | None) -> Prediction:
    rows = np.ones(len(recording), dtype=bool)
    notes: tuple[str, ...] = ()
    if model.dimension > 1:
        ((X, rows),) = input_columns([recording], model.inputs)
        if not rows.any():
            raise InputError(
                "no row of the recording has a velocity, which the model needs: record a longer motion "
                "without gaps"
            )
        X = X[rows]
        outside = np.asarray(((model.lower > X) | (model.upper < X)).any(axis=1))
        left_out = int(np.count_nonzero(~rows))
        notes = (NO_VELOCITY.format(left_out),) if left_out else ()
        return Prediction(rows, model.predict(X), outside, notes, recording.position[rows])
    flight = flight_of(recording)
    position: Float1D = recording.position
    if flight.object_position is not None:
        position = flight.object_position
        where = "of the virtual object, behind the virtual coupling"
        if flight.predicted:
            where = "predicted half a sample ahead of the handle"
        notes = (f"The force is compared at the position {where}.",)
    side = None
    if model.memory is not None:
        force = _relaxing(model, recording)
        notes += ("The object is at rest at the first row.",)
    elif not model.hysteretic:
        force = model.force(position)
    else:
        state = _state(model, recording, flight, play_radius)
        rows, notes, side = state.known, notes + state.notes, state.side[state.known]
        force = model.force(position[rows], direction=side)
    position = position[rows]
    outside = _extrapolated(model, position)
    return Prediction(rows, force, outside, notes, position, side, over_time=model.memory is not None)


def _relaxing(model: Model, recording: Recording) -> Float1D:
    """Returns the force (n,) of a model with memory over the time of a recording."""
    relaxes = model.memory is not None and np.isfinite(model.memory.time_constant_s).any()
    if recording.time is None and relaxes:
        raise InputError("the recording has no time, which the memory of the model needs: give --time NAME")
    return model.force_over_time(recording.time_or_row, recording.position)[0]


@dataclass(frozen=True)
class _State:
    """Direction state of the rows of a recording."""

    side: Float1D
    """(n,) in [-1, 1]"""
    known: NDArray[np.bool_]
    """(n,) True for rows with a known direction state"""
    notes: tuple[str, ...]


def _state(model: Model, recording: Recording, flight: FlightRecord, play_radius: float | None) -> _State:
    identified = flight.play_radius or model.play_radius  # a plan can render with a wider one
    followed = play_radius is not None or (identified and states_its_order(recording))
    if recording.direction is not None and not followed:
        rows = recording.direction != 0
        if not rows.any():
            raise InputError(
                "no row of the recording has a direction, which the model needs; give --play-radius to "
                "compute it from the motion"
            )
        left_out = int(np.count_nonzero(~rows))
        resting = (
            (f"{left_out} rows without a direction (pause, hold) are not compared.",) if left_out else ()
        )
        return _State(recording.direction.astype(float), rows, resting)
    radius, origin = _radius(model, flight, play_radius)
    if flight.object_position is None or flight.predicted:
        whole = recording.motion
    else:
        whole = Motion(flight.object_position, recording.time, np.arange(len(recording)))
    play = HysteresisInput.of_play(np.split(whole.position, _gaps(whole.time, whole.position)), radius)
    known = play.known[whole.rows]
    unit = f" {model.units['position']}" if model.units["position"] else ""
    why = "There is no direction" if recording.direction is None else "The direction of a row is not enough"
    notes: tuple[str, ...] = (
        f"{why}: the play operator follows the positions. Its radius is {radius:.4g}{unit}, {origin}.",
    )
    if left_out := int(np.count_nonzero(~known)):
        notes += (f"{left_out} rows before the motion has covered twice the play radius are not compared.",)
    side = play.side[whole.rows]
    if flight.predicted and flight.object_position is not None:
        # The play operator follows the position of the handle; the force is computed at a predicted position.
        ahead = flight.object_position - recording.position
        side = np.clip(side + ahead / radius, -1.0, 1.0)
    return _State(side, known, notes)


def _known_radius(model: Model, flight: FlightRecord) -> tuple[float, str] | None:
    """Returns the play radius and, in words, where its value comes from."""
    for radius, origin in (
        (flight.play_radius, "that of the flight record"),
        (model.play_radius, "that of the model"),
        ((model.plan or {}).get("play_radius"), "that of the plan"),
    ):
        if radius:
            return float(radius), origin
    return None


def _radius(model: Model, flight: FlightRecord, play_radius: float | None) -> tuple[float, str]:
    if play_radius is not None:
        return play_radius, "as given"
    without = "1 % of the travel, because neither the recording nor the model has one"
    return _known_radius(model, flight) or (default_play_radius(model, 0.0), without)


def _gaps(time: Float1D | None, position: Float1D) -> NDArray[np.intp]:
    """Returns the indices of rows at which a motion starts after a gap of time."""
    return np.empty(0, dtype=np.intp) if time is None else gaps_of(time, position)


def require_same_units(model: Model, units: Mapping[str, str]) -> None:
    """Refuses a recording whose units differ from those of the model. Unstated units are always accepted."""
    for role in ("position", "force"):
        model_unit, unit = model.units[role], units[role]
        if model_unit != unit and _UNSTATED not in (model_unit, unit):
            hint = "; give --torque-constant-Nm-per-A for the current" if "A" in (model_unit, unit) else ""
            raise InputError(
                f"the {role} of the model is in {model_unit}, that of the recording in {unit}{hint}"
            )


@dataclass(frozen=True)
class FlightRecord:
    """Statements of a flight record on its rendering, such as the play radius; None for other recordings."""

    play_radius: float | None = None
    """[position]"""
    object_position: Float1D | None = None
    """(n,) position at which the force was computed: that of the virtual object behind a coupling, or
    predicted"""
    predicted: bool = False
    """True if the position is a predicted position of the handle"""


def flight_of(recording: Recording) -> FlightRecord:
    """Returns the statements in the metadata and columns of a flight record."""
    structure = recording.metadata.get(_STRUCTURE, "")
    found = re.search(r"\br = ([0-9.eE+-]+)", structure)
    radius = float(found.group(1)) if found else None
    predicted = ", predict " in structure
    name = structure.partition(",")[0]
    directly = name in structure_names and not Scheme(structure=name).has_coupling and not predicted
    if not structure or directly or "compensated" in structure:
        return FlightRecord(radius)
    for name, cells in recording.columns.items():
        if name.startswith(_OBJECT_POSITION) and cells.dtype.kind == "f" and np.isfinite(cells).all():
            return FlightRecord(radius, np.asarray(cells, dtype=np.float64), predicted)
    return FlightRecord(radius)


def with_strokes(model: Model, recording: Recording) -> tuple[Recording, tuple[str, ...]]:
    """Returns the recording with strokes from its order of rows and a note; otherwise unchanged.

    Strokes are added if the model differs between press and release, and neither a direction nor a play
    radius is known. A recording without time and reversal may be sorted by position; all rows then get the
    stroke whose model force is nearer.
    """
    known = recording.direction is not None or _known_radius(model, flight_of(recording))
    if known or not model.hysteretic:
        return recording, ()
    direction = ordered_strokes(recording)
    if direction is None:
        return recording, ()
    turns = turns_of(direction)
    if turns or recording.time is not None:
        note = f"The direction is taken from the order of rows: {turns} turn{'s' * (turns != 1)}."
        return replace(recording, direction=direction), (note,)

    def error(side: int) -> float:
        modelled = model.force(recording.position, direction=np.full(len(recording), float(side)))
        return float(np.sum((modelled - recording.force) ** 2))

    side = 1 if error(1) <= error(-1) else -1
    word = "press" if side > 0 else "release"
    note = f"The position never turns back. All rows are taken as {word}, whose model force is nearer."
    return replace(recording, direction=np.full(len(recording), side, dtype=np.int8)), (note,)

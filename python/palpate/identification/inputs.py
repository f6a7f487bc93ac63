# SPDX-License-Identifier: Apache-2.0
"""What the force is taken to depend on: from recordings and names to the rows of a regression."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .._typing import Float1D, Float2D
from ..errors import InputError
from ..recording import Recording
from ..recording.motion import velocity
from .options import IdentifyOptions


@dataclass(frozen=True)
class Observations:
    """Rows of all recordings, one under the other."""

    names: tuple[str, ...]
    """Of the columns of X; the first is position"""
    X: Float2D
    """(n, d)"""
    force: Float1D
    """(n,)"""
    side: Float1D | None
    """(n,) direction of the stroke, where every recording says it"""
    starts: tuple[int, ...] | None
    """Rows at which a recording begins, where every one has time"""
    notes: tuple[str, ...]


def observations(recordings: Sequence[Recording], options: IdentifyOptions) -> Observations:
    """The rows that the options ask for.

    Raises
    ------
    InputError
        An input is not in a recording; hysteresis together with further inputs.
    """
    names = _names(recordings[0], options)
    kept, columns, notes = [], [], []
    for recording in recordings:
        taken, rows = [], np.ones(len(recording), dtype=np.bool_)
        for name in names:
            if name == "velocity" and name not in recording.input_names:
                values, known = velocity(recording)
                rows &= known
                if not known.all():
                    notes.append(f"{np.count_nonzero(~known)} rows at gaps of time have no velocity")
            else:
                values = column(recording, name)
            taken.append(values)
        columns.append(np.column_stack(taken)[rows])
        kept.append(rows)
    side, starts = None, None
    if all(part.direction is not None for part in recordings):
        sides = [np.asarray(part.direction, dtype=float) for part in recordings]
        side = np.concatenate([each[rows] for each, rows in zip(sides, kept, strict=True)])
    elif all(part.time is not None for part in recordings):
        starts = (0, *np.cumsum([np.count_nonzero(rows) for rows in kept])[:-1].tolist())
    force = np.concatenate([part.force[rows] for part, rows in zip(recordings, kept, strict=True)])
    return Observations(names, np.concatenate(columns), force, side, starts, tuple(notes))


def column(recording: Recording, name: str) -> Float1D:
    """An input (n,) by its name in the recording or in the file that it was read from.

    Raises
    ------
    InputError
        The recording has no such input.
    """
    if name == "position":
        return recording.position
    for index, known in enumerate(recording.input_names):
        if name in (known, recording.source.columns.get(known)):
            return recording.inputs[:, index]
    known_inputs = ", ".join(("position", *recording.input_names))
    hint = f"; read it with inputs=({name!r},)" if name in recording.columns else ""
    raise InputError(f"the recording has no input {name!r}, only {known_inputs}{hint}")


def _names(recording: Recording, options: IdentifyOptions) -> tuple[str, ...]:
    if options.inputs == "auto":
        return ("position", *recording.input_names)
    further = [name for name in options.inputs if name not in ("position", "hysteresis")]
    if further and "hysteresis" in options.inputs:
        raise InputError(
            f"inputs names hysteresis and {', '.join(further)}; hysteresis is identified over position alone"
        )
    by_file_name = {recording.source.columns.get(known): known for known in recording.input_names}
    return ("position", *(by_file_name.get(name, name) for name in further))

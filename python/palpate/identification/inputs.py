# SPDX-License-Identifier: Apache-2.0
"""What the force is taken to depend on: from recordings and names to the rows of a regression."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from .._typing import Float1D, Float2D
from ..errors import InputError
from ..recording import Recording
from ..recording.motion import Piece, pieces, velocity
from ..verdict import Finding
from .options import IdentifyOptions
from .paper import paper_target
from .strokes import strokes_of


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
    """(n,) direction of the stroke: stated by every recording, or taken from the order of its rows"""
    starts: tuple[int, ...] | None
    """Rows at which a recording begins, where every one has time"""
    parts: tuple[Piece, ...]
    """The motion between gaps of time, where every recording has time; rows count over all recordings"""
    notes: tuple[str, ...]
    findings: tuple[Finding, ...] = ()
    """Reservations for the verdict"""


def observations(recordings: Sequence[Recording], options: IdentifyOptions) -> Observations:
    """The rows that the options ask for.

    Raises
    ------
    InputError
        An input is not in a recording; hysteresis together with further inputs.
    """
    names = _names(recordings[0], options)
    found = [input_columns(recording, names) for recording in recordings]
    kept = [rows for _, rows in found]
    columns = [X[rows] for X, rows in found]
    lost = sum(int(np.count_nonzero(~rows)) for rows in kept)
    notes: tuple[str, ...] = (
        (f"{lost} rows at the ends and at gaps of time have no velocity",) if lost else ()
    )
    side, starts = None, None
    if all(part.direction is not None for part in recordings):
        sides = [np.asarray(part.direction, dtype=float) for part in recordings]
        side = np.concatenate([each[rows] for each, rows in zip(sides, kept, strict=True)])
    parts: tuple[Piece, ...] = ()
    if len(names) == 1 and all(part.time is not None for part in recordings):
        first = np.cumsum([0, *(len(part) for part in recordings)])
        parts = tuple(
            replace(piece, rows=slice(start + piece.rows.start, start + piece.rows.stop))
            for start, recording in zip(first[:-1].tolist(), recordings, strict=True)
            for piece in pieces(recording)
        )
    findings: tuple[Finding, ...] = ()
    if side is None and all(part.time is not None for part in recordings):
        starts = _starts(recordings, kept)
    elif side is None and len(names) == 1 and (options.inputs == "auto" or "hysteresis" in options.inputs):
        strokes = strokes_of(recordings, named=options.inputs != "auto")
        side, notes, findings = strokes.side, notes + strokes.notes, strokes.findings
    if options.filters == "matched":
        forces = [part.force for part in recordings]
    else:
        forces, parts = [paper_target(part, options) for part in recordings], ()
    force = np.concatenate([each[rows] for each, rows in zip(forces, kept, strict=True)])
    return Observations(names, np.concatenate(columns), force, side, starts, parts, notes, findings)


def _starts(recordings: Sequence[Recording], kept: Sequence[NDArray[np.bool_]]) -> tuple[int, ...]:
    """Rows, of those that are kept, at which a recording or a piece between gaps of time begins."""
    starts, before = [], 0
    for recording, rows in zip(recordings, kept, strict=True):
        starts += [before + int(np.count_nonzero(rows[: piece.rows.start])) for piece in pieces(recording)]
        before += int(np.count_nonzero(rows))
    return tuple(dict.fromkeys(start for start in starts if start < before))


def input_columns(recording: Recording, names: Sequence[str]) -> tuple[Float2D, NDArray[np.bool_]]:
    """Inputs (n, d) by their names in the recording or its file, and the rows (n,) that have them all.

    A velocity that is no column of the recording is derived from its time.

    Raises
    ------
    InputError
        The recording has no such input.
    """
    columns, rows = [], np.ones(len(recording), dtype=np.bool_)
    for name in names:
        if name == "velocity" and name not in recording.input_names:
            derived, known = velocity(recording)
            columns.append(derived)
            rows &= known
        else:
            columns.append(_column(recording, name))
    return np.column_stack(columns), rows


def _column(recording: Recording, name: str) -> Float1D:
    if name == "position":
        return recording.position
    for index, known in enumerate(recording.input_names):
        if name in (known, recording.source.columns.get(known)):
            return recording.inputs[:, index]
    known_inputs = ", ".join(("position", *recording.input_names))
    raise InputError(
        f"the recording has no input {name}, only {known_inputs}; read the recording with inputs=({name!r},)"
    )


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

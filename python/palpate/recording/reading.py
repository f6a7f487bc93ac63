# SPDX-License-Identifier: Apache-2.0
"""Read a recording: choose its columns, check every row, convert to SI, and say what was done."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from .._typing import Float1D
from ..arguments import path_of
from ..errors import InputError
from .columns import Choice, Column, choose_columns
from .files import require_file, sha256_of_file
from .layout import Layout
from .notes import chosen, noticed
from .recording import UNSTATED, Motion, Recording, Source
from .rows import RowCheck
from .table import Cells, parse_number, to_numbers
from .tables import open_table
from .units import COLUMN_SUFFIX

MIN_ROWS = 10
"""Fewer usable rows are no recording."""

MIN_POSITIONS = 3
"""Fewer distinct positions show no force over position."""


def read_recording(
    path: str | os.PathLike[str],
    *,
    position: str | None = None,
    force: str | None = None,
    time: str | None = None,
    direction: str | None = None,
    inputs: Sequence[str] = (),
    units: Mapping[str, str] | None = None,
    torque_constant: float | None = None,
    negate: Sequence[str] = (),
    rows: tuple[int | None, int | None] | None = None,
    zero: tuple[int | None, int | None] | None = None,
    force_late_s: float = 0.0,
    invalid: Literal["refuse", "drop"] = "refuse",
) -> Recording:
    """Read a recording from a file.

    The name of a column states its unit (``displacement_mm``, ``Force [gf]``, ``Force (mN)``, ``Force / N``),
    or a second header line does. The unit is looked up in a closed table, and values are converted to SI.
    Separator, decimal mark, encoding and lines before the header are recognised; the first note reports them.

    Parameters
    ----------
    path : path
        CSV (separated by commas, semicolons or tabs); a ``.part`` file, a recording cut off while it grew,
        whose torn last line is left out and counted; ``.parquet`` (needs pyarrow), ``.xlsx`` (openpyxl),
        ``.npz``, ``.mat``, or ``.mcap`` with JSON messages (mcap).
    position, force, time : str, optional
        Column names. Without them the columns are chosen by name and unit; where that is ambiguous, the error
        names the candidates.
    direction : str, optional
        Column with the direction of the stroke, in words (press, approach, load, loading, forward, +1;
        release, retract, unload, unloading, back, -1; pause, hold, extra, 0). Without it a column called
        ``direction``, or one called ``segment`` that holds words, is taken.
    inputs : sequence of str
        Further columns that the force depends on.
    units : mapping of str to str, optional
        Unit of a column, by its name or by "position", "force" or "time" where that column is named too; for
        columns without a unit, or in one that the table does not know.
    torque_constant : float, optional
        Torque per current [N*m/A]: turns a force column in A into N*m. Without it current stays in A.
    negate : sequence of str
        "position", "force" or names of used columns whose sign is to be turned.
    rows : (start, stop), optional
        Half-open range of data rows to use, counted from 0; None for either end leaves it open.
    zero : (start, stop), optional
        Half-open range of data rows, counted as `rows`, in which the tool touches nothing: their mean force
        is taken off all forces.
    force_late_s : float
        How long after its position each force was recorded [s], as where a load cell's converter averages:
        every force is brought back to the position it belongs to. Needs time.
    invalid : {"refuse", "drop"}
        What to do with a row that has no number where one is needed, an infinite one, or a time that repeats
        or runs backward: refuse the file, naming the row, or drop the row and count it.

    Returns
    -------
    Recording
        SI arrays; its ``notes`` say what was chosen, dropped and noticed. Of what was rendered live only the
        rows whose force was the model's alone are kept: not the ramp at the start, nor what a limit clipped
        or a fault set to zero.

    Raises
    ------
    InputError
        One sentence that names the file, the line or column, and the value.
    """
    file = path_of("path", path)
    if invalid not in ("refuse", "drop"):
        raise InputError(f"invalid is {invalid!r}; it must be 'refuse' or 'drop'")
    require_file(file)
    table = open_table(file)
    metadata = dict(table.metadata)
    layout = Layout.taken_from(str(file), metadata)
    choice = choose_columns(
        str(file),
        table.names,
        position=position or layout.roles.get("position"),
        force=force or layout.roles.get("force"),
        time=time or layout.roles.get("time"),
        direction=direction or layout.roles.get("direction"),
        inputs=tuple(inputs) or layout.inputs,
        units=units,
        unstated=layout.roles.values(),
        text=table.text_names,
        steady=table.steady_names,
    )
    numeric = [column for column in (choice.position, choice.force, choice.time, *choice.inputs) if column]
    status = layout.roles.get("status")
    if status is not None and status not in table.names:
        raise InputError(f"{file} has no column {status!r}, which its metadata names as the status")
    cells = table.read(
        numbers=[column.name for column in numeric],
        text=[name for name in (choice.direction, status) if name is not None],
    )
    stroke = choice.direction
    if (
        stroke == "segment"
        and direction is None
        and all(parse_number(word) is not None for word in cells[stroke])
    ):
        # Numbered segments say nothing about the stroke.
        cells[stroke], stroke = to_numbers(cells[stroke]), None
    notes = [*choice.notes, *(["1 torn line at the end is left out"] if table.torn else [])]
    total = len(cells[choice.position.name])
    start, stop = _row_range(file, rows, total)
    whole = dict(cells)
    if (start, stop) != (0, total):
        notes.append(f"rows {start} to {stop - 1} of 0 to {total - 1} are used")
        cells = {name: column[start:stop] for name, column in cells.items()}

    check = RowCheck(str(file), table, start, stop - start, drop=invalid == "drop")
    if status is not None:
        check.as_modelled(cells[status])
    for column in numeric:
        check.finite(column.name, cells[column.name])
    words = None if stroke is None else check.directions(stroke, cells[stroke])
    if choice.time is not None:
        check.increasing(choice.time.name, cells[choice.time.name])
    if not check.kept.all():
        cells = {name: column[check.kept] for name, column in cells.items()}
        words = None if words is None else words[check.kept]
    notes += check.notes

    _negate(file, choice, negate, cells)
    x = _in_si(choice.position, cells)
    f = _in_si(choice.force, cells)
    force_unit = choice.force.unit.si if choice.force.unit else UNSTATED
    if torque_constant is not None:
        if not (math.isfinite(torque_constant) and torque_constant > 0):
            raise InputError(f"--torque-constant-Nm-per-A is {torque_constant}; it must be a number > 0")
        if force_unit != "A":
            raise InputError(
                f"{file}: --torque-constant-Nm-per-A turns a current into a torque, but the force is "
                f"{choice.force.name}, which is not in A"
            )
        f, force_unit = f * torque_constant, "N*m"
    if zero is not None:
        first, last = _row_range(file, zero, total)
        numbers = np.arange(start, stop)[check.kept]
        free = (numbers >= first) & (numbers < last)
        if not free.any():
            raise InputError(f"{file}: --zero {first}:{last} holds none of the rows that are used")
        offset = float(np.mean(f[free]))
        f = f - offset
        notes.append(f"{offset:.6g} {force_unit}, the mean force of rows {first} to {last - 1}, is taken off")
    _require_enough(file, choice.position, x, check.notes)
    inputs_si = [_in_si(column, cells) for column in choice.inputs]
    used = {column.name for column in numeric} | {stroke}
    source = Source(
        files=(str(file),),
        sha256=sha256_of_file(file),
        rows=len(x),
        columns=_source_columns(choice, stroke),
    )
    recording = Recording(
        position=x,
        force=f,
        time=None if choice.time is None else _in_si(choice.time, cells),
        direction=words,
        inputs=np.column_stack(inputs_si) if inputs_si else np.empty((len(x), 0)),
        input_names=tuple(map(_si_name, choice.inputs)),
        columns={name: column for name, column in cells.items() if name not in used},
        metadata=metadata,
        units={
            "position": choice.position.unit.si if choice.position.unit else UNSTATED,
            "force": force_unit,
        },
        source=source,
        notes=(chosen(choice, stroke, torque_constant, table.notes), *notes, *noticed(x, f, words)),
    )
    if (start, stop) != (0, total):
        _negate(file, choice, negate, whole)
        recording = replace(recording, part_of=_motion(choice, whole, start + np.flatnonzero(check.kept)))
    return recording.with_force_earlier(force_late_s) if force_late_s else recording


def _motion(choice: Choice, cells: dict[str, Cells], rows: NDArray[np.intp]) -> Motion | None:
    """The motion of all rows of a file, of which these are used; None if it has no continuous time."""
    if choice.time is None:
        return None
    position, time = _in_si(choice.position, cells), _in_si(choice.time, cells)
    usable = np.isfinite(position) & np.isfinite(time)
    if not usable[rows].all() or np.any(np.diff(time[usable]) <= 0.0):
        return None
    number = np.cumsum(usable) - 1
    return Motion(position[usable], time[usable], number[rows])


def _row_range(file: Path, rows: tuple[int | None, int | None] | None, total: int) -> tuple[int, int]:
    first, last = rows or (None, None)
    start, stop = first or 0, total if last is None else last
    if not 0 <= start < stop <= total and rows is not None:
        raise InputError(
            f"{file}: rows {start}:{stop} were asked for; it has {total} rows, and START must be below STOP"
        )
    return start, stop


def _negate(file: Path, choice: Choice, negate: Sequence[str], cells: dict[str, Cells]) -> None:
    by_role = {"position": choice.position.name, "force": choice.force.name}
    used = {*by_role.values(), *(column.name for column in choice.inputs)}
    for name in negate:
        column = by_role.get(name, name)
        if column not in used:
            raise InputError(
                f"{file}: --negate {name} names no column that is used ({', '.join(sorted(used))})"
            )
        cells[column] = -cells[column]


def _in_si(column: Column, cells: dict[str, Cells]) -> Float1D:
    values: Float1D = cells[column.name]
    return values if column.unit is None else values * column.unit.factor


def _si_name(column: Column) -> str:
    """The name of an input after conversion, so that the name still tells the unit."""
    return column.name if column.unit is None else f"{column.stem}_{COLUMN_SUFFIX[column.unit.si]}"


def _source_columns(choice: Choice, stroke: str | None) -> dict[str, str]:
    columns = {"position": choice.position.name, "force": choice.force.name}
    if choice.time is not None:
        columns["time"] = choice.time.name
    if stroke is not None:
        columns["direction"] = stroke
    return columns | {_si_name(column): column.name for column in choice.inputs}


def _require_enough(file: Path, position: Column, x: Float1D, left_out: Sequence[str]) -> None:
    if len(x) < MIN_ROWS:
        told = "".join(f"; {note}" for note in left_out)
        raise InputError(f"{file} has {len(x)} usable rows; a recording needs at least {MIN_ROWS}{told}")
    distinct = len(np.unique(x))
    if distinct < MIN_POSITIONS:
        plural = "s" * (distinct > 1)
        raise InputError(
            f"{file}: column {position.name} holds {distinct} distinct value{plural}; "
            f"force over position needs at least {MIN_POSITIONS}; choose another column with --position NAME"
        )

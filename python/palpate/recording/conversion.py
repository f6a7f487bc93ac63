# SPDX-License-Identifier: Apache-2.0
"""Conversion of the cells of a table to SI arrays with their source."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from .._typing import Float1D, Int8Vector
from ..errors import InputError
from .columns import Choice, Column, choose_columns
from .contact import air_rows
from .files import Layout, sha256_of_file
from .looks import clock_seconds
from .motion import waits
from .revolutions import continued_angle
from .rows import RowCheck
from .stamps import between_steps, increases
from .table import Cells, Places, Table, parse_number, to_numbers
from .units import CLOCK, COLUMN_SUFFIX, UNITS, UNSTATED_UNIT, Unit

UNSTATED = ""
"""Unit symbol of an array given without a unit: an SI unit, but it is not known which one."""

MIN_ROWS = 10
"""Least number of usable rows of a recording."""

MIN_POSITIONS = 3
"""Least number of distinct positions of a recording."""

FALLING_CORRELATION = -0.3
"""Correlation of force and position below which the force falls over the whole file.

A mirrored axis gives about -0.3 to -0.9 on indentation curves; humps, detents and friction -0.3 to 0.2.
"""

Range = tuple[int | None, int | None]
"""First row, and row after the last one, counted from 0. None: first row, or last row, of the file."""


@dataclass(frozen=True)
class Source:
    """Source of a recording: names and SHA-256 fingerprints of its files, and the columns that were read."""

    files: tuple[str, ...]
    sha256: str
    """SHA-256 of each file, or of arrays that were not read from a file; separated by spaces."""
    rows: int
    columns: Mapping[str, str]
    """Name of the column in the file for each role: position, force, time, direction, or an input's name."""
    held_out_every: int = 0
    """k if the rows i with i mod k = k - 1 were held out; 0: no rows were held out."""
    held_out: bool = False
    """True if the recording contains only held-out rows, False if it contains none of them."""
    file_rows: int = 0
    """Number of rows of the files, including rows that are not used; 0: not known."""
    values_sha256: str = ""
    """SHA-256 of the positions and forces of each file in SI units, which a copy in another format has too;
    separated by spaces. Empty: not known."""

    @staticmethod
    def merged(sources: Iterable[Source]) -> Source:
        """Returns one source that names the files and rows of several recordings."""
        parts = list(sources)
        first = parts[0]
        return replace(
            first,
            files=tuple(file for part in parts for file in part.files),
            sha256=" ".join(part.sha256 for part in parts),
            values_sha256=" ".join(part.values_sha256 for part in parts).strip(),
            rows=sum(part.rows for part in parts),
            file_rows=sum(part.file_rows for part in parts) if all(part.file_rows for part in parts) else 0,
        )


@dataclass(frozen=True, eq=False)
class Motion:
    """Positions and times of all rows of a file; a recording can contain a part of these rows.

    Velocity and play at a row depend on the rows around it, so they are computed from all rows of the file.
    """

    position: Float1D
    """(m,)"""
    time: Float1D | None
    """(m,) [s]"""
    rows: NDArray[np.intp]
    """(n,) indices, in `position`, of the rows that the recording contains"""

    @cached_property
    def waiting(self) -> NDArray[np.bool_] | None:
        """True (n,) for rows of the recording at which the tool waits; None if all rows have no order of a
        motion"""
        found = waits(self.position, self.time)
        return None if found is None else found[self.rows]

    @property
    def moving(self) -> NDArray[np.bool_]:
        """True (n,) for rows of the recording at which the tool moves; for all rows if none of them moves, or
        if they have no order of a motion"""
        waiting = self.waiting
        return np.ones(len(self.rows), dtype=np.bool_) if waiting is None or waiting.all() else ~waiting


@dataclass(frozen=True)
class Conversion:
    """Chosen columns of a table, and the conversion of their cells to SI values."""

    name: str
    """Name of the table (a file or arrays) in messages"""
    choice: Choice
    direction: str | None
    status: str | None
    """Column that states for each row if the force is the model's or was changed by a guard or a fault"""
    negated: frozenset[str]
    drop: bool
    """True: rows that cannot be used are dropped and counted. False: the first such row refuses the table."""
    metadata: Mapping[str, str]
    time_is_named: bool = False
    """True if the caller names the column of the time"""

    @staticmethod
    def of(
        table: Table,
        name: str,
        *,
        position: str | None,
        force: str | None,
        time: str | None,
        direction: str | None,
        inputs: Sequence[str] = (),
        units: Mapping[str, str] | None,
        negate: Sequence[str] = (),
        drop: bool,
    ) -> Conversion:
        """Chooses the columns of a table; the arguments are those of `read_recording`."""
        metadata = dict(table.metadata)
        layout = Layout.pop_from(name, metadata)
        choice = choose_columns(
            name,
            table.names,
            position=position or layout.roles.get("position"),
            force=force or layout.roles.get("force"),
            time=time or layout.roles.get("time"),
            direction=direction or layout.roles.get("direction"),
            inputs=tuple(inputs) or layout.inputs,
            units=units,
            unstated=layout.roles.values(),
            looks=table.looks,
        )
        status = layout.roles.get("status")
        if status is not None and status not in table.names:
            raise InputError(f"{name} has no column {status!r}, which its metadata names as the status")
        by_role = {"position": choice.position.name, "force": choice.force.name}
        used = {*by_role.values(), *(column.name for column in choice.inputs)}
        negated = [by_role.get(each, each) for each in negate]
        for each, column in zip(negate, negated, strict=True):
            if column not in used:
                raise InputError(
                    f"{name}: --negate is {each}, must be position, force or a used column "
                    f"({', '.join(sorted(used))})"
                )
        negated_columns = frozenset(column for column in negated if negated.count(column) % 2)
        conversion = Conversion(
            name, choice, choice.direction, status, negated_columns, drop, metadata, time is not None
        )
        for column in conversion.text:
            if column in conversion.numbers:
                role = "direction" if column == choice.direction else "status"
                raise InputError(
                    f"{name}: column {column} is the {role} and also a column of numbers; use another column "
                    "for one of them"
                )
        return conversion

    @property
    def columns(self) -> list[Column]:
        """Columns of the table that are converted to numbers."""
        choice = self.choice
        return [each for each in (choice.position, choice.force, choice.time, *choice.inputs) if each]

    @property
    def numbers(self) -> list[str]:
        """Names of the columns that are converted to numbers."""
        return [column.name for column in self.columns]

    @property
    def text(self) -> list[str]:
        """Names of the columns with words."""
        return [name for name in (self.direction, self.status) if name is not None]

    def read(self, table: Table) -> tuple[Conversion, dict[str, Cells]]:
        """Returns all cells, with clock times in seconds, and between the steps of the clock if it is slower
        than the rows.

        A clock that the caller does not name and that makes too few steps is not read; the returned
        conversion then has no time.
        """
        choice, time = self.choice, self.choice.time
        if time is None:
            return self, table.read(numbers=self.numbers, text=self.text)
        clock = time.unit is CLOCK
        numbers = [name for name in self.numbers if not clock or name != time.name]
        cells = table.read(numbers=numbers, text=[*self.text, *([time.name] if clock else [])])
        if clock:
            cells[time.name] = clock_seconds(cells[time.name])
        cells[time.name], step = between_steps(cells[time.name])
        if step > 0.0:
            unit = time.unit or UNSTATED_UNIT
            note = (
                f"the clock of column {time.name} has steps of {unit.text(unit.factor * step)}: the rows "
                "between them are evenly spaced"
            )
            choice = replace(choice, notes=(*choice.notes, note))
        elif clock and not self.time_is_named and not increases(cells[time.name]):
            sentence = (
                f"column {time.name} repeats a time, so it is not read as time, and damping and memory are "
                "not tested; record fractions of a second, or state the rate by a column of times in s"
            )
            choice = replace(choice, time=None, unread_time=sentence)
        return replace(self, choice=choice), cells

    @property
    def units(self) -> dict[str, str]:
        """SI unit of position and force."""
        roles = {"position": self.choice.position, "force": self.choice.force}
        return {role: column.unit.si if column.unit else UNSTATED for role, column in roles.items()}

    @property
    def file_units(self) -> dict[str, Unit]:
        """Unit of position and force in the table."""
        roles = {"position": self.choice.position, "force": self.choice.force}
        return {role: column.unit or UNSTATED_UNIT for role, column in roles.items()}

    @property
    def names(self) -> dict[str, str]:
        """Name of the column of each role (position, force, time, direction) and of each input."""
        choice = self.choice
        columns = {"position": choice.position.name, "force": choice.force.name}
        columns |= {"time": choice.time.name} if choice.time is not None else {}
        columns |= {"direction": self.direction} if self.direction is not None else {}
        return columns | {_si_name(column): column.name for column in choice.inputs}

    def checked(
        self,
        table: Places,
        cells: Mapping[str, Cells],
        first: int = 0,
        unwanted: NDArray[np.bool_] | None = None,
    ) -> tuple[RowCheck, Int8Vector | None]:
        """Checks the rows of a table from row `first` on, except those that `unwanted` (n,) marks.

        Returns the check and the direction of every row.

        Raises
        ------
        InputError
            A row cannot be used and rows may not be dropped, or its direction is not known.
        """
        check = RowCheck(self.name, table, first, len(cells[self.choice.position.name]), self.drop)
        if unwanted is not None:
            check.kept &= ~unwanted
        if self.status is not None:
            check.leave_out_other_forces(cells[self.status])
        for name in self.numbers:
            check.finite(name, cells[name])
        directions = (
            None
            if self.direction is None
            else check.directions(self.direction, cells[self.direction], self.si(self.choice.position, cells))
        )
        if self.choice.time is not None:
            check.increasing(self.choice.time.name, cells[self.choice.time.name])
        return check, directions

    def si(self, column: Column, cells: Mapping[str, Cells]) -> Float1D:
        """Returns the values of a column in SI units, with the sign that the caller requires."""
        values: Float1D = cells[column.name]
        factor = (1.0 if column.unit is None else column.unit.factor) * (
            -1.0 if column.name in self.negated else 1.0
        )
        return values if factor == 1.0 else values * factor

    def note(self, torque_constant: float | None = None, dialect: Sequence[str] = ()) -> str:
        """Returns one sentence that names the column of each role and the text format of the table."""
        choice = self.choice
        parts = [f"position is {choice.position.name}", f"force is {choice.force.name}"]
        if torque_constant is not None:
            parts[-1] = f"force is {_torque_text(choice.force.name, torque_constant)}"
        elif choice.force.unit is not None and choice.force.unit.si == "A":
            parts[-1] += " (a current; it stays in A)"
        parts.append(f"time is {choice.time.name}" if choice.time else "there is no time")
        parts.append(f"direction is {self.direction}" if self.direction else "there is no direction")
        if choice.inputs:
            parts.append(f"inputs are {', '.join(column.name for column in choice.inputs)}")
        return ", ".join(parts) + (f"; read as: {', '.join(dialect)}" if dialect else "")


def _torque_text(column: str, torque_constant: float) -> str:
    """Returns the origin of a torque that was computed from a column of currents."""
    return f"{column} times {torque_constant:g} N*m/A"


def converted(
    table: Table,
    name: str,
    *,
    file: Path | None = None,
    direction: str | None,
    rows: Range | None = None,
    leave_out: Sequence[Range] = (),
    zero: Range | Literal["air"] | None = None,
    torque_constant: float | None = None,
    **options: Any,
) -> dict[str, Any]:
    """Reads a whole table and returns the fields of a `Recording`.

    Parameters
    ----------
    table : Table
    name : str
        Name of the table, for messages.
    file : Path, optional
        The file of the table. Without it the source is the fingerprint of the arrays.
    direction, rows, leave_out, zero, torque_constant, options
        Those of `read_recording`.
    """
    conversion = Conversion.of(table, name, direction=direction, **options)
    conversion, cells = conversion.read(table)
    direction_column = conversion.direction
    if (
        direction_column is not None
        and direction_column.lower() == "segment"
        and direction is None
        and all(parse_number(word) is not None for word in cells[direction_column])
    ):
        # A column with segment numbers does not state the direction of a stroke.
        cells[direction_column], conversion = (
            to_numbers(cells[direction_column]),
            replace(conversion, direction=None),
        )
    choice = conversion.choice
    notes = [*choice.notes, *(["1 torn line at the end is left out"] if table.torn else [])]
    if choice.time is not None:
        cells[choice.time.name], begun = _continued(cells[choice.time.name], table.starts)
        if begun:
            notes.append(
                f"the time begins again in {table.place(begun[0])}; it continues after a pause as long as "
                f"the longest block, and --rows 0:{begun[0]} reads the first one"
            )
    if (unit := choice.position.unit) is not None and unit.si == "rad":
        angle, force = choice.position.name, choice.force.name
        cells[angle], jumps = continued_angle(angle, cells[angle], cells[force], 2.0 * math.pi / unit.factor)
        notes += jumps
    total = len(cells[choice.position.name])
    start, stop = _row_range(name, rows, total)
    all_cells = cells
    if (start, stop) != (0, total):
        notes.append(f"rows {start} to {stop - 1} of 0 to {total - 1} are used")
        cells = {each: column[start:stop] for each, column in cells.items()}
    unwanted = np.zeros(total, dtype=np.bool_)
    for each in leave_out:
        first, last = _row_range(name, each, total)
        unwanted[first:last] = True
        notes.append(f"rows {first} to {last - 1} are left out")
    check, directions = conversion.checked(table, cells, start, unwanted[start:stop])
    if not check.kept.all():
        cells = {each: column[check.kept] for each, column in cells.items()}
        directions = None if directions is None else directions[check.kept]
    notes += check.notes
    x, f = conversion.si(choice.position, cells), conversion.si(choice.force, cells)
    units, file_units, names = conversion.units, conversion.file_units, dict(conversion.names)
    if torque_constant is not None:
        if not (math.isfinite(torque_constant) and torque_constant > 0):
            raise InputError(f"--torque-constant-Nm-per-A is {torque_constant}; it must be a number > 0")
        if units["force"] != "A":
            raise InputError(
                f"{name}: --torque-constant-Nm-per-A converts a current to a torque, but the force is "
                f"{choice.force.name}, which is not in A"
            )
        f, units["force"], file_units["force"] = f * torque_constant, "N*m", UNITS["Nm"]
        names["force"] = _torque_text(choice.force.name, torque_constant)
    time = None if choice.time is None else conversion.si(choice.time, cells)
    if zero is not None:
        if zero == "air":
            motion = Motion(x, time, np.arange(len(x)))
            without_contact, where = air_rows(x, f, motion.moving), "the rows before the contact"
            if not without_contact.any():
                raise InputError(
                    f"{name}: --zero air finds no rows before the contact; name them: START:STOP"
                )
        else:
            first, last = _row_range(name, zero, total)
            numbers = np.arange(start, stop)[check.kept]
            without_contact, where = (numbers >= first) & (numbers < last), f"rows {first} to {last - 1}"
            if not without_contact.any():
                raise InputError(f"{name}: --zero {first}:{last} contains no row that is used")
        offset = float(np.mean(f[without_contact]))
        f = f - offset
        notes.append(f"{offset:.6g} {units['force']}, the mean force of {where}, is subtracted")
    _require_enough(name, choice.position, x, check.notes)
    inputs = [conversion.si(column, cells) for column in choice.inputs]
    used = {*conversion.numbers, conversion.direction}
    is_part = (start, stop) != (0, total) or unwanted.any()
    return {
        "position": x,
        "force": f,
        "time": time,
        "direction": directions,
        "inputs": np.column_stack(inputs) if inputs else np.empty((len(x), 0)),
        "input_names": tuple(map(_si_name, choice.inputs)),
        "columns": {each: column for each, column in cells.items() if each not in used},
        "metadata": conversion.metadata,
        "units": units,
        "source": Source(
            files=() if file is None else (str(file),),
            sha256=digest_of(x, f, time, *inputs, directions) if file is None else sha256_of_file(file),
            rows=len(x),
            columns=names,
            file_rows=total,
            values_sha256=digest_of(x, f),
        ),
        "notes": (conversion.note(torque_constant, table.notes), *notes),
        "file_units": file_units,
        "unit_is_certain": bool({"position", choice.position.name} & set(options.get("units") or ())),
        "unread_time": choice.unread_time,
        "part_of": _motion(conversion, all_cells, start + np.flatnonzero(check.kept)) if is_part else None,
    }


def _continued(time: Float1D, starts: Sequence[int]) -> tuple[Float1D, list[int]]:
    """Returns a time (n,) that continues where the recorded one begins again, and the rows in which it does.

    It begins again at the start of a block of the file, or if it returns to the first time of at least
    `MIN_ROWS` rows, within one step, and goes on in usual steps. The pause before is not recorded: it is the
    duration of the longest block.
    """
    edges = [0]
    for row in (np.flatnonzero(np.diff(time) <= 0.0) + 1).tolist():
        first = edges[-1]
        is_block = row in starts
        if not is_block and min(row - first, len(time) - row) >= MIN_ROWS:
            returned = abs(time[row] - time[first]) <= time[first + 1] - time[first] > 0.0
            is_block = returned and time[row + 1] - time[row] <= np.diff(time[first:row]).max()
        if is_block:
            edges.append(row)
    if len(edges) == 1:
        return time, []
    blocks = np.split(time, edges[1:])
    pause = max(float(np.nanmax(block) - np.nanmin(block)) for block in blocks)
    for before, block in pairwise(blocks):
        block += before[-1] + pause - block[0]
    return np.concatenate(blocks), edges[1:]


def digest_of(*arrays: NDArray[Any] | None) -> str:
    """Returns the SHA-256 of arrays in hexadecimal digits."""
    digest = hashlib.sha256()
    for array in arrays:
        if array is not None:
            digest.update(np.ascontiguousarray(array).tobytes())
    return digest.hexdigest()


def mirror_notes(correlation: float) -> list[str]:
    """Returns a note if the force falls with position. The sign is not changed."""
    if correlation >= FALLING_CORRELATION:
        return []
    return [
        f"the force falls with position over the whole file (correlation {correlation:.2f}): if the position "
        "grows out of the object give --negate position, if the force is positive when pulling give "
        "--negate force, if the object attracts the tool identify it with --below linear"
    ]


def _motion(conversion: Conversion, cells: Mapping[str, Cells], rows: NDArray[np.intp]) -> Motion | None:
    """Returns positions and times of all rows of a file; None without a time that increases in every row."""
    if conversion.choice.time is None:
        return None
    position, time = (
        conversion.si(conversion.choice.position, cells),
        conversion.si(conversion.choice.time, cells),
    )
    usable = np.isfinite(position) & np.isfinite(time)
    if not usable[rows].all() or np.any(np.diff(time[usable]) <= 0.0):
        return None
    number = np.cumsum(usable) - 1
    return Motion(position[usable], time[usable], number[rows])


def _row_range(name: str, rows: Range | None, total: int) -> tuple[int, int]:
    first, last = rows or (None, None)
    start, stop = first or 0, total if last is None else last
    if not 0 <= start < stop <= total and rows is not None:
        raise InputError(
            f"{name}: rows {start}:{stop} are outside the {total} rows of the file, or START is not "
            "below STOP"
        )
    return start, stop


def _si_name(column: Column) -> str:
    """Returns the column name of an input with the unit replaced by its SI unit."""
    return column.name if column.unit is None else f"{column.stem}_{COLUMN_SUFFIX[column.unit.si]}"


def _require_enough(name: str, position: Column, x: Float1D, left_out: Sequence[str]) -> None:
    if len(x) < MIN_ROWS:
        reasons = "".join(f"; {note}" for note in left_out)
        raise InputError(f"{name} has {len(x)} usable rows; a recording needs at least {MIN_ROWS}{reasons}")
    distinct = len(np.unique(x))
    if distinct < MIN_POSITIONS:
        plural = "s" * (distinct > 1)
        raise InputError(
            f"{name}: column {position.name} holds {distinct} distinct value{plural}; "
            f"force over position needs at least {MIN_POSITIONS}; choose another column with --position NAME"
        )

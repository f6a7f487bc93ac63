# SPDX-License-Identifier: Apache-2.0
"""Reading of recordings from files, frames or arrays; long files are read in parts."""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal, TypeAlias

import numpy as np
import numpy.typing as npt

from .._typing import Float1D, Int8Vector
from ..arguments import path_of, shown
from ..errors import InputError
from ..frames import pd
from .conversion import Conversion, Source, converted
from .csv_file import CsvFile
from .dialect import Stated
from .files import TooLargeError, require_file, sha256_of_file, unchanged
from .formats import is_read_in_parts, is_text, open_table
from .parts import Part, PartNames, parts_of_text, parts_of_workbook, read_part, several_parts_of_text
from .recording import Recording
from .rows import LeftOut
from .table import LongTable, Places
from .units import Unit
from .workbook import is_workbook

RecordingLike: TypeAlias = "Recording | str | os.PathLike[str] | pd.DataFrame"
"""A recording, or data that can be read as one."""

_CYCLE = re.compile(r"cycle (\d+)")
"""Name of a cycle of a recording, as a part of a file"""

RECORDING_TYPES = "give a Recording, the name of a file, a DataFrame, or arrays of position and force"
ELEMENT_TYPES = "a list holds Recordings, names of files or DataFrames; Recording.from_arrays takes arrays"


def read_recording(
    path: str | os.PathLike[str],
    *,
    position: str | None = None,
    force: str | None = None,
    time: str | None = None,
    direction: str | None = None,
    inputs: Sequence[str] = (),
    units: Mapping[str, str] | None = None,
    columns: Sequence[str] = (),
    decimal: Literal[".", ","] | None = None,
    torque_constant: float | None = None,
    negate: Sequence[str] = (),
    rows: tuple[int | None, int | None] | None = None,
    leave_out: Sequence[tuple[int | None, int | None]] = (),
    zero: tuple[int | None, int | None] | Literal["air"] | None = None,
    force_late_s: float = 0.0,
    invalid: Literal["refuse", "drop"] = "refuse",
    part: PartNames | None = None,
) -> Recording:
    """Reads a recording from a file.

    The name of a column or a second header line states its unit (``displacement_mm``, ``Force [gf]``, ``Force
    (mN)``, ``Force / N``). Units are those of a closed table, and values are converted to SI. Separator,
    decimal mark, encoding and lines before the header are recognised; the first note reports them.

    Parameters
    ----------
    path : path
        CSV (separated by commas, semicolons or tabs); an incomplete ``.part`` file, whose torn last line is
        ignored and counted; ``.parquet`` (needs pyarrow), a workbook ``.xlsx``, ``.xls`` or ``.ods``
        (python-calamine), ``.npz``, ``.mat``, or ``.mcap`` with JSON messages (mcap).
    position : str, optional
        Column of the position; else chosen by unit. If several columns are possible, the error names them.
    force : str, optional
        Column of the force; else chosen by unit.
    time : str, optional
        Column of the time; else chosen by unit.
    direction : str, optional
        Column of the stroke's direction (press, release). It contains words in small or capital letters
        (press, approach, load, loading, forward, in, down, +1; release, retract, unload, unloading, back,
        out, up, -1; pause, hold, extra, 0). By default a column with both kinds of these words, or a column
        ``direction``, is used.
    inputs : sequence of str
        Further columns that the force depends on.
    units : mapping of str to str, optional
        Unit of a column whose name has none. It replaces the unit in the name. The key is the column's name,
        or "position", "force" or "time" if that column is also named.
    columns : sequence of str
        Names of all columns of a table without a header, with their units (``time_s``, ``position_mm``).
    decimal : {".", ","}, optional
        Decimal mark of a text file; the other mark then separates thousands. By default it is recognised.
    torque_constant : float, optional
        Torque per current [N*m/A]; converts a force column from A to N*m. By default a current remains in A.
    negate : sequence of str
        Invert the sign of position, force or a column. A column is given by its name and must be used.
    rows : (start, stop), optional
        Use only these rows, counted from 0. The range excludes stop; None leaves an end open.
    leave_out : sequence of (start, stop)
        Leave out these rows, such as a bad stretch or a hold. Each range is counted as `rows`.
    zero : (start, stop) or "air", optional
        Rows without contact; their mean force is subtracted. The range is counted as `rows`; "air" are the
        rows before the contact.
    force_late_s : float
        Delay of the recorded force [s]; needs time. Every force is moved to its position, for example if the
        converter of a load cell averages.
    invalid : {"refuse", "drop"}
        Refuse the file, or drop rows without a number. An infinite number, a missing direction, or a time
        that does not increase is treated in the same way. The error names the row; dropped rows are counted.
    part : str, int or sequence, optional
        Sheet, specimen or block of rows to read, by its name or its number from 1, or "cycle N" of a
        recording with several. Several are joined as strokes of one recording. By default the longest table
        with a position and a force is read. A file with several such recordings is refused; the error names
        them.

    Returns
    -------
    Recording
        SI arrays; its ``notes`` report choices, dropped rows and observations. A flight record keeps only the
        rows whose force was the model's alone: the start ramp and rows that a limit clipped or a fault set to
        zero are left out.

    Raises
    ------
    InputError
        One sentence that names the file, the line or column, and the value.
    """
    file = path_of("path", path)
    if decimal not in (None, ".", ","):
        raise InputError(f"decimal is {decimal!r}; it must be '.' or ','")
    if invalid not in ("refuse", "drop"):
        raise InputError(f"invalid is {invalid!r}; it must be 'refuse' or 'drop'")
    require_file(file)
    options: dict[str, Any] = {
        "position": position,
        "force": force,
        "time": time,
        "direction": direction,
        "inputs": inputs,
        "units": units,
        "torque_constant": torque_constant,
        "negate": negate,
        "rows": rows,
        "leave_out": leave_out,
        "zero": zero,
        "drop": invalid == "drop",
    }
    stated, cycles = Stated(tuple(columns), decimal), list[int]()
    with unchanged(file):
        try:
            fields = _fields(file, part, stated, options)
        except InputError:
            tables, cycles = _without_cycles(part)
            if not cycles:
                raise
            fields = _fields(file, tables, stated, options)
    recording = Recording(**fields)
    try:
        recording = recording.cycles(*cycles) if cycles else recording
        return recording.with_force_earlier(force_late_s) if force_late_s else recording
    except InputError as error:
        raise InputError(f"{path}: {error}") from None


def _without_cycles(part: PartNames | None) -> tuple[PartNames | None, list[int]]:
    """Returns the names of parts that are not "cycle N", None without one, and the numbers N."""
    names = [part] if isinstance(part, (str, int)) else list(part or ())
    found = [_CYCLE.fullmatch(str(each)) for each in names]
    others = [each for each, cycle in zip(names, found, strict=True) if cycle is None]
    return others or None, [int(cycle[1]) for cycle in found if cycle is not None]


def _fields(file: Path, part: PartNames | None, stated: Stated, options: dict[str, Any]) -> dict[str, Any]:
    """Returns the fields of the recording in a file, or in a part of it.

    A text file is first read as one table, which is fast. It is divided into its parts if this is refused, or
    if it has empty rows.
    """
    if is_workbook(file):
        return read_part(file, parts_of_workbook(file, stated), part, options)
    if part is not None:
        if not is_text(file):
            raise InputError(f"{file} has one part only; leave out --part")
        return read_part(file, parts_of_text(file, stated), part, options)
    refusal: InputError | None = None
    fields: dict[str, Any] = {}
    try:
        table = open_table(file, stated)
        fields = converted(table, str(file), file=file, **options)
        has_dropped = options["drop"] and fields["source"].rows < fields["source"].file_rows
        if not (isinstance(table, CsvFile) and (table.has_empty_rows or has_dropped)):
            return fields
    except InputError as error:
        if not is_text(file) or isinstance(error, TooLargeError):
            raise
        refusal = error
    parts: list[Part] = []
    with suppress(InputError):
        parts = several_parts_of_text(file, stated)
    has_notes = any(each.block.unused and each.block.too_wide is None for each in parts)
    if len(parts) > 1 or (refusal is not None and has_notes):
        return read_part(file, parts, part, options)
    if refusal is not None:
        raise refusal
    return fields


def recording_from(
    recording: RecordingLike | npt.ArrayLike,
    force: npt.ArrayLike | None = None,
    time: npt.ArrayLike | None = None,
    direction: npt.ArrayLike | None = None,
    *,
    inputs: Sequence[str] = (),
    name: str = "recording",
    types: str = RECORDING_TYPES,
) -> Recording:
    """Returns the given recording, or reads it or makes it from arrays.

    Parameters
    ----------
    recording : Recording, path, DataFrame or (n,) array_like
        The array of positions if `force` is given.
    force, time, direction : (n,) array_like, optional
        As in :meth:`palpate.Recording.from_arrays`.
    inputs : sequence of str
        Further columns of a file or a frame.
    name : str
        Name of the argument in messages.
    types : str
        The accepted types, as the end of a message.

    Raises
    ------
    InputError
        The value has another type; the message names the argument.
    """
    if force is not None:
        if isinstance(recording, (Recording, str, os.PathLike, pd.DataFrame)):
            raise InputError(f"force is given, but {name} already contains a force; leave out force")
        return Recording.from_arrays(recording, force, time, direction)
    for role, array in (("time", time), ("direction", direction)):
        if array is not None:
            raise InputError(f"{role} is given without force; arrays need a position and a force")
    if isinstance(recording, Recording):
        return recording
    if isinstance(recording, pd.DataFrame):
        return Recording.from_frame(recording, inputs=inputs)
    if isinstance(recording, (str, os.PathLike)):
        return read_recording(path_of(name, recording), inputs=inputs)
    raise InputError(f"{name} is {shown(recording)}; {types}")


def recordings_from(
    recording: RecordingLike | Iterable[RecordingLike] | npt.ArrayLike,
    force: npt.ArrayLike | None = None,
    time: npt.ArrayLike | None = None,
    direction: npt.ArrayLike | None = None,
    *,
    inputs: Sequence[str] = (),
) -> list[Recording]:
    """Returns the given recordings: one as in :func:`recording_from`, or a list.

    Raises
    ------
    InputError
        The list is empty, or a value has another type.
    """
    several: Any = recording
    is_list = isinstance(recording, Iterable) and not isinstance(
        recording, (Recording, str, os.PathLike, pd.DataFrame, dict, bytes, np.ndarray, pd.Series)
    )
    if force is not None or time is not None or direction is not None or not is_list:
        return [recording_from(several, force, time, direction, inputs=inputs)]
    found = list(several)
    if not found:
        raise InputError(f"recording is an empty list; {RECORDING_TYPES}")
    if all(isinstance(each, (int, float, np.number)) for each in found):
        raise InputError(f"recording is a list of numbers, and force is not given; {RECORDING_TYPES}")
    return [
        recording_from(each, inputs=inputs, name=f"recording[{number}]", types=ELEMENT_TYPES)
        for number, each in enumerate(found)
    ]


PART_ROWS = 4_000_000
"""Approximate number of rows of one part of a long file, which one process reads."""

BLOCK_ROWS = 500_000
"""Number of rows of a long file that one process holds in memory at a time."""


@dataclass(frozen=True)
class Block:
    """Consecutive rows of a long file, which are processed together in memory."""

    position: Float1D
    """[SI]"""
    force: Float1D
    """[SI]"""
    direction: Int8Vector | None
    kept: npt.NDArray[np.bool_]
    """True for the rows of the file that are used, False for ignored rows"""
    left_out: LeftOut


@dataclass(frozen=True)
class LongRecording:
    """Description of a long file from :func:`open_long_recording`, small enough to send to workers."""

    path: Path
    stated: Stated
    """What the caller states about the file"""
    conversion: Conversion
    """Conversion of the columns position, force and direction to SI values"""
    has_time: bool
    """True if the file has a column of time, which is not read"""
    parts: tuple[tuple[int, int], ...]
    """Start and end of each part of the file: bytes of a CSV file, row groups of a Parquet file"""
    rows: int
    """Number of rows of the file, counted without reading their cells"""
    source: Source
    """Source of the recording; `source.rows` is not yet known, because the rows were not read"""
    notes: tuple[str, ...]

    @property
    def direction(self) -> str | None:
        """Column that states the direction of the stroke in each row, or None."""
        return self.conversion.direction

    @property
    def units(self) -> Mapping[str, str]:
        """SI unit of position and force."""
        return self.conversion.units

    def file_unit(self, role: str) -> Unit:
        """Returns the unit that the file uses for "position" or "force", for messages."""
        return self.conversion.file_units[role]

    def blocks(self, part: tuple[int, int]) -> Iterator[Block]:
        """Yields position, force and direction of the rows of a part in blocks.

        Raises
        ------
        InputError
            A row has no finite number or no known direction, and rows may not be dropped.
        """
        table = _long_table(self.path, self.stated)
        conversion = self.conversion
        for first, cells in table.blocks(part, BLOCK_ROWS, numbers=conversion.numbers, text=conversion.text):
            check, directions = conversion.checked(_PartPlaces(table, part), cells, first)
            position, force = (
                conversion.si(column, cells)[check.kept]
                for column in (conversion.choice.position, conversion.choice.force)
            )
            direction = None if directions is None else directions[check.kept]
            yield Block(position, force, direction, check.kept, check.left_out)

    def places(self) -> Places:
        """Returns the line numbers and cell texts of the rows of the file, for messages."""
        return open_table(self.path, self.stated)


class _PartPlaces:
    """Line numbers of the rows of a part. Rows before the part are counted if a line number is needed."""

    def __init__(self, table: LongTable, part: tuple[int, int]) -> None:
        self._table, self._part = table, part

    def place(self, row: int) -> str:
        return self._table.place(self._table.rows_before(self._part) + row)

    def cell(self, row: int, name: str) -> str:
        return self._table.cell(self._table.rows_before(self._part) + row, name)


def open_long_recording(
    path: str | Path,
    *,
    position: str | None = None,
    force: str | None = None,
    time: str | None = None,
    direction: str | None = None,
    units: Mapping[str, str] | None = None,
    columns: Sequence[str] = (),
    decimal: Literal[".", ","] | None = None,
    negate: tuple[str, ...] = (),
    invalid: Literal["refuse", "drop"] = "refuse",
    part_rows: int = PART_ROWS,
) -> LongRecording:
    """Chooses the columns of a file and counts its rows; the arguments are those of `read_recording`.

    Raises
    ------
    InputError
        One sentence that names the file, the column and the cure.
    """
    file = Path(path)
    require_file(file)
    if not is_read_in_parts(file):
        raise InputError(
            f"{file} cannot be read part by part; leave out --out-of-core, --jobs and --scheduler, or "
            "convert the file to CSV or Parquet"
        )
    stated = Stated(tuple(columns), decimal)
    table = _long_table(file, stated)
    conversion = Conversion.of(
        table,
        str(file),
        position=position,
        force=force,
        time=time,
        direction=direction,
        units=units,
        negate=negate,
        drop=invalid == "drop",
    )
    found = conversion.direction if direction is None else None
    if found is not None and found.lower() == "segment" and found not in table.text_names:
        conversion = replace(conversion, direction=None)  # segment numbers are not directions
    notes = conversion.note(dialect=table.notes), *conversion.choice.notes
    has_time = conversion.choice.time is not None
    conversion = replace(conversion, choice=replace(conversion.choice, time=None, inputs=()))
    rows, parts = table.parts(part_rows)
    return LongRecording(
        path=file,
        stated=stated,
        conversion=conversion,
        has_time=has_time,
        parts=tuple(parts),
        rows=rows,
        source=Source(files=(str(file),), sha256=sha256_of_file(file), rows=0, columns=conversion.names),
        notes=notes,
    )


def _long_table(file: Path, stated: Stated) -> LongTable:
    table = open_table(file, stated)
    assert isinstance(table, LongTable)
    return table

# SPDX-License-Identifier: Apache-2.0
"""A recording that may be larger than memory: force over position, part by part."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

from .._typing import Float1D, Int8Vector
from ..errors import InputError
from .conversion import Conversion, Source
from .files import require_file, sha256_of_file
from .formats import open_table
from .rows import LeftOut
from .table import LongTable, Places, Table

PART_ROWS = 4_000_000
"""Rows of a part: what one worker reads at a time."""

BLOCK_ROWS = 500_000
"""Rows that are in memory at a time."""


@dataclass(frozen=True)
class Block:
    """Rows of a part that are in memory at a time."""

    position: Float1D
    """[SI]"""
    force: Float1D
    """[SI]"""
    direction: Int8Vector | None
    rows: int
    """Rows of the file, those that are left out included"""
    left_out: LeftOut


@dataclass(frozen=True)
class LongRecording:
    """How a file is read; from :func:`open_long_recording`, and light enough to be sent to workers."""

    path: Path
    how: Conversion
    """Of position, force and direction"""
    parts: tuple[tuple[int, int], ...]
    """Places between which the file is read apart"""
    rows: int
    """Rows of the file, counted without reading their cells"""
    source: Source
    """Without the number of rows that are used"""
    notes: tuple[str, ...]

    @property
    def direction(self) -> str | None:
        """Column of the direction."""
        return self.how.direction

    @property
    def units(self) -> Mapping[str, str]:
        """SI unit of position and force."""
        return self.how.units

    def blocks(self, part: tuple[int, int]) -> Iterator[Block]:
        """Position, force and direction of the rows of a part, block by block.

        Raises
        ------
        InputError
            A row has no finite number or no known direction, and rows are not to be dropped.
        """
        table = _long(open_table(self.path), self.path)
        how = self.how
        for first, cells in table.blocks(part, BLOCK_ROWS, numbers=how.numbers, text=how.text):
            check, words = how.checked(_Part(table, part), cells, first)
            position, force = (
                how.si(column, cells)[check.kept] for column in (how.choice.position, how.choice.force)
            )
            direction = None if words is None else words[check.kept]
            yield Block(position, force, direction, len(check.kept), check.left_out)

    def places(self) -> Places:
        """Where the rows of the file stand."""
        return open_table(self.path)


class _Part:
    """Where the rows of a part stand. The rows before the part are counted only when a place is needed."""

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
    negate: tuple[str, ...] = (),
    invalid: Literal["refuse", "drop"] = "refuse",
    part_rows: int = PART_ROWS,
) -> LongRecording:
    """Choose the columns of a file without reading its rows; the arguments are those of `read_recording`.

    Raises
    ------
    InputError
        One sentence that names the file, the column and what would be right.
    """
    file = Path(path)
    require_file(file)
    table = open_table(file)
    how = Conversion.of(
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
    if how.direction == "segment" and direction is None and "segment" not in table.text_names:
        how = replace(how, direction=None)  # numbered segments do not state the stroke
    notes = how.note(dialect=table.notes), *how.choice.notes
    how = replace(how, choice=replace(how.choice, time=None, inputs=()))
    rows, parts = _long(table, file).parts(part_rows)
    return LongRecording(
        path=file,
        how=how,
        parts=tuple(parts),
        rows=rows,
        source=Source(files=(str(file),), sha256=sha256_of_file(file), rows=0, columns=how.names),
        notes=notes,
    )


def _long(table: Table, file: Path) -> LongTable:
    if not isinstance(table, LongTable):
        raise InputError(
            f"{file} cannot be read part by part; leave out --out-of-core, --jobs and --scheduler, or "
            "convert the file to CSV or Parquet"
        )
    return table

# SPDX-License-Identifier: Apache-2.0
"""A recording that may be larger than memory: force over position, part by part."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from .._typing import Float1D, Int8Vector
from ..errors import InputError
from .columns import Choice, Column, choose_columns
from .files import require_file, sha256_of_file
from .layout import Layout
from .notes import chosen
from .recording import UNSTATED, Source
from .rows import LeftOut, RowCheck
from .table import Places, TableFile
from .tables import open_table

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
    choice: Choice
    direction: str | None
    status: str | None
    """Column that says of each row whether its force was the model's alone"""
    negate: tuple[str, ...]
    drop: bool
    parts: tuple[tuple[int, int], ...]
    """Places between which the file is read apart"""
    rows: int
    """Rows of the file, counted without reading their cells"""
    units: Mapping[str, str]
    source: Source
    """Without the number of rows that are used"""
    notes: tuple[str, ...]

    def blocks(self, part: tuple[int, int]) -> Iterator[Block]:
        """Position, force and direction of the rows of a part, block by block.

        Raises
        ------
        InputError
            A row has no finite number or no known direction, and rows are not to be dropped.
        """
        table = open_table(self.path)
        columns = (self.choice.position, self.choice.force)
        numbers = [column.name for column in columns]
        text = [name for name in (self.direction, self.status) if name is not None]
        for first, cells in table.blocks(part, BLOCK_ROWS, numbers=numbers, text=text):
            rows = len(cells[numbers[0]])
            check = RowCheck(str(self.path), _Part(table, part), first, rows, self.drop)
            if self.status is not None:
                check.as_modelled(cells[self.status])
            for name in numbers:
                check.finite(name, cells[name])
            words = (
                None if self.direction is None else check.directions(self.direction, cells[self.direction])
            )
            position, force = (self._read(column, cells[column.name])[check.kept] for column in columns)
            direction = None if words is None else words[check.kept]
            yield Block(position, force, direction, rows, check.left_out)

    def places(self) -> Places:
        """Where the rows of the file stand."""
        return open_table(self.path)

    def _read(self, column: Column, values: Float1D) -> Float1D:
        role = "position" if column is self.choice.position else "force"
        sign = -1.0 if {role, column.name} & set(self.negate) else 1.0
        return values * (sign if column.unit is None else sign * column.unit.factor)


class _Part:
    """Where the rows of a part stand. The rows before the part are counted only when a place is needed."""

    def __init__(self, table: TableFile, part: tuple[int, int]) -> None:
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
    layout = Layout.taken_from(str(file), dict(table.metadata))
    choice = choose_columns(
        str(file),
        table.names,
        position=position or layout.roles.get("position"),
        force=force or layout.roles.get("force"),
        time=time or layout.roles.get("time"),
        direction=direction or layout.roles.get("direction"),
        units=units,
        unstated=layout.roles.values(),
        text=table.text_names,
        steady=table.steady_names,
    )
    used = {"position", "force", choice.position.name, choice.force.name}
    for name in negate:
        if name not in used:
            raise InputError(
                f"{file}: --negate {name} names no column that is used ({', '.join(sorted(used))})"
            )
    stroke = choice.direction
    if stroke == "segment" and direction is None and stroke not in table.text_names:
        stroke = None  # numbered segments do not state the stroke
    status = layout.roles.get("status")
    if status is not None and status not in table.names:
        raise InputError(f"{file} has no column {status!r}, which its metadata names as the status")
    rows, parts = table.parts(part_rows)
    columns = {"position": choice.position.name, "force": choice.force.name}
    return LongRecording(
        path=file,
        choice=choice,
        direction=stroke,
        status=status,
        negate=tuple(negate),
        drop=invalid == "drop",
        parts=tuple(parts),
        rows=rows,
        units={
            "position": choice.position.unit.si if choice.position.unit else UNSTATED,
            "force": choice.force.unit.si if choice.force.unit else UNSTATED,
        },
        source=Source(
            files=(str(file),),
            sha256=sha256_of_file(file),
            rows=0,
            columns=columns if stroke is None else {**columns, "direction": stroke},
        ),
        notes=(chosen(choice, stroke, None, table.notes), *choice.notes),
    )

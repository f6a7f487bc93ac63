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
from .csv_file import CsvFile
from .files import require_file, sha256_of_file
from .layout import Layout
from .notes import chosen
from .parquet_file import ParquetFile
from .recording import UNSTATED, Source
from .rows import RowCheck
from .table import TableFile

PART_ROWS = 4_000_000
"""Rows of a part: what one worker reads at a time."""

BLOCK_ROWS = 500_000
"""Rows that are in memory at a time."""


@dataclass(frozen=True)
class LongRecording:
    """How a file is read; from :func:`open_long_recording`, and light enough to be sent to workers."""

    path: Path
    choice: Choice
    direction: str | None
    negate: tuple[str, ...]
    drop: bool
    parts: tuple[tuple[int, int], ...]
    """Places between which the file is read apart"""
    units: Mapping[str, str]
    source: Source
    """Without the number of its rows, which nobody has counted yet"""
    notes: tuple[str, ...]

    def blocks(self, part: tuple[int, int]) -> Iterator[tuple[Float1D, Float1D, Int8Vector | None]]:
        """Position, force (SI) and direction of the rows of a part, block by block.

        Raises
        ------
        InputError
            A row has no finite number or no known direction, and rows are not to be dropped.
        """
        table = _table(self.path)
        columns = (self.choice.position, self.choice.force)
        numbers = [column.name for column in columns]
        text = [self.direction] if self.direction else []
        for first, cells in table.blocks(part, BLOCK_ROWS, numbers=numbers, text=text):
            check = RowCheck(str(self.path), _Part(table, part), first, len(cells[numbers[0]]), self.drop)
            for name in numbers:
                check.finite(name, cells[name])
            words = (
                None if self.direction is None else check.directions(self.direction, cells[self.direction])
            )
            position, force = (self._read(column, cells[column.name])[check.kept] for column in columns)
            if len(position):
                yield position, force, None if words is None else words[check.kept]

    def _read(self, column: Column, values: Float1D) -> Float1D:
        role = "position" if column is self.choice.position else "force"
        sign = -1.0 if {role, column.name} & set(self.negate) else 1.0
        return values * (sign if column.unit is None else sign * column.unit.factor)


class _Part:
    """Where a person finds a row of a part; only when it is asked does anybody count the rows before."""

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
    table = _table(file)
    layout = Layout.taken_from(str(file), dict(table.metadata))
    choice = choose_columns(
        str(file),
        table.names,
        position=position or layout.roles.get("position"),
        force=force or layout.roles.get("force"),
        time=layout.roles.get("time"),
        direction=direction or layout.roles.get("direction"),
        units=units,
        unstated=layout.roles.values(),
    )
    used = {"position", "force", choice.position.name, choice.force.name}
    for name in negate:
        if name not in used:
            raise InputError(
                f"{file}: --negate {name} names no column that is used ({', '.join(sorted(used))})"
            )
    stroke = choice.direction
    columns = {"position": choice.position.name, "force": choice.force.name}
    return LongRecording(
        path=file,
        choice=choice,
        direction=stroke,
        negate=tuple(negate),
        drop=invalid == "drop",
        parts=tuple(table.parts(part_rows)),
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
        notes=(chosen(choice, stroke, None), *choice.notes),
    )


def _table(path: Path) -> TableFile:
    return ParquetFile(path) if path.suffix == ".parquet" else CsvFile(path)

# SPDX-License-Identifier: Apache-2.0
"""Excel workbooks: choice of the sheet; its rows without cells that are empty."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any

from ..errors import InputError, escaped, shortened
from .dialect import (
    LEAST_CONSECUTIVE_ROWS,
    decimal_mark,
    find_header,
    first_row_as_header,
    with_checked_names,
)
from .files import readable, require_memory
from .memory_table import MemoryTable, cells_of
from .table import Table

MOST_HEADER_ROWS = 200
"""Number of first rows of a sheet, without empty ones, among which the header is searched."""

_ELEMENT_BYTES, _CELL_BYTES = 100, 400
"""Memory of an XML element, and of a cell while its row is read [bytes]."""


def read_excel(path: Path, members: Iterable[tuple[str, bytes]], openpyxl: Any) -> Table:
    """Returns the first visible sheet with cells as a table; a hidden one if no visible sheet has cells.

    Parameters
    ----------
    path : Path
        The workbook.
    members : iterable of (str, bytes)
        Names and contents of the files in the workbook.
    openpyxl : module
    """
    with readable(path, "Excel (.xlsx)"):
        require_memory(path, sum(_memory_of(content) for _, content in members))
        book = openpyxl.load_workbook(path, read_only=True, data_only=True)
        sheets = sorted(book.worksheets, key=lambda each: each.sheet_state != "visible")
        rows: dict[int, list[Any]] = {}
        for sheet in sheets:
            if rows := _filled_rows(sheet):
                break
        book.close()
    if not rows:
        raise InputError(f"{path} has no sheet with cells")
    numbers, values = list(rows), list(rows.values())
    texts = [["" if cell is None else str(cell) for cell in row] for row in values[:MOST_HEADER_ROWS]]
    width = max(map(len, texts))
    texts = [row + [""] * (width - len(row)) for row in texts]
    header = find_header(texts) or first_row_as_header(texts)
    named = max((k for k, name in enumerate(header.names, 1) if name), default=0)
    longer = [number for number in numbers[header.first :] if len(rows[number]) > named]
    if not longer:
        header = replace(header, names=header.names[:named])
    elif named == len(header.names) or len(longer) < LEAST_CONSECUTIVE_ROWS:
        raise InputError(
            f"{path}, row {longer[0]}: {len(rows[longer[0]])} cells, but the header names {named} columns"
        )
    header, header_notes = with_checked_names(f"{path}, row {numbers[header.row or 0]}", header)
    numbers, values = numbers[header.first :], values[header.first :]
    decimal = "."
    if header.numbers:
        decimal = decimal_mark(f"{path}, row {numbers[0]}", texts[header.first :])
    columns = {
        name: cells_of([row[k] if k < len(row) else None for row in values], decimal)
        for k, name in enumerate(header.names)
    }
    metadata = {}
    for row in texts[: header.row]:
        key, _, value = row[0].partition(":")
        metadata[escaped(key.strip())] = escaped(" ".join(" ".join([value, *row[1:]]).split()))
    hidden = "" if sheet.sheet_state == "visible" else "hidden "
    notes = [f"{hidden}sheet {shortened(sheet.title)}"] if len(sheets) > 1 or hidden else []
    if header.row:
        notes.append(f"{header.row} row{'s' * (header.row > 1)} before the header")
    if header.units_row is not None:
        notes.append("units in a second header row")
    if numbers and numbers[-1] - numbers[0] + 1 != len(numbers):
        notes.append("empty rows are left out")
    return MemoryTable(path, columns, metadata, [*notes, *header_notes], ("row", numbers), decimal)


def _filled_rows(sheet: Any) -> dict[int, list[Any]]:
    """Returns the cells of each row that is not empty, by row number, without empty cells at the end."""
    # The stated size of a sheet can be that of one stray cell; without it a row ends with its last cell.
    sheet.reset_dimensions()
    rows = {}
    for number, row in enumerate(sheet.iter_rows(values_only=True), 1):
        filled = [k for k, cell in enumerate(row) if _is_filled(cell)]
        if filled:
            rows[number] = list(row[: filled[-1] + 1])
    return rows


def _is_filled(cell: Any) -> bool:
    return bool(cell.strip()) if isinstance(cell, str) else cell is not None


def _memory_of(member: bytes) -> int:
    """Returns the memory for the content of one file of a workbook, which is XML [bytes]."""
    cells_of_rows = map(_tags, member.split(b"row>"))
    return len(member) + _ELEMENT_BYTES * member.count(b"<") + _CELL_BYTES * max(cells_of_rows)


def _tags(text: bytes) -> int:
    return text.count(b"<")

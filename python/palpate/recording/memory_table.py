# SPDX-License-Identifier: Apache-2.0
"""Table in memory, for formats that are read as a whole; import of the optional libraries of formats."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import InputError, listed
from .dialect import refuse_marks
from .looks import LOOK_ROWS, Look
from .table import MISSING, Cells, Table, parse_with, to_numbers


class MemoryTable(Table):
    """Table in memory.

    Parameters
    ----------
    path : Path
    columns : mapping of str to (n,) array
        float64, or objects of str.
    metadata : mapping, optional
    notes : sequence of str, optional
        Statements on how the file was read, as parts of one sentence.
    first : (str, int or sequence), optional
        Word for a row, and number of the first row or of each row, for the sentences.
    decimal : str
        Decimal mark of numbers that are stored as text.
    """

    def __init__(
        self,
        path: Path,
        columns: Mapping[str, Cells],
        metadata: Mapping[str, str] | None = None,
        notes: Sequence[str] = (),
        first: tuple[str, int | Sequence[int | str]] = ("row", 0),
        decimal: str = ".",
    ) -> None:
        self._path, self._columns, self._first, self._decimal = path, dict(columns), first, decimal
        self.names = tuple(self._columns)
        self.metadata = dict(metadata or {})
        self.notes = tuple(notes)
        self.looks = {
            name: Look.of(cells[:LOOK_ROWS].tolist(), decimal) for name, cells in self._columns.items()
        }
        if len(self.names) < 2:
            raise InputError(
                f"{path} has fewer than two columns ({listed(self.names)}); a recording needs a "
                "position and a force"
            )

    def read(self, *, numbers: Collection[str], text: Collection[str]) -> dict[str, Cells]:
        columns = {}
        for name, cells in self._columns.items():
            if name in text:
                cells = np.array([_as_text(cell) for cell in cells], dtype=object)
            elif name in numbers and cells.dtype == object:
                found = to_numbers(cells, self._decimal)
                refuse_marks(f"{self._path}: column {name}", cells[np.isnan(found)], self._decimal)
                cells = found
            columns[name] = cells
        return columns

    def place(self, row: int) -> str:
        word, number = self._first
        return f"{word} {number + row if isinstance(number, int) else number[row]}"

    def cell(self, row: int, name: str) -> str:
        return _as_text(self._columns[name][row])


def _as_text(value: Any) -> str:
    return "" if value is None or value != value else f"{value:g}" if isinstance(value, float) else str(value)


def import_library(name: str, path: Path, kind: str, extra: str) -> Any:
    """Imports an optional library that reads or writes a file of this kind.

    Raises
    ------
    InputError
        The library is not installed; the message names the command that installs it.
    """
    try:
        return import_module(name)
    except ImportError:
        raise InputError(
            f"{path} is {kind}, which needs {name.split('.')[0]}: "
            f"install it with pip install 'palpate[{extra}]'"
        ) from None


def cells_of(values: Sequence[Any], decimal: str) -> Cells:
    """Returns the cells of a column as numbers if every cell is a number or missing, else as text."""
    if all(
        value is None or (isinstance(value, (int, float)) and not isinstance(value, bool)) for value in values
    ):
        return np.array([np.nan if value is None else float(value) for value in values])
    text = np.array(["" if value is None else str(value) for value in values], dtype=object)
    if all(word.strip() in MISSING or parse_with(word, decimal) is not None for word in text):
        return to_numbers(text, decimal)
    return text

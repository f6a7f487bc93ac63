# SPDX-License-Identifier: Apache-2.0
"""Interface of all tables that are read: names first, cells later; and the numbers that cells hold."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Collection, Iterator, Mapping, Sequence
from typing import Any, Protocol, TypeAlias

import numpy as np
from numpy.typing import NDArray

Cells: TypeAlias = NDArray[Any]
"""(n,) float64 for numbers (NaN where a cell holds none), (n,) object of str for text"""


class Places(Protocol):
    """Where the rows of a table stand."""

    def place(self, row: int) -> str: ...

    def cell(self, row: int, name: str) -> str: ...


class Table(ABC):
    """A table with a header, read in two steps so that only the header is needed to choose columns."""

    names: tuple[str, ...]
    metadata: Mapping[str, str]
    torn = 0
    """Torn lines at the end that are left out"""
    notes: Sequence[str] = ()
    """How the table was read where it differs from a plain one, in parts of a sentence"""
    text_names: Collection[str] = ()
    """Columns that are known to hold text before the rows are read"""
    steady_names: Collection[str] = ()
    """Columns that have one or two values at the start of the table, as far as they are read by then"""

    @abstractmethod
    def read(self, *, numbers: Collection[str], text: Collection[str]) -> dict[str, Cells]:
        """All columns. Those in `numbers` become float64 whatever they hold, those in `text` become strings;
        any other is numeric if every cell of it is."""

    @abstractmethod
    def place(self, row: int) -> str:
        """Where a person finds a row: "line 12"."""

    @abstractmethod
    def cell(self, row: int, name: str) -> str:
        """The text of one cell as it stands in the table."""


class LongTable(Table):
    """A table that can also be read part by part."""

    @abstractmethod
    def parts(self, rows: int) -> tuple[int, list[tuple[int, int]]]:
        """Number of rows of the file, counted without reading cells, and places (start, stop) that divide it
        into parts of about so many rows, or more.

        Raises
        ------
        InputError
            The file cannot be read part by part.
        """

    @abstractmethod
    def blocks(
        self, part: tuple[int, int], rows: int, *, numbers: Collection[str], text: Collection[str]
    ) -> Iterator[tuple[int, dict[str, Cells]]]:
        """The first row's number within the part, and the columns named, of each block of so many rows."""

    @abstractmethod
    def rows_before(self, part: tuple[int, int]) -> int:
        """Rows of the file that come before a part."""


def parse_number(text: str) -> float | None:
    """The number that a cell holds, or None. NaN and infinity count as numbers here."""
    try:
        # float() would accept 1_000, which no other reader of the file does.
        return None if "_" in text else float(text)
    except ValueError:
        return None


def parse_with(text: str, decimal: str) -> float | None:
    """The number that a cell holds, written with this decimal mark, or None."""
    if decimal == ".":
        return parse_number(text)
    return None if "." in text or text.count(",") > 1 else parse_number(text.replace(",", "."))


MISSING = ("", "NaN", "nan", "-NaN", "-nan", "NA", "N/A", "#N/A", "n/a", "NULL", "null", "None")
"""How a cell of a numeric column says that it has no value."""


def to_numbers(cells: Cells, decimal: str = ".") -> NDArray[np.float64]:
    """Turn strings into numbers, with NaN where a cell holds none."""

    def number(cell: Any) -> float:
        value = parse_with(cell, decimal) if isinstance(cell, str) else cell
        return np.nan if value is None else value

    return np.fromiter(map(number, cells), dtype=np.float64, count=len(cells))

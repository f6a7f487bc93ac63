# SPDX-License-Identifier: Apache-2.0
"""Tables whose column names are read before their cells; parsing of numbers; a DataFrame as a table."""

from __future__ import annotations

import re
from abc import ABC, abstractmethod
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Protocol, TypeAlias

import numpy as np
from numpy.typing import NDArray

from ..arguments import shown
from ..errors import InputError
from ..frames import pd

if TYPE_CHECKING:
    from .looks import Look

Cells: TypeAlias = NDArray[Any]
"""(n,) float64 for numbers (NaN for a cell without a number), (n,) object of str for text"""


class Places(Protocol):
    """Line numbers of the rows of a table, and texts of its cells, for messages."""

    def place(self, row: int) -> str: ...

    def cell(self, row: int, name: str) -> str: ...


class Table(ABC):
    """Table that is read in two steps: first its header, to choose the columns, then its cells."""

    names: tuple[str, ...]
    metadata: Mapping[str, str]
    torn = 0
    """Number of lines (0 or 1) at the end of the file that are ignored because they are incomplete"""
    notes: Sequence[str] = ()
    """Differences of the file from a plain table, as parts of one sentence"""
    looks: Mapping[str, Look] = MappingProxyType({})
    """First rows of each column; a column without a look is taken to hold numbers"""
    starts: Sequence[int] = ()
    """Rows at which a further block of the file begins, whose time can begin again"""

    @property
    def text_names(self) -> set[str]:
        """Columns that hold text in the first rows."""
        return {name for name, look in self.looks.items() if look.text}

    @abstractmethod
    def read(self, *, numbers: Collection[str], text: Collection[str]) -> dict[str, Cells]:
        """Returns all columns. Those in `numbers` become float64, those in `text` become strings. Any other
        column is numeric if all its cells are.
        """

    @abstractmethod
    def place(self, row: int) -> str:
        """Returns the place of a row in the file, for messages: "line 12"."""

    @abstractmethod
    def cell(self, row: int, name: str) -> str:
        """Returns the unchanged text of one cell."""


class LongTable(Table):
    """Table in a file that can also be read in parts, because it may be larger than memory."""

    @abstractmethod
    def parts(self, rows: int) -> tuple[int, list[tuple[int, int]]]:
        """Returns the number of rows, counted without reading cells, and places (start, stop) of parts.

        Each part except the last has at least about `rows` rows.

        Raises
        ------
        InputError
            The file cannot be read in parts.
        """

    @abstractmethod
    def blocks(
        self, part: tuple[int, int], rows: int, *, numbers: Collection[str], text: Collection[str]
    ) -> Iterator[tuple[int, dict[str, Cells]]]:
        """Yields, for each block, the number of its first row within the part and the named columns."""

    @abstractmethod
    def rows_before(self, part: tuple[int, int]) -> int:
        """Returns the number of rows of the file before a part."""


def parse_number(text: str) -> float | None:
    """Returns the number in a cell, or None. NaN and infinity count as numbers."""
    try:
        # Python's float() accepts "1_000", which other programs do not read as a number.
        return None if "_" in text else float(text)
    except ValueError:
        return None


_GROUPED = re.compile(
    r"\s*([-+]?\d{1,3}(?:(?P<group>[.,'’ \u00a0\u202f])\d{3})(?:(?P=group)\d{3})*)"
    r"(?:(?P<decimal>[.,])(\d*))?\s*"
)
"""Number whose digits are in groups of three."""


def parse_with(text: str, marks: str) -> float | None:
    """Returns the number in a cell, or None.

    Parameters
    ----------
    text : str
    marks : str
        The decimal mark, "." or ",", and behind it the mark between thousands if it is known. A cell with
        both marks, several groups of thousands, or an apostrophe or space between them, needs no known mark.
    """
    decimal = marks[:1] or "."
    number = (
        text if decimal == "." else text.replace(",", ".") if "." not in text and text.count(",") < 2 else ""
    )
    if (value := parse_number(number)) is not None:
        return value
    if not (found := _GROUPED.fullmatch(text)):
        return None
    whole, group, mark, fraction = found.groups()
    is_known = mark == decimal or whole.count(group) > 1 or group in marks[1:]
    known = group not in ".," or (group != decimal and is_known)
    if not known or mark not in (None, decimal):
        return None
    return parse_number(whole.replace(group, "") + "." + (fraction or ""))


MISSING = ("", "NaN", "nan", "-NaN", "-nan", "NA", "N/A", "#N/A", "n/a", "NULL", "null", "None")
"""Texts that mean a missing value in a column of numbers."""


def to_numbers(cells: Cells, marks: str = ".") -> NDArray[np.float64]:
    """Converts strings to numbers; NaN for a cell without a number."""

    def number(cell: Any) -> float:
        value = parse_with(cell, marks) if isinstance(cell, str) else cell
        return np.nan if value is None else value

    return np.fromiter(map(number, cells), dtype=np.float64, count=len(cells))


FRAME = "the frame"
"""Name of a pandas frame in messages, because a frame has no file name."""


@contextmanager
def python_arguments() -> Iterator[None]:
    """Replaces command line options by the names of Python arguments in a message about a file."""
    try:
        yield
    except InputError as error:
        message = re.sub(r"--units (\w+)=(\w+)", r'units={"\1": "\2"}', str(error))
        message = re.sub(r"--([a-z_]+) (\w+)", r'\1="\2"', message)
        message = message.replace("correct the file", "correct the frame").replace("--", "")
        raise InputError(message) from None


class FrameTable(Table):
    """Columns of a frame; a named index is one more column, and ``attrs`` are the metadata."""

    def __init__(self, frame: pd.DataFrame) -> None:
        if not isinstance(frame, pd.DataFrame):
            raise InputError(f"frame is {shown(frame)}; it must be a pandas DataFrame")
        if isinstance(frame.index.name, str) and frame.index.name not in frame.columns:
            frame = frame.reset_index()
        for name in frame.columns:
            if not isinstance(name, str):
                raise InputError(f"{FRAME} has a column called {name!r}; every column name must be text")
        if not frame.columns.is_unique:
            repeated = frame.columns[frame.columns.duplicated()][0]
            raise InputError(f"{FRAME} has several columns called {repeated}; give each one name")
        self._frame = frame
        self.names = tuple(frame.columns)
        self.metadata = {str(key): str(value) for key, value in frame.attrs.items()}

    def read(self, *, numbers: Collection[str], text: Collection[str]) -> dict[str, Cells]:
        """Returns all columns as float64 or text."""
        return {
            name: _numbers(self._frame[name])
            if name in numbers
            else _texts(self._frame[name])
            if name in text or not _is_real(self._frame[name])
            else _floats(self._frame[name])
            for name in self.names
        }

    def place(self, row: int) -> str:
        """Returns the place of a row for messages: its number in the frame and its index label."""
        return f"row {row} (index {self._frame.index[row]!r})"

    def cell(self, row: int, name: str) -> str:
        """Returns a cell as text; long texts are cut."""
        value = self._frame[name].iloc[row]
        return "" if value is None or value is pd.NA else shown(str(value))[1:-1]


def _is_real(column: pd.Series[Any]) -> bool:
    return pd.api.types.is_numeric_dtype(column.dtype) and not pd.api.types.is_complex_dtype(column.dtype)


def _floats(column: pd.Series[Any]) -> Cells:
    return column.to_numpy(dtype=np.float64, na_value=np.nan, copy=True)


def _numbers(column: pd.Series[Any]) -> Cells:
    """Returns the column as float64; NaN for a cell without a real number."""
    if pd.api.types.is_complex_dtype(column.dtype):
        raise InputError(f"{FRAME}: column {column.name} holds complex numbers; give real ones")
    if pd.api.types.is_bool_dtype(column.dtype) or pd.api.types.is_datetime64_any_dtype(column.dtype):
        raise InputError(f"{FRAME}: column {column.name} holds {column.dtype}, not numbers")
    if pd.api.types.is_numeric_dtype(column.dtype):
        return _floats(column)
    return np.array([_number(cell) for cell in column], dtype=np.float64)


def _number(cell: object) -> float:
    if isinstance(cell, str):
        value = parse_number(cell)
        return np.nan if value is None else value
    try:
        return float(cell)  # type: ignore[arg-type]
    except (TypeError, ValueError):
        return np.nan


def _texts(column: pd.Series[Any]) -> Cells:
    """Returns the cells of a column as text; missing cells are empty."""
    missing = column.isna()
    return np.array(
        ["" if is_missing else str(cell) for cell, is_missing in zip(column, missing, strict=True)], object
    )

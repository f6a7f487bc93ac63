# SPDX-License-Identifier: Apache-2.0
"""A pandas DataFrame as a table, and messages that name arguments in place of the command line's options."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
import pandas as pd

from ..arguments import shown
from ..errors import InputError
from .table import Cells, Table, parse_number

NAME = "the frame"
"""The frame in messages, where a file has its name."""


@contextmanager
def python_arguments() -> Iterator[None]:
    """Names the arguments of Python in a message about a file, in place of the command line's options."""
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
                raise InputError(
                    f"{NAME} has a column called {name!r}; names must be text that ends in a unit"
                )
        if not frame.columns.is_unique:
            twice = frame.columns[frame.columns.duplicated()][0]
            raise InputError(f"{NAME} has several columns called {twice}; give each one name")
        self._frame = frame
        self.names = tuple(frame.columns)
        self.metadata = {str(key): str(value) for key, value in frame.attrs.items()}

    def read(self, *, numbers: Collection[str], text: Collection[str]) -> dict[str, Cells]:
        """All columns, as float64 or text."""
        return {
            name: _numbers(self._frame[name])
            if name in numbers
            else _words(self._frame[name])
            if name in text or not _is_real(self._frame[name])
            else _floats(self._frame[name])
            for name in self.names
        }

    def place(self, row: int) -> str:
        """Position and index label of a row."""
        return f"row {row} (index {self._frame.index[row]!r})"

    def cell(self, row: int, name: str) -> str:
        """A cell as text, cut where it is long."""
        value = self._frame[name].iloc[row]
        return "" if value is None or value is pd.NA else shown(str(value))[1:-1]


def _is_real(column: pd.Series[Any]) -> bool:
    return pd.api.types.is_numeric_dtype(column.dtype) and not pd.api.types.is_complex_dtype(column.dtype)


def _floats(column: pd.Series[Any]) -> Cells:
    return column.to_numpy(dtype=np.float64, na_value=np.nan, copy=True)


def _numbers(column: pd.Series[Any]) -> Cells:
    """The column as float64, with NaN where a cell holds no real number."""
    if pd.api.types.is_complex_dtype(column.dtype):
        raise InputError(f"{NAME}: column {column.name} holds complex numbers; give real ones")
    if pd.api.types.is_bool_dtype(column.dtype) or pd.api.types.is_datetime64_any_dtype(column.dtype):
        raise InputError(f"{NAME}: column {column.name} holds {column.dtype}, not numbers")
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


def _words(column: pd.Series[Any]) -> Cells:
    """The cells of a column as text, empty where there is none."""
    missing = column.isna()
    return np.array(["" if gone else str(cell) for cell, gone in zip(column, missing, strict=True)], object)

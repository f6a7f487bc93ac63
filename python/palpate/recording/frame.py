# SPDX-License-Identifier: Apache-2.0
"""A recording from a pandas DataFrame: columns are chosen by name and unit, as from a file."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any

import numpy as np
import pandas as pd

from ..arguments import shown
from ..errors import InputError
from .columns import Column, choose_columns
from .notes import chosen, noticed
from .reading import MIN_POSITIONS, MIN_ROWS
from .recording import UNSTATED, Recording, Source
from .rows import RowCheck
from .table import Cells, parse_number
from .units import COLUMN_SUFFIX

NAME = "the frame"
"""The frame in messages, where a file has its name."""


class FrameRows:
    """Rows of a frame, for messages."""

    def __init__(self, frame: pd.DataFrame) -> None:
        self._frame = frame

    def place(self, row: int) -> str:
        """Position and index label of a row."""
        return f"row {row} (index {self._frame.index[row]!r})"

    def cell(self, row: int, name: str) -> str:
        """A cell as text, cut where it is long."""
        value = self._frame[name].iloc[row]
        return "" if value is None or value is pd.NA else shown(str(value))[1:-1]


@contextmanager
def _python_arguments() -> Iterator[None]:
    """Names the arguments of Python in a message about a file, in place of the command line's options."""
    try:
        yield
    except InputError as error:
        message = re.sub(r"--units (\w+)=(\w+)", r'units={"\1": "\2"}', str(error))
        message = re.sub(r"--([a-z_]+) (\w+)", r'\1="\2"', message)
        message = message.replace("correct the file", "correct the frame").replace("--", "")
        raise InputError(message) from None


@_python_arguments()
def recording_of_frame(
    frame: pd.DataFrame,
    *,
    position: str | None,
    force: str | None,
    time: str | None,
    direction: str | None,
    inputs: Sequence[str],
    units: Mapping[str, str] | None,
    drop: bool,
) -> Recording:
    """See :meth:`palpate.Recording.from_frame`."""
    if not isinstance(frame, pd.DataFrame):
        raise InputError(f"frame is {shown(frame)}; it must be a pandas DataFrame")
    if isinstance(frame.index.name, str) and frame.index.name not in frame.columns:
        frame = frame.reset_index()
    for name in frame.columns:
        if not isinstance(name, str):
            raise InputError(f"{NAME} has a column called {name!r}; names must be text that ends in a unit")
    if not frame.columns.is_unique:
        twice = frame.columns[frame.columns.duplicated()][0]
        raise InputError(f"{NAME} has several columns called {twice}; give each one name")
    choice = choose_columns(
        NAME,
        tuple(frame.columns),
        position=position,
        force=force,
        time=time,
        direction=direction,
        inputs=tuple(inputs),
        units=units,
    )
    numeric = [column for column in (choice.position, choice.force, choice.time, *choice.inputs) if column]
    cells: dict[str, Cells] = {column.name: _numbers(frame[column.name]) for column in numeric}
    stroke = choice.direction
    words = None if stroke is None else _words(frame[stroke])
    if stroke == "segment" and direction is None and words is not None and all(map(_is_number, words)):
        # Numbered segments state no direction.
        stroke, words = None, None

    check = RowCheck(NAME, FrameRows(frame), 0, len(frame), drop)
    for column in numeric:
        check.finite(column.name, cells[column.name])
    directions = None if stroke is None or words is None else check.directions(stroke, words)
    if choice.time is not None:
        check.increasing(choice.time.name, cells[choice.time.name])
    kept = check.kept
    si = {column.name: _in_si(column, cells[column.name][kept]) for column in numeric}
    directions = None if directions is None else directions[kept]
    x, f = si[choice.position.name], si[choice.force.name]
    if len(x) < MIN_ROWS or len(np.unique(x)) < MIN_POSITIONS:
        told = "".join(f"; {note}" for note in check.notes)
        raise InputError(
            f"{NAME} has {len(x)} usable rows and {len(np.unique(x))} distinct positions; "
            f"a recording needs at least {MIN_ROWS} rows and {MIN_POSITIONS} positions{told}"
        )
    time_s = None if choice.time is None else si[choice.time.name]
    others = [name for name in frame.columns if name not in si and name != stroke]
    digest = hashlib.sha256()
    for array in (*si.values(), directions):
        if array is not None:
            digest.update(np.ascontiguousarray(array).tobytes())
    roles = {"position": choice.position, "force": choice.force, "time": choice.time}
    names = {role: column.name for role, column in roles.items() if column is not None}
    names |= {} if stroke is None else {"direction": stroke}
    names |= {_si_name(column): column.name for column in choice.inputs}
    return Recording(
        position=x,
        force=f,
        time=time_s,
        direction=directions,
        inputs=np.column_stack([*(si[column.name] for column in choice.inputs), np.empty((len(x), 0))]),
        input_names=tuple(map(_si_name, choice.inputs)),
        columns={name: _column(frame[name])[kept] for name in others},
        metadata={str(key): str(value) for key, value in frame.attrs.items()},
        units={
            role: UNSTATED if column is None or column.unit is None else column.unit.si
            for role, column in roles.items()
            if role != "time"
        },
        source=Source(files=(), sha256=digest.hexdigest(), rows=len(x), columns=names),
        notes=(chosen(choice, stroke, None), *choice.notes, *check.notes, *noticed(x, f, directions)),
    )


def _numbers(column: pd.Series[Any]) -> Cells:
    """The column as float64, with NaN where a cell holds no real number."""
    if pd.api.types.is_complex_dtype(column.dtype):
        raise InputError(f"{NAME}: column {column.name} holds complex numbers; give real ones")
    if pd.api.types.is_bool_dtype(column.dtype) or pd.api.types.is_datetime64_any_dtype(column.dtype):
        raise InputError(f"{NAME}: column {column.name} holds {column.dtype}, not numbers")
    if pd.api.types.is_numeric_dtype(column.dtype):
        return column.to_numpy(dtype=np.float64, na_value=np.nan, copy=True)
    return np.array([_number(cell) for cell in column], dtype=np.float64)


def _number(cell: object) -> float:
    if isinstance(cell, str):
        value = parse_number(cell)
        return np.nan if value is None else value
    try:
        return float(cell)  # type: ignore[arg-type]
    except (TypeError, ValueError):
        return np.nan


def _is_number(word: str) -> bool:
    return parse_number(word) is not None


def _words(column: pd.Series[Any]) -> Cells:
    """The cells of a column of directions as text, empty where there is none."""
    missing = column.isna()
    return np.array(["" if gone else str(cell) for cell, gone in zip(column, missing, strict=True)], object)


def _column(column: pd.Series[Any]) -> Cells:
    """Any other column: float64 if it is numeric, else text."""
    if pd.api.types.is_numeric_dtype(column.dtype) and not pd.api.types.is_complex_dtype(column.dtype):
        return column.to_numpy(dtype=np.float64, na_value=np.nan, copy=True)
    return _words(column)


def _in_si(column: Column, values: Cells) -> Cells:
    return values if column.unit is None else values * column.unit.factor


def _si_name(column: Column) -> str:
    """The name of an input after conversion, so that the name still states the unit."""
    return column.name if column.unit is None else f"{column.stem}_{COLUMN_SUFFIX[column.unit.si]}"

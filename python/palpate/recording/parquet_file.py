# SPDX-License-Identifier: Apache-2.0
"""Parquet with the same column names as CSV (needs pyarrow)."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import InputError
from .table import Cells, to_numbers

_BUFFER_BYTES = 1 << 20
"""Read ahead of each column."""


class ParquetFile:
    """A Parquet recording."""

    torn = 0

    def __init__(self, path: Path) -> None:
        try:
            pyarrow = import_module("pyarrow")
            parquet = import_module("pyarrow.parquet")
        except ImportError:
            raise InputError(
                f"{path} is Parquet, which needs pyarrow: install it with pip install pyarrow"
            ) from None
        self._path, self._failures = path, (pyarrow.ArrowException, OSError)
        try:
            # read in small pieces: a file may be larger than memory, and so may one of its row groups
            self._file = parquet.ParquetFile(path, buffer_size=_BUFFER_BYTES, pre_buffer=False)
        except self._failures as error:
            raise self._unreadable(error) from None
        self.names = tuple(str(name) for name in self._file.schema_arrow.names)
        if len(set(self.names)) < len(self.names):
            raise InputError(f"{path}: a column name stands twice in {', '.join(self.names)}")
        if len(self.names) == 1:
            raise InputError(
                f"{path}: there is one column ({self.names[0]}); a recording needs a position and a force"
            )
        stored = self._file.schema_arrow.metadata or {}
        self.metadata = {
            key.decode(): value.decode()
            for key, value in stored.items()
            # What the writing libraries note for themselves says nothing about the measurement.
            if key not in (b"pandas", b"ARROW:schema")
        }

    def read(self, *, numbers: Collection[str], text: Collection[str]) -> dict[str, Cells]:
        """See :class:`palpate.recording.table.TableFile`."""
        try:
            return _cells(self._file.read(), numbers, text)
        except self._failures as error:
            raise self._unreadable(error) from None

    def parts(self, rows: int) -> list[tuple[int, int]]:
        """See :class:`palpate.recording.table.TableFile`: runs of row groups."""
        runs, start, held = [], 0, 0
        for group in range(self._file.num_row_groups):
            held += self._file.metadata.row_group(group).num_rows
            if held >= rows or group == self._file.num_row_groups - 1:
                runs.append((start, group + 1))
                start, held = group + 1, 0
        return runs

    def blocks(
        self, part: tuple[int, int], rows: int, *, numbers: Collection[str], text: Collection[str]
    ) -> Iterator[tuple[int, dict[str, Cells]]]:
        """See :class:`palpate.recording.table.TableFile`."""
        groups = range(*part)
        first = 0
        wanted = [name for name in self.names if name in numbers or name in text]
        try:
            for batch in self._file.iter_batches(batch_size=rows, row_groups=list(groups), columns=wanted):
                yield first, _cells(batch, numbers, text)
                first += batch.num_rows
        except self._failures as error:
            raise self._unreadable(error) from None

    def rows_before(self, part: tuple[int, int]) -> int:
        """See :class:`palpate.recording.table.TableFile`."""
        return sum(self._file.metadata.row_group(group).num_rows for group in range(part[0]))

    def place(self, row: int) -> str:
        """See :class:`palpate.recording.table.TableFile`."""
        return f"row {row}"

    def cell(self, row: int, name: str) -> str:
        """See :class:`palpate.recording.table.TableFile`."""
        for group in range(self._file.num_row_groups):
            rows = self._file.metadata.row_group(group).num_rows
            if row < rows:
                return _as_text(self._file.read_row_group(group, columns=[name]).column(0)[row].as_py())
            row -= rows
        raise IndexError(row)

    def _unreadable(self, error: Exception) -> InputError:
        return InputError(f"{self._path} is not readable as Parquet: {error}")


def _cells(table: Any, numbers: Collection[str], text: Collection[str]) -> dict[str, Cells]:
    """The columns of a table or batch of Arrow."""
    columns: dict[str, Cells] = {}
    for name in map(str, table.schema.names):
        values = table.column(name).to_pandas().to_numpy()
        numeric = values.dtype.kind in "iufb"
        if name in text or (name not in numbers and not numeric):
            columns[name] = np.array([_as_text(value) for value in values], dtype=object)
        else:
            columns[name] = values.astype(np.float64) if numeric else to_numbers(_as_objects(values))
    return columns


def _as_text(value: Any) -> str:
    return "" if value is None or value != value else str(value)


def _as_objects(values: Cells) -> Cells:
    return np.array([_as_text(value) for value in values], dtype=object)

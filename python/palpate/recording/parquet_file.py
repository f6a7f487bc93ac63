# SPDX-License-Identifier: Apache-2.0
"""Parquet with the same column names as CSV (needs pyarrow)."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import InputError
from .files import readable
from .names import listed, shortened, visible
from .table import Cells, to_numbers

_BUFFER_BYTES = 1 << 20
"""Read ahead of each column."""


class ParquetFile:
    """A Parquet recording."""

    torn = 0
    notes: tuple[str, ...] = ()
    steady_names: frozenset[str] = frozenset()

    def __init__(self, path: Path) -> None:
        try:
            parquet = import_module("pyarrow.parquet")
        except ImportError:
            raise InputError(
                f"{path} is Parquet, which needs pyarrow: install it with pip install pyarrow"
            ) from None
        self._path = path
        with readable(path, "Parquet"):
            # read in small pieces: a file may be larger than memory, and so may one of its row groups
            self._file = parquet.ParquetFile(path, buffer_size=_BUFFER_BYTES, pre_buffer=False)
            schema = self._file.schema_arrow
            self._stored = tuple(str(name) for name in schema.names)
            self.names = tuple(map(visible, self._stored))
            self.text_names = {
                name
                for name, field in zip(self.names, schema, strict=True)
                if str(getattr(field.type, "value_type", field.type)) in ("string", "large_string")
            }
            self.metadata = {
                visible(key.decode()): visible(value.decode())
                for key, value in (schema.metadata or {}).items()
                # What the writing libraries note for themselves says nothing about the measurement.
                if key not in (b"pandas", b"ARROW:schema")
            }
        if len(set(self.names)) < len(self.names):
            raise InputError(f"{path}: a column name stands twice in {listed(self.names)}")
        if len(self.names) == 1:
            raise InputError(
                f"{path}: there is one column ({shortened(self.names[0])}); a recording needs a position and "
                "a force"
            )

    def read(self, *, numbers: Collection[str], text: Collection[str]) -> dict[str, Cells]:
        """See :class:`palpate.recording.table.TableFile`."""
        with readable(self._path, "Parquet"):
            return _cells(self._file.read(), self.names, numbers, text)

    def parts(self, rows: int) -> tuple[int, list[tuple[int, int]]]:
        """See :class:`palpate.recording.table.TableFile`: runs of row groups."""
        runs, start, held = [], 0, 0
        for group in range(self._file.num_row_groups):
            held += self._file.metadata.row_group(group).num_rows
            if held >= rows or group == self._file.num_row_groups - 1:
                runs.append((start, group + 1))
                start, held = group + 1, 0
        return self._file.metadata.num_rows, runs

    def blocks(
        self, part: tuple[int, int], rows: int, *, numbers: Collection[str], text: Collection[str]
    ) -> Iterator[tuple[int, dict[str, Cells]]]:
        """See :class:`palpate.recording.table.TableFile`."""
        groups = range(*part)
        first = 0
        pairs = zip(self._stored, self.names, strict=True)
        wanted = [(stored, name) for stored, name in pairs if name in numbers or name in text]
        columns, names = [stored for stored, _ in wanted], [name for _, name in wanted]
        with readable(self._path, "Parquet"):
            batches = self._file.iter_batches(batch_size=rows, row_groups=list(groups), columns=columns)
        while True:
            with readable(self._path, "Parquet"):
                batch = next(batches, None)
                if batch is None:
                    return
                cells = _cells(batch, names, numbers, text)
            yield first, cells
            first += batch.num_rows

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
                stored = self._stored[self.names.index(name)]
                with readable(self._path, "Parquet"):
                    return _as_text(self._file.read_row_group(group, columns=[stored]).column(0)[row].as_py())
            row -= rows
        raise IndexError(row)


def _cells(
    table: Any, names: Sequence[str], numbers: Collection[str], text: Collection[str]
) -> dict[str, Cells]:
    """The columns of a table or batch of Arrow."""
    columns: dict[str, Cells] = {}
    for index, name in enumerate(names):
        values = table.column(index).to_pandas().to_numpy()
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

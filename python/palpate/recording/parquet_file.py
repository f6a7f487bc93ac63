# SPDX-License-Identifier: Apache-2.0
"""Parquet with the same column names as CSV (needs pyarrow)."""

from __future__ import annotations

from collections.abc import Collection
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import InputError
from .table import Cells, to_numbers


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
        try:
            self._table = parquet.read_table(path)
        except (pyarrow.ArrowException, OSError) as error:
            raise InputError(f"{path} is not readable as Parquet: {error}") from None
        self.names = tuple(str(name) for name in self._table.column_names)
        if len(set(self.names)) < len(self.names):
            raise InputError(f"{path}: a column name stands twice in {', '.join(self.names)}")
        if len(self.names) == 1:
            raise InputError(
                f"{path}: there is one column ({self.names[0]}); a recording needs a position and a force"
            )
        stored = self._table.schema.metadata or {}
        self.metadata = {
            key.decode(): value.decode()
            for key, value in stored.items()
            # What the writing libraries note for themselves says nothing about the measurement.
            if key not in (b"pandas", b"ARROW:schema")
        }

    def read(self, *, numbers: Collection[str], text: Collection[str]) -> dict[str, Cells]:
        """See :class:`palpate.recording.table.TableFile`."""
        columns: dict[str, Cells] = {}
        for name in self.names:
            values = self._table.column(name).to_pandas().to_numpy()
            numeric = values.dtype.kind in "iufb"
            if name in text or (name not in numbers and not numeric):
                columns[name] = np.array([_as_text(value) for value in values], dtype=object)
            else:
                columns[name] = values.astype(np.float64) if numeric else to_numbers(_as_objects(values))
        return columns

    def place(self, row: int) -> str:
        """See :class:`palpate.recording.table.TableFile`."""
        return f"row {row}"

    def cell(self, row: int, name: str) -> str:
        """See :class:`palpate.recording.table.TableFile`."""
        return _as_text(self._table.column(name)[row].as_py())


def _as_text(value: Any) -> str:
    return "" if value is None or value != value else str(value)


def _as_objects(values: Cells) -> Cells:
    return np.array([_as_text(value) for value in values], dtype=object)

# SPDX-License-Identifier: Apache-2.0
"""Opening of files by their format; readers of Parquet and of formats that are read as a whole."""

from __future__ import annotations

import struct
from collections import Counter
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import InputError, escaped, listed, shortened
from .csv_file import CsvFile
from .dialect import decimal_mark, find_header, first_row_as_header, with_checked_names
from .files import readable
from .mcap_file import read_mcap
from .memory_table import MemoryTable, cells_of, import_library
from .table import Cells, LongTable, Table, to_numbers

_BUFFER_BYTES = 1 << 20
"""Number of bytes of each Parquet column that are read at once, before they are needed."""

MOST_HEADER_ROWS = 200
"""Number of first rows of an Excel sheet among which the header is searched."""

_MATLAB_HEADER_BYTES = 128
"""Number of bytes before the first data element of a MATLAB file."""

_MATRIX_TYPE, _COMPRESSED_TYPE = 14, 15
"""Type numbers of a MATLAB element that holds an array, and of one that holds a compressed array."""

_ITEM_BYTES = {
    **dict.fromkeys((1, 2, 14, 15, 16), 1),
    **dict.fromkeys((3, 4, 17), 2),
    **dict.fromkeys((5, 6, 7, 18), 4),
    **dict.fromkeys((9, 12, 13), 8),
}
"""Size of one number in a MATLAB element, by the type number of the element [bytes]."""

_NUMERIC_CLASSES = range(6, 16)
"""Class numbers of numeric MATLAB arrays. An array holds flags, dimensions, name, values, imaginary parts."""

_COMPLEX_FLAG = 1 << 11
"""Bit of the flags of a MATLAB array that marks complex numbers."""


def open_table(path: Path) -> Table:
    """Opens a recording as a table of columns; the suffix of its name gives the format.

    Raises
    ------
    InputError
        The file does not have that format, or the library that reads it is not installed.
    """
    return _reader_of(path)(path)


def is_read_in_parts(path: Path) -> bool:
    """Returns True for a CSV or Parquet file, which may be larger than memory."""
    return _reader_of(path) in (CsvFile, ParquetFile)


def _reader_of(path: Path) -> Callable[[Path], Table]:
    readers: dict[str, Callable[[Path], Table]] = {
        ".parquet": ParquetFile,
        ".xlsx": _excel,
        ".xlsm": _excel,
        ".npz": _numpy,
        ".mat": _matlab,
        ".mcap": read_mcap,
    }
    return readers.get(path.suffix.lower(), CsvFile)


class ParquetFile(LongTable):
    """A Parquet recording."""

    def __init__(self, path: Path) -> None:
        parquet = import_library("pyarrow.parquet", path, "Parquet", "parquet")
        self._path = path
        with readable(path, "Parquet"):
            # The file is read in small pieces: the file or one of its row groups may be larger than memory.
            self._file = parquet.ParquetFile(path, buffer_size=_BUFFER_BYTES, pre_buffer=False)
            schema = self._file.schema_arrow
            self._stored = tuple(str(name) for name in schema.names)
            self.names = tuple(map(escaped, self._stored))
            self.text_names = {
                name
                for name, field in zip(self.names, schema, strict=True)
                if str(getattr(field.type, "value_type", field.type)) in ("string", "large_string")
            }
            self.metadata = {
                escaped(key.decode()): escaped(value.decode())
                for key, value in (schema.metadata or {}).items()
                # Metadata of the libraries that wrote the file do not describe the measurement.
                if key not in (b"pandas", b"ARROW:schema")
            }
        if len(set(self.names)) < len(self.names):
            raise InputError(f"{path}: a column name occurs twice in {listed(self.names)}")
        if len(self.names) == 1:
            raise InputError(
                f"{path}: there is one column ({shortened(self.names[0])}); a recording needs a position and "
                "a force"
            )

    def read(self, *, numbers: Collection[str], text: Collection[str]) -> dict[str, Cells]:
        with readable(self._path, "Parquet"):
            return _arrow_cells(self._file.read(), self.names, numbers, text)

    def parts(self, rows: int) -> tuple[int, list[tuple[int, int]]]:
        parts, start, rows_in_part = [], 0, 0
        for group in range(self._file.num_row_groups):
            rows_in_part += self._file.metadata.row_group(group).num_rows
            if rows_in_part >= rows or group == self._file.num_row_groups - 1:
                parts.append((start, group + 1))
                start, rows_in_part = group + 1, 0
        return self._file.metadata.num_rows, parts

    def blocks(
        self, part: tuple[int, int], rows: int, *, numbers: Collection[str], text: Collection[str]
    ) -> Iterator[tuple[int, dict[str, Cells]]]:
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
                cells = _arrow_cells(batch, names, numbers, text)
            yield first, cells
            first += batch.num_rows

    def rows_before(self, part: tuple[int, int]) -> int:
        return sum(self._file.metadata.row_group(group).num_rows for group in range(part[0]))

    def place(self, row: int) -> str:
        return f"row {row}"

    def cell(self, row: int, name: str) -> str:
        for group in range(self._file.num_row_groups):
            rows = self._file.metadata.row_group(group).num_rows
            if row < rows:
                stored = self._stored[self.names.index(name)]
                with readable(self._path, "Parquet"):
                    return _cell_text(
                        self._file.read_row_group(group, columns=[stored]).column(0)[row].as_py()
                    )
            row -= rows
        raise IndexError(row)


def _arrow_cells(
    table: Any, names: Sequence[str], numbers: Collection[str], text: Collection[str]
) -> dict[str, Cells]:
    """Returns the columns of a table or batch of Arrow."""
    columns: dict[str, Cells] = {}
    for index, name in enumerate(names):
        values = table.column(index).to_pandas().to_numpy()
        numeric = values.dtype.kind in "iufb"
        if name in text or (name not in numbers and not numeric):
            columns[name] = np.array([_cell_text(value) for value in values], dtype=object)
        else:
            columns[name] = values.astype(np.float64) if numeric else to_numbers(_as_objects(values))
    return columns


def _cell_text(value: Any) -> str:
    return "" if value is None or value != value else str(value)


def _as_objects(values: Cells) -> Cells:
    return np.array([_cell_text(value) for value in values], dtype=object)


def _excel(path: Path) -> Table:
    """Returns the first sheet of a workbook that is not empty."""
    openpyxl = import_library("openpyxl", path, "an Excel file", "excel")
    with readable(path, "Excel (.xlsx)"):
        book = openpyxl.load_workbook(path, read_only=True, data_only=True)
        sheets = [(sheet.title, [*sheet.iter_rows(values_only=True)]) for sheet in book.worksheets]
        book.close()
    filled = [(title, values) for title, values in sheets if values]
    if not filled:
        raise InputError(f"{path} has no sheet with cells")
    title, values = filled[0]
    kept = [k for k, row in enumerate(values) if any(cell is not None for cell in row)]
    width = max(k + 1 for row in (values[k] for k in kept) for k, cell in enumerate(row) if cell is not None)
    values = [values[k][:width] for k in kept]
    rows = [["" if cell is None else str(cell) for cell in row] for row in values[:MOST_HEADER_ROWS]]
    header, header_notes = with_checked_names(
        f"{path}, row {kept[0] + 1}", find_header(rows) or first_row_as_header(rows)
    )
    where = f"{path}, row {kept[min(header.first, len(kept) - 1)] + 1}"
    decimal = decimal_mark(where, rows[header.first :], ";") if header.numbers else "."
    notes = [f"sheet {shortened(title)}"] if len(filled) > 1 else []
    if header.row:
        notes.append(f"{header.row} row{'s' * (header.row > 1)} before the header")
    if header.units_row is not None:
        notes.append("units in a second header row")
    data = values[header.first :]
    columns = {name: cells_of([row[k] for row in data], decimal) for k, name in enumerate(header.names)}
    metadata = {}
    for row in rows[: header.row]:
        key, _, value = row[0].partition(":")
        metadata[escaped(key.strip())] = escaped(" ".join(" ".join([value, *row[1:]]).split()))
    if len(kept) > header.first and kept[-1] - kept[header.first] + 1 != len(data):
        notes.append("empty rows are left out")
    first = kept[header.first] + 1 if len(kept) > header.first else 0
    return MemoryTable(path, columns, metadata, [*notes, *header_notes], ("row", first), decimal)


def _numpy(path: Path) -> Table:
    """Returns the arrays of an .npz file by name."""
    with readable(path, "NumPy (.npz)"), path.open("rb") as stream:
        arrays = np.load(stream, allow_pickle=False)
        found = {name: arrays[name] for name in arrays.files}
    return _table_of_arrays(path, found)


def _matlab(path: Path) -> Table:
    """Returns the vectors of a .mat file by name, fields of a structure included."""
    from scipy.io import loadmat

    with readable(path, "MATLAB (.mat)"):
        _refuse_damaged(path.read_bytes())
        try:
            found = loadmat(path, squeeze_me=True, struct_as_record=True)
        except NotImplementedError:
            raise InputError(
                f"{path} is MATLAB 7.3 (HDF5); save it in MATLAB as version 7: save('NEW.mat', '-v7')"
            ) from None
    arrays: dict[str, Any] = {}
    found = {name: np.asarray(value) for name, value in found.items() if not name.startswith("__")}
    structures = [name for name, value in found.items() if value.dtype.names]
    for name, value in found.items():
        if name in structures and value.ndim == 0:
            prefix = f"{name}." if len(structures) > 1 else ""
            arrays |= {f"{prefix}{field}": value[field][()] for field in value.dtype.names}
        else:
            arrays[name] = value
    return _table_of_arrays(path, arrays)


def _refuse_damaged(content: bytes) -> None:
    """Refuses a MATLAB file of version 5 with a damaged element, for example one longer than the file.

    `scipy.io.loadmat` crashes on some of them. Compressed elements are not examined inside.

    Raises
    ------
    ValueError
        An element is damaged; the message names the byte at which it begins.
    """
    if len(content) < _MATLAB_HEADER_BYTES or 0 in content[:4] or content[125] + content[124] != 1:
        return
    _elements(content, _MATLAB_HEADER_BYTES, len(content), "<" if content[126:128] == b"IM" else ">")


def _elements(content: bytes, offset: int, end: int, order: str) -> list[tuple[int, int]]:
    """Checks the MATLAB elements between two bytes; returns type and first data byte of each element."""
    found = []
    while offset < end:
        start = offset
        if offset + 8 > end:
            raise _damaged(start)
        kind, size = struct.unpack_from(f"{order}II", content, offset)
        data = offset + 8
        if kind >> 16:  # a small MATLAB element: type, size and data share 8 bytes
            kind, size, data = kind & 0xFFFF, kind >> 16, offset + 4
            offset += 8
        else:
            offset = data + (size if kind == _COMPRESSED_TYPE else -(-size // 8) * 8)
        available = (start + 8 if data == start + 4 else end) - data
        if kind not in _ITEM_BYTES or size % _ITEM_BYTES[kind] or size > available:
            raise _damaged(start)
        if kind == _MATRIX_TYPE and size:
            inside = _elements(content, data, data + size, order)
            first = inside[0][1]
            flags = int.from_bytes(content[first : first + 4], "little" if order == "<" else "big")
            if flags & 0xFF in _NUMERIC_CLASSES and len(inside) != (5 if flags & _COMPLEX_FLAG else 4):
                raise _damaged(start)
        found.append((kind, data))
    return found


def _damaged(offset: int) -> ValueError:
    return ValueError(f"the element at byte {offset} is damaged")


def _table_of_arrays(path: Path, found: Mapping[str, Any]) -> Table:
    """Returns the vectors of the most frequent length as columns; single values are metadata."""
    arrays = {escaped(str(name)): np.squeeze(np.asarray(value)) for name, value in found.items()}
    vectors = {name: each for name, each in arrays.items() if each.ndim == 1 and each.dtype.kind in "iufbUO"}
    lengths = Counter(len(array) for array in vectors.values())
    if not lengths:
        raise InputError(f"{path} holds no vectors, only {listed(arrays) or 'nothing'}")
    length = max(lengths, key=lambda each: (lengths[each], each))
    columns = {name: _vector(array) for name, array in vectors.items() if len(array) == length}
    metadata = {name: escaped(str(each)) for name, each in arrays.items() if each.ndim == 0}
    others = [name for name in arrays if name not in columns and name not in metadata]
    notes = [f"left out {listed(others)}, not vectors of {length} values"] if others else []
    return MemoryTable(path, columns, metadata, notes)


def _vector(array: Any) -> Cells:
    if array.dtype.kind in "iufb":
        return np.asarray(array, dtype=np.float64)
    return np.array([str(value) for value in array], dtype=object)

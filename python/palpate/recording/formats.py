# SPDX-License-Identifier: Apache-2.0
"""Opening of files by their format; readers of Parquet and of formats that are read as a whole."""

from __future__ import annotations

import base64
import io
import math
import struct
import sys
import zlib
from collections import Counter
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from importlib import import_module
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import scipy

from ..errors import InputError, escaped, listed, shortened
from .csv_file import CsvFile
from .dialect import NOT_STATED, Stated
from .files import CELL_BYTES, MEMORY_LIMIT, readable, require_memory, zip_members
from .looks import Look
from .mcap_file import read_mcap
from .memory_table import MemoryTable, import_library
from .table import Cells, LongTable, Table, to_numbers
from .workbook import is_workbook

_BUFFER_BYTES = 1 << 20
"""Number of bytes of each Parquet column that are read at once, before they are needed."""

_PARQUET_END_BYTES = 8
"""Number of bytes after the footer of a Parquet file: its length and a mark."""

_ARROW_SCHEMA_BYTES = b"/////"
"""First bytes of the copy of the schema that Arrow adds to a Parquet file: a mark, in base 64."""

_ARROW_TEXT = ("string", "large_string", "binary", "large_binary")
"""Names of the types of text in Arrow; a file without the logical type of its columns stores bytes."""

_MATLAB_HEADER_BYTES = 128
"""Number of bytes before the first data element of a MATLAB file."""

_MATRIX_TYPE, _COMPRESSED_TYPE = 14, 15
"""Type numbers of a MATLAB element that holds an array, and of one that holds a compressed array."""

_INTEGER_TYPES, _TEXT_TYPES = (5, 6), (1, 16)
"""Type numbers of MATLAB elements with dimensions, and of those with names."""

_NUMBER_TYPES = frozenset({*range(1, 8), 9, 12, 13, 16, 17, 18})
"""Type numbers of MATLAB elements with numbers or characters."""

_TYPES = _NUMBER_TYPES | {_MATRIX_TYPE, _COMPRESSED_TYPE}

_CELL_CLASS, _SPARSE_CLASS, _OPAQUE_CLASS = 1, 5, 17
_NESTED_CLASSES, _VALUE_CLASSES = range(1, 4), range(4, 16)
"""Class numbers of MATLAB arrays that hold arrays (cell, structure, object), and of those with values."""

_COMPLEX_FLAG = 1 << 11
"""Bit of the flags of a MATLAB array that marks complex numbers."""


def open_table(path: Path, stated: Stated = NOT_STATED) -> Table:
    """Opens a recording, except a workbook, as a table of columns; the suffix of its name gives the format.

    Raises
    ------
    InputError
        The file does not have that format, the library that reads it is not installed, or something is stated
        that a file of this format contains itself.
    """
    reader = _reader_of(path)
    if reader is CsvFile:
        return CsvFile(path, stated)
    if stated != NOT_STATED:
        raise InputError(f"{path} is not a text file; --columns and --decimal are for text files only")
    return reader(path)


def is_read_in_parts(path: Path) -> bool:
    """Returns True for a CSV or Parquet file, which may be larger than memory."""
    return _reader_of(path) in (CsvFile, ParquetFile) and not is_workbook(path)


def is_text(path: Path) -> bool:
    """Returns True for a complete text file."""
    return _reader_of(path) is CsvFile and path.suffix != ".part" and not is_workbook(path)


def _reader_of(path: Path) -> Callable[[Path], Table]:
    readers: dict[str, Callable[[Path], Table]] = {
        ".parquet": ParquetFile,
        ".npz": _numpy,
        ".mat": _matlab,
        ".mcap": read_mcap,
    }
    return readers.get(path.suffix.lower(), CsvFile)


class ParquetFile(LongTable):
    """A Parquet recording.

    Its pages can have checksums. The footer has none, but it states much twice; both statements must agree.
    """

    def __init__(self, path: Path) -> None:
        parquet = import_library("pyarrow.parquet", path, "Parquet", "parquet")
        self._path = path
        with readable(path, "Parquet"):
            footer = parquet.ParquetFile(path)
            _require_whole_footer(path, footer)
            if not footer.metadata.created_by:  # damage that hides the metadata hides this field, too
                self.notes = ["the footer names no program, so that metadata may be lost"]
            schema = footer.schema_arrow
            self._stored = tuple(str(name) for name in schema.names)
            self.names = tuple(map(escaped, self._stored))
            self.looks = {
                name: Look(text=True)
                for name, field in zip(self.names, schema, strict=True)
                if str(getattr(field.type, "value_type", field.type)) in _ARROW_TEXT
            }
            self.metadata = {
                escaped(key.decode()): escaped(value.decode())
                for key, value in _own_metadata(schema.metadata).items()
            }
            # The file is read in small pieces: the file or one of its row groups may be larger than memory.
            # Text is read as a dictionary, which stores a long word that occurs in many rows once.
            self._file = parquet.ParquetFile(
                path,
                metadata=footer.metadata,
                buffer_size=_BUFFER_BYTES,
                pre_buffer=False,
                read_dictionary=self._stored_names(self.text_names),
                page_checksum_verification=True,
            )
        self._checked_chunks(range(min(self._file.num_row_groups, 1)))
        if len(set(self.names)) < len(self.names):
            raise InputError(f"{path}: a column name occurs twice in {listed(self.names)}")
        if len(self.names) == 1:
            raise InputError(
                f"{path}: there is one column ({shortened(self.names[0])}); a recording needs a position and "
                "a force"
            )

    def read(self, *, numbers: Collection[str], text: Collection[str]) -> dict[str, Cells]:
        """Returns the columns in `numbers` and `text`, and those others for which the memory suffices."""
        chunks = self._checked_chunks(range(self._file.num_row_groups))
        memory = {name: self._memory([name], chunks) for name in self.names}
        needed = sum(memory[name] for name in {*numbers, *text})
        require_memory(self._path, needed)
        names, left_out = [], []
        for name in self.names:
            if name not in numbers and name not in text:
                if needed + memory[name] > MEMORY_LIMIT:
                    left_out.append(name)
                    continue
                needed += memory[name]
            names.append(name)
        if left_out:
            note = f"left out {listed(left_out)}, for which the limit of memory is too low"
            self.notes = [*self.notes, note]
        with readable(self._path, "Parquet"):
            return _arrow_cells(self._file.read(self._stored_names(names)), names, numbers, text)

    def _stored_names(self, names: Collection[str]) -> list[str]:
        pairs = zip(self._stored, self.names, strict=True)
        return [stored for stored, name in pairs if name in names]

    def _memory(self, names: Collection[str], chunks: Iterable[Any]) -> int:
        """Returns the memory for the pages and the cells of columns [bytes]."""
        stored = {*self._stored_names(names)}
        return sum(
            chunk.total_uncompressed_size + CELL_BYTES * chunk.num_values
            for chunk in chunks
            if chunk.path_in_schema in stored or chunk.path_in_schema.split(".")[0] in stored
        )

    def _checked_chunks(self, groups: Iterable[int]) -> list[Any]:
        """Returns the descriptions of the columns of row groups, after comparing them with the schema.

        Raises
        ------
        InputError
            The footer is damaged.
        """
        footer, chunks = self._file.metadata, []
        with readable(self._path, "Parquet"):
            for group in groups:
                rows = footer.row_group(group)
                # A damaged description ends the process in `rows.column`; reading raises an exception.
                for name in self._stored if rows.num_rows else ():
                    next(self._file.iter_batches(1, row_groups=[group], columns=[name]))
                for index in range(rows.num_columns if rows.num_rows else 0):
                    chunk, column = rows.column(index), footer.schema.column(index)
                    all_rows = column.max_repetition_level > 0 or chunk.num_values == rows.num_rows
                    same = (chunk.path_in_schema, chunk.physical_type) == (column.path, column.physical_type)
                    if not (all_rows and same):
                        raise ValueError(f"the footer describes column {column.path} in two ways")
                    chunks.append(chunk)
            ranges = sorted(
                (start, start + chunk.total_compressed_size)
                for chunk in chunks
                for start in [min(filter(None, (chunk.dictionary_page_offset, chunk.data_page_offset)))]
            )
            if any(first[1] > second[0] for first, second in pairwise(ranges)):
                raise ValueError("the footer states one place for two columns")
        return chunks

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
        names = [name for name in self.names if name in numbers or name in text]
        for group in groups:
            require_memory(self._path, self._memory(text, self._checked_chunks([group])))
        with readable(self._path, "Parquet"):
            batches = self._file.iter_batches(
                batch_size=rows, row_groups=list(groups), columns=self._stored_names(names)
            )
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


def _own_metadata(metadata: Mapping[bytes, bytes] | None) -> dict[bytes, bytes]:
    """Returns the metadata of a Parquet file that describe the measurement, not those of libraries."""
    return {key: value for key, value in (metadata or {}).items() if key not in (b"pandas", b"ARROW:schema")}


def _require_whole_footer(path: Path, file: Any) -> None:
    """Compares length, number of rows and schema of a Parquet footer with their second statements.

    Raises
    ------
    ValueError
        The footer is damaged.
    """
    footer = file.metadata
    with path.open("rb") as stream:
        stream.seek(-_PARQUET_END_BYTES, io.SEEK_END)
        length = int.from_bytes(stream.read(4), "little")
    rows = [footer.row_group(group).num_rows for group in range(footer.num_row_groups)]
    same = length == footer.serialized_size and sum(rows) == footer.num_rows
    metadata = footer.metadata or {}
    copies = [key for key, value in metadata.items() if value.startswith(_ARROW_SCHEMA_BYTES)]
    same &= copies in ([], [b"ARROW:schema"])
    if copies and same:
        arrow: Any = import_module("pyarrow")  # without type hints
        schema = arrow.ipc.read_schema(arrow.py_buffer(base64.b64decode(metadata[b"ARROW:schema"])))
        same = schema.names == file.schema_arrow.names
        if footer.created_by.startswith("parquet-cpp-arrow"):  # other programs store the metadata once
            same &= _own_metadata(schema.metadata).items() <= _own_metadata(metadata).items()
    if not same:
        raise ValueError("the footer is damaged")


def _arrow_cells(
    table: Any, names: Sequence[str], numbers: Collection[str], text: Collection[str]
) -> dict[str, Cells]:
    """Returns the columns of a table or batch of Arrow."""
    columns: dict[str, Cells] = {}
    for index, name in enumerate(names):
        column = table.column(index)
        chunks = getattr(column, "chunks", [column])
        if hasattr(column.type, "index_type") and str(column.type.value_type) in _ARROW_TEXT and chunks:
            values = np.concatenate([_dictionary_words(chunk) for chunk in chunks])
        else:
            values = column.to_pandas().to_numpy()
        numeric = values.dtype.kind in "iufb"
        if name in text or (name not in numbers and not numeric):
            columns[name] = _as_objects(values)
        else:
            columns[name] = values.astype(np.float64) if numeric else to_numbers(_as_objects(values))
    return columns


def _dictionary_words(chunk: Any) -> Cells:
    """Returns the words of a column that Arrow stores as a dictionary; equal cells share one object."""
    words = np.array([*map(_cell_text, chunk.dictionary.to_pylist()), ""], dtype=object)
    return np.asarray(words[chunk.indices.cast("int64").fill_null(-1).to_numpy(zero_copy_only=False)])


def _cell_text(value: Any) -> str:
    if isinstance(value, bytes):
        return value.decode(errors="replace")
    return "" if value is None or value != value else str(value)


def _as_objects(values: Cells) -> Cells:
    return np.array([_cell_text(value) for value in values], dtype=object)


def _numpy(path: Path) -> Table:
    """Returns the arrays of an .npz file by name."""
    with readable(path, "NumPy (.npz)"):
        arrays = {
            name.removesuffix(".npy"): np.load(io.BytesIO(content), allow_pickle=False)
            for name, content in zip_members(path)
        }
    return _table_of_arrays(path, arrays)


def _matlab(path: Path) -> Table:
    """Returns the vectors of a .mat file by name, fields of a structure included."""
    with readable(path, "MATLAB (.mat)"):
        stream: Any = io.BytesIO(_inflated(path))
        try:
            found = scipy.io.loadmat(stream, squeeze_me=True, struct_as_record=True)
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


def _inflated(path: Path) -> bytes:
    """Returns a MATLAB file without compression, after checking the elements of a file of version 5.

    `scipy.io.loadmat` crashes on some damaged elements.

    Raises
    ------
    ValueError
        An element is damaged, for example longer than the file; the message names its first byte.
    """
    needed = path.stat().st_size
    require_memory(path, 2 * needed)  # the content and its arrays
    content = path.read_bytes()
    order = "<" if content[126:128] == b"IM" else ">"
    if 0 in content[:4] or content[125 if order == "<" else 124 :][:1] != b"\1":
        return content
    parts = [content[:_MATLAB_HEADER_BYTES]]
    for element in _elements(content, _MATLAB_HEADER_BYTES, len(content), order):
        if element.kind != _COMPRESSED_TYPE:
            _require_array(content, element, order)
            parts.append(content[element.offset : element.stop])
            continue
        stream = zlib.decompressobj()
        try:
            tag = stream.decompress(content[element.start : element.stop], 8)
            _, size = struct.unpack(f"{order}II", tag)
        except (zlib.error, struct.error):
            raise _damaged(element.offset) from None
        needed += size
        require_memory(path, 2 * needed)
        try:
            part = tag + stream.decompress(stream.unconsumed_tail, size + 8)
            (array,) = _elements(part, 0, len(part), order)
            _require_array(part, array, order)
        except (zlib.error, ValueError):
            raise _damaged(element.offset) from None
        if not stream.eof or stream.unused_data.strip(b"\0"):
            raise _damaged(element.offset)
        parts.append(part[: array.stop])
    return b"".join(parts)


class _Element(NamedTuple):
    """Element of a MATLAB file."""

    kind: int
    offset: int
    """First byte of its tag"""
    start: int
    """First byte of its data"""
    stop: int
    """Byte after its data"""


def _elements(content: bytes, offset: int, end: int, order: str) -> list[_Element]:
    """Returns the elements between two bytes of a MATLAB file."""
    found = []
    while offset < end:
        if offset + 8 > end:
            raise _damaged(offset)
        kind, size = struct.unpack_from(f"{order}II", content, offset)
        if kind >> 16:  # a small element: type, size and data share 8 bytes
            kind, size, start, available = kind & 0xFFFF, kind >> 16, offset + 4, 4
            following = offset + 8
        else:
            start, available = offset + 8, end - offset - 8
            following = start + (size if kind == _COMPRESSED_TYPE else -(-size // 8) * 8)
        if kind not in _TYPES or size > available:
            raise _damaged(offset)
        found.append(_Element(kind, offset, start, start + size))
        offset = following
    return found


def _require_array(content: bytes, array: _Element, order: str) -> None:
    """Checks the elements inside an array, and those inside its cells and fields."""
    if array.kind != _MATRIX_TYPE:
        raise _damaged(array.offset)
    inside = _elements(content, array.start, array.stop, order)
    try:
        complete = not inside or _is_complete(content, inside, order)  # an empty cell holds no elements
    except (ValueError, IndexError, ZeroDivisionError, struct.error):
        complete = False
    if not complete:
        raise _damaged(array.offset)
    for each in inside:
        if each.kind == _MATRIX_TYPE:
            _require_array(content, each, order)


def _is_complete(content: bytes, inside: list[_Element], order: str) -> bool:
    """Returns True if an array holds the elements that its class needs: flags, dimensions, name, values."""

    def numbers(element: _Element) -> list[int]:
        return [each for (each,) in struct.iter_unpack(f"{order}i", content[element.start : element.stop])]

    flags, _ = numbers(inside[0])
    array_class, kinds = flags & 0xFF, [each.kind for each in inside]
    if array_class == _OPAQUE_CLASS:  # flags, three texts, an array
        return len(kinds) == 5 and kinds[4] == _MATRIX_TYPE
    _, dimensions, _, *values = inside
    sizes, count = numbers(dimensions), 1  # values, or the array of a function
    if array_class in _NESTED_CLASSES:  # an object has the name of its class, then the same as a structure
        count = math.prod(sizes)
        if array_class != _CELL_CLASS:
            (length,), names = numbers(values[array_class - 2]), values[array_class - 1]
            count = array_class + count * ((names.stop - names.start) // length)
    elif array_class in _VALUE_CLASSES:  # a sparse array also has rows and columns
        count = (3 if array_class == _SPARSE_CLASS else 1) + bool(flags & _COMPLEX_FLAG)
        if not _NUMBER_TYPES.issuperset(kinds[3:]):
            return False
    well_typed = kinds[1] in _INTEGER_TYPES and kinds[2] in _TEXT_TYPES
    return well_typed and len(sizes) >= 2 and len(values) == count


def _damaged(offset: int) -> ValueError:
    return ValueError(f"the element at byte {offset} is damaged")


def _table_of_arrays(path: Path, found: Mapping[str, Any]) -> Table:
    """Returns the vectors of the most frequent length as columns; single values are metadata."""
    arrays = {escaped(str(name)): np.squeeze(np.asarray(value)) for name, value in found.items()}
    vectors = {name: each for name, each in arrays.items() if each.ndim == 1 and _is_column(each)}
    lengths = Counter(len(array) for array in vectors.values())
    if not lengths:
        raise InputError(f"{path} holds no vectors, only {listed(arrays) or 'nothing'}")
    length = max(lengths, key=lambda each: (lengths[each], each))
    chosen = {name: array for name, array in vectors.items() if len(array) == length}
    text_bytes = sum(sys.getsizeof("") + each.itemsize for each in chosen.values() if each.dtype.kind in "UO")
    require_memory(path, length * (CELL_BYTES * len(chosen) + text_bytes))
    columns = {name: _vector(array) for name, array in chosen.items()}
    # A structure or a sparse array has no short text; that of a damaged sparse array crashes SciPy.
    metadata = {
        name: escaped(str(each))
        for name, each in arrays.items()
        if each.ndim == 0 and each.dtype.kind not in "OV"
    }
    others = [name for name in arrays if name not in columns and name not in metadata]
    notes = [f"left out {listed(others)}, not vectors of {length} values"] if others else []
    return MemoryTable(path, columns, metadata, notes)


def _is_column(array: Any) -> bool:
    """Returns True for real numbers, for text, and for cells that are words, numbers or empty."""
    return array.dtype.kind in "iufbU" or (
        array.dtype.kind == "O"
        and all(isinstance(cell, (str, float, int)) or not np.size(cell) for cell in array)
    )


def _vector(array: Any) -> Cells:
    if array.dtype.kind in "iufb":
        return np.asarray(array, dtype=np.float64)
    return np.array([str(cell) if np.size(cell) else "" for cell in array], dtype=object)

# SPDX-License-Identifier: Apache-2.0
"""Opens a file of columns by its kind, and the kinds that are read as a whole."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import InputError
from .csv_file import CsvFile
from .files import readable
from .header import decimal_mark, find_header, first_row_as_header, named, refuse_marks
from .matlab_file import refuse_damaged
from .names import listed, shortened, visible
from .parquet_file import ParquetFile
from .table import MISSING, Cells, TableFile, parse_with, to_numbers

MOST_HEADER_ROWS = 200
"""Rows of a sheet in which its header must stand."""

STEADY_ROWS = 1000
"""Rows in which a column with one or two values counts as steady."""


def open_table(path: Path) -> TableFile:
    """Open a file of columns; the end of its name tells its kind.

    Raises
    ------
    InputError
        The file is not of its kind, or the library that reads it is not installed.
    """
    kinds: dict[str, Callable[[Path], TableFile]] = {
        ".parquet": ParquetFile,
        ".xlsx": _excel,
        ".xlsm": _excel,
        ".npz": _numpy,
        ".mat": _matlab,
        ".mcap": _mcap,
    }
    return kinds.get(path.suffix.lower(), CsvFile)(path)


class MemoryTable:
    """Columns that were read as a whole.

    Parameters
    ----------
    path : Path
    columns : mapping of str to (n,) array
        float64, or objects of str.
    metadata : mapping, optional
    notes : sequence of str, optional
        How the file was read.
    first : (str, int), optional
        Word for a row and number of the first one, for the sentences.
    decimal : str
        Decimal mark of numbers that are stored as text.
    """

    torn = 0

    def __init__(
        self,
        path: Path,
        columns: Mapping[str, Cells],
        metadata: Mapping[str, str] | None = None,
        notes: Sequence[str] = (),
        first: tuple[str, int] = ("row", 0),
        decimal: str = ".",
    ) -> None:
        self._path, self._columns, self._first, self._decimal = path, dict(columns), first, decimal
        self.names = tuple(self._columns)
        self.metadata = dict(metadata or {})
        self.notes = tuple(notes)
        self.text_names = {name for name, cells in self._columns.items() if cells.dtype == object}
        self.steady_names = {
            name for name, cells in self._columns.items() if len(set(cells[:STEADY_ROWS].tolist())) < 3
        }
        if len(self.names) < 2:
            raise InputError(
                f"{path} has no two columns ({listed(self.names)}); a recording needs a position and a force"
            )

    def read(self, *, numbers: Collection[str], text: Collection[str]) -> dict[str, Cells]:
        """See :class:`palpate.recording.table.TableFile`."""
        columns = {}
        for name, cells in self._columns.items():
            if name in text:
                cells = np.array([_as_text(cell) for cell in cells], dtype=object)
            elif name in numbers and cells.dtype == object:
                found = to_numbers(cells, self._decimal)
                refuse_marks(f"{self._path}: column {name}", cells[np.isnan(found)], self._decimal, ";")
                cells = found
            columns[name] = cells
        return columns

    def parts(self, rows: int) -> tuple[int, list[tuple[int, int]]]:
        """See :class:`palpate.recording.table.TableFile`."""
        raise InputError(
            f"{self._path} cannot be read part by part; leave out --out-of-core, --jobs and --scheduler, or "
            "convert the file to CSV or Parquet"
        )

    def blocks(
        self, part: tuple[int, int], rows: int, *, numbers: Collection[str], text: Collection[str]
    ) -> Iterator[tuple[int, dict[str, Cells]]]:
        """See :class:`palpate.recording.table.TableFile`."""
        raise NotImplementedError

    def rows_before(self, part: tuple[int, int]) -> int:
        """See :class:`palpate.recording.table.TableFile`."""
        raise NotImplementedError

    def place(self, row: int) -> str:
        """See :class:`palpate.recording.table.TableFile`."""
        word, number = self._first
        return f"{word} {number + row}"

    def cell(self, row: int, name: str) -> str:
        """See :class:`palpate.recording.table.TableFile`."""
        return _as_text(self._columns[name][row])


def _as_text(value: Any) -> str:
    return "" if value is None or value != value else f"{value:g}" if isinstance(value, float) else str(value)


def _needed(name: str, path: Path, kind: str, extra: str) -> Any:
    try:
        return import_module(name)
    except ImportError:
        raise InputError(
            f"{path} is {kind}, which needs {name.split('.')[0]}: "
            f"install it with pip install 'palpate[{extra}]'"
        ) from None


def _excel(path: Path) -> TableFile:
    """The first sheet of a workbook that holds cells."""
    openpyxl = _needed("openpyxl", path, "an Excel file", "excel")
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
    header, told = named(f"{path}, row {kept[0] + 1}", find_header(rows) or first_row_as_header(rows))
    where = f"{path}, row {kept[min(header.first, len(kept) - 1)] + 1}"
    decimal = decimal_mark(where, rows[header.first :], ";") if header.numbers else "."
    notes = [f"sheet {shortened(title)}"] if len(filled) > 1 else []
    if header.row:
        notes.append(f"{header.row} row{'s' * (header.row > 1)} before the header")
    if header.units_row is not None:
        notes.append("units in a second header row")
    data = values[header.first :]
    columns = {name: _cells([row[k] for row in data], decimal) for k, name in enumerate(header.names)}
    metadata = {}
    for row in rows[: header.row]:
        key, _, value = row[0].partition(":")
        metadata[visible(key.strip())] = visible(" ".join(" ".join([value, *row[1:]]).split()))
    if len(kept) > header.first and kept[-1] - kept[header.first] + 1 != len(data):
        notes.append("empty rows are left out")
    first = kept[header.first] + 1 if len(kept) > header.first else 0
    return MemoryTable(path, columns, metadata, [*notes, *told], ("row", first), decimal)


def _cells(values: Sequence[Any], decimal: str) -> Cells:
    """Numbers where every value is one or is missing, else text."""
    if all(
        value is None or (isinstance(value, (int, float)) and not isinstance(value, bool)) for value in values
    ):
        return np.array([np.nan if value is None else float(value) for value in values])
    text = np.array(["" if value is None else str(value) for value in values], dtype=object)
    if all(word.strip() in MISSING or parse_with(word, decimal) is not None for word in text):
        return to_numbers(text, decimal)
    return text


def _numpy(path: Path) -> TableFile:
    """Arrays of an .npz file, by their names."""
    with readable(path, "NumPy (.npz)"), path.open("rb") as stream:
        arrays = np.load(stream, allow_pickle=False)
        found = {name: arrays[name] for name in arrays.files}
    return _of_arrays(path, found)


def _matlab(path: Path) -> TableFile:
    """Vectors of a .mat file, by their names; the fields of a structure stand beside them."""
    from scipy.io import loadmat

    with readable(path, "MATLAB (.mat)"):
        refuse_damaged(path.read_bytes())
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
    return _of_arrays(path, arrays)


def _of_arrays(path: Path, found: Mapping[str, Any]) -> TableFile:
    """The vectors of the most frequent length as columns; single values are metadata."""
    arrays = {visible(str(name)): np.squeeze(np.asarray(value)) for name, value in found.items()}
    vectors = {name: each for name, each in arrays.items() if each.ndim == 1 and each.dtype.kind in "iufbUO"}
    lengths = Counter(len(array) for array in vectors.values())
    if not lengths:
        raise InputError(f"{path} holds no vectors, only {listed(arrays) or 'nothing'}")
    length = max(lengths, key=lambda each: (lengths[each], each))
    columns = {name: _vector(array) for name, array in vectors.items() if len(array) == length}
    metadata = {name: visible(str(each)) for name, each in arrays.items() if each.ndim == 0}
    others = [name for name in arrays if name not in columns and name not in metadata]
    notes = [f"left out {listed(others)}, not vectors of {length} values"] if others else []
    return MemoryTable(path, columns, metadata, notes)


def _vector(array: Any) -> Cells:
    if array.dtype.kind in "iufb":
        return np.asarray(array, dtype=np.float64)
    return np.array([str(value) for value in array], dtype=object)


def _mcap(path: Path) -> TableFile:
    """JSON messages of an MCAP file: each topic is a table of its numbers, beside the time of its log."""
    reader = _needed("mcap.reader", path, "MCAP", "mcap")
    topics: dict[str, list[dict[str, Any]]] = {}
    others: Counter[str] = Counter()
    with readable(path, "MCAP"), path.open("rb") as stream:
        for _, channel, message in reader.make_reader(stream).iter_messages():
            if channel.message_encoding != "json":
                others[channel.message_encoding] += 1
                continue
            row = {"log_time_s": message.log_time, **dict(_flat(json.loads(message.data)))}
            topics.setdefault(channel.topic, []).append(row)
    if not topics:
        told = f"only messages in {listed(others)}" if others else "no messages"
        raise InputError(
            f"{path} holds {told}; JSON messages are read. Convert it to JSON messages or export CSV"
        )
    sizes = {topic: len({name for row in rows for name in row}) for topic, rows in topics.items()}
    wide = [topic for topic, size in sizes.items() if size > 2]
    if len(wide) != 1:
        raise InputError(
            f"{path}: {len(wide)} topics hold two values or more ({listed(wide or sizes)}); position and "
            "force must stand in the only such topic. Write them to one topic or export them as CSV"
        )
    rows = topics[wide[0]]
    names = dict.fromkeys(name for row in rows for name in row)
    start = rows[0]["log_time_s"]
    for row in rows:
        row["log_time_s"] = (row["log_time_s"] - start) * 1e-9
    columns = {visible(name): _cells([row.get(name) for row in rows], ".") for name in names}
    notes = [f"topic {shortened(wide[0])}"]
    if len(topics) > 1 or others:
        notes.append("other topics are left out")
    return MemoryTable(path, columns, {}, notes, ("message", 0))


def _flat(value: Any, name: str = "") -> Iterator[tuple[str, Any]]:
    """Numbers and words of a message, by names such as ``wrench.force_N``."""
    if isinstance(value, dict):
        for key, item in value.items():
            yield from _flat(item, f"{name}.{key}" if name else str(key))
    elif isinstance(value, list):
        for index, item in enumerate(value):
            yield from _flat(item, f"{name}.{index}")
    elif isinstance(value, (int, float, str)) and not isinstance(value, bool):
        yield name or "value", value

# SPDX-License-Identifier: Apache-2.0
"""CSV with `#` lines of metadata and a header: pandas reads it, this adds the line numbers it forgets."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from ..errors import InputError
from .file_bytes import FileBytes
from .table import MISSING, Cells, parse_number, to_numbers

_CHUNK_ROWS = 1_000_000
"""Rows read at a time: bounds the memory beside the columns themselves."""

_EXACT: dict[str, Any] = (
    {} if tuple(map(int, pd.__version__.split(".")[:2])) >= (3, 1) else {"float_precision": "round_trip"}
)
"""Numbers to the last bit: what older pandas had to be asked for, newer pandas always does."""

_SNIFF_ROWS = 1000
"""Rows looked at to tell text columns from numeric ones before the fast reader starts."""


class CsvFile:
    """A CSV recording. The header is read when it is opened; the rows when :meth:`read` is called.

    A name that ends in ``.part`` is a recording that was cut off while it grew: a last line without its line
    feed is torn and left out.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._size = path.stat().st_size
        self.torn = 0
        if path.suffix == ".part":
            self._leave_out_torn_line()
        self.metadata: dict[str, str] = {}
        self._header_line = 0
        with self._lines() as lines:
            self.names = self._read_header(lines)
        self._sniffed_text = self._sniff()

    def _leave_out_torn_line(self) -> None:
        with self._path.open("rb") as stream:
            end = self._size
            while end > 0:
                start = max(0, end - (1 << 16))
                stream.seek(start)
                found = stream.read(end - start).rfind(b"\n")
                if found >= 0:
                    end = start + found + 1
                    break
                end = start
        self.torn = int(end < self._size)
        self._size = end

    def _bytes(self) -> io.BufferedReader:
        return io.BufferedReader(FileBytes(self._path, 0, self._size), 1 << 20)

    def _not_text(self) -> InputError:
        return InputError(f"{self._path} is not text in UTF-8; a recording is CSV or Parquet")

    @contextmanager
    def _lines(self) -> Iterator[io.TextIOWrapper]:
        with io.TextIOWrapper(self._bytes(), encoding="utf-8-sig", newline="") as lines:
            try:
                yield lines
            except UnicodeDecodeError:
                raise self._not_text() from None
            except csv.Error as error:
                raise InputError(f"{self._path} is not CSV: {error}") from None

    def _read_header(self, lines: io.TextIOWrapper) -> tuple[str, ...]:
        while line := lines.readline():
            self._header_line += 1
            text = line.strip()
            if text.startswith("#"):
                key, _, value = text[1:].partition(":")
                self.metadata[key.strip()] = value.strip()
            elif text:
                names = tuple(name.strip() for name in next(csv.reader([text])))
                self._check_names(names)
                return names
        raise InputError(f"{self._path} holds no header: the first line must name the columns")

    def _check_names(self, names: tuple[str, ...]) -> None:
        where = f"{self._path}, line {self._header_line}"
        if any(parse_number(name) is not None for name in names):
            raise InputError(f"{where}: a header with column names must come first, found {', '.join(names)}")
        if "" in names:
            raise InputError(f"{where}: column {names.index('') + 1} has no name")
        for name in names:
            if names.count(name) > 1:
                raise InputError(f"{where}: column name {name} stands {names.count(name)} times")
        if len(names) == 1:
            raise InputError(
                f"{where}: there is one column ({names[0]}); a recording needs a position and a force, "
                "separated by commas"
            )

    def _rows(self, lines: io.TextIOWrapper) -> Iterator[tuple[int, list[str]]]:
        """Line number and cells of each row: slow, for the start of a file and for error messages."""
        for _ in range(self._header_line):
            lines.readline()
        reader = csv.reader(lines)
        for cells in reader:
            if len(cells) > 1 or (cells and cells[0].strip()):
                yield self._header_line + reader.line_num, cells

    def _sniff(self) -> set[str]:
        text: set[str] = set()
        with self._lines() as lines:
            for row, (line, cells) in enumerate(self._rows(lines)):
                if len(cells) > len(self.names):
                    raise self._too_many_cells(line, len(cells))
                text |= {name for name, cell in zip(self.names, cells, strict=False) if not _numeric(cell)}
                if row == _SNIFF_ROWS:
                    break
        return text

    def _too_many_cells(self, line: int, found: int) -> InputError:
        return InputError(
            f"{self._path}, line {line}: {found} cells, but the header names {len(self.names)} columns"
        )

    def read(self, *, numbers: Collection[str], text: Collection[str]) -> dict[str, Cells]:
        """See :class:`palpate.recording.table.TableFile`."""
        as_text = self._sniffed_text | set(text)
        try:
            return self._read(as_text, numbers, text)
        except ValueError as error:
            if isinstance(error, InputError):
                raise
        # Somewhere below the sniffed rows a number column holds text: find which, and read those as text.
        return self._read(as_text | self._columns_with_text(as_text), numbers, text)

    def _read(self, as_text: set[str], numbers: Collection[str], text: Collection[str]) -> dict[str, Cells]:
        parts: dict[str, list[Cells]] = {name: [] for name in self.names}
        for chunk in self._chunks({name: "str" if name in as_text else "float64" for name in self.names}):
            for name in self.names:
                cells: Cells
                if name not in as_text:
                    cells = chunk[name].to_numpy(dtype=np.float64)
                elif name in numbers and name not in text:
                    cells = to_numbers(chunk[name].to_numpy(dtype=object))
                else:
                    # Few words, many rows: a categorical keeps one string for each word.
                    cells = chunk[name].astype("category").to_numpy(dtype=object)
                parts[name].append(cells)
        columns: dict[str, Cells] = {}
        for name in self.names:
            empty = np.empty(0, dtype=object if name in as_text else np.float64)
            columns[name] = np.concatenate(parts.pop(name) or [empty])
        return columns

    def _columns_with_text(self, known: set[str]) -> set[str]:
        found: set[str] = set()
        for chunk in self._chunks(dict.fromkeys(self.names, "str")):
            for name in set(self.names) - known - found:
                cells = chunk[name]
                if pd.to_numeric(cells[~cells.isin(MISSING)], errors="coerce").isna().any():
                    found.add(name)
        return found

    def parts(self, rows: int) -> list[tuple[int, int]]:
        """See :class:`palpate.recording.table.TableFile`: ranges of bytes that end where a line does."""
        with self._bytes() as stream:
            for _ in range(self._header_line):
                stream.readline()
            start = stream.tell()
            first = stream.readline()
            edges = [start]
            step = max(rows * max(len(first), 1), 1)
            while (aim := edges[-1] + step) < self._size:
                stream.seek(aim)
                stream.readline()
                edges.append(min(stream.tell(), self._size))
        if edges[-1] < self._size:
            edges.append(self._size)
        return list(pairwise(edges))

    def blocks(
        self, part: tuple[int, int], rows: int, *, numbers: Collection[str], text: Collection[str]
    ) -> Iterator[tuple[int, dict[str, Cells]]]:
        """See :class:`palpate.recording.table.TableFile`."""
        wanted = [name for name in self.names if name in numbers or name in text]
        # Most files hold nothing but numbers in number columns, and are read fast; at the first block that
        # does not, the rest is read as text and becomes numbers one by one.
        done = 0
        for as_text in ({*text}, {*text, *numbers}):
            types = {name: "str" if name in as_text else "float64" for name in wanted}
            first, skipped = 0, 0
            try:
                for chunk in self._chunks(types, part=part, columns=wanted, rows=rows):
                    if skipped < done:
                        skipped += 1
                    else:
                        yield first, {name: self._block(chunk[name], name in text) for name in wanted}
                        done += 1
                    first += len(chunk)
                return
            except ValueError as error:
                if isinstance(error, InputError) or set(numbers) <= as_text:
                    raise

    def _block(self, cells: Any, text: bool) -> Cells:
        if text:
            return np.asarray(cells.astype("category").to_numpy(dtype=object))
        if cells.dtype == np.float64:
            return np.asarray(cells.to_numpy(dtype=np.float64))
        return to_numbers(cells.to_numpy(dtype=object))

    def rows_before(self, part: tuple[int, int]) -> int:
        """See :class:`palpate.recording.table.TableFile`; a file is not expected to have blank lines."""
        rows, left = 0, part[0]
        with self._bytes() as stream:
            for _ in range(self._header_line):
                left -= len(stream.readline())
            while left > 0:
                block = stream.read(min(1 << 20, left))
                left -= len(block)
                rows += block.count(b"\n")
        return rows

    def _chunks(
        self,
        dtypes: dict[str, str],
        *,
        part: tuple[int, int] | None = None,
        columns: Collection[str] | None = None,
        rows: int = _CHUNK_ROWS,
    ) -> Iterator[Any]:
        """Frames of so many rows of the whole file or a part of it."""
        raw = FileBytes(self._path, *(part or (0, self._size)))
        try:
            with (
                io.BufferedReader(raw, 1 << 20) as stream,
                pd.read_csv(
                    stream,
                    encoding="utf-8",
                    header=None,
                    names=list(self.names),
                    usecols=None if columns is None else list(columns),
                    skiprows=self._header_line if part is None else 0,
                    dtype=dtypes,
                    keep_default_na=False,
                    na_values={name: MISSING for name, dtype in dtypes.items() if dtype == "float64"},
                    **_EXACT,
                    chunksize=rows,
                    engine="c",
                ) as reader,
            ):
                yield from reader
        except pd.errors.EmptyDataError:
            return
        except UnicodeDecodeError:
            raise self._not_text() from None
        except pd.errors.ParserError as error:
            if "source failed" in str(error):
                # What was raised while pandas read is lost in it: the disk's failure, or else Ctrl-C.
                raise (raw.failure or KeyboardInterrupt()) from None
            if cells := re.search(r"in line (\d+), saw (\d+)", str(error)):
                raise self._too_many_cells(int(cells[1]), int(cells[2])) from None
            raise InputError(f"{self._path} is not CSV: {str(error).strip()}") from None

    def place(self, row: int) -> str:
        """See :class:`palpate.recording.table.TableFile`."""
        return f"line {self._find(row)[0]}"

    def cell(self, row: int, name: str) -> str:
        """See :class:`palpate.recording.table.TableFile`."""
        cells = self._find(row)[1]
        column = self.names.index(name)
        return cells[column].strip() if column < len(cells) else ""

    def _find(self, row: int) -> tuple[int, list[str]]:
        with self._lines() as lines:
            for index, found in enumerate(self._rows(lines)):
                if index == row:
                    return found
        raise IndexError(row)


def _numeric(cell: str) -> bool:
    return cell.strip() in MISSING or parse_number(cell) is not None

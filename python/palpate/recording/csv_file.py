# SPDX-License-Identifier: Apache-2.0
"""CSV files: recognises the text format once, then reads the rows with pandas; messages name the line.

Rows of a long file are counted, and their ends are found, without splitting the rows into cells.
"""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from itertools import islice, pairwise
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from ..errors import InputError
from ..frames import pd
from .dialect import HEAD_BYTES, NOT_STATED, Stated, cells_of_lines, not_csv, recognise, refuse_marks
from .files import CELL_BYTES, require_memory
from .looks import LOOK_ROWS, Look
from .table import MISSING, Cells, LongTable, to_numbers

_CHUNK_CELLS = 1 << 22
"""Number of cells of a CSV file that are read at a time, to limit the use of memory."""

_WORD_BYTES = 64
"""Memory of a word without its characters [bytes]."""

_TRAILING_COLUMN = "\n"
"""Name of the empty column if each row ends with a separator. A header cannot contain it."""

_BLOCK_BYTES = 1 << 22
"""Number of bytes that are read at a time to count rows."""

_BLANK_LINE = re.compile(rb"\n[ \t\r\n]")
"""Start of a line that may be blank."""

_EMPTY_ROW = re.compile(rb"\n[ \t\r]*\n[ \t\r]*[^ \t\r\n]")
"""Empty row between two rows."""

_CLOSING_QUOTE = re.compile(rb'(?:[^"]|"")*"(?!")')
"""Pattern of the text of a quoted cell up to and including its closing quotation mark."""

_OPENING_QUOTE = {separator: re.compile(rb'(?:^|%b)"' % separator) for separator in (b",", b";", b"\t")}
"""Pattern, by separator, of a quotation mark that opens a cell: it is the first character of the cell."""


def _exact_options() -> dict[str, Any]:
    """Returns the options for exact conversion of numbers; newer pandas versions always convert exactly."""
    is_newer = tuple(map(int, pd.__version__.split(".")[:2])) >= (3, 1)
    return {} if is_newer else {"float_precision": "round_trip"}


class FileBytes(io.RawIOBase):
    """The bytes [start, stop) of a CSV file: all without an incomplete last line, or one part of the file."""

    def __init__(self, path: Path, start: int, stop: int) -> None:
        self._stream = path.open("rb", buffering=0)
        self._stream.seek(start)
        self._start, self._stop = start, stop
        self.failure: OSError | None = None
        """Reason why reading the file failed. The C parser of pandas reports the failure without a reason."""

    def readable(self) -> bool:
        return True

    def seekable(self) -> bool:
        return True

    def seek(self, offset: int, whence: int = io.SEEK_SET) -> int:
        if whence == io.SEEK_CUR:  # the base class's `tell` calls `seek(0, SEEK_CUR)`
            return self._stream.seek(offset, whence) - self._start
        if whence != io.SEEK_SET:
            raise io.UnsupportedOperation("only from the start or the current position")
        return self._stream.seek(self._start + offset) - self._start

    def readinto(self, buffer: Any) -> int:
        try:
            block = self._stream.read(min(len(buffer), max(self._stop - self._stream.tell(), 0)))
        except OSError as failure:
            self.failure = failure
            raise
        buffer[: len(block)] = block
        return len(block)

    def close(self) -> None:
        self._stream.close()
        super().close()


class CsvFile(LongTable):
    """A CSV recording. Opening reads the header; :meth:`read` reads the rows.

    A name that ends in ``.part`` is an incomplete recording: its last line is ignored if it has no line feed.
    """

    def __init__(self, path: Path, stated: Stated = NOT_STATED) -> None:
        self._path = path
        self._size = path.stat().st_size
        self.torn = 0
        self.has_empty_rows = False
        """True if :meth:`read` found an empty row between two rows"""
        if path.suffix == ".part":
            self._leave_out_torn_line()
        with self._bytes() as stream:
            head = stream.read(HEAD_BYTES)
        self._dialect = recognise(str(path), head, len(head) == self._size, stated)
        self.names = self._dialect.names
        self.metadata = self._dialect.metadata
        self.notes = self._dialect.notes
        self.looks = self._look_at_first_rows()

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

    def _bytes(self, start: int = 0, stop: int | None = None) -> io.BufferedReader:
        return io.BufferedReader(FileBytes(self._path, start, self._size if stop is None else stop), 1 << 20)

    def _wrong_encoding(self) -> InputError:
        encoding = {"latin-1": "Latin-1"}.get(self._dialect.encoding, self._dialect.encoding.upper())
        return InputError(
            f"{self._path} begins as {encoding} and later has other bytes; if they are Latin-1, "
            "convert the file: iconv -f LATIN1 -t UTF-8 OLD.csv > NEW.csv"
        )

    @contextmanager
    def _lines(self) -> Iterator[io.TextIOWrapper]:
        """Yields the lines of the file after the header and its units."""
        stream = self._bytes(self._dialect.start)
        with io.TextIOWrapper(stream, encoding=self._dialect.encoding, newline="") as lines:
            try:
                yield lines
            except UnicodeDecodeError:
                raise self._wrong_encoding() from None
            except csv.Error as error:
                raise not_csv(str(self._path), error) from None

    def _rows(self, lines: io.TextIOWrapper) -> Iterator[tuple[int, list[str]]]:
        """Yields first line and cells of each row that pandas reads: it skips lines of spaces and tabs.

        Slow: for the first rows and error messages only.
        """
        blank = " \t\r\n".replace(self._dialect.separator, "")
        row: list[str] = []

        def noted() -> Iterator[str]:
            for each in lines:
                row.append(each)
                yield each

        line = self._dialect.lines_before + 1
        for cells in cells_of_lines(noted(), self._dialect.separator):
            if len(row) > 1 or row[0].strip(blank):
                yield line, cells
            line += len(row)
            row.clear()

    def _look_at_first_rows(self) -> dict[str, Look]:
        """Describes the columns by their first rows."""
        cells: dict[str, list[str]] = {name: [] for name in self.names}
        columns = len(self.names) + self._dialect.trailing
        with self._lines() as lines:
            for line, row in islice(self._rows(lines), LOOK_ROWS):
                if len(row) > columns:
                    raise self._too_many_cells(line, len(row))
                for name, cell in zip(self.names, row, strict=False):
                    cells[name].append(cell)
        return {name: Look.of(found, self._dialect.marks) for name, found in cells.items()}

    def _first_too_wide(self) -> InputError:
        columns = len(self.names) + self._dialect.trailing
        with self._lines() as lines:
            return next(
                self._too_many_cells(line, len(cells))
                for line, cells in self._rows(lines)
                if len(cells) > columns
            )

    def _too_many_cells(self, line: int, found: int) -> InputError:
        return InputError(
            f"{self._path}, line {line}: {found} cells, but the header names {len(self.names)} columns"
        )

    def read(self, *, numbers: Collection[str], text: Collection[str]) -> dict[str, Cells]:
        as_text = {*self.text_names, *text}
        require_memory(self._path, self._least_memory())
        try:
            return self._read(as_text, numbers, text)
        except ValueError as error:
            if isinstance(error, InputError):
                raise
        # A column has numbers in its first rows and text in later rows. Find this column and read it as text.
        return self._read(as_text | self._columns_with_text(as_text), numbers, text)

    def _least_memory(self) -> int:
        """Returns the memory for all cells without the words in them [bytes]."""
        lines = 0
        with self._bytes(self._dialect.start) as stream:
            for block in iter(lambda: stream.read(_BLOCK_BYTES), b""):
                lines += block.count(b"\n")
                self.has_empty_rows |= _EMPTY_ROW.search(block) is not None
        return CELL_BYTES * lines * len(self.names)

    def _read(self, as_text: set[str], numbers: Collection[str], text: Collection[str]) -> dict[str, Cells]:
        parts: dict[str, list[Cells]] = {name: [] for name in self.names}
        needed = 0
        for chunk in self._chunks({name: "str" if name in as_text else "float64" for name in self.names}):
            for name in self.names:
                cells: Cells
                if name not in as_text:
                    cells = chunk[name].to_numpy(dtype=np.float64)
                elif name in numbers and name not in text:
                    cells = self._to_numbers(name, chunk[name].to_numpy(dtype=object))
                else:
                    # The pandas type "category" stores each distinct word only once, which saves memory.
                    words = chunk[name].astype("category")
                    needed += sum(_WORD_BYTES + len(word) for word in words.cat.categories)
                    cells = words.to_numpy(dtype=object)
                parts[name].append(cells)
                needed += CELL_BYTES * len(cells)
            require_memory(self._path, needed)
        columns: dict[str, Cells] = {}
        for name in self.names:
            empty = np.empty(0, dtype=object if name in as_text else np.float64)
            columns[name] = np.concatenate(parts.pop(name) or [empty])
        return columns

    def _columns_with_text(self, text_names: set[str]) -> set[str]:
        found: set[str] = set()
        for chunk in self._chunks(dict.fromkeys(self.names, "str")):
            for name in set(self.names) - text_names - found:
                cells = chunk[name]
                if self._dialect.marks.startswith(","):
                    cells = cells.str.replace(",", ".")
                if pd.to_numeric(cells[~cells.isin(MISSING)], errors="coerce").isna().any():
                    found.add(name)
        return found

    def parts(self, rows: int) -> tuple[int, list[tuple[int, int]]]:
        if self._dialect.separator == " ":
            raise InputError(
                f"{self._path} is separated by spaces, which cannot be read part by part; separate its "
                "columns by commas, semicolons or tabs"
            )
        if not self._dialect.single_bytes:
            encoding = self._dialect.encoding.upper().replace("16-", "16")  # for iconv
            raise InputError(
                f"{self._path} is {encoding}, which cannot be read part by part; convert it: "
                f"iconv -f {encoding} -t UTF-8 OLD.csv > NEW.csv"
            )
        start = self._dialect.start
        with self._bytes(start) as stream:
            first = stream.readline()
        columns = len(self.names) + self._dialect.trailing
        step = max(rows * len(first), 1)
        with self._bytes(start) as stream:
            found = count_rows(stream, self._dialect.separator, columns=columns, step=step)
        if found.too_wide is not None:
            row, cells = found.too_wide
            raise self._too_many_cells(self._find(row)[0], cells)
        return found.rows, [(start + begin, start + end) for begin, end in pairwise(found.ends)]

    def blocks(
        self, part: tuple[int, int], rows: int, *, numbers: Collection[str], text: Collection[str]
    ) -> Iterator[tuple[int, dict[str, Cells]]]:
        wanted = [name for name in self.names if name in numbers or name in text]
        # Most files have only numbers in columns of numbers and are read fast. If a block has text, the part
        # is read again as text, without the rows that were already returned.
        returned = 0
        for as_text in ({*text}, {*text, *numbers}):
            types = {name: "str" if name in as_text else "float64" for name in wanted}
            first = 0
            try:
                for chunk in self._chunks(types, part=part, columns=wanted, rows=rows):
                    stop = first + len(chunk)
                    if stop > returned:
                        new = chunk.iloc[max(returned - first, 0) :]
                        begin, returned = stop - len(new), stop
                        yield begin, {name: self._block(name, new[name], name in text) for name in wanted}
                    first = stop
                return
            except ValueError as error:
                if isinstance(error, InputError) or set(numbers) <= as_text:
                    raise

    def _block(self, name: str, cells: Any, text: bool) -> Cells:
        if text:
            return np.asarray(cells.astype("category").to_numpy(dtype=object))
        if cells.dtype == np.float64:
            return np.asarray(cells.to_numpy(dtype=np.float64))
        return self._to_numbers(name, cells.to_numpy(dtype=object))

    def _to_numbers(self, name: str, cells: Cells) -> Cells:
        numbers = to_numbers(cells, self._dialect.marks)
        others = cells[np.isnan(numbers)]
        where = f"{self._path}: column {name}"
        refuse_marks(where, others, self._dialect.marks)
        return numbers

    def rows_before(self, part: tuple[int, int]) -> int:
        with self._bytes(self._dialect.start, part[0]) as stream:
            return count_rows(stream, self._dialect.separator).rows

    def _chunks(
        self,
        dtypes: dict[str, str],
        *,
        part: tuple[int, int] | None = None,
        columns: Collection[str] | None = None,
        rows: int = 0,
    ) -> Iterator[Any]:
        """Yields frames of the given number of rows, by default few, from the whole file or a part."""
        raw = FileBytes(self._path, *(part or (self._dialect.start, self._size)))
        trailing = [_TRAILING_COLUMN] if self._dialect.trailing else []
        before = 0
        try:
            with (
                io.BufferedReader(raw, 1 << 20) as stream,
                pd.read_csv(
                    stream,
                    encoding=self._dialect.encoding,
                    sep=r"\s+" if self._dialect.separator == " " else self._dialect.separator,
                    decimal=self._dialect.marks[0],
                    header=None,
                    names=[*self.names, *trailing],
                    usecols=None if columns is None else [*columns, *trailing],
                    index_col=False,
                    dtype={**dtypes, **dict.fromkeys(trailing, "category")},
                    keep_default_na=False,
                    na_values={name: MISSING for name, dtype in dtypes.items() if dtype == "float64"},
                    **_exact_options(),
                    chunksize=rows or max(1, _CHUNK_CELLS // len(self.names)),
                    engine="c",
                ) as reader,
            ):
                for chunk in reader:
                    if trailing:
                        self._refuse_extra_cells(chunk.pop(_TRAILING_COLUMN), before, part)
                    before += len(chunk)
                    yield chunk
        except pd.errors.EmptyDataError:
            return
        except UnicodeDecodeError:
            raise self._wrong_encoding() from None
        except pd.errors.ParserError as error:
            if "source failed" in str(error):
                # pandas hides the exception that interrupted the read (disk error or Ctrl-C): raise that
                # exception.
                raise (raw.failure or KeyboardInterrupt()) from None
            if re.search(r"in line \d+, saw \d+", str(error)):
                raise self._first_too_wide() from None
            if columns is not None and "Too many columns specified" in str(error):
                # With `usecols`, pandas refuses a part that begins with incomplete rows: read all columns.
                all_types = {name: dtypes.get(name, "category") for name in self.names}
                yield from self._chunks(all_types, part=part, rows=rows)
                return
            raise InputError(f"{self._path} is not CSV: {str(error).strip()}") from None

    def _refuse_extra_cells(self, cells: Any, before: int, part: tuple[int, int] | None) -> None:
        """Refuses a row that has more cells than the header has names."""
        if any(str(word).strip() for word in cells.cat.categories):
            extra = cells.notna() & (cells.astype(str).str.strip() != "")
            row = before + int(np.flatnonzero(extra)[0])
            line, found = self._find(row + (self.rows_before(part) if part else 0))
            raise self._too_many_cells(line, len(found))

    def place(self, row: int) -> str:
        return f"line {self._find(row)[0]}"

    def cell(self, row: int, name: str) -> str:
        cells = self._find(row)[1]
        column = self.names.index(name)
        return cells[column].strip() if column < len(cells) else ""

    def _find(self, row: int) -> tuple[int, list[str]]:
        with self._lines() as lines:
            for index, found in enumerate(self._rows(lines)):
                if index == row:
                    return found
        raise IndexError(row)


@dataclass
class RowCount:
    """Number of rows in a stream of bytes, and byte positions at which rows end."""

    rows: int = 0
    ends: list[int] = field(default_factory=lambda: [0])
    """Bytes from the start of the stream to some ends of rows, at least `step` bytes apart, and to its end"""
    too_wide: tuple[int, int] | None = None
    """First row that has more cells than the table has columns, and its number of cells"""


def count_rows(stream: BinaryIO, separator: str, *, columns: int = 0, step: int = _BLOCK_BYTES) -> RowCount:
    """Counts the rows of a stream and finds ends of rows. The stream must begin with a row.

    A line break within a quoted cell does not end a row. A line of white space does not count.

    Parameters
    ----------
    stream : binary stream
    separator : str
        One character.
    columns : int
        Reports rows with more cells than this; 0 disables the check.
    step : int
        Least distance of the ends of rows that are returned [bytes].
    """
    mark = separator.encode()
    space = b" \r" if mark == b"\t" else b" \t\r"
    found, offset, quoted, row = RowCount(), 0, False, b""
    while block := stream.read(min(step, _BLOCK_BYTES)):
        block += stream.readline()
        offset += len(block)
        lines = block.count(b"\n") + (not block.endswith(b"\n"))
        blank = block[0] in b"\n" + space or _BLANK_LINE.search(block)
        equal_rows = not columns or block.count(mark) == lines * (columns - 1)
        if not (quoted or blank or b'"' in block) and equal_rows:
            found.rows += lines
        else:
            for line in block.removesuffix(b"\n").split(b"\n"):
                if b'"' in line:
                    quoted = _ends_quoted(line, quoted, mark)
                # The row is cut: a cell whose quotation mark is never closed would otherwise fill the memory.
                row += line[: _BLOCK_BYTES - len(row)]
                if quoted:
                    row += b"\n"
                    continue
                if row.strip(space):
                    if columns and not found.too_wide and (cells := _cell_count(row, mark)) > columns:
                        found.too_wide = found.rows, cells
                    found.rows += 1
                row = b""
        if not quoted and offset - found.ends[-1] >= step:
            found.ends.append(offset)
    if offset > found.ends[-1]:
        found.ends.append(offset)
    return found


def _cell_count(row: bytes, mark: bytes) -> int:
    if b'"' not in row:
        return row.count(mark) + 1
    return len(next(csv.reader([row.decode("latin-1")], delimiter=mark.decode())))


def _ends_quoted(line: bytes, quoted: bool, mark: bytes) -> bool:
    """Returns True if a line ends inside a quoted cell; `quoted`: the line begins inside a quoted cell."""
    offset = 0
    while True:
        found = (_CLOSING_QUOTE.match if quoted else _OPENING_QUOTE[mark].search)(line, offset)
        if found is None:
            return quoted
        offset, quoted = found.end(), not quoted

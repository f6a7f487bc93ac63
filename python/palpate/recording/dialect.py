# SPDX-License-Identifier: Apache-2.0
"""Recognition of the dialect of a text file: encoding, separator, decimal mark, header, units, first row."""

from __future__ import annotations

import codecs
import csv
import io
import re
import unicodedata
from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from itertools import chain, islice
from typing import Any

from ..errors import InputError, escaped, listed, shortened
from .looks import cure_of_header
from .table import MISSING, parse_number, parse_with
from .units import JAPANESE_QUANTITIES, split_name, unit_of

HEAD_BYTES = 1 << 20
"""Number of first bytes of a file in which the header is searched; a later header is not found."""

HEAD_LINES = 1000
"""Number of lines, without comments, from which separator and decimal mark are recognised."""

SEPARATORS = {"\t": "tab", ";": "semicolon", ",": "comma", " ": "space"}
"""Separators by preference: a comma may be a decimal comma, but a tab is always a separator. Several spaces
separate like one."""

_BYTE_ORDER_MARKS = (
    (codecs.BOM_UTF8, "utf-8"),
    (codecs.BOM_UTF16_LE, "utf-16-le"),
    (codecs.BOM_UTF16_BE, "utf-16-be"),
)

RECORDING_FORMATS = "CSV, Parquet, a workbook (.xlsx, .xls, .ods), NumPy (.npz), MATLAB (.mat) or MCAP"

Row = Sequence[str]

LEAST_NUMBERS = 2
"""A row of data needs numbers in at least this number of cells: position and force."""

LEAST_CONSECUTIVE_ROWS = 3
"""Least number of consecutive rows of numbers that mark the data of a table; all rows of a shorter table."""

_MARKS = re.compile(r"[^.,]")
"""Every character that is neither a decimal point nor a comma."""

_OTHER = {".": ",", ",": "."}
"""Mark between thousands by the decimal mark."""

_OTHER_SEPARATOR = re.compile(r"[\t;]|,(?!\d)|(?<!\d),")
"""Separator other than a space; a comma between digits may be a decimal comma."""

_COMMENT_START = re.compile(r"[#\s]*((columns|fields|names|header|units)\s*[:=]\s*)?", re.IGNORECASE)
"""Start of a comment that holds a header."""

AMBIGUOUS_COMMA = re.compile(r"[-+]?[1-9]\d{0,2},\d{3}")
"""Number with one comma that may be a decimal comma or a thousands separator."""


@dataclass(frozen=True)
class Dialect:
    """Dialect of a text file: how its bytes are divided into names, numbers and words."""

    encoding: str
    separator: str
    marks: str
    """Decimal mark, and behind it the mark between thousands if it is known"""
    names: tuple[str, ...]
    metadata: dict[str, str]
    start: int
    """Number of bytes of the file up to the end of the header and its line of units"""
    lines_before: int
    """Number of lines of the file up to the end of the header and its line of units"""
    trailing: bool
    """True if each row ends with a separator"""
    notes: tuple[str, ...]
    """Differences of this file from a plain CSV file, as parts of one sentence"""

    @property
    def single_bytes(self) -> bool:
        """True if line feeds, separators and quotes are single bytes, so the file can be read in parts."""
        return not self.encoding.startswith("utf-16")


@dataclass(frozen=True)
class Stated:
    """What the caller states about a table that does not state it itself."""

    columns: tuple[str, ...] = ()
    """Column names of a table without a header; empty if the table has one"""
    decimal: str | None = None
    """Decimal mark, "." or ","; the other mark then separates thousands. None: recognised"""


NOT_STATED = Stated()


def recognise(file: str, head: bytes, whole: bool, stated: Stated = NOT_STATED) -> Dialect:
    """Recognises the dialect of a text file.

    Parameters
    ----------
    file : str
        The file's name, for the sentences.
    head : bytes
        The first bytes of the file.
    whole : bool
        True if these are all of its bytes.
    stated : Stated
        What the caller states about the file.

    Raises
    ------
    InputError
        The bytes are not text, no header with usable names is found, or the decimal mark is ambiguous.
    """
    mark, encoding, text = _text_of(file, head, whole)
    if text.lstrip().startswith("{") or file.endswith(".json"):
        raise _json_refusal(file, text)
    lines = list(io.StringIO(text, newline=""))
    if not whole and len(lines) > 1:
        lines.pop()  # the bytes read so far may end inside a line
    found = _header(file, lines, stated.columns)
    if found.without_header:
        raise InputError(f"{file} has no header. {cure_of_header(found.without_header)}")
    separator, spans, row = found.separator, found.spans, found.header.row
    before, header_line = spans[row]
    header, header_notes = with_checked_names(f"{file}, line {header_line + 1}", found.header)
    marks = marks_of(stated.decimal)
    if found.sample and stated.decimal is None:
        marks = decimal_mark(f"{file}, line {spans[header.first][0] + 1}", found.sample)
    last = header.row if header.units_row is None else header.units_row
    if header.stated or header.units_row is not None or _is_comment(lines[before]):
        lines_before = spans[header.first][0]  # comments can be between units and data
    else:
        lines_before = spans[last][1] + 1
    notes = []
    if encoding != "utf-8":
        notes.append({"latin-1": "Latin-1", "cp932": "Shift JIS"}.get(encoding, encoding.upper()))
    if separator != ",":
        notes.append(f"separated by {SEPARATORS[separator]}s")
    if marks.startswith(","):
        notes.append("decimal comma")
    preamble = sum(1 for line in lines[:before] if line.strip() and not _is_comment(line))
    if preamble:
        place = "data" if header.stated else "header"
        notes.append(f"{preamble} line{'s' * (preamble > 1)} before the {place} in line {before + 1}")
    if header.stated:
        notes.append("the column names are stated")
    elif _is_comment(lines[before]):
        notes.append(f"header in the comment in line {before + 1}")
    if header.units_row is not None:
        notes.append(f"units in line {spans[header.units_row][0] + 1}")
    return Dialect(
        encoding=encoding,
        separator=separator,
        marks=marks,
        names=header.names,
        metadata=dict(_metadata(lines[:before], separator)),
        start=mark + len("".join(lines[:lines_before]).encode(encoding)),
        lines_before=lines_before,
        trailing=header.trailing,
        notes=(*notes, *header_notes),
    )


def read_rows(
    file: str, content: bytes, names: tuple[str, ...] = ()
) -> tuple[str, dict[int, list[str | None]], set[int]]:
    """Splits a text file into its cells. `names` are those that the caller states for its columns.

    Returns
    -------
    separator : str
    rows : dict
        Cells by the number of the line; empty cells are None, empty rows and cells at the end are left out.
    behind_empty : set of int
        Numbers of the lines behind an empty row.

    Raises
    ------
    InputError
        The bytes are not text, or a quotation mark is missing.
    """
    lines = list(io.StringIO(_text_of(file, content, True)[2], newline=""))
    separator = _header(file, lines, names).separator
    without_marks = (_COMMENT_START.sub("", line, count=1) if _is_comment(line) else line for line in lines)
    reader = cells_of_lines(without_marks, separator)
    rows: dict[int, list[str | None]] = {}
    behind_empty = set()
    line, is_empty = 1, False
    try:
        for cells in reader:
            filled = [cell if cell.strip() else None for cell in cells]
            while filled and filled[-1] is None:
                filled.pop()
            if filled:
                rows[line] = filled
            if filled and is_empty:
                behind_empty.add(line)
            line, is_empty = reader.line_num + 1, not filled
    except csv.Error as error:
        raise not_csv(file, error) from None
    return separator, rows, behind_empty


def not_csv(file: str, error: csv.Error) -> InputError:
    """Returns the error for text that cannot be split into cells."""
    return InputError(f"{file} is not CSV: {error}; a closing quotation mark is probably missing")


def not_text(file: str) -> InputError:
    """Returns the error for a file that is neither text nor of another known format."""
    return InputError(f"{file} is not text; a recording is {RECORDING_FORMATS}")


def _text_of(file: str, head: bytes, whole: bool) -> tuple[int, str, str]:
    """Returns length of the byte order mark, encoding and text of the first bytes of a file."""
    mark, encoding = _encoding(head)
    text = _decoded(file, head[mark:], encoding, whole)
    if encoding == "utf-8" and text is None:
        encoding, text = "cp932", _decoded(file, head[mark:], "cp932", whole)
        if text is None or not any(word in text for word in JAPANESE_QUANTITIES):
            encoding, text = "latin-1", _decoded(file, head[mark:], "latin-1", whole)
    if text is None or _is_binary(text):
        raise not_text(file)
    return mark, encoding, text


def _encoding(head: bytes) -> tuple[int, str]:
    for mark, encoding in _BYTE_ORDER_MARKS:
        if head.startswith(mark):
            return len(mark), encoding
    start = head[:4096]
    even, odd = start[0::2].count(0), start[1::2].count(0)
    # In UTF-16, one of the two bytes of Latin letters, digits and separators is zero.
    if 4 * max(even, odd) > len(start) and 20 * min(even, odd) < max(even, odd):
        return 0, "utf-16-le" if odd > even else "utf-16-be"
    return 0, "utf-8"


def _decoded(file: str, head: bytes, encoding: str, whole: bool) -> str | None:
    with suppress(UnicodeDecodeError):
        return codecs.getincrementaldecoder(encoding)().decode(head, final=whole)
    return None


def _is_binary(text: str) -> bool:
    """Returns True if more than a tenth of the first characters are control characters, or one is NUL."""
    start = text[:4096]
    control = sum(unicodedata.category(each) == "Cc" and each not in "\t\n\r\f" for each in start)
    return "\x00" in start or 10 * control > len(start)


def _json_refusal(file: str, text: str) -> InputError:
    kind = "a palpate model" if '"network"' in text or '"palpate' in text else "JSON"
    return InputError(f"{file} looks like {kind}; a recording is {RECORDING_FORMATS}")


@dataclass(frozen=True)
class _Candidate:
    """Header of a file whose lines are split at a separator that may be the right one."""

    header: Header
    separator: str
    spans: list[tuple[int, int]]
    """First and last line in the file of each row, counted from 0"""
    sample: list[list[str]]
    """First rows of data; empty if no row holds numbers"""
    without_header: list[list[str]] = field(default_factory=list)
    """First rows of data of a table without a header, which the first row replaces"""


def _header(file: str, lines: list[str], names: tuple[str, ...]) -> _Candidate:
    """Returns the header with the separator that gives most columns of numbers.

    `names` are those that the caller states for a file without a header.
    """
    with_text = ((k, line) for k, line in enumerate(lines) if line.strip() and not _is_comment(line))
    plain = list(islice(with_text, HEAD_LINES))
    if not plain:
        raise InputError(f"{file} has no header: the first line must name the columns")
    best: _Candidate | None = None
    without_header: list[list[str]] = []
    for separator in SEPARATORS:
        if not any(separator in line.strip() for _, line in plain):
            continue
        if separator == " " and any(_OTHER_SEPARATOR.search(line) for _, line in plain):
            continue
        spans, rows = _rows(file, plain, separator)
        header = find_header(rows, names)
        if header is None:
            without_header = max(
                without_header, _first_data(rows), key=lambda each: len(each[0]) if each else 0
            )
        if header is None and not names:
            # Some programs write the header as a comment, as numpy.savetxt does.
            cells = len(without_header[0]) if without_header else 0
            comments = _comments_above(lines, plain[0][0])
            above = [each for each in comments if _cell_count(file, each, separator) == cells]
            if above:
                spans, rows = _rows(file, [*above, *plain], separator)
                header = find_header(rows)
        if header is not None and (best is None or header.numbers > best.header.numbers):
            best = _Candidate(header, separator, spans, rows[header.first :])
    if best is not None:
        return best
    if names and without_header:
        raise InputError(f"{file} has {len(without_header[0])} columns, but --columns names {len(names)}")
    separator = max(",;\t", key=lambda each: len(_rows(file, plain[:1], each)[1][0]))
    if without_header and len(_rows(file, plain[:1], separator)[1][0]) == 1:
        separator = " "
    spans, rows = _rows(file, plain, separator)
    return _Candidate(first_row_as_header(rows), separator, spans, [], without_header)


def _comments_above(lines: list[str], first: int) -> list[tuple[int, str]]:
    """Returns number and text of the comments directly above a line."""
    start = first
    while start > 0 and _is_comment(lines[start - 1]):
        start -= 1
    return [(k, _COMMENT_START.sub("", lines[k], count=1)) for k in range(start, first)]


def _cell_count(file: str, line: tuple[int, str], separator: str) -> int:
    return max(map(len, _rows(file, [line], separator)[1]), default=0)


def _first_data(rows: Sequence[list[str]]) -> list[list[str]]:
    """Returns the rows of data of a table without a header; empty if it has none."""
    first = next((k for k in range(len(rows)) if _starts_data(rows, k)), None)
    if first is None or any(len(row) == len(rows[first]) and not _is_data(row) for row in rows[:first]):
        return []
    return [row for row in rows[first:] if len(row) == len(rows[first])]


def _is_comment(line: str) -> bool:
    return line.lstrip().startswith("#")


def _rows(
    file: str, plain: list[tuple[int, str]], separator: str
) -> tuple[list[tuple[int, int]], list[list[str]]]:
    """Returns, for each row, the indices of its first and last line in the file, and its cells."""
    spans, rows = [], []
    reader = cells_of_lines((line for _, line in plain), separator)
    first_line = 0
    try:
        for cells in reader:
            spans.append((plain[first_line][0], plain[reader.line_num - 1][0]))
            first_line = reader.line_num
            rows.append(cells)
    except csv.Error as error:
        raise not_csv(file, error) from None
    return spans, rows


def cells_of_lines(lines: Iterable[str], separator: str) -> Any:
    """Returns a csv reader of lines; several spaces separate like one."""
    if separator == " ":
        return csv.reader((" ".join(line.split()) for line in lines), delimiter=" ")
    return csv.reader(lines, delimiter=separator)


def _metadata(lines: list[str], separator: str) -> Iterator[tuple[str, str]]:
    """Yields key and value of each line before the header."""
    for line in lines:
        text = line.strip()
        if not text:
            continue
        comment = text.startswith("#")
        text = text[1:] if comment else text.rstrip(";,\t ")
        key, found, value = text.partition(":")
        if not comment and not found:
            key, _, value = text.partition(separator)
        yield escaped(key.strip()), escaped(value.strip())


@dataclass(frozen=True)
class Header:
    """Header of a table: its column names, and the indices of the rows with names, units and first data."""

    row: int
    names: tuple[str, ...]
    """Column names. Control characters are escaped; a unit from a line of units is added in brackets."""
    first: int
    """Index of the first row of data"""
    units_row: int | None = None
    trailing: bool = False
    """True if each row ends with a separator; the last column then has no name and is ignored"""
    numbers: int = 0
    """Number of columns that hold numbers in the first row of data"""
    stated: bool = False
    """True if the caller states the names; `row` is then the first row of data"""


def find_header(rows: Sequence[Row], stated: tuple[str, ...] = ()) -> Header | None:
    """Finds the header above the first run of rows with two or more numbers, or None without one.

    If the names are stated, the run begins with a row of as many cells, and no header is searched.

    The header is a row above the run without numbers for which :func:`_may_be_header` is true. Of several
    such rows the one above a row of units is chosen, else the one with the most units in its names, then the
    lowest one.
    """
    starts = (k for k in range(len(rows)) if _starts_data(rows, k))
    if stated:
        starts = (k for k in starts if len(_without_empty_end(rows[k])) == len(stated))
    first = next(starts, None)
    if first is None:
        return None
    cells = len(rows[first])
    numbers = sum(is_number(cell) for cell in rows[first])
    if stated:
        names = [*stated, *[""] * (cells - len(stated))]
        return _without_trailing(
            Header(first, tuple(names), first, numbers=numbers, stated=True),
            rows[first : first + LEAST_CONSECUTIVE_ROWS],
        )
    above = first
    while above > 0 and _may_be_header(rows, above - 1, first) and not _is_data(rows[above - 1][:cells]):
        above -= 1
    candidates = [k for k in range(above, first) if not any(map(is_number, rows[k][:cells]))]
    if not candidates:
        return None
    units_row = max((k for k in candidates[1:] if _is_units(rows[k])), default=None)
    if units_row is not None:
        row = candidates[candidates.index(units_row) - 1]
    else:
        row = max(candidates, key=lambda k: (sum(split_name(name)[1] is not None for name in rows[k]), k))
    names = [escaped(name.strip()) for name in rows[row]]
    if any(map(is_number, names)):  # behind the names of the columns, a header can hold settings
        names = names[:cells]
    names += [""] * (cells - len(names))
    if units_row is not None:
        units = [escaped(_without_brackets(unit)) for unit in rows[units_row]] + [""] * len(names)
        names = [f"{name} [{unit}]" if unit else name for name, unit in zip(names, units, strict=False)]
    found = Header(row, tuple(names), first, units_row, numbers=numbers)
    return _without_trailing(found, rows[first : first + LEAST_CONSECUTIVE_ROWS])


def _without_empty_end(row: Row) -> Row:
    return row if row[-1].strip() else row[:-1]


def first_row_as_header(rows: Sequence[Row]) -> Header:
    """Returns the first row as the header, for a table without rows of numbers."""
    return Header(0, tuple(escaped(name.strip()) for name in rows[0]), 1)


def with_checked_names(where: str, header: Header) -> tuple[Header, list[str]]:
    """Checks the names of a header and names an unnamed first column. Returns the header and notes.

    Raises
    ------
    InputError
        A name is a number, missing or repeated, or there is only one column.
    """
    names = list(header.names)
    notes = []
    if any(parse_number(name) is not None for name in names):
        raise InputError(f"{where}: a header must name the columns, found {listed(names)}")
    if names[0] == "" and len(names) > LEAST_NUMBERS:
        names[0] = "unnamed"
        while names[0] in names[1:]:
            names[0] += "_"
        notes.append("the first column has no name (an index)")
    if "" in names:
        raise InputError(f"{where}: column {names.index('') + 1} has no name; name it in the file")
    for name in names:
        if names.count(name) > 1:
            raise InputError(
                f"{where}: column name {shortened(name)} occurs {names.count(name)} times; "
                "rename these columns in the file"
            )
    if len(names) == 1:
        raise InputError(
            f"{where}: there is one column ({shortened(names[0])}); a recording needs a position and a "
            "force, separated by commas, semicolons, tabs or spaces"
        )
    return replace(header, names=tuple(names)), notes


def decimal_mark(where: str, rows: Sequence[Row]) -> str:
    """Returns the decimal mark of rows of data, "." or ",", and behind it the mark between thousands, if any.

    Raises
    ------
    InputError
        A comma may be a decimal comma or a thousands separator, or both marks occur as decimal marks.
    """
    cells = [cell.strip() for cell in dict.fromkeys(chain.from_iterable(rows)) if is_number(cell)]
    for decimal in {_proven_mark(_MARKS.sub("", cell)) for cell in cells} - {""}:
        marks = decimal + _OTHER[decimal]
        if all(parse_with(cell, marks) is not None for cell in cells):
            return marks
    commas = [cell for cell in cells if parse_number(cell) is None and parse_with(cell, ",") is not None]
    if not commas:
        return "."
    points = next((cell for cell in cells if "." in cell and parse_number(cell) is not None), None)
    if points is None and not all(AMBIGUOUS_COMMA.fullmatch(cell) for cell in commas):
        return ","
    if points is None:
        raise _unknown_mark(f"{where} holds {commas[0]!r}, and three digits follow every comma", ",.")
    raise _unknown_mark(f"{where} holds {commas[0]!r}, and {points!r} has a decimal point", ".")


def _proven_mark(marks: str) -> str:
    """Returns the decimal mark of a number by its points and commas: a mark between thousands may repeat and
    is before the decimal mark. Empty if these marks do not determine it.
    """
    if len(marks) < 2:
        return ""
    return marks[-1] if len(set(marks)) > 1 else _OTHER[marks[0]]


def marks_of(decimal: str | None) -> str:
    """Returns the stated decimal mark and the other mark, which then separates thousands; "." if none is
    stated."""
    return "." if decimal is None else decimal + _OTHER[decimal]


def refuse_marks(where: str, cells: Iterable[object], marks: str) -> None:
    """Refuses numbers whose decimal or thousands marks differ from those in the first rows of the file.

    Raises
    ------
    InputError
        A cell is a number with marks that the first rows do not have. The message names the option that
        states the decimal mark.
    """
    for cell in dict.fromkeys(str(cell).strip() for cell in cells):
        if is_number(cell) and parse_number(cell) is None:
            finding = f"{where} holds {cell!r}, and the decimal mark of the first rows is {marks[0]!r}"
            candidates = "," if marks[0] == "," else ",."
            possible = [mark for mark in candidates if parse_with(cell, mark + _OTHER[mark]) is not None]
            if not possible:
                raise InputError(f"{finding}: export the file again without a mark between thousands")
            raise _unknown_mark(finding, possible)


def _unknown_mark(finding: str, possible: Iterable[str]) -> InputError:
    """Returns the refusal of a number whose decimal mark is not known, with the options that state it."""
    uses = {
        ",": "if the comma is the decimal mark, add: --decimal ','",
        ".": "if the point is the decimal mark, add: --decimal .",
    }
    return InputError(f"{finding}: {'; '.join(uses[mark] for mark in possible)}")


def is_number(cell: str) -> bool:
    """Returns True if a cell is a number with any decimal mark and any mark between thousands."""
    word = cell.strip()
    return parse_with(word, ".,") is not None or parse_with(word, ",.") is not None


def _is_data(row: Row) -> bool:
    numbers = sum(is_number(cell) or cell.strip() in MISSING[1:] for cell in row)
    return numbers >= LEAST_NUMBERS


def _starts_data(rows: Sequence[Row], k: int) -> bool:
    following = rows[k : k + LEAST_CONSECUTIVE_ROWS]
    return all(len(row) == len(following[0]) and _is_data(row) for row in following)


def _may_be_header(rows: Sequence[Row], k: int, first: int) -> bool:
    """Returns True if row k can be the header above the data row `first`: both have the same number of cells.

    A row directly above `first` may have one cell less if each data row ends with a separator, or more if
    cells of the data row are missing.
    """
    cells, needed = len(rows[k]), len(rows[first])
    if cells == needed:
        return True
    if k + 1 != first:
        return False
    ends_empty = all(row[-1].strip() == "" for row in rows[first : first + LEAST_CONSECUTIVE_ROWS])
    return cells > needed or (cells == needed - 1 and cells >= LEAST_NUMBERS and ends_empty)


def _without_brackets(unit: str) -> str:
    text = unit.strip()
    return text[1:-1].strip() if text[:1] + text[-1:] in ("[]", "()") else text


def _is_units(row: Row) -> bool:
    stated = [_without_brackets(cell) for cell in row if _without_brackets(cell) not in ("", "-")]
    known = sum(unit_of(text) is not None for text in stated)
    return known > 0 and 2 * known >= len(stated) and not any(map(is_number, stated))


def _without_trailing(header: Header, data: Sequence[Row]) -> Header:
    empty = all(row[-1].strip() == "" for row in data if len(row) == len(header.names))
    if len(header.names) > LEAST_NUMBERS and header.names[-1] == "" and empty:
        return replace(header, names=header.names[:-1], trailing=True)
    return header

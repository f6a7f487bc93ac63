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
from dataclasses import dataclass, replace
from itertools import islice

from ..errors import InputError, escaped, listed, shortened
from .table import MISSING, parse_number, parse_with
from .units import split_name, unit_of

HEAD_BYTES = 1 << 20
"""Number of first bytes of a file in which the header is searched; a later header is not found."""

HEAD_LINES = 1000
"""Number of lines, without comments, from which separator and decimal mark are recognised."""

SEPARATORS = {"\t": "tab", ";": "semicolon", ",": "comma"}
"""Separators by preference: a comma may be a decimal comma, but a tab is always a separator."""

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

THOUSANDS_SEPARATED = re.compile(
    r"[-+]?(\d{1,3}(,\d{3})+\.\d*|\d{1,3}(\.\d{3})+,\d*|\d{1,3}(,\d{3}){2,}|\d{1,3}(\.\d{3}){2,}"
    r"|\d{1,3}(['’ \u00a0\u202f]\d{3})+([.,]\d*)?)"
)
"""Number with thousands separators, with any decimal mark."""

AMBIGUOUS_COMMA = re.compile(r"[-+]?[1-9]\d{0,2},\d{3}")
"""Number with one comma that may be a decimal comma or a thousands separator."""


@dataclass(frozen=True)
class Dialect:
    """Dialect of a text file: how its bytes are divided into names, numbers and words."""

    encoding: str
    separator: str
    decimal: str
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


def recognise(file: str, head: bytes, whole: bool) -> Dialect:
    """Recognises the dialect of a text file.

    Parameters
    ----------
    file : str
        The file's name, for the sentences.
    head : bytes
        The first bytes of the file.
    whole : bool
        True if these are all of its bytes.

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
    found = _header(file, lines)
    separator, spans = found.separator, found.spans
    before, header_line = spans[found.header.row]
    header, header_notes = with_checked_names(f"{file}, line {header_line + 1}", found.header)
    decimal = "."
    if found.sample:
        decimal = decimal_mark(f"{file}, line {spans[header.first][0] + 1}", found.sample, separator)
    lines_before = spans[header.row if header.units_row is None else header.units_row][1] + 1
    notes = []
    if encoding != "utf-8":
        notes.append({"latin-1": "Latin-1"}.get(encoding, encoding.upper()))
    if separator != ",":
        notes.append(f"separated by {SEPARATORS[separator]}s")
    if decimal == ",":
        notes.append("decimal comma")
    preamble = sum(1 for line in lines[:before] if line.strip() and not _is_comment(line))
    if preamble:
        notes.append(f"{preamble} line{'s' * (preamble > 1)} before the header in line {before + 1}")
    if _is_comment(lines[before]):
        notes.append(f"header in the comment in line {before + 1}")
    if header.units_row is not None:
        notes.append(f"units in line {spans[header.units_row][0] + 1}")
    return Dialect(
        encoding=encoding,
        separator=separator,
        decimal=decimal,
        names=header.names,
        metadata=dict(_metadata(lines[:before], separator)),
        start=mark + len("".join(lines[:lines_before]).encode(encoding)),
        lines_before=lines_before,
        trailing=header.trailing,
        notes=(*notes, *header_notes),
    )


def read_rows(file: str, content: bytes) -> tuple[str, dict[int, list[str | None]], set[int]]:
    """Splits a text file into its cells.

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
    separator = _header(file, lines).separator
    reader = csv.reader(
        (line.lstrip("# \t") if _is_comment(line) else line for line in lines), delimiter=separator
    )
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
        encoding = "latin-1"
        text = _decoded(file, head[mark:], encoding, whole)
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


def _header(file: str, lines: list[str]) -> _Candidate:
    """Returns the header with the separator that gives most columns of numbers."""
    with_text = ((k, line) for k, line in enumerate(lines) if line.strip() and not _is_comment(line))
    plain = list(islice(with_text, HEAD_LINES))
    if not plain:
        raise InputError(f"{file} has no header: the first line must name the columns")
    best: _Candidate | None = None
    for separator in SEPARATORS:
        if not any(separator in line for _, line in plain):
            continue
        spans, rows = _rows(file, plain, separator)
        header = find_header(rows)
        above = plain[0][0] - 1
        if header is None and above >= 0 and _is_comment(lines[above]):
            # `numpy.savetxt` writes its header as a comment.
            spans, rows = _rows(file, [(above, lines[above].lstrip("# \t")), *plain], separator)
            header = find_header(rows)
        if header is not None and (best is None or header.numbers > best.header.numbers):
            best = _Candidate(header, separator, spans, rows[header.first :])
    if best is not None:
        return best
    separator = max(",;\t", key=lambda each: len(_rows(file, plain[:1], each)[1][0]))
    spans, rows = _rows(file, plain, separator)
    return _Candidate(first_row_as_header(rows), separator, spans, [])


def _is_comment(line: str) -> bool:
    return line.lstrip().startswith("#")


def _rows(
    file: str, plain: list[tuple[int, str]], separator: str
) -> tuple[list[tuple[int, int]], list[list[str]]]:
    """Returns, for each row, the indices of its first and last line in the file, and its cells."""
    spans, rows = [], []
    reader = csv.reader((line for _, line in plain), delimiter=separator)
    first_line = 0
    try:
        for cells in reader:
            spans.append((plain[first_line][0], plain[reader.line_num - 1][0]))
            first_line = reader.line_num
            rows.append(cells)
    except csv.Error as error:
        raise not_csv(file, error) from None
    return spans, rows


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


def find_header(rows: Sequence[Row]) -> Header | None:
    """Finds the header above the first run of rows with two or more numbers, or None without one.

    The header is a row above the run without numbers for which :func:`_may_be_header` is true. Of several
    such rows the one above a row of units is chosen, else the one with the most units in its names, then the
    lowest one.
    """
    first = next((k for k in range(len(rows)) if _starts_data(rows, k)), None)
    if first is None:
        return None
    cells = len(rows[first])
    above = first
    while above > 0 and _may_be_header(rows, above - 1, first) and not _is_data(rows[above - 1]):
        above -= 1
    candidates = [k for k in range(above, first) if not any(map(is_number, rows[k]))]
    if not candidates:
        return None
    units_row = candidates[-1] if len(candidates) > 1 and _is_units(rows[candidates[-1]]) else None
    if units_row is not None:
        row = candidates[-2]
    else:
        row = max(candidates, key=lambda k: (sum(split_name(name)[1] is not None for name in rows[k]), k))
    names = [escaped(name.strip()) for name in rows[row]]
    names += [""] * (cells - len(names))
    if units_row is not None:
        units = [escaped(_without_brackets(unit)) for unit in rows[units_row]] + [""] * len(names)
        names = [f"{name} [{unit}]" if unit else name for name, unit in zip(names, units, strict=False)]
    numbers = sum(is_number(cell) for cell in rows[first])
    found = Header(row, tuple(names), first, units_row, numbers=numbers)
    return _without_trailing(found, rows[first : first + LEAST_CONSECUTIVE_ROWS])


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
        raise InputError(f"{where}: a header with column names must come first, found {listed(names)}")
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
            "force, separated by commas, semicolons or tabs"
        )
    return replace(header, names=tuple(names)), notes


def decimal_mark(where: str, rows: Sequence[Row], separator: str) -> str:
    """Returns the decimal mark of rows of data, "." or ",".

    Raises
    ------
    InputError
        A comma may be a decimal comma or a thousands separator, or both marks occur.
    """
    cells = [cell.strip() for row in rows for cell in row]
    commas = [cell for cell in cells if parse_number(cell) is None and parse_with(cell, ",") is not None]
    if not commas:
        return "."
    points = next((cell for cell in cells if "." in cell and parse_number(cell) is not None), None)
    if points is None and not all(AMBIGUOUS_COMMA.fullmatch(cell) for cell in commas):
        return ","
    other = f"{points!r} has a decimal point" if points else "three digits follow every comma"
    raise _ambiguous_comma(f"{where} holds {commas[0]!r}, and {other}", separator)


def refuse_marks(where: str, cells: Iterable[object], decimal: str, separator: str) -> None:
    """Refuses numbers whose decimal or thousands marks differ from those in the first rows of the file.

    Raises
    ------
    InputError
        A cell has thousands separators, or a comma in a file with decimal points. The message contains a
        command that changes them.
    """
    for cell in dict.fromkeys(str(cell).strip() for cell in cells):
        if THOUSANDS_SEPARATED.fullmatch(cell):
            mark = re.findall(r"[^\d+-]", cell)[0]
            raise InputError(
                f"{where} holds {cell!r}, which has thousands separators; export the file without them, "
                f"or remove them: {_sed_command(mark, separator, '')}"
            )
        if decimal == "." and "," in cell and parse_with(cell, ",") is not None:
            raise _ambiguous_comma(f"{where} holds {cell!r}, and the first rows have no comma", separator)


def _ambiguous_comma(finding: str, separator: str) -> InputError:
    points, nothing = (_sed_command(",", separator, by) for by in (".", ""))
    return InputError(
        f"{finding}: the comma may be a decimal comma or a thousands separator. If it is a decimal comma, "
        f"write points: {points}; if it is a thousands separator, remove it: {nothing}"
    )


def _sed_command(mark: str, separator: str, by: str) -> str:
    """Returns a sed command that replaces a mark between digits; in comma-separated files only in quotes."""
    escaped = {".": "[.]", "'": "\\x27"}.get(mark, mark)
    digits = "[0-9]" if by else "[0-9]{3}"
    if mark == separator:
        script = f':a;s/("[^"{mark}]*[0-9]){escaped}({digits}[^"]*")/\\1{by}\\2/;ta'
    else:
        script = f":a;s/([0-9]){escaped}({digits})/\\1{by}\\2/;ta"
    return f"sed -E '{script}' OLD.csv > NEW.csv"


def is_number(cell: str) -> bool:
    """Returns True for a number with any decimal mark and thousands separators."""
    text = cell.strip()
    return (
        parse_number(text) is not None
        or parse_with(text, ",") is not None
        or THOUSANDS_SEPARATED.fullmatch(text) is not None
    )


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

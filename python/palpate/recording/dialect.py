# SPDX-License-Identifier: Apache-2.0
"""How a text file writes its table: encoding, separator, decimal mark, and where header and rows stand."""

from __future__ import annotations

import codecs
import csv
import io
import unicodedata
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from itertools import islice

from ..errors import InputError
from .header import Header, decimal_mark, find_header, first_row_as_header, named
from .names import visible

HEAD_BYTES = 1 << 20
"""Bytes in which the header must stand."""

HEAD_LINES = 1000
"""Lines, without comments, from which separator and decimal mark are recognised."""

SEPARATORS = {"\t": "tab", ";": "semicolon", ",": "comma"}
"""On equal evidence the first wins: a comma may be a decimal comma, a tab is only a separator."""

_MARKS = ((codecs.BOM_UTF8, "utf-8"), (codecs.BOM_UTF16_LE, "utf-16-le"), (codecs.BOM_UTF16_BE, "utf-16-be"))

RECORDING_FORMATS = "CSV, Parquet, Excel (.xlsx), NumPy (.npz), MATLAB (.mat) or MCAP"


@dataclass(frozen=True)
class Dialect:
    """How a text file is read."""

    encoding: str
    separator: str
    decimal: str
    names: tuple[str, ...]
    metadata: dict[str, str]
    start: int
    """Bytes before the first line after the header (and its units)"""
    lines_before: int
    """Lines before that line"""
    trailing: bool
    """Each row ends with a separator"""
    notes: tuple[str, ...]
    """What differs from a plain CSV file, in parts of a sentence"""

    @property
    def single_bytes(self) -> bool:
        """Line feeds, separators and quotes are single bytes, so the file can be divided between rows."""
        return not self.encoding.startswith("utf-16")


def recognise(file: str, head: bytes, whole: bool) -> Dialect:
    """Recognise the dialect of a text file.

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
        The bytes are not text, or no header is found.
    """
    mark, encoding = _encoding(head)
    text = _decoded(file, head[mark:], encoding, whole)
    if encoding == "utf-8" and text is None:
        encoding = "latin-1"
        text = _decoded(file, head[mark:], encoding, whole)
    if text is None or _is_binary(text):
        raise not_text(file)
    if text.lstrip().startswith("{") or file.endswith(".json"):
        raise _json(file, text)
    lines = list(io.StringIO(text, newline=""))
    if not whole and len(lines) > 1:
        lines.pop()  # the last line may be cut
    found = _header(file, lines)
    separator, spans = found.separator, found.spans
    before, header_line = spans[found.header.row]
    header, notes = named(f"{file}, line {header_line + 1}", found.header)
    decimal = "."
    if found.sample:
        decimal = decimal_mark(f"{file}, line {spans[header.first][0] + 1}", found.sample, separator)
    lines_before = spans[header.row if header.units_row is None else header.units_row][1] + 1
    told = []
    if encoding != "utf-8":
        told.append({"latin-1": "Latin-1"}.get(encoding, encoding.upper()))
    if separator != ",":
        told.append(f"separated by {SEPARATORS[separator]}s")
    if decimal == ",":
        told.append("decimal comma")
    preamble = sum(1 for line in lines[:before] if line.strip() and not _is_comment(line))
    if preamble:
        told.append(f"{preamble} line{'s' * (preamble > 1)} before the header in line {before + 1}")
    if _is_comment(lines[before]):
        told.append(f"header in the comment in line {before + 1}")
    if header.units_row is not None:
        told.append(f"units in line {spans[header.units_row][0] + 1}")
    return Dialect(
        encoding=encoding,
        separator=separator,
        decimal=decimal,
        names=header.names,
        metadata=dict(_metadata(lines[:before], separator)),
        start=mark + len("".join(lines[:lines_before]).encode(encoding)),
        lines_before=lines_before,
        trailing=header.trailing,
        notes=(*told, *notes),
    )


def not_csv(file: str, error: csv.Error) -> InputError:
    """The refusal of text that cannot be split into cells."""
    return InputError(f"{file} is not CSV: {error}; a quotation mark may not be closed")


def not_text(file: str) -> InputError:
    """The refusal of a file that is neither text nor of another known format."""
    return InputError(f"{file} is not text; a recording is {RECORDING_FORMATS}")


def _encoding(head: bytes) -> tuple[int, str]:
    for mark, encoding in _MARKS:
        if head.startswith(mark):
            return len(mark), encoding
    some = head[:4096]
    even, odd = some[0::2].count(0), some[1::2].count(0)
    # Latin letters, digits and separators have a zero byte beside them in UTF-16.
    if 4 * max(even, odd) > len(some) and 20 * min(even, odd) < max(even, odd):
        return 0, "utf-16-le" if odd > even else "utf-16-be"
    return 0, "utf-8"


def _decoded(file: str, head: bytes, encoding: str, whole: bool) -> str | None:
    with suppress(UnicodeDecodeError):
        return codecs.getincrementaldecoder(encoding)().decode(head, final=whole)
    return None


def _is_binary(text: str) -> bool:
    """Whether one character in ten is a control character, or one is NUL."""
    some = text[:4096]
    control = sum(unicodedata.category(each) == "Cc" and each not in "\t\n\r\f" for each in some)
    return "\x00" in some or 10 * control > len(some)


def _json(file: str, text: str) -> InputError:
    kind = "a palpate model" if '"network"' in text or '"palpate' in text else "JSON"
    return InputError(f"{file} looks like {kind}; a recording is {RECORDING_FORMATS}")


@dataclass(frozen=True)
class _Found:
    """The header with one separator."""

    header: Header
    separator: str
    spans: list[tuple[int, int]]
    """First and last line of each row, counted from 0"""
    sample: list[list[str]]
    """First rows of data; none without rows of numbers"""


def _header(file: str, lines: list[str]) -> _Found:
    """The header with the separator that gives most columns of numbers."""
    every = ((k, line) for k, line in enumerate(lines) if line.strip() and not _is_comment(line))
    plain = list(islice(every, HEAD_LINES))
    if not plain:
        raise InputError(f"{file} holds no header: the first line must name the columns")
    best: _Found | None = None
    for separator in SEPARATORS:
        if not any(separator in line for _, line in plain):
            continue
        spans, rows = _rows(file, plain, separator)
        header = find_header(rows)
        above = plain[0][0] - 1
        if header is None and above >= 0 and _is_comment(lines[above]):
            # numpy.savetxt writes its header as a comment.
            spans, rows = _rows(file, [(above, lines[above].lstrip("# \t")), *plain], separator)
            header = find_header(rows)
        if header is not None and (best is None or header.numbers > best.header.numbers):
            best = _Found(header, separator, spans, rows[header.first :])
    if best is not None:
        return best
    separator = max(",;\t", key=lambda each: len(_rows(file, plain[:1], each)[1][0]))
    spans, rows = _rows(file, plain, separator)
    return _Found(first_row_as_header(rows), separator, spans, [])


def _is_comment(line: str) -> bool:
    return line.lstrip().startswith("#")


def _rows(
    file: str, plain: list[tuple[int, str]], separator: str
) -> tuple[list[tuple[int, int]], list[list[str]]]:
    """First and last line of each row, and its cells."""
    spans, rows = [], []
    reader = csv.reader((line for _, line in plain), delimiter=separator)
    begun = 0
    try:
        for cells in reader:
            spans.append((plain[begun][0], plain[reader.line_num - 1][0]))
            begun = reader.line_num
            rows.append(cells)
    except csv.Error as error:
        raise not_csv(file, error) from None
    return spans, rows


def _metadata(lines: list[str], separator: str) -> Iterator[tuple[str, str]]:
    """Key and value of each line before the header."""
    for line in lines:
        text = line.strip()
        if not text:
            continue
        comment = text.startswith("#")
        text = text[1:] if comment else text.rstrip(";,\t ")
        key, found, value = text.partition(":")
        if not comment and not found:
            key, _, value = text.partition(separator)
        yield visible(key.strip()), visible(value.strip())

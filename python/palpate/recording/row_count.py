# SPDX-License-Identifier: Apache-2.0
"""Counts the rows of CSV and finds where rows end, without splitting them into cells."""

from __future__ import annotations

import csv
import re
from dataclasses import dataclass, field
from typing import BinaryIO

_BLOCK = 1 << 22

_BLANK = re.compile(rb"\n[ \t\r\n]")
"""The start of a line that may be blank"""

_CLOSING = re.compile(rb'(?:[^"]|"")*"(?!")')
"""The rest of a quoted cell"""

_OPENING = {separator: re.compile(rb'(?:^|%b)"' % separator) for separator in (b",", b";", b"\t")}
"""A quote opens a cell only at the start of the cell."""


@dataclass
class RowCount:
    """Rows of a stream."""

    rows: int = 0
    ends: list[int] = field(default_factory=lambda: [0])
    """Bytes from the start to ends of rows that are at least one step apart, and to the end"""
    too_wide: tuple[int, int] | None = None
    """First row with more cells than the table has columns, and the number of its cells"""


def count_rows(stream: BinaryIO, separator: str, *, columns: int = 0, step: int = _BLOCK) -> RowCount:
    """Count the rows of a stream that begins with a row, and find ends of rows.

    A line break within a quoted cell ends no row. A line of white space is no row.

    Parameters
    ----------
    stream : binary stream
    separator : str
        One character.
    columns : int
        Look for rows with more cells than this; 0 for not.
    step : int
        Least distance of the ends of rows that are returned [bytes].
    """
    mark = separator.encode()
    space = b" \r" if mark == b"\t" else b" \t\r"
    found, place, quoted, record = RowCount(), 0, False, b""
    while block := stream.read(min(step, _BLOCK)):
        block += stream.readline()
        place += len(block)
        lines = block.count(b"\n") + (not block.endswith(b"\n"))
        blank = block[0] in b"\n" + space or _BLANK.search(block)
        even = not columns or block.count(mark) == lines * (columns - 1)
        if not (quoted or blank or b'"' in block) and even:
            found.rows += lines
        else:
            for line in block.removesuffix(b"\n").split(b"\n"):
                if b'"' in line:
                    quoted = _ends_quoted(line, quoted, mark)
                # A quote that is never closed must not gather the rest of the file.
                record += line[: _BLOCK - len(record)]
                if quoted:
                    record += b"\n"
                    continue
                if record.strip(space):
                    if columns and not found.too_wide and (cells := _cells(record, mark)) > columns:
                        found.too_wide = found.rows, cells
                    found.rows += 1
                record = b""
        if not quoted and place - found.ends[-1] >= step:
            found.ends.append(place)
    if place > found.ends[-1]:
        found.ends.append(place)
    return found


def _cells(record: bytes, mark: bytes) -> int:
    if b'"' not in record:
        return record.count(mark) + 1
    return len(next(csv.reader([record.decode("latin-1")], delimiter=mark.decode())))


def _ends_quoted(line: bytes, quoted: bool, mark: bytes) -> bool:
    """Whether a line ends within a quoted cell, if it begins within one or not."""
    place = 0
    while True:
        found = (_CLOSING.match if quoted else _OPENING[mark].search)(line, place)
        if found is None:
            return quoted
        place, quoted = found.end(), not quoted

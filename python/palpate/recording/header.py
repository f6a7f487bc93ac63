# SPDX-License-Identifier: Apache-2.0
"""Finds the header, the line of units and the first row of numbers in the first rows of a table."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

from ..errors import InputError
from .names import listed, shortened, visible
from .table import MISSING, parse_number, parse_with
from .units import split_name, unit_of

Row = Sequence[str]

LEAST_NUMBERS = 2
"""Cells with numbers that make a row a row of data: a position and a force."""

LEAST_RUN = 3
"""Rows of data that must follow each other, or all that the table has."""

THOUSANDS = re.compile(
    r"[-+]?(\d{1,3}(,\d{3})+\.\d*|\d{1,3}(\.\d{3})+,\d*|\d{1,3}(,\d{3}){2,}|\d{1,3}(\.\d{3}){2,}"
    r"|\d{1,3}(['’ \u00a0\u202f]\d{3})+([.,]\d*)?)"
)
"""A number with thousands separators, whatever the decimal mark."""

MAYBE_THOUSANDS = re.compile(r"[-+]?[1-9]\d{0,2},\d{3}")
"""A number with one comma that may be a decimal comma or a thousands separator."""


@dataclass(frozen=True)
class Header:
    """Where the parts of a table stand, as indices of the rows that were given."""

    row: int
    names: tuple[str, ...]
    """Control characters are escaped; a unit from a line of units is added in brackets"""
    first: int
    """First row of data"""
    units_row: int | None = None
    trailing: bool = False
    """Each row ends with a separator; the last column has no name and is left out"""
    numbers: int = 0
    """Columns that hold numbers in the first row of data"""


def find_header(rows: Sequence[Row]) -> Header | None:
    """Find the header above the first run of rows with two or more numbers, or None without such rows.

    The header is the row above the run that has the same number of cells, none of them a number; of several
    such rows it is the one with the most units in its names, then the lowest one.
    """
    first = next((k for k in range(len(rows)) if _starts_run(rows, k)), None)
    if first is None:
        return None
    cells = len(rows[first])
    above = first
    while above > 0 and _fits(rows, above - 1, first) and not _is_data(rows[above - 1]):
        above -= 1
    candidates = [k for k in range(above, first) if not any(map(_is_number, rows[k]))]
    if not candidates:
        return None
    units_row = candidates[-1] if len(candidates) > 1 and _is_units(rows[candidates[-1]]) else None
    if units_row is not None:
        row = candidates[-2]
    else:
        row = max(candidates, key=lambda k: (sum(split_name(name)[1] is not None for name in rows[k]), k))
    names = [visible(name.strip()) for name in rows[row]]
    names += [""] * (cells - len(names))
    if units_row is not None:
        units = [visible(_bare(unit)) for unit in rows[units_row]] + [""] * len(names)
        names = [f"{name} [{unit}]" if unit else name for name, unit in zip(names, units, strict=False)]
    numbers = sum(_is_number(cell) for cell in rows[first])
    found = Header(row, tuple(names), first, units_row, numbers=numbers)
    return _without_trailing(found, rows[first : first + LEAST_RUN])


def first_row_as_header(rows: Sequence[Row]) -> Header:
    """Take the first row as the header, where no row of numbers tells."""
    return Header(0, tuple(visible(name.strip()) for name in rows[0]), 1)


def named(where: str, header: Header) -> tuple[Header, list[str]]:
    """Check the names of a header. An unnamed first column gets a name; returns notes on what was recognised.

    Raises
    ------
    InputError
        A name is a number, is missing or stands twice, or there is only one column.
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
                f"{where}: column name {shortened(name)} stands {names.count(name)} times; "
                "rename these columns in the file"
            )
    if len(names) == 1:
        raise InputError(
            f"{where}: there is one column ({shortened(names[0])}); a recording needs a position and a "
            "force, separated by commas, semicolons or tabs"
        )
    return replace(header, names=tuple(names)), notes


def decimal_mark(where: str, rows: Sequence[Row], separator: str) -> str:
    """The decimal mark of rows of data, "." or ",".

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
    if points is None and not all(MAYBE_THOUSANDS.fullmatch(cell) for cell in commas):
        return ","
    other = f"{points!r} has a decimal point" if points else "every comma stands before three digits"
    raise _either(f"{where} holds {commas[0]!r}, and {other}", separator)


def refuse_marks(where: str, cells: Iterable[object], decimal: str, separator: str) -> None:
    """Refuse cells that are numbers with other marks than the first rows have.

    Raises
    ------
    InputError
        A cell has thousands separators, or a comma in a file with decimal points. The sentence holds a
        command that changes them.
    """
    for cell in dict.fromkeys(str(cell).strip() for cell in cells):
        if THOUSANDS.fullmatch(cell):
            mark = re.findall(r"[^\d+-]", cell)[0]
            raise InputError(
                f"{where} holds {cell!r}, which has thousands separators; export the file without them, "
                f"or remove them: {_remove(mark, separator, '')}"
            )
        if decimal == "." and "," in cell and parse_with(cell, ",") is not None:
            raise _either(f"{where} holds {cell!r}, and the first rows have no comma", separator)


def _either(told: str, separator: str) -> InputError:
    points, nothing = (_remove(",", separator, by) for by in (".", ""))
    return InputError(
        f"{told}: the comma may be a decimal comma or a thousands separator. If it is a decimal comma, write "
        f"points: {points}; if it is a thousands separator, remove it: {nothing}"
    )


def _remove(mark: str, separator: str, by: str) -> str:
    """A command that replaces a mark between digits; in a comma-separated file only within quotes."""
    escaped = {".": "[.]", "'": "\\x27"}.get(mark, mark)
    digits = "[0-9]" if by else "[0-9]{3}"
    if mark == separator:
        script = f':a;s/("[^"{mark}]*[0-9]){escaped}({digits}[^"]*")/\\1{by}\\2/;ta'
    else:
        script = f":a;s/([0-9]){escaped}({digits})/\\1{by}\\2/;ta"
    return f"sed -E '{script}' OLD.csv > NEW.csv"


def _is_number(cell: str) -> bool:
    text = cell.strip()
    return (
        parse_number(text) is not None
        or parse_with(text, ",") is not None
        or THOUSANDS.fullmatch(text) is not None
    )


def _is_data(row: Row) -> bool:
    numbers = sum(_is_number(cell) or cell.strip() in MISSING[1:] for cell in row)
    return numbers >= LEAST_NUMBERS


def _starts_run(rows: Sequence[Row], k: int) -> bool:
    run = rows[k : k + LEAST_RUN]
    return all(len(row) == len(run[0]) and _is_data(row) for row in run)


def _fits(rows: Sequence[Row], k: int, first: int) -> bool:
    """Whether row k can be the header of row `first`: it has as many cells.

    Directly above it may have one less, if each row ends with a separator, or more, if cells are missing.
    """
    have, need = len(rows[k]), len(rows[first])
    if have == need:
        return True
    if k + 1 != first:
        return False
    ends_empty = all(row[-1].strip() == "" for row in rows[first : first + LEAST_RUN])
    return have > need or (have == need - 1 and have >= LEAST_NUMBERS and ends_empty)


def _bare(unit: str) -> str:
    text = unit.strip()
    return text[1:-1].strip() if text[:1] + text[-1:] in ("[]", "()") else text


def _is_units(row: Row) -> bool:
    stated = [_bare(cell) for cell in row if _bare(cell) not in ("", "-")]
    known = sum(unit_of(text) is not None for text in stated)
    return known > 0 and 2 * known >= len(stated) and not any(map(_is_number, stated))


def _without_trailing(header: Header, data: Sequence[Row]) -> Header:
    empty = all(row[-1].strip() == "" for row in data if len(row) == len(header.names))
    if len(header.names) > LEAST_NUMBERS and header.names[-1] == "" and empty:
        return replace(header, names=header.names[:-1], trailing=True)
    return header

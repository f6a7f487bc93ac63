# SPDX-License-Identifier: Apache-2.0
"""Tables in the cells of a sheet or a text: below one another, side by side, and between other cells.

A table is a header above rows with two numbers or more. It ends at the header of the next table. Tables are
side by side if the names in a header repeat. The rows of a table between two empty rows are a block.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import chain
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError, escaped, shortened
from .conversion import MIN_ROWS
from .dialect import (
    LEAST_CONSECUTIVE_ROWS,
    LEAST_NUMBERS,
    NOT_STATED,
    Header,
    Stated,
    decimal_mark,
    find_header,
    first_row_as_header,
    is_number,
    marks_of,
    with_checked_names,
)
from .looks import LOOK_ROWS, cure_of_header
from .memory_table import MemoryTable, cells_of
from .table import MISSING, Cells
from .units import split_name

Cell: TypeAlias = Any
"""None if it is empty, else a number, a text, or text and seconds of a date or a time"""

Row: TypeAlias = Sequence[Cell]

EMPTY, TEXT, READING = 0, 1, 2
"""Kinds of cells; a reading is a number, a time or a word that means a missing number."""

_KINDS = {type(None): EMPTY, str: TEXT, bool: TEXT, int: READING, float: READING, tuple: READING}
"""Kind of a cell by its type; text can also be a reading."""

_HEAD_ROWS = 200
"""Largest number of rows above a table in which its header is searched, and of its first rows from which the
decimal mark of numbers stored as text is recognised."""


@dataclass(frozen=True, eq=False)
class Grid:
    """Cells of a sheet or a text file."""

    name: str
    """Name of the sheet; empty for a text file"""
    cells: Mapping[int, Row]
    """Cells of each row that is not empty, by row number, without empty cells at the end"""
    visible: bool = True
    separator: str = ""
    """Separator of the cells of a text file; empty for a sheet"""
    behind_empty: frozenset[int] = frozenset()
    """Numbers of the rows of a text file that follow an empty row"""
    stated: Stated = NOT_STATED

    @property
    def word(self) -> str:
        """Word for a row in messages."""
        return "line" if self.separator else "row"

    @cached_property
    def rows(self) -> list[Row]:
        """Cells of each row."""
        return list(self.cells.values())

    @cached_property
    def numbers(self) -> NDArray[np.int64]:
        """Number of each row (n,)."""
        return np.array(list(self.cells), dtype=np.int64)

    @cached_property
    def kinds(self) -> NDArray[np.int8]:
        """Kind of each cell (n, columns): EMPTY, TEXT or READING."""
        lengths = np.array([len(row) for row in self.rows], dtype=np.intp)
        cells = list(chain.from_iterable(self.rows))
        found = np.fromiter(map(_KINDS.__getitem__, map(type, cells)), dtype=np.int8, count=len(cells))
        for k in np.flatnonzero(found == TEXT).tolist():
            found[k] = _kind(cells[k])
        kinds = np.zeros((len(lengths), lengths.max(initial=0)), dtype=np.int8)
        kinds[np.arange(kinds.shape[1]) < lengths[:, np.newaxis]] = found
        return kinds

    @cached_property
    def follows(self) -> NDArray[np.bool_]:
        """True for each row (n,) that is directly below the row before it."""
        if self.separator:
            return ~np.isin(self.numbers, list(self.behind_empty))
        return np.asarray(np.diff(self.numbers, prepend=0) == 1)


@dataclass(frozen=True, eq=False)
class Block:
    """Table in a grid, or its rows between two empty rows."""

    grid: Grid
    header: Header
    """Header whose names are those of the columns of this table"""
    header_row: int
    """Index of the header among the rows of the grid"""
    columns: tuple[int, ...]
    """Places of the columns in a row"""
    span: tuple[int, int]
    """Places in a row that belong to no other table"""
    above: tuple[Row, ...]
    """Rows between the table before and the header; the row next to the header is the first"""
    rows: NDArray[np.intp]
    """Index of each row (n,) among the rows of the grid"""
    unused: tuple[str, ...] = ()
    """Sentences on cells below and next to the table, which are not used"""
    too_wide: int | None = None
    """Index of the first row of a text file with a cell next to the table"""
    title: str = ""
    """Text above the header that distinguishes the table from others with the same columns"""

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the columns."""
        return self.header.names

    @property
    def series(self) -> tuple[str, tuple[str, ...], tuple[int, ...], str]:
        """Key that is the same for blocks without separate names: strokes of one recording."""
        return self.grid.name, self.names, self.columns, self.title

    @property
    def columns_without_header(self) -> list[list[Cell]]:
        """First cells of the columns of numbers, if the first row of the block holds numbers, not names."""
        if not any(map(is_number, self.names)):
            return []
        rows = [self.header_row, *self.rows[:LOOK_ROWS].tolist()]
        full = sorted(_full_columns(self.grid.kinds[rows]))
        return [
            [row[k] if k < len(row) else None for row in map(self.grid.rows.__getitem__, rows)] for k in full
        ]

    def text_above(self, rows: int) -> str:
        """Returns the text in a row above the header, counted from the header."""
        return _line(self.above[rows][slice(*self.span)])

    @property
    def rows_above(self) -> list[str]:
        """Place and text of the rows between the table before and the header."""
        first = self.header_row - len(self.above)
        return [
            f"{self.place(first + k)}, {shortened(_line(row))}" for k, row in enumerate(reversed(self.above))
        ]

    def place(self, row: int) -> str:
        """Returns the place of a row of the grid in the file: "row 12"."""
        return f"{self.grid.word} {self.grid.numbers[row]}"


def joined_table(path: Path, name: str, blocks: Sequence[Block], most_rows: int | None = None) -> MemoryTable:
    """Returns blocks with the same columns as one table, or only its first rows.

    Parameters
    ----------
    path : Path
        The file.
    name : str
        File and part, for messages.
    blocks : sequence of Block
    most_rows : int, optional
        Largest number of rows of each block.

    Raises
    ------
    InputError
        A column has no usable name, or numbers have no clear decimal mark or unit.
    """
    first, word = blocks[0], blocks[0].grid.word
    where = f"{name}, {first.place(first.header_row)}"
    if not first.header.stated and (columns_found := first.columns_without_header):
        if stated := first.grid.stated.columns:
            raise InputError(f"{name} has {len(columns_found)} columns, but --columns names {len(stated)}")
        raise InputError(f"{name} has no header. {cure_of_header(list(zip(*columns_found, strict=True)))}")
    if "" in first.names[1:]:
        place = first.columns[first.names.index("", 1)]
        raise InputError(f"{where}: column {place + 1} has no name; name it in the file")
    for block in blocks:
        if block.too_wide is not None:
            cells_found = len(block.grid.rows[block.too_wide])
            raise InputError(
                f"{name}, {block.place(block.too_wide)}: {cells_found} cells, but the header names "
                f" {len(block.names)} columns"
            )
    header, notes = with_checked_names(where, first.header)
    values: list[list[Cell]] = [[] for _ in header.names]
    places: list[int | str] = []
    several_grids = len({block.grid.name for block in blocks}) > 1
    for block in blocks:
        rows = block.rows[:most_rows].tolist()
        cells = [block.grid.rows[row] for row in rows]
        for column, place in zip(values, block.columns, strict=True):
            column += [row[place] if place < len(row) else None for row in cells]
        numbers = block.grid.numbers[rows].tolist()
        places += [f"{number} of {block.grid.name}" for number in numbers] if several_grids else numbers
    marks = marks_of(first.grid.stated.decimal)
    if places and first.grid.stated.decimal is None:
        heads = zip(*(column[:_HEAD_ROWS] for column in values), strict=True)
        texts = [[cell for cell in row if isinstance(cell, str)] for row in heads]
        marks = decimal_mark(f"{name}, {word} {places[0]}", texts)
    columns = {}
    for column_name, column in zip(header.names, values, strict=True):
        if tuple in map(type, column):
            column_name, column = _in_seconds(where, column_name, column)
            notes = [*notes, "times to a millisecond"]
        columns[column_name] = _cells(column, marks)
    if not all(block.grid.follows[block.rows[1:]].all() for block in blocks):
        notes = [*notes, "empty rows are left out"]
    if header.units_row is not None:
        notes = ["units in a second header row", *notes]
    if header.stated:
        notes = ["the column names are stated", *notes]
    if before := len(first.above):
        below = "data" if header.stated else "header"
        notes = [f"{before} {word}{'s' * (before > 1)} before the {below}", *notes]
    table = MemoryTable(path, columns, _metadata(first), notes, (word, places), marks)
    table.starts = np.cumsum([len(block.rows[:most_rows]) for block in blocks])[:-1].tolist()
    return table


def tables_of(grid: Grid) -> list[Block]:
    """Returns the tables in a grid, divided at empty rows, in their order."""
    tables = [each for band in _bands(grid) for each in _side_by_side(grid, band)]
    for names in dict.fromkeys(each.names for each in tables):
        same = [k for k, each in enumerate(tables) if each.names == names]
        for rows in range(min(len(tables[k].above) for k in same) if len(same) > 1 else 0):
            titles = [tables[k].text_above(rows) for k in same]
            if all(titles) and len(set(titles)) == len(titles):
                for k, title in zip(same, titles, strict=True):
                    tables[k] = replace(tables[k], title=escaped(title))
                break
    return [block for table in tables for block in _blocks(table)]


def whole_grid(grid: Grid) -> Block:
    """Returns the rows of a grid without a table; its first row of numbers, if it has one, is the header."""
    row = next((start for start, stop in _data_runs(grid) if stop - start >= LEAST_CONSECUTIVE_ROWS), 0)
    names = _texts(grid.rows[row])
    header = first_row_as_header([names + [""] * (grid.kinds.shape[1] - len(names))])
    columns = tuple(range(len(header.names)))
    above, rows = tuple(reversed(grid.rows[:row])), np.arange(row + 1, len(grid.rows))
    return Block(grid, header, row, columns, (0, len(columns)), above, rows)


def _data_runs(grid: Grid) -> list[tuple[int, int]]:
    """Returns the first row of each run of rows of data, and the row behind its last one."""
    is_data = np.count_nonzero(grid.kinds == READING, axis=1) >= LEAST_NUMBERS
    edges = np.flatnonzero(np.diff(is_data, prepend=False, append=False)).tolist()
    return list(zip(edges[::2], edges[1::2], strict=True))


@dataclass(frozen=True)
class _Band:
    """A header and the rows below it, over the whole width of a grid, by their indices."""

    header: Header
    above: int
    """First row that belongs to no table before it"""
    row: int
    """Row of the header"""
    first: int
    """First row of data"""
    stop: int
    """Row after the last one that can belong to the table"""


def _bands(grid: Grid) -> list[_Band]:
    """Returns the headers of a grid with their rows, from the top to the bottom."""
    if grid.stated.columns:
        return _stated_bands(grid)
    bands: list[_Band] = []
    after_data = 0
    for start, stop in _data_runs(grid):
        head = max(after_data, start - _HEAD_ROWS)
        header, row = _header_of(grid, head, start, stop), start
        if header is not None:
            row = head + header.row
        elif bands and min(stop - start, after_data - bands[-1].first) >= MIN_ROWS:
            header = bands[-1].header if _is_title(grid.kinds[after_data:start]) else None
        if header is not None:
            same = bool(bands) and row < start and header.names == bands[-1].header.names
            if not bands or same or not grid.follows[after_data : row + 1].all():
                above = after_data
                while bands and above < row and grid.follows[above] and _begins_with_reading(grid, above):
                    above += 1
                if bands:
                    bands[-1] = replace(bands[-1], stop=above)
                bands.append(_Band(header, above if bands else 0, row, start, len(grid.rows)))
        after_data = stop
    return bands


def _stated_bands(grid: Grid) -> list[_Band]:
    """Returns the first rows with as many full columns as the caller names, and all rows below, as one
    band."""
    for start, stop in _data_runs(grid):
        full = _full_columns(grid.kinds[start:stop])
        if stop - start >= LEAST_CONSECUTIVE_ROWS and len(full) == len(grid.stated.columns):
            names = dict(zip(sorted(full), grid.stated.columns, strict=True))
            all_names = tuple(names.get(k, "") for k in range(grid.kinds.shape[1]))
            return [_Band(Header(start, all_names, start, stated=True), 0, start, start, len(grid.rows))]
    return []


def _is_title(kinds: NDArray[np.int8]) -> bool:
    """Returns True for rows with one text each."""
    return bool(len(kinds)) and bool((kinds.sum(axis=1) == TEXT).all())


def _begins_with_reading(grid: Grid, row: int) -> bool:
    kinds = grid.kinds[row]
    return bool(kinds[np.flatnonzero(kinds)[0]] == READING)


def _header_of(grid: Grid, above: int, start: int, stop: int) -> Header | None:
    """Returns the header in the rows above rows of data, or None.

    A number above a column that is mostly empty is not part of it.
    """
    if stop - start < LEAST_CONSECUTIVE_ROWS:
        return None
    full = _full_columns(grid.kinds[start:stop])
    texts = [
        ["" if k not in full and _kind(cell) == READING else _text(cell) for k, cell in enumerate(row)]
        for row in grid.rows[above:start]
    ]
    data = grid.rows[start : start + LEAST_CONSECUTIVE_ROWS]
    numbers = [["0" if isinstance(cell, tuple) else _text(cell) for cell in row] for row in data]
    rows = _padded([*texts, *numbers])
    header = find_header(rows)
    if header is None or sum(map(bool, header.names)) < LEAST_NUMBERS:
        return None
    below = slice(above + header.row + 1, start + 1)
    if not all(header.names[k] for k in full - {0}) and not grid.follows[below].all():
        return None  # text in fewer cells, above an empty row
    width = grid.kinds.shape[1]
    return replace(header, names=header.names + ("",) * (width - len(header.names)), trailing=False)


def _side_by_side(grid: Grid, band: _Band) -> list[Block]:
    """Returns the tables below one header: several if its names repeat."""
    names, kinds = band.header.names, grid.kinds[band.first : band.stop]
    full, filled = _full_columns(kinds), np.count_nonzero(kinds, axis=0)
    last = max(full, default=0)
    columns = [k for k, name in enumerate(names) if (filled[k] or k < last if name else k in full)]
    groups = _repeated(names, columns)
    shared = groups[0][: len(groups[0]) - len(groups[-1])]
    begins = [0, *(group[0] for group in groups[1:]), len(names)]
    above = tuple(reversed(grid.rows[band.above : band.row]))
    found = []
    for number, group in enumerate(groups):
        own = group[len(shared) :] if number == 0 else group
        held = band.first + np.flatnonzero(kinds[:, own].any(axis=1))
        used = _used(grid, held, own)
        places = (*shared, *own)
        header = replace(band.header, names=tuple(names[k] for k in places))
        span = begins[number], begins[number + 1]
        block = Block(grid, header, band.row, places, span, above, used)
        found.append(replace(block, unused=_below(block, held[len(used) :])))
    last_row = max((int(each.rows[-1]) for each in found if len(each.rows)), default=0)
    outside = grid.kinds[: last_row + 1].copy()
    outside[:, np.array(columns)] = EMPTY
    outside[: band.row] = outside[band.row + 1 : band.first] = EMPTY
    rows, places_outside = np.nonzero(outside)
    if len(rows):
        cells = f"{len(rows)} cell{'s' * (len(rows) > 1)} next to the table"
        text = shortened(_text(grid.rows[rows[0]][places_outside[0]]))
        note = f"not used: {cells} (first: {found[0].place(rows[0])}, {text})"
        data = rows[rows > band.row]
        too_wide = int(data[0]) if grid.separator and len(data) else None
        found = [replace(each, unused=(*each.unused, note), too_wide=too_wide) for each in found]
    return [each for each in found if len(each.rows)]


def _below(block: Block, rows: NDArray[np.intp]) -> tuple[str, ...]:
    """Returns a sentence on the rows below a table, which are not used; none without such rows."""
    if not len(rows):
        return ()
    text = shortened(_line(block.grid.rows[rows[0]]))
    where = block.place(rows[0])
    if len(rows) > 1:
        where = f"{block.grid.word}s {block.grid.numbers[rows[0]]} to {block.grid.numbers[rows[-1]]}"
    return (f"not used: {where} below the table ({text})",)


def _repeated(names: Sequence[str], columns: Sequence[int]) -> list[list[int]]:
    """Divides columns where their names begin to repeat; names before the repeated ones are shared."""
    groups: list[list[int]] = [[]]
    used: set[str] = set()
    for k in columns:
        if names[k] in used:
            groups.append([])
            used.clear()
        groups[-1].append(k)
        used.add(names[k])
    named = [[names[k] for k in group] for group in groups]
    last = named[-1]
    whole = len(last) >= LEAST_NUMBERS and "" not in last
    if whole and all(each == last for each in named[1:]) and named[0][-len(last) :] == last:
        return groups
    return [list(columns)]


def _used(grid: Grid, held: NDArray[np.intp], columns: Sequence[int]) -> NDArray[np.intp]:
    """Returns the rows of a table without notes and calculations below it.

    These follow the last row of numbers. A row whose first cell is text in a column of numbers is a note; an
    incomplete row directly below the table is not.
    """
    if not len(held):
        return held
    kinds = grid.kinds[held][:, columns]
    first = np.argmax(kinds != EMPTY, axis=1)
    is_note = (kinds[0, first] == READING) & (kinds[np.arange(len(held)), first] == TEXT)
    readings = np.where(is_note, 0, np.count_nonzero(kinds == READING, axis=1))
    stop = int(np.flatnonzero(readings >= LEAST_NUMBERS).max(initial=-1)) + 1
    directly_below = grid.follows[held] & (np.diff(held, prepend=-1) == 1)
    while stop < len(held) and directly_below[stop] and readings[stop]:
        stop += 1
    return held[:stop]


def _blocks(table: Block) -> list[Block]:
    """Divides a table at empty rows, if every block can be a recording."""
    blocks = np.split(table.rows, np.flatnonzero(~table.grid.follows[table.rows[1:]]) + 1)
    if len(blocks) < 2 or min(map(len, blocks)) < MIN_ROWS:
        return [table]
    return [replace(table, rows=rows) for rows in blocks]


def _full_columns(kinds: NDArray[np.int8]) -> set[int]:
    """Returns the columns that are filled in most rows."""
    return set(np.flatnonzero(2 * np.count_nonzero(kinds, axis=0) > len(kinds)).tolist())


def _metadata(block: Block) -> dict[str, str]:
    """Returns key and value of each row above the header."""
    metadata = {}
    for row in reversed(block.above):
        texts = _texts(row[slice(*block.span)])
        if any(texts):
            key, _, value = texts[0].partition(":")
            metadata[escaped(key.strip())] = escaped(" ".join(" ".join([value, *texts[1:]]).split()))
    return metadata


def _kind(cell: Cell) -> int:
    if isinstance(cell, str) and (is_number(cell) or cell.strip() in MISSING[1:]):
        return READING
    return _KINDS[type(cell)]


def _text(cell: Cell) -> str:
    if isinstance(cell, float) and cell.is_integer():
        return str(int(cell))
    return "" if cell is None else str(cell[0] if isinstance(cell, tuple) else cell)


def _texts(row: Row) -> list[str]:
    return [_text(cell) for cell in row]


def _line(row: Row) -> str:
    return " ".join(_text(cell) for cell in row if cell is not None)


def _padded(texts: Sequence[list[str]]) -> list[list[str]]:
    width = max(map(len, texts), default=0)
    return [row + [""] * (width - len(row)) for row in texts]


def _cells(values: Sequence[Cell], marks: str) -> Cells:
    """Returns the cells of a column as numbers, or as text if one cell is text."""
    if {*map(type, values)} <= {type(None), int, float}:
        return np.array(values, dtype=np.float64)
    texts = [_text(cell).replace(".", marks[0]) if type(cell) is float else _text(cell) for cell in values]
    return cells_of(texts, marks)


def _in_seconds(where: str, name: str, values: Sequence[Cell]) -> tuple[str, list[Cell]]:
    """Returns name and cells of a column of dates or times in seconds.

    Raises
    ------
    InputError
        The name of the column states another unit.
    """
    first = next(cell[0] for cell in values if isinstance(cell, tuple))
    unit = split_name(name)[1]
    if unit is not None and unit.symbol != "s":
        raise InputError(
            f"{where}: column {shortened(name)} holds times such as {first}, but its name states "
            f"{unit.symbol}; format its cells as numbers, or state s"
        )
    seconds = [cell[1] if isinstance(cell, tuple) else cell for cell in values]
    return (name if unit else f"{name} [s]"), seconds

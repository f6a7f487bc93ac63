# SPDX-License-Identifier: Apache-2.0
"""Choice of the part of a file that is read: a sheet, one of several specimens, or blocks of rows.

A file with several recordings says so by names: those of its sheets, or a title above each header. Blocks
without separate names are strokes of one recording. A recording is a table in which position and force
can be chosen. If there are several kinds of such tables, the longest one is a recording, and so are all
others of its kind.
"""

from __future__ import annotations

import hashlib
import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, TypeAlias

from ..arguments import shown
from ..errors import InputError, command_word, did_you_mean, escaped, listed, shortened
from .conversion import MIN_ROWS, Conversion, converted
from .dialect import HEAD_BYTES, Stated, read_rows
from .files import require_memory
from .grid import Block, Grid, joined_table, tables_of, whole_grid
from .looks import LOOK_ROWS
from .workbook import read_sheets

PartNames: TypeAlias = str | int | Sequence[str | int]
"""Name or number of a part of a file, or several"""

_TEXT_CELL_BYTES = 100
"""Memory of a cell of a text file that is split into cells [bytes]."""

_OTHER_ROW = re.compile(rb"\n[ \t;,\"]*(?:\r?\n|[^-+.,;\"\d\s])")
"""Row of a text file that is empty or begins with a word, so that it can be between two tables."""

_COLUMN_OPTIONS = ("position", "force", "time", "direction", "inputs", "units", "negate", "drop")
"""Arguments of `read_recording` with which columns are chosen."""


@dataclass(frozen=True, eq=False)
class Part:
    """Part of a file."""

    block: Block
    name: str
    group: str
    """Name of its sheet and its table; that of several parts if empty rows divide the table"""

    @property
    def rows(self) -> int:
        """Number of its rows."""
        return len(self.block.rows)

    def has(self, name: str) -> bool:
        """Returns True if the part has this name, or is in the sheet or table with this name."""
        return name in (self.name, self.group, escaped(self.block.grid.name), self.block.title)

    def __str__(self) -> str:
        kind = "" if self.group else "part "
        return f"{kind}{shortened(self.name)} ({self.rows} row{'s' * (self.rows != 1)})"


class SeveralPartsError(InputError):
    """A file has several recordings, and none was chosen."""

    def __init__(self, message: str, parts: Sequence[Part]) -> None:
        super().__init__(message)
        self.parts = parts


def parts_of_text(path: Path, stated: Stated) -> list[Part]:
    """Returns the tables in a text file.

    Raises
    ------
    InputError
        The file is not text, or too large.
    """
    return _parts_of(path, path.read_bytes(), stated)


def several_parts_of_text(path: Path, stated: Stated) -> list[Part]:
    """Returns the tables in a text file; none if it is long and clearly has one table only.

    Raises
    ------
    InputError
        The file is not text, or too large.
    """
    content = path.read_bytes()
    if len(content) > HEAD_BYTES:
        head = content[: content.rfind(b"\n", 0, HEAD_BYTES) + 1]
        if len(_parts_of(path, head, stated)) < 2 and not _OTHER_ROW.search(content, max(len(head) - 1, 0)):
            return []
    return _parts_of(path, content, stated)


def _parts_of(path: Path, content: bytes, stated: Stated) -> list[Part]:
    require_memory(path, _TEXT_CELL_BYTES * sum(map(content.count, b"\n,;\t ")))
    separator, rows, behind_empty = read_rows(str(path), content, stated.columns)
    require_memory(path, len(rows) * max(map(len, rows.values()), default=0))
    grid = Grid("", rows, separator=separator, behind_empty=frozenset(behind_empty), stated=stated)
    return _named([grid])


def parts_of_workbook(path: Path, stated: Stated) -> list[Part]:
    """Returns the tables in the sheets of a workbook; a sheet without a table is one part.

    Raises
    ------
    InputError
        The file is not a workbook, needs too much memory, or has no cells.
    """
    sheets = read_sheets(path)
    if not sheets:
        raise InputError(f"{path} has no sheet with cells")
    return _named([replace(each, stated=stated) for each in sheets])


def _named(grids: Sequence[Grid]) -> list[Part]:
    blocks = [block for grid in grids for block in tables_of(grid) or [whole_grid(grid)]]
    sheets = [escaped(block.grid.name) if len(grids) > 1 else "" for block in blocks]
    groups = [
        ": ".join(filter(None, (sheet, block.title))) for sheet, block in zip(sheets, blocks, strict=True)
    ]
    counts, reached, parts = Counter(groups), Counter[str](), []
    for block, group in zip(blocks, groups, strict=True):
        reached[group] += 1
        name = group if counts[group] == 1 and group else f"{group} {reached[group]}".strip()
        parts.append(Part(block, name, group))
    return parts


def read_part(
    path: Path, parts: Sequence[Part], wanted: PartNames | None, options: dict[str, Any]
) -> dict[str, Any]:
    """Returns the fields of the recording in a file with several tables.

    Parameters
    ----------
    path : Path
    parts : sequence of Part
    wanted : str, int or sequence, optional
        Names or numbers of parts; several are joined.
    options : dict
        The other arguments of `converted`.

    Raises
    ------
    SeveralPartsError
        There are several recordings, and none was chosen.
    InputError
        There is no such part, or no recording in it.
    """
    chosen = _chosen(path, parts, wanted, options)
    name = _name_of(path, parts, chosen)
    table = joined_table(path, name, [each.block for each in chosen])
    table.notes = (*_place_notes(parts, chosen), *table.notes)
    try:
        fields = converted(table, name, file=path, **options)
    except InputError as error:
        same_names = {each.block.series for each in parts if each.block.names == chosen[0].block.names}
        if wanted is None and len(same_names) > 1 and "add: " in str(error):
            raise InputError(f"{error} {_options(parts, chosen)}") from None
        raise
    if len(_series(parts)) > 1:
        source, names = fields["source"], _names(parts, chosen)
        fields["source"] = replace(
            source,
            files=tuple(f"{path}, part {each}" for each in names),
            sha256=" ".join(hashlib.sha256(f"{source.sha256} {each}".encode()).hexdigest() for each in names),
        )
    fields["notes"] = (*fields["notes"], *_notes(parts, chosen, wanted))
    return fields


def _series(parts: Sequence[Part]) -> list[list[Part]]:
    """Returns the parts that are blocks of one table together."""
    found: dict[Any, list[Part]] = {}
    for part in parts:
        found.setdefault(part.block.series, []).append(part)
    return list(found.values())


def _chosen(
    path: Path, parts: Sequence[Part], wanted: PartNames | None, options: dict[str, Any]
) -> list[Part]:
    candidates = list(parts)
    if wanted is not None:
        names = [wanted] if isinstance(wanted, (str, int)) else list(wanted)
        if not names:
            raise InputError("part is empty; give the name or the number of a part")
        candidates = list(dict.fromkeys(part for each in names for part in _selected(path, parts, each)))
        if len(names) > 1:
            other = next((each for each in candidates if each.block.names != candidates[0].block.names), None)
            if other is not None:
                raise InputError(
                    f"{path}: parts {candidates[0]} and {other} have different columns, and only strokes of "
                    "one object can be joined; choose one of them"
                )
            return candidates
    series = _series(candidates)
    kinds = [_kind(path, each, options) for each in series]
    recordings = [k for k, kind in enumerate(kinds) if kind is not None]
    recordings = [k for k in recordings if series[k][0].block.grid.visible] or recordings
    longest = max(recordings or range(len(series)), key=lambda k: _rows(series[k]))
    same = [series[k] for k in recordings if kinds[k] == kinds[longest]]
    if len(same) > 1:
        listed_parts = listed(f"{_label(parts, each)} ({_rows(each)} rows)" for each in same)
        raise SeveralPartsError(
            f"{path} holds {len(same)} recordings: {listed_parts}. "
            f"For example, add: {_options(parts, same[0])}",
            parts,
        )
    return series[longest]


def _selected(path: Path, parts: Sequence[Part], wanted: object) -> list[Part]:
    """Returns the parts with a name, else the part with a number."""
    if isinstance(wanted, bool) or not isinstance(wanted, (str, int)):
        raise InputError(f"part is {shown(wanted)}; it must be the name or the number of a part, or a list")
    text = str(wanted)
    found = [part for part in parts if text and part.has(text)]
    if not found and text.isdecimal() and 1 <= int(text) <= len(parts):
        found = [parts[int(text) - 1]]
    if not found:
        hint = did_you_mean(text, [each.name for each in parts])
        raise InputError(
            f"{path}: there is no part {shortened(text)!r}{hint}; its parts are {listed(map(str, parts))}"
        )
    return found


def _kind(path: Path, blocks: Sequence[Part], options: dict[str, Any]) -> tuple[Any, ...] | None:
    """Returns names and SI units of position and force of a recording; None for another table."""
    if _rows(blocks) < MIN_ROWS:
        return None
    try:
        table = joined_table(path, str(path), [each.block for each in blocks], LOOK_ROWS)
        choice = Conversion.of(table, str(path), **{each: options[each] for each in _COLUMN_OPTIONS}).choice
    except InputError:
        return None
    return tuple((each.stem, each.unit and each.unit.si) for each in (choice.position, choice.force))


def _rows(parts: Sequence[Part]) -> int:
    return sum(each.rows for each in parts)


def _names(parts: Sequence[Part], chosen: Sequence[Part]) -> list[str]:
    """Returns the names of parts: that of a table if all its blocks are chosen and nothing else has it."""
    whole = {
        group
        for group in {each.group for each in chosen} - {""}
        if len(_series([each for each in parts if each.group == group])) == 1
        and all(each in chosen for each in parts if each.group == group)
    }
    return list(dict.fromkeys(each.group if each.group in whole else each.name for each in chosen))


def _label(parts: Sequence[Part], chosen: Sequence[Part]) -> str:
    return listed(_names(parts, chosen))


def _options(parts: Sequence[Part], chosen: Sequence[Part]) -> str:
    """Returns the options that choose parts."""
    return " ".join(f"--part {command_word(each)}" for each in _names(parts, chosen))


def _name_of(path: Path, parts: Sequence[Part], chosen: Sequence[Part]) -> str:
    return str(path) if len(_series(parts)) == 1 else f"{path}, part {_label(parts, chosen)}"


def _place_notes(parts: Sequence[Part], chosen: Sequence[Part]) -> list[str]:
    """Returns the place of the chosen parts, as parts of one sentence on how the file was read."""
    grid = chosen[0].block.grid
    hidden = "" if grid.visible else "hidden "
    if len({each.group for each in chosen}) > 1 or (grid.separator and len(_series(parts)) > 1):
        return [f"part {_label(parts, chosen)}"]
    notes = []
    if hidden or len({each.block.grid.name for each in parts}) > 1:
        notes.append(f"{hidden}sheet {shortened(grid.name)}")
    if chosen[0].block.title or (not notes and len(_series(parts)) > 1):
        notes.append(f"part {shortened(chosen[0].block.title or chosen[0].name)}")
    return notes


def _notes(parts: Sequence[Part], chosen: Sequence[Part], wanted: PartNames | None) -> list[str]:
    """Returns sentences on joined blocks and on what was not used, except parts that were not wanted."""
    notes = [] if len(chosen) == 1 else [f"{len(chosen)} blocks are read as strokes of one recording"]
    between = [each for part in chosen[1:] for each in part.block.rows_above]
    if between:
        count = f"{len(between)} row{'s' * (len(between) > 1)}"
        notes.append(f"not used: {count} between the blocks (first: {between[0]})")
    notes += dict.fromkeys(each for part in chosen for each in part.block.unused)
    others = [str(each) for each in parts if each not in chosen]
    if others and wanted is None:
        notes.append(f"not used: {listed(others)}; --part NAME reads another part")
    elif len(chosen) > 1 and not others:
        notes[0] += f"; --part {command_word(chosen[0].name)} reads one of them"
    return notes

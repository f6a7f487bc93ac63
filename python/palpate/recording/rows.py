# SPDX-License-Identifier: Apache-2.0
"""Checks of every row of the chosen columns. A row that cannot be used refuses the file, or is dropped."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sized
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._core.status import Status
from .._typing import Float1D, Int8Vector
from ..errors import InputError, shortened
from ..frames import pd
from .motion import strokes_from_order
from .table import Cells, Places

WAYS = {**dict.fromkeys(("down", "ab", "descente"), 1), **dict.fromkeys(("up", "auf", "montée"), -1)}
"""Direction by the words for a way of the tool. Down is into the object, unless the position rises in the
rows of the words for up."""

DIRECTION_WORDS: dict[str, int] = {
    **dict.fromkeys(("press", "approach", "load", "loading", "forward", "+1"), 1),
    **dict.fromkeys(("release", "retract", "unload", "unloading", "back", "-1"), -1),
    **dict.fromkeys(("pause", "hold", "extra", "0"), 0),
}
"""Direction of the stroke by the word in a file, in lower case: into the object (+1), out of it (-1), neither
(0)."""

_MORE_WORDS = WAYS | {
    **dict.fromkeys(("in", "druck", "belastung", "charge"), 1),
    **dict.fromkeys(("out", "entlastung", "décharge"), -1),
}
"""More words that are read, but that a message does not list"""


@dataclass
class LeftOut:
    """Number of rows of a file that are not used, by reason."""

    status: Counter[str] = field(default_factory=Counter)
    """Number of rows whose force was not the model's force, by the word in the status column"""
    dropped: dict[str, tuple[int, int]] = field(default_factory=dict)
    """Number of dropped rows and index of the first dropped row, by reason"""

    @property
    def rows(self) -> int:
        """Number of rows of the file that are not used, for all reasons together."""
        return self.status.total() + sum(count for count, _ in self.dropped.values())

    def drop(self, reason: str, count: int, first: int) -> None:
        """Counts dropped rows."""
        earlier_count, earlier_first = self.dropped.get(reason, (0, first))
        self.dropped[reason] = earlier_count + count, min(earlier_first, first)

    def add(self, other: LeftOut, rows_before: int) -> None:
        """Adds the numbers of unused rows in one part of a file; the part begins after `rows_before` rows."""
        self.status += other.status
        for reason, (count, first) in other.dropped.items():
            self.drop(reason, count, rows_before + first)

    def sentences(self, table: Places) -> list[str]:
        """Returns one sentence for each reason for unused rows, with the place of the first such row."""
        sentences = []
        if count := self.status.total():
            words = ", ".join(f"{number} {word}" for word, number in sorted(self.status.items()))
            sentences.append(f"left out {_rows(count)} whose force is not the model's force ({words})")
        for reason, (count, first) in self.dropped.items():
            sentences.append(f"dropped {_rows(count)} {reason} (first: {table.place(first)})")
        return sentences


class RowCheck:
    """Marks the rows of a file that can be used.

    Parameters
    ----------
    file : str
        The file's name, for the sentences.
    table : Places
        Gives line numbers and texts of cells for messages.
    first_row : int
        Data row of the file at which the arrays begin.
    rows : int
        Number of rows.
    drop : bool
        True: drops and counts rows that cannot be used. False: refuses the file at the first such row.
    """

    def __init__(self, file: str, table: Places, first_row: int, rows: int, drop: bool) -> None:
        self._file, self._table, self._first_row, self._drop = file, table, first_row, drop
        self.kept: NDArray[np.bool_] = np.ones(rows, dtype=bool)
        self.left_out = LeftOut()

    @property
    def notes(self) -> list[str]:
        """One sentence for each reason for ignored rows."""
        return self.left_out.sentences(self._table)

    def leave_out_other_forces(self, words: Cells) -> None:
        """Removes the rows whose status states that the force was not the model's alone: start ramp, clipped,
        or zero after a fault. They do not describe the object.
        """
        others = ~np.isin(words, (Status.Ok.name,)) & self.kept
        if others.any():
            self.left_out.status += Counter(words[others].astype(str).tolist())
            self.kept &= ~others

    def finite(self, name: str, values: Float1D) -> None:
        """Refuses or drops each row without a finite number in this column."""
        bad = self.kept & ~np.isfinite(values)
        self._refuse_or_drop(
            bad, name, "holds {cell}, which is not a finite number", "without a finite number in " + name
        )

    def directions(self, name: str, cells: Cells, position: Float1D) -> Int8Vector:
        """Returns the direction that each row states; `position` (n,) decides if it states a way of the tool.
        An unknown word always refuses the file.
        """
        codes, words = pd.factorize(cells)
        values = np.zeros(len(words), dtype=np.int8)
        for index, word in enumerate(words):
            value = direction_of(word)
            rows = codes == index
            if value is not None:
                values[index] = value
            elif word.strip():
                accepted_words = ", ".join(DIRECTION_WORDS)
                where = self._where(int(np.flatnonzero(rows)[0]))
                raise InputError(
                    f"{where}: column {name} holds {shortened(word)!r}, which is not a direction; "
                    f"use one of {accepted_words}"
                )
            else:
                self._refuse_or_drop(
                    self.kept & rows, name, "has no direction", "without a direction in " + name
                )
        found = np.asarray(values[codes])
        is_way = all(word.strip().casefold() in WAYS for word in words)
        return -found if is_way and along(position[self.kept], found[self.kept]).sum() < 0.0 else found

    def increasing(self, name: str, time: Float1D) -> None:
        """Refuses or drops each row whose time is not later than the times of all usable rows before it."""
        rows = np.flatnonzero(self.kept)
        usable = time[rows]
        latest_before = np.maximum.accumulate(usable)[:-1]
        not_later = np.zeros_like(self.kept)
        not_later[rows[1:][usable[1:] <= latest_before]] = True
        self._refuse_or_drop(
            not_later,
            name,
            "holds {cell}, must be later than the time before it",
            "with a time that is not later than in a row before",
        )

    def _refuse_or_drop(self, bad: NDArray[np.bool_], name: str, sentence: str, reason: str) -> None:
        count = int(np.count_nonzero(bad))
        if not count:
            return
        first = int(np.flatnonzero(bad)[0])
        if not self._drop:
            cell = self._table.cell(self._first_row + first, name)
            problem = sentence.format(cell=repr(shortened(cell)) if cell else "nothing")
            others = f" (and {count - 1} more such rows)" if count > 1 else ""
            raise InputError(
                f"{self._where(first)}: column {name} {problem}{others}; correct the file or drop such rows "
                "with --invalid drop"
            )
        self.left_out.drop(reason, count, self._first_row + first)
        self.kept &= ~bad

    def _where(self, row: int) -> str:
        return f"{self._file}, {self._table.place(self._first_row + row)}"


def _rows(count: int) -> str:
    return f"{count} row{'s' * (count > 1)}"


def of_each(parts: Iterable[Sized], values: NDArray[Any]) -> list[NDArray[Any]]:
    """Returns the values of each recording, from those at the rows (n,) of all."""
    return np.split(values, np.cumsum([len(part) for part in parts])[:-1])


def along(position: Float1D, direction: Int8Vector) -> Float1D:
    """Returns the steps (k,) of the tool between rows of one stated direction, > 0 in this direction and < 0
    against it; none if the rows are not in the order of a motion."""
    if strokes_from_order(position) is None:
        return np.empty(0)
    steps = np.diff(position) * direction[1:]
    return np.asarray(steps[(direction[1:] == direction[:-1]) & (steps != 0.0)])


def direction_of(word: str) -> int | None:
    """Returns the direction that a cell states, or None for an unknown word.

    Numbers count by their value: ``1``, ``+1`` and ``1.0`` are the same direction.
    """
    text = word.strip().casefold()
    if (known := DIRECTION_WORDS.get(text, _MORE_WORDS.get(text))) is not None:
        return known
    try:
        value = float(text)
    except ValueError:
        return None
    return int(value) if value in (-1.0, 0.0, 1.0) else None

# SPDX-License-Identifier: Apache-2.0
"""Roles of the rows of a recording: which rows show the force law over position, and which only wait.

A recording is a motion. Its information on a force over position is in the distance that the tool travels,
not in the number of rows: a tool that waits repeats one position, and its force changes with time, not with
position. A row is a wait if the tool moves less, since the rows before, than a twentieth of what it moves
nearby in the same time.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from enum import IntEnum
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from .._typing import Float1D, Int8Vector
from ..verdict import FORCE_FLOOR
from .checks.wrong_readings import repeated_rows, wrong_readings
from .contact import contact_at
from .hum import without_hum
from .rows import of_each

if TYPE_CHECKING:
    from .recording import Recording


class Role(IntEnum):
    """What a row of a recording shows."""

    MOVING = 0
    """The tool moves in contact or close to it, or the order of rows shows no motion: the row is fitted"""
    APPROACH = 1
    """The tool is far from the object"""
    REST = 2
    """The tool waits without contact, close to the object"""
    HOLD = 3
    """The tool waits in contact"""
    REPEATED = 4
    """The tool moves, and the row repeats the reading of a sensor that is slower than the recorder"""


AIR_MARGIN = 0.1
"""Distance before the contact that is fitted, as a share of the travel in contact [-]: the force is the same
further away, however long the approach is."""

MOST_NAMED_ROWS = 3
"""Largest number of wrong readings that a note lists."""

WRONG_READING = "wrong reading"

DROPPED = {
    "repeated": "repeats of the previous reading",
    WRONG_READING: "wrong readings",
    "approach": "far from the contact",
    "first stroke": "first strokes over their places, before the object changed",
}
"""What the rows are that are dropped for a reason, for texts."""


def roles_of(recording: Recording, deepest: float | None = None) -> Int8Vector:
    """Returns the role of each row (n,) as the number of a :class:`Role`, from position and force in recorded
    order.

    `deepest` is the largest position of all recordings of the object; without it no row is far from the
    object. A recording with further inputs, or whose rows are not in the order of a motion, has only moving
    rows.
    """
    role = np.where(repeated_rows(recording), Role.REPEATED, Role.MOVING).astype(np.int8)
    if recording.input_names or recording.motion.waiting is None:
        return role
    position, moving = recording.position, recording.motion.moving
    contact = contact_at(position[moving], recording.force[moving])
    role[~moving] = Role.HOLD
    rest, force = ~moving & (position <= contact), np.abs(recording.force)
    # Without rows in air, an object that is loaded from the start waits in contact.
    if contact > position[moving].min() or (rest.any() and force[rest].mean() <= FORCE_FLOOR * force.max()):
        role[rest] = Role.REST
    if deepest is not None:
        role[position < contact - AIR_MARGIN * (deepest - contact)] = Role.APPROACH
    return role


ROLE_NAMES = {
    Role.MOVING: "move",
    Role.APPROACH: "approach",
    Role.REST: "wait in air",
    Role.HOLD: "wait in contact",
    Role.REPEATED: "repeat the previous reading",
}
"""What the rows of each role do, for texts."""


def role_counts(role: Int8Vector) -> dict[str, int]:
    """Returns the number of rows of each role (n,) that occurs, by its name."""
    counts = np.bincount(role, minlength=len(Role)).tolist()
    return {name: counts[each] for each, name in ROLE_NAMES.items() if counts[each]}


def counts_text(counts: Mapping[str, int]) -> str:
    """Returns numbers of rows as text: "2186 move, 1 waits in contact"."""
    return ", ".join(
        f"{count} {name.replace('wait ', 'waits ') if count == 1 else name}" for name, count in counts.items()
    )


class Informative:
    """Recordings without hum and without rows that say nothing on the force of their object, and which rows
    these are.

    Parameters
    ----------
    recordings : sequence of Recording
        Recordings of one kind of object.
    lower : float, optional
        Lower end of a model with which the rows are compared. Rows far from the contact are then dropped only
        below it, and repeats at which the tool waits are kept as waits.
    """

    def __init__(self, recordings: Sequence[Recording], lower: float | None = None) -> None:
        quiet = [without_hum(each) for each in recordings]
        self.given = [recording for recording, _ in quiet]
        """Recordings (as many as given) with all rows, without hum"""
        self._hum = [notes for _, notes in quiet]
        self.recordings = list(self.given)
        self.kept = [np.arange(len(each)) for each in recordings]
        """Rows of each given recording that are left"""
        self._dropped: dict[tuple[int, str], NDArray[np.intp]] = {}
        """Rows that were dropped, by the number of the recording and the reason"""
        for number, recording in enumerate(recordings):
            counted = lower is None or recording.motion.moving
            self._drop(number, repeated_rows(recording) & counted, "repeated")
        self.drop_wrong_readings()
        self.drop_approach(np.inf if lower is None else lower)

    def drop_approach(self, below: float = np.inf) -> None:
        """Drops rows that are far from the contact of every recording, below a position.

        A release can end before the tool leaves the object, so that its own contact is that of the press.
        """
        deepest = max(float(each.position.max()) for each in self.recordings)
        far = [roles_of(each, deepest) == Role.APPROACH for each in self.recordings]
        for recording, rows in zip(self.recordings, far, strict=True):
            below = min(below, float(recording.position[~rows].min(initial=np.inf)))
        for number, rows in enumerate(far):
            self._drop(number, rows & (self.recordings[number].position < below), "approach")

    @property
    def dropped(self) -> dict[str, int]:
        """Number of dropped rows, by the reason."""
        reasons = dict.fromkeys(reason for _, reason in self._dropped)
        return {
            each: sum(len(rows) for (_, why), rows in self._dropped.items() if why == each)
            for each in reasons
        }

    @property
    def notes(self) -> list[str]:
        """Sentences on hum and on dropped rows."""
        several = len(self.given) > 1
        names = [f"recording {number}: " if several else "" for number in range(1, len(self.given) + 1)]
        found = [name + note for name, notes in zip(names, self._hum, strict=True) for note in notes]
        for (number, reason), rows in self._dropped.items():
            text = f"{names[number]}{len(rows)} of {len(self.given[number])} rows dropped ({DROPPED[reason]})"
            if reason == WRONG_READING:
                named = [self._reading(number, row) for row in np.sort(rows)[:MOST_NAMED_ROWS].tolist()]
                text += f": {', '.join(named)}{', and others' * (len(rows) > MOST_NAMED_ROWS)}"
            found.append(f"{text}.")
        return found

    def drop_wrong_readings(self, residuals: Float1D | None = None) -> bool:
        """Drops rows with a wrong reading, and returns True if there are any. With the residuals (n,) of a
        model at all rows, these are compared in place of the forces."""
        before, count = self.dropped.get(WRONG_READING, 0), len(self.recordings)
        parts = [None] * count if residuals is None else of_each(self.recordings, residuals)
        for number, (recording, residual) in enumerate(zip(self.recordings, parts, strict=True)):
            path, position, force = recording.motion.position, recording.position, recording.force
            wrong = wrong_readings(path, position, force, recording.inputs.T, residual)
            self._drop(number, wrong, WRONG_READING)
        return self.dropped.get(WRONG_READING, 0) > before

    def drop_first_strokes(self, first: NDArray[np.bool_]) -> None:
        """Drops rows (n,) of all recordings at which a stroke passes a place for the first time."""
        for number, rows in enumerate(of_each(self.recordings, first)):
            self._drop(number, rows, "first stroke")

    def _drop(self, number: int, rows: NDArray[np.bool_], reason: str) -> None:
        """Drops rows (n,) of one recording."""
        if rows.any():
            before = self._dropped.get((number, reason), np.empty(0, dtype=np.intp))
            self._dropped[number, reason] = np.append(before, self.kept[number][rows])
            self.kept[number] = self.kept[number][~rows]
            self.recordings[number] = self.recordings[number].without(rows)

    def _reading(self, number: int, row: int) -> str:
        """Returns the force and the position of a row of a given recording as text."""
        given = self.given[number]
        force, position = given.file_unit("force"), given.file_unit("position")
        return f"row {row}: {force.text(given.force[row])} at {position.text(given.position[row])}"


def unused_rows(role: Int8Vector, used: str = "fitted") -> str:
    """Returns a sentence on the rows of each role (n,) that are not fitted or compared."""
    unused = role[role != Role.MOVING]
    return f"{len(unused)} of {len(role)} rows are not {used}: {counts_text(role_counts(unused))}."

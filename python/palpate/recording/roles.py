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
from .checks.wrong_readings import repeated_rows, wrong_readings
from .contact import contact_at
from .motion import waits

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


AIR_MARGIN = 0.1
"""Distance before the contact that is fitted, as a share of the travel in contact [-]: the force is the same
further away, however long the approach is."""

MOST_NAMED_ROWS = 3
"""Largest number of wrong readings that a note lists."""


def roles_of(recording: Recording, deepest: float | None = None) -> Int8Vector:
    """Returns the role of each row (n,) as the number of a :class:`Role`, from position and force in recorded
    order.

    `deepest` is the largest position of all recordings of the object; without it no row is far from the
    object. A recording with further inputs, or whose rows are not in the order of a motion, has only moving
    rows.
    """
    role = np.full(len(recording), Role.MOVING, dtype=np.int8)
    of_motion = None if recording.input_names else waits(recording.motion.position, recording.motion.time)
    if of_motion is None or (waiting := of_motion[recording.motion.rows]).all():
        return role
    position = recording.position
    contact = contact_at(position[~waiting], recording.force[~waiting])
    role[waiting] = np.where(position <= contact, Role.REST, Role.HOLD)[waiting]
    if deepest is not None:
        role[position < contact - AIR_MARGIN * (deepest - contact)] = Role.APPROACH
    return role


ROLE_NAMES = {
    Role.MOVING: "move",
    Role.APPROACH: "approach",
    Role.REST: "wait in air",
    Role.HOLD: "wait in contact",
}
"""What the rows of each role do, for texts."""


def role_counts(role: Int8Vector) -> dict[str, int]:
    """Returns the number of rows of each role (n,) that occurs, by its name."""
    counts = np.bincount(role, minlength=len(Role)).tolist()
    return {name: counts[each] for each, name in ROLE_NAMES.items() if counts[each]}


def counts_text(counts: Mapping[str, int]) -> str:
    """Returns numbers of rows as text: "2186 move, 155 wait in contact"."""
    return ", ".join(f"{count} {name}" for name, count in counts.items())


class Informative:
    """Recordings without rows that say nothing on the force of their object, and which rows these are.

    Parameters
    ----------
    recordings : sequence of Recording
        Recordings of one kind of object.
    """

    def __init__(self, recordings: Sequence[Recording]) -> None:
        self.recordings = list(recordings)
        self.notes: list[str] = []
        """Sentences on dropped rows"""
        self.dropped: dict[str, int] = {}
        """Number of dropped rows, by the reason"""
        self._row = [np.arange(len(each)) for each in recordings]
        """Number of each row of each recording before any was dropped"""
        self._all = [len(each) for each in recordings]
        for number, recording in enumerate(recordings):
            self._drop(
                number, repeated_rows(recording), "repeated", "repeat the previous row and were dropped"
            )
        self.drop_wrong_readings()
        deepest = max(float(each.position.max()) for each in self.recordings)
        for number, recording in enumerate(self.recordings):
            approach = roles_of(recording, deepest) == Role.APPROACH
            self._drop(number, approach, "approach", "are far from the contact and were dropped")

    def drop_wrong_readings(self, residuals: Sequence[Float1D] | None = None) -> bool:
        """Drops rows with a wrong reading, and returns True if there are any. With the residuals (n,) of a
        model for each recording, these are compared in place of the forces."""
        before = len(self.notes)
        for number, recording in enumerate(self.recordings):
            residual = None if residuals is None else residuals[number]
            path, position, force = recording.motion.position, recording.position, recording.force
            wrong = wrong_readings(path, position, force, recording.inputs.T, residual)
            force_unit, position_unit = recording.file_unit("force"), recording.file_unit("position")
            named = ", ".join(
                f"row {self._row[number][row]}: {force_unit.text(force[row])} at "
                f"{position_unit.text(position[row])}"
                for row in np.flatnonzero(wrong)[:MOST_NAMED_ROWS]
            )
            more = ", ..." if np.count_nonzero(wrong) > MOST_NAMED_ROWS else ""
            text = f"are wrong readings and were dropped: {named}{more}"
            self._drop(number, wrong, "wrong reading", text)
        return len(self.notes) > before

    def _drop(self, number: int, rows: NDArray[np.bool_], name: str, text: str) -> None:
        """Drops rows (n,) of one recording."""
        if rows.any():
            where = f"recording {number + 1}: " if len(self.recordings) > 1 else ""
            count = int(np.count_nonzero(rows))
            self.notes.append(f"{where}{count} of {self._all[number]} rows {text}.")
            self.dropped[name] = self.dropped.get(name, 0) + count
            self.recordings[number] = self.recordings[number].without(rows)
            self._row[number] = self._row[number][~rows]


def unused_rows(role: Int8Vector, used: str = "fitted") -> str:
    """Returns a sentence on the rows of each role (n,) that are not fitted or compared."""
    unused = role[role != Role.MOVING]
    return f"{len(unused)} of {len(role)} rows are not {used}: {counts_text(role_counts(unused))}."

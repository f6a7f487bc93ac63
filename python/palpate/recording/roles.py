# SPDX-License-Identifier: Apache-2.0
"""Roles of the rows of a recording: which rows show the force law over position, and which only wait.

A recording is a motion. Its information on a force over position is in the distance that the tool travels,
not in the number of rows: a tool that waits repeats one position, and its force changes with time, not with
position. A row is a wait if the tool moves less, since the rows before, than a twentieth of what it moves
nearby.
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


def informative(recordings: Sequence[Recording]) -> tuple[list[Recording], list[str], dict[str, int]]:
    """Returns recordings of one kind of object without rows that say nothing on its force, notes on these
    rows, and their numbers: repeated rows, wrong readings, and rows far from the contact."""
    kept, notes, dropped = list(recordings), list[str](), {"repeated": 0, "wrong reading": 0, "approach": 0}

    def drop(number: int, rows: NDArray[np.bool_], name: str, text: str) -> None:
        if rows.any():
            where = f"recording {number + 1}: " if len(kept) > 1 else ""
            count, of = int(np.count_nonzero(rows)), len(recordings[number])
            notes.append(f"{where}{count} of {of} rows {text}.")
            dropped[name] += count
            kept[number] = kept[number].without(rows)

    for number, recording in enumerate(recordings):
        again = repeated_rows(recording)
        drop(number, again, "repeated", "repeat the previous row and were dropped")
    kept, of_wrong, count = without_wrong_readings(kept)
    notes += of_wrong
    dropped["wrong reading"] = count
    deepest = max(float(each.position.max()) for each in kept)
    for number, recording in enumerate(kept):
        approach = roles_of(recording, deepest) == Role.APPROACH
        drop(number, approach, "approach", "are far from the contact and were dropped")
    return kept, notes, {name: count for name, count in dropped.items() if count}


def without_wrong_readings(
    recordings: Sequence[Recording], residuals: Sequence[Float1D] | None = None
) -> tuple[list[Recording], list[str], int]:
    """Returns recordings without rows with a wrong reading, notes that name them, and their number. With the
    residuals of a model, these are compared in place of the forces."""
    kept: list[Recording] = []
    notes, count = list[str](), 0
    for number, recording in enumerate(recordings):
        residual = None if residuals is None else residuals[number]
        path, position, force = recording.motion, recording.position, recording.force
        wrong = wrong_readings(path.position, position, force, recording.inputs.T, residual)
        kept.append(recording.without(wrong) if wrong.any() else recording)
        if not wrong.any():
            continue
        rows = np.flatnonzero(wrong)
        force_unit, position_unit = recording.file_unit("force"), recording.file_unit("position")
        named = ", ".join(
            f"row {path.rows[row]}: {force_unit.text(force[row])} at {position_unit.text(position[row])}"
            for row in rows[:MOST_NAMED_ROWS]
        )
        more = ", ..." if len(rows) > MOST_NAMED_ROWS else ""
        where = f"recording {number + 1}: " if len(recordings) > 1 else ""
        notes.append(
            f"{where}{len(rows)} of {len(path.rows)} rows are wrong readings and were dropped: {named}{more}."
        )
        count += len(rows)
    return kept, notes, count


def unused_rows(role: Int8Vector, used: str = "fitted") -> str:
    """Returns a sentence on the rows of each role (n,) that are not fitted or compared."""
    unused = role[role != Role.MOVING]
    return f"{len(unused)} of {len(role)} rows are not {used}: {counts_text(role_counts(unused))}."

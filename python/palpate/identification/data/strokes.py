# SPDX-License-Identifier: Apache-2.0
"""Finds the directions of recordings without a direction column: from the order of rows, or from the
force."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from itertools import combinations, product

import numpy as np
from numpy.typing import NDArray

from ... import _core
from ..._typing import Float1D, Int8Vector
from ...recording import Recording
from ...recording.checks.recordings import PRESS_ABOVE_SHARE
from ...recording.motion import FORCE_RESOLUTION, ordered_strokes, states_its_order, turns_of
from ...verdict import usable
from ..log import Decision, Log

TRAVEL_CELLS = 32
"""Number of cells of the travel in which press force and release force are compared."""

LEAST_MEAN_DIFFERENCE = 0.05
"""Least mean force difference of two recordings for press and release [standard deviations of the force].
Repeated measurements of one stroke differ by at most 0.02."""

LEAST_GROUP_GAP = 3.0
"""Least mean force difference between the recordings of press and of release, divided by the largest one
between recordings of the same stroke [-]. Repeats of one stroke also form two groups by chance, but close
ones."""

DIRECTION_CURE = (
    "keep the rows in the order of the recording, or add a column direction with the words press and release"
)
"""Text of the cure in messages on rows with unknown direction."""


@dataclass(frozen=True)
class Strokes:
    """Directions of the rows of all recordings, or why they are not known."""

    side: Float1D | None = None
    """(n,) +1 into the object, -1 out of it, 0 neither; None if it is not known, or only by `order`"""
    order: Float1D | None = None
    """(n,) the same of rows in the order of a motion; None if `side` is known or if there are no strokes"""
    in_order: bool = False
    """True if a play operator can follow the rows, which are in the order of a motion"""
    log: Log = field(default_factory=Log)


def stated_strokes(recordings: Sequence[Recording]) -> Strokes:
    """Returns the directions that all recordings state; without them, whether the rows have a time.

    Directions that the order of rows shows too add nothing to it, except rows of neither direction: the rows
    are those of a motion, as without a statement.
    """
    side = _all_of([recording.direction for recording in recordings])
    if side is None:
        return Strokes(in_order=all(each.time is not None for each in recordings))
    if {-1.0, 1.0} <= set(side.tolist()) and all(map(states_its_order, recordings)):
        order = _all_of([ordered_strokes(each) for each in recordings])
        return Strokes(order=None if order is None else order * (side != 0.0), in_order=True)
    return Strokes(side)


def strokes_of(recordings: Sequence[Recording]) -> Strokes:
    """Returns the directions of recordings of a force over position: stated ones, or those of the motion.

    If all positions change in the same direction, the recordings with the higher force are press: the press
    force of a passive object is above its release force.
    """
    stated = stated_strokes(recordings)
    if stated.side is not None or stated.order is not None:
        return stated
    ordered = [ordered_strokes(recording) for recording in recordings]
    if stated.in_order:
        return replace(stated, order=_all_of(ordered))
    found = [
        direction if recording.direction is None else recording.direction
        for recording, direction in zip(recordings, ordered, strict=True)
    ]
    known = [direction for direction in found if direction is not None]
    if len(known) < len(found):
        missing = _names(recordings, [direction is None for direction in found])
        return _untested(f"the rows of {missing} have no direction and are not in recorded order")
    turns = sum(map(turns_of, known))
    side = np.concatenate(known).astype(np.float64)
    note = f"The direction is taken from the order of rows: {turns} turn{'s' * (turns != 1)}"
    if len(recordings) > 1:
        note += f" in {len(recordings)} recordings, " + _ways(recordings, known)
    if (side > 0).any() and (side < 0).any():
        if _all_of(ordered) is None:  # the rows with a stated direction are in another order
            return Strokes(side, log=Log(notes=[f"{note}."]))
        return Strokes(order=side, in_order=True, log=Log(notes=[f"{note}."]))
    press = _press(recordings)
    if press is None:
        return _untested("the position never turns back in the order of rows")
    side = np.concatenate([np.full(len(part), up) for part, up in zip(recordings, press, strict=True)])
    position = np.concatenate([recording.position for recording in recordings])
    force = np.concatenate([recording.force for recording in recordings])
    unit = recordings[0].units["force"] and f" {recordings[0].units['force']}"
    press_files, release_files = _names(recordings, press > 0), _names(recordings, press < 0)
    difference = float(np.nanmean(_difference(position, force, side)))
    note = f"{press_files} is taken as press and {release_files} as release: the press force is higher"
    finding = usable(
        f"{note} by {difference:.3g}{unit} on average. There is no direction column, and all "
        "positions change in the same direction. If these are two objects, identify each one "
        f"separately. If they repeat one stroke, give --inputs position. Else {DIRECTION_CURE}"
    )
    return Strokes(side, log=Log(notes=[f"{note}."], findings=[finding]))


def _all_of(directions: Sequence[Int8Vector | None]) -> Float1D | None:
    """Returns the directions of all recordings in sequence; None if those of one are not known."""
    known = [each for each in directions if each is not None]
    return np.concatenate(known).astype(np.float64) if len(known) == len(directions) else None


def _difference(position: Float1D, force: Float1D, side: Float1D) -> Float1D:
    """Returns the mean press force minus the mean release force at equal position (m,) [force], in the cells
    of the travel that have rows of both strokes."""
    press, release = side > 0, side < 0
    lower = max(position[press].min(), position[release].min())
    upper = min(position[press].max(), position[release].max())
    rows = (side != 0) & (position >= lower) & (position <= upper)
    if not upper > lower:
        return np.empty(0)
    x, f = (position[rows] - lower) / (upper - lower), force[rows] - force[rows].mean()
    cell = np.minimum((x * TRAVEL_CELLS).astype(np.int64), TRAVEL_CELLS - 1)
    group = 2 * cell + press[rows]
    count, f_sum, x_sum, xx, xf = (
        np.bincount(group, values, 2 * TRAVEL_CELLS).reshape(TRAVEL_CELLS, 2)
        for values in (None, f, x, x * x, x * f)
    )
    mean_x, mean_f = (total / np.maximum(count, 1) for total in (x_sum, f_sum))
    # One slope of force over position is fitted to both strokes of a cell.
    xx, xf = (
        np.sum(square - count * mean_x * other, axis=1) for square, other in ((xx, mean_x), (xf, mean_f))
    )
    slope = np.divide(xf, xx, out=np.zeros(TRAVEL_CELLS), where=xx > 0)
    difference = mean_f[:, 1] - mean_f[:, 0] - slope * (mean_x[:, 1] - mean_x[:, 0])
    n_out, n_in = count.T
    return np.asarray(difference[(n_in >= 2) & (n_out >= 2) & (n_in + n_out > 4)])


def _press(recordings: Sequence[Recording]) -> Float1D | None:
    """Returns +1 (press) for each recording of the group with the higher force, -1 (release) for each of the
    other group; None if the recordings do not form two groups."""
    if len(recordings) < 2 or any(recording.direction is not None for recording in recordings):
        return None

    def apart_from(one: Recording, other: Recording) -> tuple[Float1D, float]:
        """Returns the force of `one` minus that of `other` in the cells of the travel, and the standard
        deviation of all forces."""
        position = np.concatenate([one.position, other.position])
        force = np.concatenate([one.force, other.force])
        side = np.repeat([1.0, -1.0], [len(one), len(other)])
        return _difference(position, force, side), float(force.std())

    def above(one: Recording, other: Recording) -> int:
        """Returns +1 if the force of `one` is above that of `other` in most cells, -1 if below, else 0."""
        apart, deviation = apart_from(one, other)
        if len(apart) < TRAVEL_CELLS // 2 or abs(apart.mean()) < LEAST_MEAN_DIFFERENCE * deviation:
            return 0
        sign = int(np.sign(apart.mean()))
        return sign if np.mean(np.sign(apart) == sign) >= PRESS_ABOVE_SHARE else 0

    first = np.array([above(recording, recordings[0]) for recording in recordings])
    if not first.any() or ((first > 0).any() and (first < 0).any()):
        return None
    high = first >= 0 if (first < 0).any() else first > 0
    press_files = [recording for recording, up in zip(recordings, high, strict=True) if up]
    release_files = [recording for recording, up in zip(recordings, high, strict=True) if not up]
    if not all(above(one, other) > 0 for one, other in product(press_files, release_files)):
        return None

    def mean_apart(pair: tuple[Recording, Recording]) -> float:
        apart = apart_from(*pair)[0]
        return abs(float(apart.mean())) if len(apart) else 0.0

    between = min(map(mean_apart, product(press_files, release_files)))
    same = (*combinations(press_files, 2), *combinations(release_files, 2))
    if between < LEAST_GROUP_GAP * max(map(mean_apart, same), default=0.0):
        return None
    return np.where(high, 1.0, -1.0)


def _untested(why: str) -> Strokes:
    """Returns no directions, and the decision that hysteresis is not tested."""
    return Strokes(log=Log(decisions=[Decision("hysteresis", "not tested", why)]))


def _names(recordings: Sequence[Recording], which: Sequence[bool] | NDArray[np.bool_]) -> str:
    """Returns the file names of some recordings, or the numbers of recordings without a file, as text."""
    if len(recordings) == 1:
        return ", ".join(recordings[0].source.files) or "the recording"
    return ", ".join(
        ", ".join(recording.source.files) or f"recording {number}"
        for number, (recording, wanted) in enumerate(zip(recordings, which, strict=True), 1)
        if wanted
    )


def _ways(recordings: Sequence[Recording], directions: Sequence[Int8Vector]) -> str:
    """Returns the numbers of recordings with press only, release only, and both, as text."""
    ways = [(bool((each > 0).any()), bool((each < 0).any())) for each in directions]
    words = {"press": (True, False), "release": (False, True), "both": (True, True)}
    return ", ".join(f"{ways.count(way)} {word}" for word, way in words.items() if ways.count(way))


NEAR_TURN = 2.0 ** np.arange(-9.0, -2.0)
"""Distances from a turn between which rows are taken to have one noise [travel]."""

FAR = len(NEAR_TURN)
"""Number of the largest distance."""

NEXT_TO_TURN = 2
"""Number of distances, from the smallest one, next to a turn."""


def turns_before(order: Float1D) -> tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.intp]]:
    """Returns the rows of strokes (k,), the number of the stroke of each (k,), and the row of the turn before
    each stroke (strokes,).

    This is the last row of the stroke before, or the first row. `order` (n,) holds directions, 0 for rows of
    no stroke.
    """
    moving = np.flatnonzero(order)
    begins = np.diff(order[moving], prepend=0.0) != 0.0
    return moving, np.cumsum(begins) - 1, moving[np.maximum(np.flatnonzero(begins) - 1, 0)]


def weights_behind_turns(
    path: Float1D, order: Float1D, residual: Float1D, touched: NDArray[np.bool_], least: float
) -> Float1D:
    """Returns the weight (n,) of each row in a fit, from 0 to 1.

    Friction reverses behind a turn in a way that a model with a direction state follows only roughly. The n
    rows that are as far behind the turns at one end share this error, of variance v_s, besides an error of
    variance v. Their weight is v / (v + n v_s).
    v + v_s is their mean squared residual. v is that of rows as far before these turns, which are of the
    other stroke and have the same positions. A tool that leaves the object at one end shows walls and clicks
    near the other one, so that only rows next to its turns are weighted.

    The positions `path` are in recorded order [travel], and `order` is 0 for rows of no stroke. `touched` is
    True in contact. The force sensor resolves no error below `least` > 0 [force].
    """
    (moving, stroke, begins), weight = turns_before(order), np.ones(len(path))
    if not len(moving):
        return weight
    x, way, square = path[moving], order[moving] > 0.0, residual[moving] ** 2 + least**2
    ends = np.append(begins[1:], moving[-1])
    leaves = not touched[ends].all()

    def parts(turn: NDArray[np.intp], at_bottom: NDArray[np.bool_]) -> NDArray[np.intp]:
        """Returns the number of the end and of the distance (n,) of each row from the turn of its stroke."""
        distance = np.searchsorted(NEAR_TURN, np.abs(x - path[turn][stroke]))
        return np.asarray(
            np.where(leaves & (distance >= NEXT_TO_TURN), FAR, distance) + (FAR + 1) * at_bottom
        )

    behind, before = parts(begins, way), parts(ends, ~way)
    if not (far := behind % (FAR + 1) == FAR).any():
        return weight

    def mean(part: NDArray[np.intp]) -> Float1D:
        count = np.bincount(part, minlength=2 * FAR + 2)
        return np.bincount(part, square, 2 * FAR + 2) / np.where(count, count, np.nan)

    of_all = float(np.mean(square[far]))
    # The direction of a row next to a turn is uncertain, and that of the row at which the tool turns unknown.
    turning = np.where(np.isin(moving, ends), np.where(way, 0, FAR + 1), FAR)
    expected = np.fmax(mean(before), of_all)
    expected[:: FAR + 1] = of_all
    for part in (behind, turning):
        shared = np.where(part % (FAR + 1) < FAR, np.fmax(mean(part) - expected, 0.0)[part], 0.0)
        here = expected[part] / (expected[part] + shared * np.bincount(part)[part])
        weight[moving] = np.minimum(weight[moving], here)
    return weight


def weights_of_shared_errors(
    path: Float1D, order: Float1D, residual: Float1D, force: Float1D, contact_share: float
) -> Float1D:
    """Returns the weights (n,) of `weights_behind_turns` for rows with forces (n,), in the fit and in the
    error that is stated; 1 each for a constant force.

    The tool touches the object where |force| is above `contact_share` of its range in the strokes.
    """
    moving = order != 0.0
    reach = float(np.ptp(force[moving])) if moving.any() else 0.0
    if reach == 0.0:
        return np.ones(len(path))
    touched = np.abs(force) > contact_share * reach
    return weights_behind_turns(path, order, residual, touched, FORCE_RESOLUTION * reach)


@dataclass(frozen=True)
class HysteresisInput:
    """Direction state s of every row of a recording."""

    side: Float1D
    """(n,) in [-1, 1]"""
    known: NDArray[np.bool_]
    """(n,) True for rows whose direction state does not depend on the motion before the recording"""
    play_radius: float | None = None
    """[box]"""
    weight: Float1D | None = None
    """(n,) weight of each row in the fit, from 0 to 1; None: 1 each"""

    @property
    def share(self) -> Float1D:
        """(n,) weight in the fit of each row with known direction state, 0 of the others."""
        return np.where(self.known, 1.0 if self.weight is None else self.weight, 0.0)

    @property
    def both_ways(self) -> bool:
        """True if the rows with known direction state contain press and release."""
        side = self.side[self.known]
        return bool((side > 0.0).any() and (side < 0.0).any())

    @classmethod
    def of_play(cls, motions: Sequence[Float1D], radius: float) -> HysteresisInput:
        """Returns the direction states of the play operator along motions that each start at s = 0.

        After a motion has covered twice the play radius, the direction state no longer depends on its start
        value, and counts as known. If no motion is this long, all rows count as known.
        """
        side, known = [], []
        for motion in motions:
            play = _core.model.play(motion, radius, start=motion[0])
            side.append(np.clip((motion - play) / radius, -1.0, 1.0))
            covered = np.maximum.accumulate(motion) - np.minimum.accumulate(motion)
            known.append(covered >= 2.0 * radius)
        all_known = np.concatenate(known)
        return cls(np.concatenate(side), all_known if all_known.any() else ~all_known, radius)

# SPDX-License-Identifier: Apache-2.0
"""Recordings of one object whose forces differ at the same positions: another unit, object or zero."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..._typing import Float1D
from ...verdict import Finding, no, usable
from ..rows import of_each
from ..units import GRAVITY
from .cells import MOST_CELLS, sides

if TYPE_CHECKING:
    from ..recording import Recording

ROWS_PER_POINT = 4
"""Mean number of rows that are averaged for one point of a curve of force over position."""

UNIT_RATIOS = {
    10.0: "mm and cm",
    25.4: "mm and in",
    1e3: "a unit and its thousandth, such as mm and m or mN and N",
    1e6: "a unit and its millionth, such as um and m",
    GRAVITY: "N and kgf",
    1e3 / GRAVITY: "gf and N",
    4.4482216: "N and lbf",
    180.0 / np.pi: "deg and rad",
}
"""Names of two units that are often confused in files, by the ratio of the units."""

LEAST_SHARED_TRAVEL = 0.3
"""Least common position range of two recordings whose forces are compared.

It is a share of the longer of the two position ranges.
"""

LEAST_CURVE_DIFFERENCE = 0.25
"""RMS force difference of two recordings above which it is reported, divided by the standard deviation."""

LARGEST_EXPLAINED_DIFFERENCE = 0.1
"""Largest RMS force difference of two recordings that is explained by a wrong unit of one of them.

It is computed after the change of unit, and divided by the force's standard deviation.
"""

PRESS_ABOVE_SHARE = 0.9
"""Share of positions at which the press force must exceed the release force, for one object with hysteresis.

Otherwise a recorded press and a recorded release that differ are reported as two objects. Without directions
the recording with the higher force is then taken as press, the other one as release.
"""

LARGEST_RANGE_RATIO = 2.0
"""Largest ratio of the force ranges (largest minus least force) of press and release of one object.

The ratio is near 1, because the release begins where the press ends: 0.9 to 1.2 in 74 measured pairs.
"""

MOST_COMPARED_RECORDINGS = 20
"""Largest number of recordings among which the one that agrees best with the others is searched."""

Curve = tuple[Float1D, Float1D]
"""Curve of force over position: mean positions in rising order, and the mean force at each."""


@dataclass(frozen=True)
class _Strokes:
    """Curves of force over position of the strokes of one recording."""

    direction: int
    """+1: the recording holds only presses, -1: only releases, 0: both or unknown"""
    curves: Mapping[int, Curve]
    """Curve of the press rows (key +1), of the release rows (-1) and of all rows (0)"""

    @staticmethod
    def of(recording: Recording, side: Float1D | None) -> _Strokes:
        """Returns force over position of each stroke of a recording.

        `side` (n,) is the direction of the rows; with None the result of :func:`sides` is used.
        """
        signs = sides(recording) if side is None else side
        moving = recording.motion.moving  # in a wait the force relaxes
        into, out = moving & (signs > 0), moving & (signs < 0)
        direction = int(into.any()) - int(out.any())
        rows = {0: moving, 1: into, -1: out}
        return _Strokes(direction, {key: _curve(recording, at) for key, at in rows.items() if at.any()})


def scale_findings(recordings: Sequence[Recording], side: Float1D | None = None) -> list[Finding]:
    """Returns findings on recordings of one object whose forces differ at the same positions.

    A recording of one stroke is compared with the same stroke of the others, because of hysteresis.

    Parameters
    ----------
    recordings : sequence of Recording
    side : (n,) array, optional
        Direction of the rows of all recordings, if it was computed from their order or from the force.
    """
    if len(recordings) < 2 or any(recording.input_names for recording in recordings):
        return []
    directions = [None] * len(recordings) if side is None else of_each(recordings, side)
    strokes = [_Strokes.of(*each) for each in zip(recordings, directions, strict=True)]
    differences = [
        [min(_difference(one, other), 1.0) for other in strokes[:MOST_COMPARED_RECORDINGS]]
        for one in strokes[:MOST_COMPARED_RECORDINGS]
    ]
    reference = int(np.argmin(np.sum(differences, axis=1)))
    found = []
    for index, each in enumerate(strokes):
        if index == reference:
            continue
        difference = _difference(strokes[reference], each)
        if difference <= LEAST_CURVE_DIFFERENCE:
            continue
        name, other = _name(recordings, index), _name(recordings, reference)
        if (explained := _ratio(*_shared_curves(strokes[reference], each))) is not None:
            role, ratio, units = explained
            found.append(
                no(
                    f"{name} agrees with {other} only if its {role} is multiplied by {ratio:.4g}: one of "
                    f"them is probably in another unit ({units}); name the unit of the {role} column with "
                    "--units"
                )
            )
        elif np.isfinite(difference):
            found.append(
                usable(
                    f"{name} and {other} differ by {difference:.0%} of the force's spread at the same "
                    "positions: they probably belong to two objects or have two zeros; identify "
                    "them separately"
                )
            )
    return found


def _name(recordings: Sequence[Recording], index: int) -> str:
    files = recordings[index].source.files
    return files[0] if files else f"recording {index + 1}"


def _curve(recording: Recording, rows: NDArray[np.bool_]) -> Curve:
    """Returns the mean force over position of the rows that are marked by True."""
    x, f = recording.position[rows], recording.force[rows]
    lower, length = float(x.min()), float(np.ptp(x))
    if not length > 0.0:
        return x[:1], f[:1]
    cells = int(np.clip(len(x) // ROWS_PER_POINT, 2, MOST_CELLS))
    cell = np.minimum((cells * ((x - lower) / length)).astype(np.intp), cells - 1)
    count = np.bincount(cell, minlength=cells)
    filled = count > 0
    return (
        np.bincount(cell, x, cells)[filled] / count[filled],
        np.bincount(cell, f, cells)[filled] / count[filled],
    )


def _shared_curves(one: _Strokes, other: _Strokes) -> tuple[Curve, Curve]:
    """Returns the curves of two recordings: of the stroke that one holds alone, else of all rows.

    Opposite strokes are compared over all rows.
    """
    direction = 0 if one.direction * other.direction < 0 else one.direction or other.direction
    return one.curves.get(direction, one.curves[0]), other.curves.get(direction, other.curves[0])


def _difference(one: _Strokes, other: _Strokes) -> float:
    """Returns the RMS force difference of two recordings, divided by the standard deviation of the force; 0
    if hysteresis explains the difference."""
    difference = _curve_difference(*_shared_curves(one, other))
    if one.direction * other.direction < 0 and np.isfinite(difference):
        press, release = (one, other) if one.direction > 0 else (other, one)
        (x, f), (at, force) = press.curves[0], release.curves[0]
        shared = (at >= x[0]) & (at <= x[-1])
        above = np.mean(np.interp(at[shared], x, f) >= force[shared])
        ranges = float(np.ptp(f)), float(np.ptp(force))
        if above >= PRESS_ABOVE_SHARE and max(ranges) <= LARGEST_RANGE_RATIO * min(ranges):
            return 0.0
    return difference


def _curve_difference(one: Curve, other: Curve) -> float:
    """Returns the RMS force difference of two curves over the standard deviation of the first curve's force.

    The result is infinite if the positions of the curves overlap too little.
    """
    (x, f), (at, force) = one, other
    shared = (at >= x[0]) & (at <= x[-1])
    reach = min(x[-1], at[-1]) - max(x[0], at[0])
    spread = float(np.std(f))
    if (
        reach < LEAST_SHARED_TRAVEL * max(x[-1] - x[0], at[-1] - at[0])
        or np.count_nonzero(shared) < 3
        or spread == 0.0
    ):
        return float("inf")
    difference = force[shared] - np.interp(at[shared], x, f)
    return float(np.sqrt(np.mean(difference**2))) / spread


def _ratio(one: Curve, other: Curve) -> tuple[str, float, str] | None:
    """Returns the column, unit ratio and unit names that explain a force difference, or None."""
    x, f = other
    candidates = []
    for ratio, units in UNIT_RATIOS.items():
        for by in (ratio, 1.0 / ratio):
            candidates.append((_curve_difference(one, (by * x, f)), "position", by, units))
            candidates.append((_curve_difference(one, (x, by * f)), "force", by, units))
    best = min(candidates, key=lambda each: each[0])
    return best[1:] if best[0] <= LARGEST_EXPLAINED_DIFFERENCE else None

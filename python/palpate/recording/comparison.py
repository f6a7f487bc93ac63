# SPDX-License-Identifier: Apache-2.0
"""Detection of mixed recordings: two objects in one file, repeated rows, other units or zeros.

Rows are compared by position cell and stroke.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .._core.model import play
from .._typing import Float1D, Float2D
from ..verdict import Finding, no, usable
from .recording import Recording
from .units import GRAVITY

MOST_COMPARED_ROWS = 100_000
"""Most rows that the comparison of cells uses. Longer recordings are thinned evenly."""

MOST_CELLS = 64
"""Largest number of position cells."""

LEAST_ROWS_PER_CELL = 8
"""Least mean number of rows in a cell of one stroke."""

LEAST_COMPARED_ROWS = 3
"""Rows that a cell of one stroke needs to be compared with another."""

PLAY_RADIUS_SHARE = 0.02
"""Play radius over the travel. A smaller motion back does not end a stroke."""

SPIKE_PERCENT = 0.5
"""Percentage of the rows at each end that may be position spikes."""


@dataclass(frozen=True)
class Travel:
    """Range of the position without spikes, and the rows inside it."""

    lower: float
    upper: float
    inside: NDArray[np.bool_]
    """(n,)"""

    @property
    def length(self) -> float:
        return self.upper - self.lower

    @staticmethod
    def of(position: Float1D) -> Travel:
        """Returns the range of all rows within half a travel of the inner 99 % of the rows."""
        low, high = np.percentile(position, (SPIKE_PERCENT, 100.0 - SPIKE_PERCENT))
        margin = 0.5 * (high - low)
        inside = (position >= low - margin) & (position <= high + margin)
        kept = position[inside]
        return Travel(float(kept.min()), float(kept.max()), inside)


@dataclass(frozen=True)
class CellRows:
    """Rows by cell. A cell holds rows of one stroke at nearly the same position."""

    row: NDArray[np.intp]
    """(k,) the rows used, in their order"""
    cell: NDArray[np.intp]
    """(k,) position cell, + `cells` in rows of a stroke out of the object"""
    place: Float1D
    """(k,) position inside the cell, in cells: 0 to 1"""
    residual: Float1D
    """(k,) force minus the mean curve of the row's stroke"""
    cells: int
    """Position cells"""
    loop: Float1D
    """(m,) press minus release force, if both are known"""
    loop_error: Float1D
    """(m,) standard error of `loop`"""


def cell_rows(recording: Recording, travel: Travel) -> CellRows | None:
    """Returns the rows by cell, or None if too few rows move."""
    side = sides(recording, travel)
    row = np.flatnonzero(travel.inside & (side != 0))
    row = row[:: max(1, -(-len(row) // MOST_COMPARED_ROWS))]
    if not travel.length > 0.0 or len(row) < 8 * LEAST_ROWS_PER_CELL:
        return None
    cells = min(len(row) // (2 * LEAST_ROWS_PER_CELL), MOST_CELLS)
    x, f, release = recording.position[row], recording.force[row], side[row] < 0
    place = cells * ((x - travel.lower) / travel.length)
    at = np.minimum(place.astype(np.intp), cells - 1)
    cell = at + cells * release
    count = np.bincount(cell, minlength=2 * cells)
    used = np.maximum(count, 1)
    mean_x, mean_f = np.bincount(cell, x, 2 * cells) / used, np.bincount(cell, f, 2 * cells) / used
    residual = np.zeros_like(f)
    curves: list[tuple[Float1D, Float1D, Float1D]] = []
    for rows, of in ((~release, slice(0, cells)), (release, slice(cells, None))):
        compared = count[of] >= LEAST_COMPARED_ROWS
        curve = mean_x[of][compared], mean_f[of][compared]
        if compared.any():
            residual[rows] = f[rows] - np.interp(x[rows], *curve)
        scatter = np.bincount(cell, residual**2, 2 * cells)[of][compared]
        curves.append((*curve, np.sqrt(scatter) / count[of][compared]))
    (press_x, press_f, press_error), (release_x, release_f, release_error) = curves
    loop, error = np.empty(0), np.empty(0)
    if len(press_x) and len(release_x):
        shared = (release_x >= press_x[0]) & (release_x <= press_x[-1])
        loop = np.interp(release_x, press_x, press_f)[shared] - release_f[shared]
        error = np.hypot(np.interp(release_x, press_x, press_error), release_error)[shared]
    return CellRows(row, cell, place - at, residual, cells, loop, error)


def sides(recording: Recording, travel: Travel) -> NDArray[np.int8]:
    """Returns (n,) +1 in rows of a stroke into the object, -1 out of it, 0 if unknown."""
    if recording.direction is not None and recording.direction.any():
        return recording.direction
    if not travel.length > 0.0:
        return np.zeros(len(recording), dtype=np.int8)
    radius = PLAY_RADIUS_SHARE * travel.length
    position = np.clip(recording.position, travel.lower, travel.upper)
    state = (position - play(position, radius)) / radius
    return (state > 0.99).astype(np.int8) - (state < -0.99).astype(np.int8)


SPLIT_BLOCKS = 32
"""Blocks of rows between which a file is split."""

LEAST_EXPLAINED_SHARE = 0.4
"""Least share of the scatter about the mean curves that a split into two parts must explain."""

LEAST_PART_DISTANCE = 0.02
"""Least distance of the two parts, as a share of the force's spread."""

PATTERN_ROWS = 16
"""Number of rows by which a repetition of the beginning is found."""

LEAST_COPY_SHARE = 0.1
"""Least share of the rows in a copy."""

MOST_COPY_STARTS = 4
"""Most places that begin like the file and are compared to the end."""

LARGEST_MEAN_OFFSET = 0.1
"""Largest distance of the mean positions of two parts in a cell at which they are compared [cells]."""

MOST_CURVE_POINTS = 64
"""Largest number of points of a curve."""

ROWS_PER_POINT = 4
"""Mean number of rows that are averaged for a point of a curve."""

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
"""Ratios of units that files mix up."""

LEAST_SHARED_TRAVEL = 0.3
"""Least common share of the travel of two recordings that are compared."""

LEAST_CURVE_DIFFERENCE = 0.25
"""RMS difference of two curves above which they differ, as a share of the force's spread."""

LARGEST_EXPLAINED_DIFFERENCE = 0.1
"""Largest RMS difference at which a ratio explains it, as a share of the force's spread."""

ONE_STROKE_SHARE = 0.99
"""Least share of the moving rows with one direction in a recording of one stroke."""

PRESS_ABOVE_SHARE = 0.9
"""Least share of the shared positions at which the press is above the release of the same object."""

LARGEST_RANGE_RATIO = 2.0
"""Largest ratio of the force ranges of two strokes of one object.

The release begins where the press ends. 74 measured pairs have 0.9 to 1.2.
"""

MOST_COMPARED_RECORDINGS = 20
"""Largest number of recordings in the search for the one that agrees best with the others."""

Curve = tuple[Float1D, Float1D]
"""Mean positions in rising order, and mean forces."""


def merged_findings(recording: Recording, cells: CellRows | None) -> list[Finding]:
    """Returns findings on repeated rows and on a force with two branches, one before and one after a row."""
    if recording.input_names:
        return []
    if (copy_start := _copy_start(recording)) is not None:
        return [
            usable(
                f"the rows from {copy_start} on repeat those from 0 on exactly: the file was probably "
                f"appended to itself; give --rows 0:{copy_start}"
            )
        ]
    return [] if cells is None else _change_findings(recording, cells)


def _change_findings(recording: Recording, cells: CellRows) -> list[Finding]:
    """Compares the parts before and after each block edge, cell by cell."""
    total = float(np.sum(cells.residual**2))
    spread = float(np.std(recording.force))
    if not total > 0.0 or not spread > 0.0:
        return []
    width = 2 * cells.cells
    block = cells.row * SPLIT_BLOCKS // len(recording)
    code = block * width + cells.cell

    def sums(values: Float1D | None) -> Float2D:
        table = np.bincount(code, values, SPLIT_BLOCKS * width).reshape(SPLIT_BLOCKS, width)
        return table.cumsum(axis=0, dtype=np.float64)

    count, force, place = sums(None), sums(cells.residual), sums(cells.place)
    before, after = count[:-1], count[-1] - count[:-1]
    one, other = np.maximum(before, 1.0), np.maximum(after, 1.0)
    force_difference = force[:-1] / one - (force[-1] - force[:-1]) / other
    place_difference = place[:-1] / one - (place[-1] - place[:-1]) / other
    compared_cells = (
        (before >= LEAST_COMPARED_ROWS)
        & (after >= LEAST_COMPARED_ROWS)
        & (np.abs(place_difference) <= LARGEST_MEAN_OFFSET)
    )
    explained_scatter = np.where(compared_cells, before * after / (one + other) * force_difference**2, 0.0)
    explained = explained_scatter.sum(axis=1) / total
    best = int(np.argmax(explained))
    shared = compared_cells[best]
    if not shared.any():
        return []
    rows = (before[best] + after[best])[shared]
    distance = float(np.sqrt(np.average(force_difference[best][shared] ** 2, weights=rows)))
    if explained[best] < LEAST_EXPLAINED_SHARE or distance < LEAST_PART_DISTANCE * spread:
        return []
    split = (best + 1) * len(recording) // SPLIT_BLOCKS
    return [
        usable(
            f"near row {split} the force at the same position and stroke changes by "
            f"{recording.file_unit('force').text(distance)}, {distance / spread:.0%} of its spread. The file "
            "probably holds two objects or two zeros, or the object changed (drift, settling): identify "
            f"each part separately with --rows 0:{split} and --rows {split}:{len(recording)}"
        )
    ]


def _copy_start(recording: Recording) -> int | None:
    """Returns the first row of a copy of the beginning that continues to the end of the file."""
    x, f = recording.position, recording.force
    n = len(x)
    least = int(LEAST_COPY_SHARE * n)
    if least < PATTERN_ROWS:
        return None
    starts = np.arange(n // 3, n - least + 1)
    for k in (*range(PATTERN_ROWS), *np.linspace(PATTERN_ROWS, least - 1, PATTERN_ROWS).astype(int).tolist()):
        starts = starts[(x[starts + k] == x[k]) & (f[starts + k] == f[k])]
    for start in starts[:MOST_COPY_STARTS].tolist():
        copied = slice(0, n - start)
        same = np.array_equal(x[start:], x[copied]) and np.array_equal(f[start:], f[copied])
        if same and len(np.unique(f[copied])) > PATTERN_ROWS:
            return int(start)
    return None


@dataclass(frozen=True)
class _Strokes:
    """Curves of one recording."""

    direction: int
    """+1: all rows go into the object, -1: out of it, 0: both or unknown"""
    curves: Mapping[int, Curve]
    """Of the rows of each direction, and of all rows (0)"""

    @staticmethod
    def of(recording: Recording, side: Float1D | None) -> _Strokes:
        """Returns the curves of a recording; `side` (n,) is the direction of its rows, None: as recorded."""
        travel = Travel.of(recording.position)
        signs = sides(recording, travel) if side is None else side
        into, out = signs > 0, signs < 0
        moving = max(int(np.count_nonzero(into | out)), 1)
        shares = float(np.count_nonzero(into)) / moving, float(np.count_nonzero(out)) / moving
        direction = 1 if shares[0] >= ONE_STROKE_SHARE else -1 if shares[1] >= ONE_STROKE_SHARE else 0
        rows = {0: travel.inside, 1: travel.inside & into, -1: travel.inside & out}
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
    ends = np.cumsum([len(recording) for recording in recordings])[:-1]
    directions = [None] * len(recordings) if side is None else np.split(side, ends)
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
    """Returns the mean force over position of the given rows."""
    x, f = recording.position[rows], recording.force[rows]
    lower, length = float(x.min()), float(np.ptp(x))
    if not length > 0.0:
        return x[:1], f[:1]
    cells = int(np.clip(len(x) // ROWS_PER_POINT, 2, MOST_CURVE_POINTS))
    cell = np.minimum((cells * ((x - lower) / length)).astype(np.intp), cells - 1)
    count = np.bincount(cell, minlength=cells)
    filled = count > 0
    return (
        np.bincount(cell, x, cells)[filled] / count[filled],
        np.bincount(cell, f, cells)[filled] / count[filled],
    )


def _shared_curves(one: _Strokes, other: _Strokes) -> tuple[Curve, Curve]:
    """Returns the curves of the stroke that both recordings contain, or of all rows."""
    direction = 0 if one.direction * other.direction < 0 else one.direction or other.direction
    return one.curves.get(direction, one.curves[0]), other.curves.get(direction, other.curves[0])


def _difference(one: _Strokes, other: _Strokes) -> float:
    """Returns the difference of two recordings; 0 if they differ only by hysteresis."""
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
    """Returns the RMS difference over the spread of the first force; infinite without overlap."""
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
    """Returns the role and the ratio of two units that explain the difference best, or None."""
    x, f = other
    candidates = []
    for ratio, units in UNIT_RATIOS.items():
        for by in (ratio, 1.0 / ratio):
            candidates.append((_curve_difference(one, (by * x, f)), "position", by, units))
            candidates.append((_curve_difference(one, (x, by * f)), "force", by, units))
    best = min(candidates, key=lambda each: each[0])
    return best[1:] if best[0] <= LARGEST_EXPLAINED_DIFFERENCE else None

# SPDX-License-Identifier: Apache-2.0
"""Detection of mixed recordings: two objects in one file, repeated rows, other units or zeros.

Rows are compared by position cell and stroke.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from .._core.model import play
from .._typing import Float1D, Float2D
from ..verdict import Finding, no, usable
from .units import GRAVITY

if TYPE_CHECKING:
    from .recording import Recording

MOST_COMPARED_ROWS = 100_000
"""Largest number of rows used to compare forces; of a longer recording every k-th moving row is used."""

MOST_CELLS = 64
"""Largest number of equal intervals (cells) into which the positions of a recording are divided."""

LEAST_ROWS_PER_CELL = 8
"""Mean number of rows for each stroke and position cell; it sets the number of cells of a short recording."""

LEAST_COMPARED_ROWS = 3
"""The mean force of a stroke in a position cell is used if the cell has at least this number of its rows."""

PLAY_RADIUS_SHARE = 0.02
"""Play radius that separates the strokes, as a share of the distance between least and largest position.

After a reversal, the rows of the first two play radii belong to no stroke.
"""

SPIKE_PERCENT = 0.5
"""Percentage of the rows, at the least and again at the largest positions, that may be sensor spikes."""


@dataclass(frozen=True)
class Travel:
    """Least and largest position of a recording, spikes excluded, and the rows between these positions."""

    lower: float
    upper: float
    inside: NDArray[np.bool_]
    """(n,) True for rows between `lower` and `upper`"""

    @property
    def length(self) -> float:
        return self.upper - self.lower

    @staticmethod
    def of(position: Float1D) -> Travel:
        """Returns least and largest position of a recording, without rows far outside the inner 99 % of rows.

        A row is far outside if its distance exceeds half the width of the inner 99 %.
        """
        low, high = np.percentile(position, (SPIKE_PERCENT, 100.0 - SPIKE_PERCENT))
        margin = 0.5 * (high - low)
        inside = (position >= low - margin) & (position <= high + margin)
        kept = position[inside]
        return Travel(float(kept.min()), float(kept.max()), inside)


@dataclass(frozen=True)
class CellRows:
    """Rows of a recording by position cell. A cell holds rows of one stroke at nearly the same position."""

    row: NDArray[np.intp]
    """(k,) indices, in the recording, of the rows that are compared, ascending"""
    cell: NDArray[np.intp]
    """(k,) index of the position cell of each row; rows of a release have the index plus `cells`"""
    place: Float1D
    """(k,) position of each row inside its cell: 0 at the lower edge, 1 at the upper edge"""
    residual: Float1D
    """(k,) force of each row minus the mean force of its stroke at the same position"""
    cells: int
    """Number of position cells"""
    press: Float1D
    """(m,) mean force of the press, at m rising positions where both strokes have rows"""
    release: Float1D
    """(m,) mean force of the release at these positions"""
    loop_error: Float1D
    """(m,) standard error of each force difference in `loop`"""

    @property
    def loop(self) -> Float1D:
        """(m,) press minus release force"""
        return self.press - self.release


def cell_rows(recording: Recording, travel: Travel) -> CellRows | None:
    """Returns the rows of a recording by position cell, or None if too few rows belong to a stroke."""
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
    press, released, error = np.empty(0), np.empty(0), np.empty(0)
    if len(press_x) and len(release_x):
        shared = (release_x >= press_x[0]) & (release_x <= press_x[-1])
        press, released = np.interp(release_x, press_x, press_f)[shared], release_f[shared]
        error = np.hypot(np.interp(release_x, press_x, press_error), release_error)[shared]
    return CellRows(row, cell, place - at, residual, cells, press, released, error)


def sides(recording: Recording, travel: Travel) -> NDArray[np.int8]:
    """Returns the direction of each of the n rows: +1 for a press, -1 for a release, 0 if unknown."""
    if recording.direction is not None and recording.direction.any():
        return recording.direction
    if not travel.length > 0.0:
        return np.zeros(len(recording), dtype=np.int8)
    radius = PLAY_RADIUS_SHARE * travel.length
    position = np.clip(recording.position, travel.lower, travel.upper)
    state = (position - play(position, radius)) / radius
    return (state > 0.99).astype(np.int8) - (state < -0.99).astype(np.int8)


SPLIT_BLOCKS = 32
"""Number of equal blocks of rows. A change of the object is searched only at the edges of these blocks."""

LEAST_EXPLAINED_SHARE = 0.4
"""Least share of the force's scatter that a division into two parts must remove to report two objects.

The scatter is the sum of the squared differences between force and mean force at the same position.
"""

LEAST_PART_DISTANCE = 0.1
"""Least RMS force difference of two parts of a file at which the file is reported to hold two objects.

It is a share of the force's standard deviation.
"""

PATTERN_ROWS = 16
"""Number of first rows of a file that are searched again later in the file, to find an appended copy."""

LEAST_COPY_SHARE = 0.1
"""Least length of a copy of a file's first rows at the end of the file, as a share of all rows."""

MOST_COPY_STARTS = 4
"""Largest number of rows that are tested as the first row of a copy of the file appended to itself."""

LARGEST_MEAN_OFFSET = 0.1
"""Largest difference of the mean positions of two file parts in one position cell [cell widths].

If the difference is larger, the forces of the parts in this cell are not compared.
"""

MOST_CURVE_POINTS = 64
"""Largest number of points of a curve of force over position."""

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

ONE_STROKE_SHARE = 0.99
"""A recording with at least this share of its moving rows in one direction holds only that stroke."""

PRESS_ABOVE_SHARE = 0.9
"""Share of positions at which the press force must exceed the release force, for one object with hysteresis.

Otherwise a recorded press and a recorded release that differ are reported as two objects.
"""

LARGEST_RANGE_RATIO = 2.0
"""Largest ratio of the force ranges (largest minus least force) of press and release of one object.

The ratio is near 1, because the release begins where the press ends: 0.9 to 1.2 in 74 measured pairs.
"""

MOST_COMPARED_RECORDINGS = 20
"""Largest number of recordings among which the one that agrees best with the others is searched."""

Curve = tuple[Float1D, Float1D]
"""Curve of force over position: mean positions in rising order, and the mean force at each."""


def merged_findings(recording: Recording, cells: CellRows | None) -> list[Finding]:
    """Returns findings on a file that was appended to itself, and on a file that holds two objects."""
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
    """Returns a finding if the force at equal positions differs between two parts of a recording."""
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
    """Returns the row from which to the last row the file repeats its first rows exactly, or None."""
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
    """Returns the mean force over position of the rows that are marked by True."""
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

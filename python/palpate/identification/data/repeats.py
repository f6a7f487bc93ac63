# SPDX-License-Identifier: Apache-2.0
"""Repeatability: the differences between several recordings of one object, or of several objects of one kind.

A recording differs from the mean of all recordings by a part that is similar in all its rows, such as another
zero position or stiffness, and by a part that is independent from row to row. The first part is known as
often as there are recordings, not rows, so that its variance has few degrees of freedom. The band of a
further recording therefore uses the quantile of Student's t for each part, and adds the squares of both. With
few recordings this sum is safer than one quantile with mean degrees of freedom (Satterthwaite 1946).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray

from ..._typing import Float1D
from ...model.band import BAND_LEVEL, Band
from ...recording.motion import FORCE_RESOLUTION

BAND_PARTS = 8
"""Number of parts of the travel. Each part has its own variances."""

LEAST_COMPARED_SHARE = 0.5
"""Least share of the rows at whose positions another recording has rows, for recordings to count as repeats
[-]."""


@dataclass(frozen=True)
class Repeats:
    """Recording of each row, and the object of each recording."""

    recording: NDArray[np.intp]
    """(n,) number of the recording"""
    objects: tuple[int, ...]
    """Number of the object, for each recording"""

    @property
    def several(self) -> bool:
        """True if the recordings are of several objects."""
        return len(set(self.objects)) > 1

    @property
    def groups(self) -> NDArray[np.intp]:
        """(n,) number of the group that a check leaves out: the object if there are several, else the
        recording."""
        return np.asarray(self.objects, dtype=np.intp)[self.recording] if self.several else self.recording

    def only(self, rows: NDArray[np.bool_]) -> Repeats:
        """Returns the repeats of some of the rows."""
        return Repeats(self.recording[rows], self.objects)


def pure_error(
    position: Float1D, side: Float1D | None, residual: Float1D, recording: NDArray[np.intp]
) -> float | None:
    """Returns the RMS difference of the rows of all recordings from the mean of all recordings [force]; None
    if they share few positions.

    No force that is the same in all recordings can have a smaller RMS error. The arguments are those of
    :func:`deviations`.
    """
    apart = deviations(position, side, residual, recording, np.zeros(len(position), dtype=np.intp))
    known = apart[np.isfinite(apart)]
    return float(np.sqrt(np.mean(known**2))) if len(known) > LEAST_COMPARED_SHARE * len(apart) else None


def deviations(
    position: Float1D,
    side: Float1D | None,
    residual: Float1D,
    recording: NDArray[np.intp],
    object_of: NDArray[np.intp],
) -> Float1D:
    """Returns the difference (n,) of each row from the mean of the recordings of its object at its position;
    NaN where no other recording has rows.

    Rows of different directions are not compared. Residuals of a model change little between neighbouring
    positions.
    """
    strokes = np.zeros(len(position)) if side is None else np.sign(side)
    found = np.full(len(position), np.nan)
    for stroke, number in {*zip(strokes.tolist(), object_of.tolist(), strict=True)}:
        of_both = (strokes == stroke) & (object_of == number)
        parts = [np.flatnonzero(of_both & (recording == each)) for each in np.unique(recording[of_both])]
        curves = [_curve(position[rows], residual[rows]) for rows in parts]
        for index, rows in enumerate(parts):
            x, total, count = position[rows], np.zeros(len(rows)), np.zeros(len(rows))
            for across, values in curves[:index] + curves[index + 1 :]:
                reached = (x >= across[0]) & (x <= across[-1])
                total += np.where(reached, np.interp(x, across, values), 0.0)
                count += reached
            others = np.where(count > 0.0, count, np.nan)
            # the mean of all recordings is nearer to a row than the mean of the others
            found[rows] = (residual[rows] - total / others) * others / (others + 1.0)
    return found


def _curve(position: Float1D, value: Float1D) -> tuple[Float1D, Float1D]:
    """Returns the distinct positions in increasing order, and the mean value at each of them."""
    distinct, place = np.unique(position, return_inverse=True)
    return distinct, np.asarray(np.bincount(place, value) / np.bincount(place))


def band_of(
    position: Float1D,
    side: Float1D | None,
    residual: Float1D,
    repeats: Repeats,
    ends: tuple[float, float],
    force_range: float,
) -> Band | None:
    """Returns the band of a further recording, without its check; None if no part of the travel has rows of
    two recordings, or of two objects if there are several.

    Each recording counts once, with few rows or many. The rows are in recorded order, and `ends` are those of
    the domain. The band is at least as wide as the resolution of the force, a share of `force_range`.
    """
    lower, width = ends[0], (ends[1] - ends[0]) / BAND_PARTS
    part = np.clip(((position - lower) / width).astype(np.intp), 0, BAND_PARTS - 1)
    middle = np.asarray(lower + width * (np.arange(BAND_PARTS) + 0.5), dtype=np.float64)
    recording, several = repeats.recording, repeats.several
    object_of = np.asarray(repeats.objects, dtype=np.intp)[recording]
    inner = deviations(position, side, residual, recording, object_of) if several else residual
    of_repeat, of_object = np.full((2, BAND_PARTS), np.nan)
    for k in np.unique(part).tolist():
        rows = part == k
        noise = row_noise(position, residual, recording, rows)
        compared = rows & np.isfinite(inner)
        own = _mean_squares(inner, recording, compared)
        objects = len(np.unique(object_of[compared])) if several else 1
        if len(own) > objects:
            of_repeat[k] = _half_width(own, len(own) / objects, len(own) - objects, noise, rows)
        own = _mean_squares(residual, object_of, rows)
        if len(own) > 1:
            of_object[k] = _half_width(own, len(own), len(own) - 1, noise, rows)
    least = FORCE_RESOLUTION * force_range or np.finfo(float).tiny
    repeat, between = (_filled(middle, half, least) for half in (of_repeat, of_object))
    if (between if several else repeat) is None:
        return None
    used = np.unique(recording)
    objects = len({repeats.objects[number] for number in used})
    return Band(middle, repeat, between, len(used), objects, 0.0, None)


def _mean_squares(values: Float1D, group: NDArray[np.intp], rows: NDArray[np.bool_]) -> Float1D:
    """Returns the mean square of the values (n,) of each group that is among the rows."""
    count = np.bincount(group[rows])
    return np.asarray(np.bincount(group[rows], values[rows] ** 2)[count > 0] / count[count > 0])


def _half_width(squares: Float1D, count: float, freedom: int, noise: float, rows: NDArray[np.bool_]) -> float:
    """Returns the half width of a band for a further member of a group.

    The mean of `count` members, from which each differs by a mean square (members,), leaves `freedom` degrees
    of freedom. `noise` is the variance of the difference from row to row of all `rows` (n,).
    """
    square, level = float(squares.mean()), 0.5 + 0.5 * BAND_LEVEL
    noise = min(noise, square)
    shared = (square - noise) * (count + 1.0) / (count - 1.0)
    by_row = scipy.special.stdtrit(np.count_nonzero(rows), level) * np.sqrt(noise)
    return float(np.hypot(scipy.special.stdtrit(freedom, level) * np.sqrt(shared), by_row))


def row_noise(
    position: Float1D, residual: Float1D, recording: NDArray[np.intp], rows: NDArray[np.bool_]
) -> float:
    """Returns the variance of the part of the residual that is independent from row to row [force^2].

    It is half the mean squared difference of neighbouring rows, in recorded order or in order of position;
    the smaller value is taken, because neighbours in one of them can be far apart.
    """
    squares, count = np.zeros(2), 0
    for number in np.unique(recording[rows]):
        own = rows & (recording == number)
        values = residual[own]
        ordered = values[np.argsort(position[own], kind="stable")]
        squares += [float(np.sum(np.diff(each) ** 2)) for each in (values, ordered)]
        count += len(values) - 1
    return 0.5 * float(squares.min()) / count if count > 0 else 0.0


def _filled(position: Float1D, half: Float1D, least: float) -> Float1D | None:
    """Returns half widths (k,) with unknown values taken from the known neighbours; None if all are
    unknown."""
    known = np.isfinite(half)
    if not known.any():
        return None
    return np.asarray(np.interp(position, position[known], np.maximum(half[known], least)))

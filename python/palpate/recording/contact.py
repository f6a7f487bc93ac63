# SPDX-License-Identifier: Apache-2.0
"""Position at which the tool meets the object."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from .._typing import Float1D
from ..verdict import FORCE_FLOOR
from .motion import (
    FORCE_RESOLUTION,
    LEAST_STROKE_ROWS,
    SIGNIFICANT_STANDARD_ERRORS,
    noise_of,
    resolution_of,
)


def air_rows(position: Float1D, force: Float1D, moving: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Returns True (n,) for rows before the contact of the tool; positions and forces (n,) are in recorded
    order, and `moving` (n,) is True where the tool moves."""
    air = position < contact_at(position[moving], force[moving])
    return np.asarray(air & (air & moving).any())


@np.errstate(over="ignore")  # huge forces are refused later
def contact_at(position: Float1D, force: Float1D) -> float:
    """Returns the smallest position at which the force of moving rows (n,) differs from the mean force at all
    smaller positions by more than its noise: there the tool meets the object. If it differs nowhere, or from
    the start, this is the smallest position.

    Rows that are neighbours in position are compared in blocks, as many as each has rows, by their mean and
    by their spread.
    """
    order = np.argsort(position, kind="stable")
    reach = float(np.ptp(force))
    if not 0.0 < reach < math.inf or len(force) < LEAST_STROKE_ROWS:
        return float(position.min())
    zero, force = -float(force.min()) / reach, (force - force.min()) / reach
    of_rows, resolution = noise_of(force), 0.5 * resolution_of(force)
    force = force[order]
    starts = np.linspace(0, len(force), math.isqrt(len(force)), endpoint=False).astype(np.intp)
    rows = np.diff(starts, append=len(force))
    spread = float(np.std(force[: rows[0]])) * (1.0 + SIGNIFICANT_STANDARD_ERRORS / math.sqrt(2.0 * rows[0]))
    noise = max(min(of_rows, spread), resolution, FORCE_RESOLUTION)
    total, before = np.add.reduceat(force, starts), np.append(0, np.cumsum(rows)[:-1])
    air = np.append(total[0] / rows[0], np.cumsum(total)[:-1] / before[1:])
    away = (force - np.repeat(air, rows)) / noise
    squares = np.add.reduceat(away**2, starts) - rows
    shift = np.abs(np.add.reduceat(away, starts)) / np.sqrt(rows * (1.0 + rows / np.fmax(before, 1)))
    apart = np.flatnonzero(np.fmax(shift, squares / np.sqrt(2.0 * rows)) > SIGNIFICANT_STANDARD_ERRORS)
    if not len(apart) or apart[0] < 2:
        return float(position.min())  # the second block already differs from the first one: there is no air
    first, of_air = starts[apart[0]], starts[apart[0] - 1]
    met = np.abs(away[first : first + rows[apart[0]]]) > SIGNIFICANT_STANDARD_ERRORS
    contact = int(first + np.argmax(met))
    # In air the force is constant, and zero. If it is not zero, its slope must change at the contact,
    # compared over the same way behind: the force of a magnet begins nowhere.
    position = position[order]
    from_air, force = position - position[:of_air].mean(), force - force[:of_air].mean()

    def slope(rows: slice) -> tuple[float, float]:
        """Returns the slope from the middle of the air to some rows, and its standard error."""
        squared = float(from_air[rows] @ from_air[rows])
        if squared == 0.0:
            return 0.0, math.inf
        return float(from_air[rows] @ force[rows]) / squared, noise / math.sqrt(squared)

    end = int(np.searchsorted(position, 2.0 * position[contact] - position[0], side="right"))
    (in_air, error), (behind, error_behind) = slope(slice(of_air)), slope(slice(contact, end))
    is_constant = abs(in_air) < SIGNIFICANT_STANDARD_ERRORS * error
    is_zero = abs(float(air[apart[0]]) - zero) < FORCE_FLOOR
    bends = abs(behind - in_air) > SIGNIFICANT_STANDARD_ERRORS * math.hypot(error, error_behind)
    return float(position[contact if is_constant and (is_zero or bends) else 0])

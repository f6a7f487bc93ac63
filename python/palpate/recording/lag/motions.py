# SPDX-License-Identifier: Apache-2.0
"""Motions of a recording between gaps of time: position, velocity and acceleration at the time of a lag."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
import scipy
from numpy.typing import NDArray

from ..._typing import Float1D
from ..motion import GAP_RATIO
from .force_lag import LONGEST_LAG_S, LONGEST_LEAD_S

if TYPE_CHECKING:
    from ..recording import Recording

DEGREE = 5
"""Degree of the polynomial that smooths a noisy position: a lower degree makes fast motions slower."""

HALF_WINDOWS = (4, 6, 8, 12, 18, 25, 50)
"""Half widths of the window that smooths a coarse position [rows]."""

MOST_ROUNDING_ERROR = 1.5
"""Largest noise of the position that counts as rounding error [standard deviations of a rounding error]."""

MOST_SMOOTHED = 1.5
"""Largest standard deviation of the part of the position that a smoothing window removes [standard deviations
of the noise]. A larger part is motion."""

SMOOTH_NOISE = 0.005
"""Largest standard deviation of the noise of a position step, after smoothing [share of the RMS step]."""

TURN_ROWS = 8
"""Least number of rows used on each side of a turn."""


@dataclass(frozen=True)
class Motion:
    """Rows of a recording between two gaps of time."""

    time: Float1D
    """(k,) [s]"""
    position: Float1D
    """(k,)"""
    rows: NDArray[np.intp]
    """Rows of the motion with a force whose position is known for every lag of the search"""
    force: Float1D
    """(k,) force of each row; NaN for a held-out row"""

    @property
    def force_known(self) -> Float1D:
        return np.asarray(self.force[self.rows])

    @cached_property
    def period(self) -> float:
        return float(np.median(np.diff(self.time)))

    @cached_property
    def noise(self) -> float:
        """Standard deviation of the noise of the position, from its third differences."""
        return float(np.median(np.abs(np.diff(self.position, 3)))) / (0.6745 * math.sqrt(20.0))

    @cached_property
    def is_coarse(self) -> bool:
        """True if the noise of the position is a rounding error. Other noise can be motion."""
        steps = np.abs(np.diff(self.position))
        step = float(np.min(steps, where=steps > 0.0, initial=np.inf))
        return self.noise <= MOST_ROUNDING_ERROR * step / math.sqrt(12.0)

    @cached_property
    def _half_window(self) -> int:
        """Half width of the window that smooths a coarse position [rows]; 0 for an exact or noisy one."""
        x = self.position
        limit = SMOOTH_NOISE * float(np.sqrt(np.mean(np.diff(x) ** 2)))
        if self.noise <= limit or not self.is_coarse:
            return 0

        chosen = 0
        for half in HALF_WINDOWS:
            window = 2 * half + 1
            if (
                2 * window > len(x)
                or np.std(x - scipy.signal.savgol_filter(x, window, DEGREE)) > MOST_SMOOTHED * self.noise
            ):
                break
            chosen = half
            if (
                self.noise * float(np.linalg.norm(scipy.signal.savgol_coeffs(window, DEGREE, deriv=1)))
                <= limit
            ):
                break
        return chosen

    def _smoothed(self, derivative: int) -> Float1D:

        return np.asarray(
            scipy.signal.savgol_filter(
                self.position, 2 * self._half_window + 1, DEGREE, deriv=derivative, delta=self.period
            )
        )

    @cached_property
    def smooth(self) -> Float1D:
        """Position without the noise of a coarse or noisy sensor."""
        return self._smoothed(0) if self._half_window else self.position

    @cached_property
    def velocity(self) -> Float1D:
        return self._smoothed(1) if self._half_window else np.gradient(self.position, self.time)

    @cached_property
    def acceleration(self) -> Float1D:
        return np.gradient(self.velocity, self.time)

    def at(self, late_s: float, values: Float1D, rows: NDArray[np.intp]) -> Float1D:
        """Returns values (k,) at the times of the given rows minus a lag."""
        return np.interp(self.time[rows] - late_s, self.time, values)


def motions_of(recording: Recording, most: int) -> list[Motion]:
    """Returns the motions of a recording that are long enough for the longest lag, with at most `most`
    rows."""
    motion = recording.motion
    assert motion.time is not None
    force = np.full(len(motion.time), np.nan)
    force[motion.rows] = recording.force
    time, position, force = motion.time[:most], motion.position[:most], force[:most]
    steps = np.diff(time)
    if not len(steps):
        return []
    edges = [0, *(np.flatnonzero(steps > GAP_RATIO * np.median(steps)) + 1).tolist(), len(time)]
    found = []
    for start, stop in pairwise(edges):
        t = time[start:stop]
        inside = (t >= t[0] + LONGEST_LAG_S) & (t <= t[-1] - LONGEST_LEAD_S)
        rows = np.flatnonzero(inside & np.isfinite(force[start:stop]))
        if len(rows) > 2 * TURN_ROWS:
            found.append(Motion(t, position[start:stop], rows, force[start:stop]))
    return found

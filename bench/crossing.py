# SPDX-License-Identifier: Apache-2.0
"""What no passive model can follow: rows where release was measured above press."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

import palpate

Array = NDArray[np.float64]
Rows = NDArray[np.bool_]

AT_TURN = 0.01
"""Share of the travel before its end where strokes turn."""


@dataclass(frozen=True)
class Crossing:
    """Of one recording with both strokes."""

    floor: float
    """NRMSE on some rows of the best force with h >= 0: both strokes as measured, and their mean where they
    cross. It was shown these very rows, noise and all."""
    above: float
    """How far release lies above press at most [force]"""
    at_turn: Rows
    """(n,) rows in the last hundredth of the travel"""

    @staticmethod
    def of(recording: palpate.Recording, judged: Rows) -> Crossing | None:
        """On the judged rows (n,); None where there are no two strokes."""
        x, direction, force = recording.position, recording.direction, recording.force
        if direction is None or not {-1, 1} <= set(direction.tolist()):
            return None
        press, release = (_stroke(recording, side) for side in (1, -1))
        both = (x >= max(press[0][0], release[0][0])) & (x <= min(press[0][-1], release[0][-1]))
        above = np.where(both, np.maximum(np.interp(x, *release) - np.interp(x, *press), 0.0), 0.0)
        floor = float(np.sqrt(np.mean(above[judged] ** 2))) / 2.0 / float(np.std(force[judged]))
        return Crossing(floor, float(above.max()), x > x.max() - AT_TURN * np.ptp(x))


def _stroke(recording: palpate.Recording, side: int) -> tuple[Array, Array]:
    """Distinct positions of one stroke and the mean forces there."""
    assert recording.direction is not None
    on = recording.direction == side
    places, where = np.unique(recording.position[on], return_inverse=True)
    return places, np.bincount(where, recording.force[on]) / np.bincount(where)

# SPDX-License-Identifier: Apache-2.0
"""Lag of a force from the rows around the turns of a motion at nearly one speed.

After a turn a late force still follows the previous stroke for the time of the lag. Around each turn, force
over position is a polynomial for each of the two strokes.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray

from ... import _core
from ..._typing import Float1D, Float2D
from ..motion import strokes_from_order
from .correlation import independent_share
from .force_lag import LONGEST_LAG_S, LONGEST_LEAD_S, NORMAL_QUANTILE, SAMPLING_ERROR, ForceLag, unknown
from .motions import TURN_ROWS, Motion

LEAST_TURN_CERTAINTY = 40.0
"""Least F statistic of the best lag against the median lag around turns [-]. Several play radii and lags are
tried, and noise favours the best of them."""

NO_BEND_AT_TURNS = "the force changes too little around the turns for its noise"
"""Text of the reason that the turns of a motion do not determine the lag."""

MISSED_TURN_ERROR = 0.3
"""Standard error of the time of a turn between two samples [sample periods], as of a uniform error."""

TURN_S = 0.15
"""Least time used on each side of a turn [s]."""

TURN_DEGREES = (3, 2)
"""Degrees of the polynomials of force and hysteresis over position around a turn."""

TURN_RADII = (0.0, 0.001, 0.002, 0.004, 0.008, 0.016, 0.032)
"""Play radii of the direction state that are tried around turns [share of the travel]."""

STATE_ROWS = 1000
"""Number of rows before a turn from which its direction state is computed."""

MOST_TURNS = 50
"""Largest number of turns that are used; of more turns an evenly spread part is used."""

TURN_STEP_S = 5e-4
"""Step of the lags that are tried at turns [s]."""


def lag_of_turns(parts: Sequence[Motion]) -> ForceLag:
    """Returns the lag from the rows around the turns of a motion at nearly one speed."""
    turns = [turn for part in parts for turn in _turns(part)]
    turns = turns[:: -(-len(turns) // MOST_TURNS) or 1]
    if not turns:
        return unknown("the speed is nearly constant, and no turn is recorded without a gap of time")
    lags = np.arange(-LONGEST_LEAD_S, LONGEST_LAG_S + TURN_STEP_S / 2, TURN_STEP_S)
    travel = float(np.ptp(np.concatenate([part.position for part in parts])))
    fits = [[turn.residuals(lags, radius * travel) for turn in turns] for radius in TURN_RADII]
    rss = np.array([sum(np.sum(residual**2, axis=1) for residual in each) for each in fits])
    best_radius, best = (int(each) for each in np.unravel_index(int(np.argmin(rss)), rss.shape))
    found = [residual[best] for residual in fits[best_radius]]
    freedom = sum(map(len, found)) - len(turns) * (sum(TURN_DEGREES) + 2) - 2
    least = float(rss[best_radius, best])
    if freedom < 2 or not least > 0.0:
        return unknown("too few rows are recorded around the turns")
    share = float(np.mean([independent_share(residual, sum(TURN_DEGREES) + 2) for residual in found]))
    allowed = rss.min(axis=0) <= least * (1.0 + _f_quantile(freedom) / (share * freedom))
    period = max(turn.part.period for turn in turns)
    missed = math.sqrt(sum(not turn.is_held for turn in turns)) / len(turns)
    extra = NORMAL_QUANTILE * period * math.hypot(SAMPLING_ERROR, MISSED_TURN_ERROR * missed)
    name = f"{len(turns)} turn{'s' * (len(turns) > 1)}"
    lower, upper = float(lags[allowed].min()) - extra, float(lags[allowed].max()) + extra
    certainty = (float(np.median(rss.min(axis=0))) / least - 1.0) * share * freedom
    reason = "" if certainty >= LEAST_TURN_CERTAINTY else NO_BEND_AT_TURNS
    return ForceLag(float(lags[best]), lower, upper, name, reason)


def _f_quantile(freedom: float) -> float:
    """Returns the 95 % quantile of the F distribution with 1 and `freedom` degrees of freedom."""
    return float(scipy.special.fdtri(1.0, freedom, 0.95))


@dataclass(frozen=True)
class _Turn:
    """Turn of a motion, with the rows around it."""

    part: Motion
    row: int
    """Last row before the position changes in the new direction"""
    rows: NDArray[np.intp]

    @property
    def is_held(self) -> bool:
        """True if two rows have the position of the turn, so that its time is known."""
        x = self.part.position
        return bool(self.row > 0 and x[self.row - 1] == x[self.row])

    def residuals(self, lags: Float1D, radius: float) -> Float2D:
        """Returns the residuals (lags, rows) of force and hysteresis as polynomials of the position, for each
        lag and one play radius [position]; the direction state changes at once for radius 0."""
        part, rows = self.part, self.rows
        at = part.time[rows] - lags[:, None]
        x = np.interp(at, part.time, part.position) - part.position[self.row]
        x = x / (float(np.ptp(part.position[rows])) or 1.0)
        s = np.where(at <= part.time[self.row], 1.0, -1.0)
        if radius:
            around = slice(max(0, int(rows[0]) - STATE_ROWS), int(rows[-1]) + 1)
            position = np.ascontiguousarray(part.position[around])
            state = (position - _core.model.play(position, radius, start=float(position[0]))) / radius
            s = np.interp(at, part.time[around], np.clip(state, -1.0, 1.0))
        degree_f, degree_h = TURN_DEGREES
        columns = np.stack(
            [x**power for power in range(degree_f + 1)] + [s * x**power for power in range(degree_h + 1)],
            axis=-1,
        )
        orthogonal = np.linalg.qr(columns).Q
        force = part.force[rows]
        fitted = orthogonal @ (np.swapaxes(orthogonal, 1, 2) @ force)[:, :, None]
        return np.asarray(force - fitted[:, :, 0])


def _turns(part: Motion) -> list[_Turn]:
    """Returns the turns of a motion with enough rows on both sides."""
    direction = strokes_from_order(part.position)
    if direction is None:
        return []
    moving = np.flatnonzero(direction)
    changed = np.flatnonzero(np.diff(direction[moving]))
    found = []
    half = max(TURN_ROWS, math.ceil(TURN_S / part.period))
    for last, first in zip(moving[changed].tolist(), moving[changed + 1].tolist(), strict=True):
        if first - last > half:
            continue  # a hold is longer than the window
        rows = part.rows[(part.rows >= last - half) & (part.rows <= first + half)]
        if min(np.count_nonzero(rows <= last), np.count_nonzero(rows >= first)) >= TURN_ROWS - 1:
            end = first - 1
            while end + 1 < len(part.position) and part.position[end + 1] == part.position[last]:
                end += 1
            found.append(_Turn(part, end, rows))
    return found

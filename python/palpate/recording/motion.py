# SPDX-License-Identifier: Apache-2.0
"""Motion of a recording: direction of strokes, pieces on an even time grid, derivatives without delay.

Velocity and acceleration are central differences, which have no phase. A low-pass L without phase limits
their noise. For the velocity as an input, and for the regression of mass and damping, L is two real poles,
forward and backward: |L| = 1 / (1 + (w/w_c)^2)^2, which does not overshoot. For the forces of mass and
damping, L is that of a quintic smoothing spline: L = 1 / (1 + (w/w_c)^6), which is flat below w_c
(Woltring 1986).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
import scipy
from numpy.typing import NDArray

from .._core.dynamics import TransferFunction
from .._core.model import play
from .._typing import Float1D, Int8Vector
from ..errors import InputError

if TYPE_CHECKING:
    from .recording import Recording

FORCE_RESOLUTION = 2.0**-16
"""Force error below which errors are ignored [share of the range of the force]: one step of a 16-bit
converter. A simulated force has no noise, so that a criterion would add wavelets until the error is a
rounding error."""

SIGNIFICANT_STANDARD_ERRORS = 5.0
"""A correlation of neighbouring residuals, or a difference of mean forces, is not random if it exceeds this
number of standard errors."""

TURN_SHARE = 0.02
"""Least motion against the stroke that reverses the stroke, as a share of the position range [-]."""

TURN_NOISE = 8.0
"""Least motion back that counts as a reversal, in standard deviations of the position noise [-].

Noise alone moves the position back by less.
"""

TURN_STEPS = 1.5
"""Least motion back that counts as a reversal, in steps of a quantised position [-].

A position that alternates between two neighbouring steps moves back by less.
"""

LARGEST_TURN = 0.4
"""Largest least motion back, as a share of the position range [-].

If noise or steps require more, reversals cannot be distinguished from noise.
"""

GRID_STEPS = 8.0
"""Grid steps in the least motion against a stroke that reverses the stroke [-].

To find reversals, positions are rounded to this grid.
"""

MOST_DIFFERENCES = 100_000
"""Approximate largest number of differences of adjacent positions from which the noise is estimated."""

LEAST_STROKE_ROWS = 4
"""Least number of rows between two reversals; fewer rows are a jump, for example between two strokes."""

JUMPING_SHARE = 0.1
"""If a larger share of the rows is in jumps of position, the rows are not ordered in time [-]."""


def strokes_from_order(position: Float1D) -> Int8Vector | None:
    """Returns the direction of each row from the order of rows.

    A stroke ends at the first row at its extreme position. The motion back must exceed the noise, the
    resolution and 2 % of the travel.

    Parameters
    ----------
    position : (n,) array
        Positions in the recorded order, growing into the object.

    Returns
    -------
    (n,) array of int8 or None
        +1 into the object, -1 out of it, 0 in a jump. All rows have one direction if the position never
        turns back. None if the rows have no order, are too few, or do not move.
    """
    travel = float(np.ptp(position)) if len(position) > LEAST_STROKE_ROWS else 0.0
    if not 0.0 < travel < np.inf:
        return None
    x = np.asarray((position - position.min()) / travel)
    turn = max(TURN_SHARE, TURN_NOISE * noise_of(x), TURN_STEPS * resolution_of(x))
    if turn > LARGEST_TURN:
        return None
    direction = np.zeros(len(x), dtype=np.int8)
    begin, jumping = 0, 0
    ends = _stroke_ends(x, turn)
    for end, sign in ends:
        if end - begin + 1 < LEAST_STROKE_ROWS:
            jumping += end - begin
            begin = end
            continue
        last = len(x) - 1 if end == ends[-1][0] else end
        direction[begin : last + 1] = sign
        begin = last + 1
    if jumping > JUMPING_SHARE * len(x) or not direction.any():
        return None
    return direction


def ordered_strokes(recording: Recording) -> Int8Vector | None:
    """Returns the direction of the rows (n,) of a recording from the order of all rows of its motion."""
    motion = recording.motion
    direction = strokes_from_order(motion.position)
    return None if direction is None else direction[motion.rows]


def directions_of(recording: Recording) -> Int8Vector | None:
    """Returns the directions (n,) that a recording states, else those of the order of its rows."""
    return ordered_strokes(recording) if recording.direction is None else recording.direction


def states_its_order(recording: Recording) -> bool:
    """Returns True if the stated directions are those of the order of rows: they name each stroke as most of
    its rows do. The rows are then in the order of a motion, which shows more than their directions."""
    direction, ordered = recording.direction, ordered_strokes(recording)
    if direction is None or ordered is None:
        return False
    stroke = np.cumsum(np.diff(ordered, prepend=0) != 0)
    agreed = np.bincount(stroke, direction * ordered, minlength=1)
    return bool((agreed[np.unique(stroke[ordered != 0])] > 0).all())


def cycles_of(recording: Recording) -> list[slice]:
    """Returns the rows of each cycle of a recording: a press and the release behind it, with their holds.

    Without a column of directions they are those of the order of rows.
    """
    direction = directions_of(recording)
    if direction is None:
        return []
    moving = np.flatnonzero(direction)
    begins = moving[1:][np.diff(direction[moving]) > 0]
    edges = [0, *begins.tolist(), len(direction)]
    return [slice(first, stop) for first, stop in pairwise(edges)]


def turns_of(direction: Int8Vector) -> int:
    """Returns the number of sign changes of the direction (n,)."""
    moving = direction[direction != 0]
    return int(np.count_nonzero(moving[1:] != moving[:-1]))


def noise_of(x: Float1D) -> float:
    """Returns the standard deviation of the noise of positions or forces (n,) from their sixth differences; 0
    for fewer than seven rows.

    A motion leaves almost nothing in them, and reversals are too few to change their median. A motion in one
    direction that is rounded to steps has no noise.
    """
    if len(x) < 7:
        return 0.0
    every = max(1, len(x) // MOST_DIFFERENCES)
    differences = np.abs(np.diff(x, 6))[::every]
    changes = np.lib.stride_tricks.sliding_window_view(np.diff(x), 6)[::every]
    one_way = (changes.min(axis=1) >= 0.0) | (changes.max(axis=1) <= 0.0)
    # Rounding moves each value by at most half a step, and the coefficients of a sixth difference sum to 64.
    differences[one_way & (differences <= 32.0 * resolution_of(x))] = 0.0
    return float(np.median(differences)) / (0.6745 * math.sqrt(math.comb(12, 6)))


def resolution_of(x: Float1D) -> float:
    """Returns the smallest change of position between adjacent rows that is not a rounding error."""
    steps = np.abs(np.diff(x))
    return float(np.min(steps[steps > 1e-9], initial=np.inf))


def _stroke_ends(x: Float1D, turn: float) -> list[tuple[int, int]]:
    """Returns last row and direction of each stroke. A motion back by more than `turn` ends a stroke."""
    # Rounded to a grid, even noisy positions have few local extremes, so few rows must be examined.
    grid = np.rint(x * (GRID_STEPS / turn))
    steps = np.diff(grid)
    moves = np.flatnonzero(steps)
    up = steps[moves] > 0.0
    rows = [0, *moves[1:][up[1:] != up[:-1]].tolist(), len(x) - 1]
    ends: list[tuple[int, int]] = []
    low = high = (0, float(grid[0]))
    sign = 0
    for row, place in zip(rows, grid[rows].tolist(), strict=True):
        if place > high[1]:
            high = row, place
        if place < low[1]:
            low = row, place
        if sign <= 0 and place - low[1] > GRID_STEPS:
            if sign < 0:
                ends.append((low[0], -1))
            sign, high = 1, (row, place)
        elif sign >= 0 and high[1] - place > GRID_STEPS:
            if sign > 0:
                ends.append((high[0], 1))
            sign, low = -1, (row, place)
    ends.append((high[0], 1) if sign > 0 else (low[0], -1))
    exact: list[tuple[int, int]] = []
    start = 0
    for (_, sign), (stop, _) in pairwise([*ends, (len(x) - 1, 0)]):
        start += int(np.argmax(sign * x[start : stop + 1]))
        exact.append((start, sign))
    return exact


SLOW_RATIO = 0.05
"""Speed of a wait over the speed of the motion around it [-]. A hand that turns is slower than this in less
than 1 % of the time and of the travel."""

SECTIONS, LEAST_SECTION_ROWS = 16, 32
"""Number of sections of a recording, and least number of rows of a section, of which the one with the most
position noise decides: a position can have noise only while the tool waits."""

STEP = 0.0025
"""Distance over which a speed of the motion is taken, unless the noise needs more [share of the travel]."""

STEPS_AROUND = 8
"""Number of distances before a row, and after it, whose median speeds are the speed of the motion around
it."""

SHORT_WAY = 0.01
"""Distance without weight in a fit [share of the travel]: the tool would travel further during a wait that is
left out, and can move further in a gap of time."""


def noise_band(x: Float1D) -> float:
    """Returns the width within which noise and resolution move positions (n,) in recorded order."""
    sections = np.array_split(x, max(1, min(SECTIONS, len(x) // LEAST_SECTION_ROWS)))
    step = resolution_of(x)
    return max(TURN_NOISE * max(noise_of(section) for section in sections), TURN_STEPS * step)


def waits(position: Float1D, time: Float1D | None = None) -> NDArray[np.bool_] | None:
    """Returns True (n,) for rows at which the tool waits; positions (n,) are in recorded order. Returns None
    if the rows are not in the order of a motion. Without `time` (n,), rows have equal distances in time.

    The distance that the tool has travelled is that of a play operator as wide as the noise, which noise does
    not move. The speed around a row is the smaller one of the median speeds of `STEPS_AROUND` distances
    before it and after it, which a wait among them does not change.
    """
    if strokes_from_order(position) is None:
        return None
    x = (position - position.min()) / float(np.ptp(position))
    band = noise_band(x)
    travelled = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(play(x, 0.5 * band, start=x[0]))))])
    tick = np.arange(len(x), dtype=np.float64)
    if time is not None:
        tick = (time - time[0]) / float(np.median(np.diff(time)))
    step = max(STEP, 2.0 * band)
    if travelled[-1] <= 2 * STEPS_AROUND * step:
        return np.zeros(len(x), dtype=bool)
    # Start and end of each step of distance: interpolated, because a row can travel several steps.
    moved, at_row = np.unique(travelled, return_index=True)
    reached = np.interp(np.arange(0.0, travelled[-1], step), moved, tick[at_row])
    ticks = np.diff(reached, append=tick[-1])
    around = np.pad(ticks, STEPS_AROUND, constant_values=np.nan)
    windows = np.lib.stride_tricks.sliding_window_view(around, STEPS_AROUND)
    typical = np.full(len(windows), np.nan)  # unknown at the start and at the end of the motion
    known = np.count_nonzero(np.isfinite(windows), axis=1)
    enough = known >= max(1, min(STEPS_AROUND // 2, len(ticks) - 1))
    typical[enough] = np.nanmedian(windows[enough], axis=1)
    nearby = np.fmax(typical[: len(ticks)], typical[-len(ticks) :])
    nearby = np.maximum(np.nan_to_num(nearby, nan=1.0), np.finfo(float).tiny)
    speed = step / nearby[np.minimum((travelled / step).astype(np.int64), len(ticks) - 1)]
    row = np.arange(len(x))
    before = np.maximum(row - 1, 0)

    def is_slow(first: NDArray[np.intp], last: NDArray[np.intp]) -> NDArray[np.bool_]:
        return np.asarray(
            travelled[last] - travelled[first] < SLOW_RATIO * speed * (tick[last] - tick[first])
        )

    # Speed is taken back to the last row that is far enough, at least to the row before.
    first = np.searchsorted(tick, tick - 2.0 * band / speed, side="right") - 1
    slow = is_slow(np.maximum(np.minimum(first, row - 1), 0), row)
    slow[0] = slow[1]
    # A tool that trembles within the noise while it waits is slow over a longer way.
    longer = band / SLOW_RATIO / speed
    last = np.searchsorted(tick, tick[before] + longer, side="right") - 1
    waiting = (
        slow | is_slow(np.searchsorted(tick, tick - longer), row) | is_slow(before, np.maximum(last, row))
    )
    found = np.zeros(len(x), dtype=bool)
    for begin, end in np.flatnonzero(np.diff(waiting, prepend=False, append=False)).reshape(-1, 2).tolist():
        rows = begin + np.flatnonzero(slow[begin:end])
        if not len(rows):
            continue
        begin, end = int(rows[0]), int(rows[-1]) + 1
        # The tool stops between two rows: the last row that moves less than half of a step waits as well.
        moved_there = travelled[begin - 1] - travelled[begin - 2]
        stopped = begin > 1 and moved_there < 0.5 * speed[begin - 1] * (tick[begin - 1] - tick[begin - 2])
        # Speed is taken over some rows: the wait begins behind the row with which the tool arrives.
        first_row = min(begin - int(stopped), int(np.searchsorted(travelled, travelled[begin])) + 1)
        # One slow row is a turn between two rows.
        lasting = tick[end - 1] - tick[first_row] + 1.0
        found[first_row:end] = end - first_row > 1 and lasting * speed[begin:end].max() >= SHORT_WAY
    return found


GAP_RATIO = 2.5
"""Ratio of a time step to the median time step above which the time step can be a gap of the recording.

Derivatives and filters are not computed across a gap.
"""


def gaps_of(time: Float1D, position: Float1D) -> NDArray[np.intp]:
    """Returns the indices of the rows after which a motion (n,) continues beyond a gap of time.

    The tool can move far in a gap, at the speed around it: a recorder that stores a row for each change of
    position or force leaves no gap.
    """
    steps = np.diff(time)
    if not len(steps):
        return np.empty(0, dtype=np.intp)
    speed = np.abs(np.diff(position)) / steps
    around = np.maximum(speed, np.maximum(np.append(speed[1:], 0.0), np.insert(speed[:-1], 0, 0.0)))
    moved = around * steps > SHORT_WAY * float(np.ptp(position))
    return np.flatnonzero((steps > GAP_RATIO * np.median(steps)) & moved) + 1


LARGEST_STEP_DEVIATION = 0.01
"""Rows between two gaps are resampled if a time step differs from the period by more than this share."""

MARGIN_TIME_CONSTANTS = 3.0
"""Duration of the inaccurate results that are removed at both ends of a low-passed signal.

It is in time constants 2/w_c of the low-pass filter, with the cutoff frequency w_c.
"""

HIGHEST_CUTOFF = 0.25
"""Highest cutoff frequency of the low-pass that is tried [rad/time step]; a higher one would not filter."""

NOISE_SHARE = 0.01
"""Accepted share of position noise in the variance of a low-passed velocity or acceleration."""

CUTOFF_RATIO = 0.85
"""Each tried cutoff frequency of the low-pass is the previously tried one times this factor [-]."""

LEAST_TIME_CONSTANTS = 200.0
"""Least duration of a recording that may be low-passed with the cutoff w_c [rad/s], in units of 1/w_c."""


@dataclass(frozen=True)
class Piece:
    """Rows of a recording between two gaps in time, with an even time grid."""

    rows: slice
    """Rows of the recording between the two gaps"""
    time: Float1D
    """(k,) [s]"""
    position: Float1D
    force: Float1D
    row_time: Float1D
    """(rows,) [s]"""
    period: float
    """Time step of the even time grid [s]"""
    even: bool
    """True if the grid times are the times of the rows; False if values are interpolated between the rows"""

    def on_grid(self, values: Float1D) -> Float1D:
        """Returns values, given at the rows of the recording, interpolated to the even time grid."""
        return values if self.even else np.interp(self.time, self.row_time, values)

    def at_rows(self, values: Float1D) -> Float1D:
        """Returns values, given on the even time grid, interpolated to the rows of the recording."""
        return values if self.even else np.interp(self.row_time, self.time, values)

    @property
    def velocity(self) -> Float1D:
        """Velocity (k,) on the even time grid: central difference of the position [position/s]"""
        return velocity_of(self.position, self.period)

    @property
    def acceleration(self) -> Float1D:
        """Acceleration (k,) on the even time grid: second central difference of position [position/s^2]"""
        return acceleration_of(self.position, self.period)


@dataclass(frozen=True)
class LowPass:
    """Low-pass L, two real poles, which runs over a signal forward and then backward, so it has no delay."""

    cutoff: float
    """Cutoff frequency w_c [rad/s]"""

    def margin(self, period: float) -> int:
        """Returns the number of samples at each end of a filtered signal that are inaccurate."""
        return math.ceil(2.0 * MARGIN_TIME_CONSTANTS / (self.cutoff * period))

    def __call__(self, signal: Float1D, period: float) -> Float1D:
        """Returns the low-passed signal (k,) without delay. The signal is first mirrored at both ends."""
        pole = math.exp(-self.cutoff * period)
        response = TransferFunction([(1.0 - pole) ** 2, 0.0, 0.0], [1.0, -2.0 * pole, pole * pole])
        mirrored = min(len(signal) - 1, self.margin(period))
        wide = np.concatenate([signal[mirrored:0:-1], signal, signal[-2 : -mirrored - 2 : -1]])
        for _ in range(2):
            start = wide[0]
            wide = (start + response.filter(np.ascontiguousarray(wide - start)))[::-1]
        return wide[mirrored : mirrored + len(signal)]


@dataclass(frozen=True)
class SplineLowPass(LowPass):
    """Low-pass of a quintic smoothing spline. It multiplies the cosine series of a signal, which mirrors both
    ends."""

    def gain(self, frequency: Float1D) -> Float1D:
        """Returns the gain L (k,) at frequencies (k,) [rad/s]."""
        square = (frequency / self.cutoff) ** 2
        return 1.0 / (1.0 + square * square * square)

    def __call__(self, signal: Float1D, period: float) -> Float1D:
        series = scipy.fft.dct(signal, norm="ortho") * self.gain(_phases(len(signal)) / period)
        return np.asarray(scipy.fft.idct(series, norm="ortho"), dtype=np.float64)


def _phases(n: int) -> Float1D:
    """Returns the frequencies (n,) of the cosine series of n samples [rad/time step]."""
    return np.pi / n * np.arange(n, dtype=np.float64)


def pieces(recording: Recording) -> list[Piece]:
    """Divides the recording at its gaps in time; the grid step of each piece is the median time step.

    Positions include held-out rows; forces are those of the recording's rows only.

    Raises
    ------
    InputError
        The recording has no time.
    """
    motion = recording.motion
    if recording.time is None or motion.time is None or len(motion.time) < 2:
        raise InputError(
            "velocity needs time, and the recording has no time: name its column with --time, or record time"
        )
    steps = np.diff(motion.time)
    period = float(np.median(steps))
    edges = [0, *gaps_of(motion.time, motion.position), len(motion.time)]
    found = []
    for start, stop in pairwise(edges):
        first, last = np.searchsorted(motion.rows, [start, stop])
        if first == last:
            continue
        rows = slice(int(first), int(last))
        at, position = motion.time[start:stop], motion.position[start:stop]
        row_time, force = recording.time[rows], recording.force[rows]
        even = bool(np.all(np.abs(np.diff(at) - period) <= LARGEST_STEP_DEVIATION * period))
        whole = last - first == stop - start
        grid = at
        if not even:
            grid = at[0] + period * np.arange(int((at[-1] - at[0]) / period + 1e-9) + 1)
            position = np.interp(grid, at, position)
        if not (even and whole):
            force = np.interp(grid, row_time, force)
        found.append(Piece(rows, grid, position, force, row_time, period, even and whole))
    return found


def velocity_of(position: Float1D, period: float) -> Float1D:
    """Returns the velocity: central difference of the position (k,), one-sided at both ends."""
    return np.gradient(position, period) if len(position) > 1 else np.zeros_like(position)


def acceleration_of(position: Float1D, period: float) -> Float1D:
    """Returns the acceleration: second central difference of the position (k,), repeated at both ends."""
    if len(position) < 3:
        return np.zeros_like(position)
    inner = np.diff(position, 2) / period**2
    return np.concatenate([inner[:1], inner, inner[-1:]])


LONGEST_LAG_S = 0.1
"""Longest lag of a force that is searched, and advised to be corrected [s]"""


def position_noise(parts: Sequence[Piece]) -> float | None:
    """Returns the variance of the noise of the position; None for a too short motion.

    It is that of sixth differences of the position, because a hand's motion leaves almost nothing in them.
    """
    sixth = [np.diff(part.position, 6) for part in parts if len(part.position) > 6]
    return float(np.mean(np.concatenate(sixth) ** 2)) / math.comb(12, 6) if sixth else None


def quiet_low_pass(parts: Sequence[Piece], *, order: int) -> LowPass | None:
    """Returns the low-pass with the highest cutoff that leaves at most NOISE_SHARE of noise in a derivative;
    None without one, or if an acceleration is not above this share between the turns of the tool.

    The noise of the derivative follows from the impulse response of both filters. Between turns at constant
    speed there is nothing else, and at the turns friction reverses too.
    """
    if (noise := position_noise(parts)) is None:
        return None
    derive = (velocity_of, acceleration_of)[order - 1]
    duration = sum(part.period * len(part.time) for part in parts)
    low_pass = LowPass(HIGHEST_CUTOFF / parts[0].period)
    while low_pass.cutoff * duration > LEAST_TIME_CONSTANTS:
        moving = long_enough(parts, low_pass)
        if not moving:
            return None
        margins = [low_pass.margin(part.period) for part in moving]
        squares = [
            low_pass(derive(part.position, part.period), part.period)[margin:-margin] ** 2
            for part, margin in zip(moving, margins, strict=True)
        ]
        period, accepted = parts[0].period, NOISE_SHARE * float(np.mean(np.concatenate(squares)))
        impulse = np.zeros(2 * low_pass.margin(period) + 5)
        impulse[len(impulse) // 2] = 1.0
        passed = float(np.sum(low_pass(derive(impulse, period), period) ** 2))
        if noise * passed <= accepted:
            if order == 1:
                return low_pass
            of_parts = zip(moving, margins, squares, strict=True)
            between = np.concatenate(
                [
                    square[~_near_turns(part.position, margin)[margin:-margin]]
                    for part, margin, square in of_parts
                ]
            )
            return low_pass if not len(between) or np.mean(between) > accepted else None
        low_pass = LowPass(CUTOFF_RATIO * low_pass.cutoff)
    return None


def _near_turns(position: Float1D, rows: int) -> NDArray[np.bool_]:
    """Returns True (k,) for the rows of a motion (k,) with a turn among a number of rows before or behind."""
    direction = strokes_from_order(position)
    near = np.zeros(len(position), dtype=bool)
    for turn in [] if direction is None else np.flatnonzero(np.diff(direction)).tolist():
        near[max(turn - rows, 0) : turn + rows + 2] = True
    return near


def least_error_low_pass(parts: Sequence[Piece], *, order: int) -> SplineLowPass | None:
    """Returns the low-pass with the least expected error of a derivative, of those that leave at most
    NOISE_SHARE of noise in it; None without one.

    The expected squared error of the estimate L y is (1 - L)^2 y^2 + (2 L - 1) N, for a signal y with noise
    of the variance N (Mallows 1973).
    """
    if (variance := position_noise(parts)) is None:
        return None
    period, power, noise, phases = parts[0].period, [], [], []
    for part in parts:
        # Noise that is cut off at an end has every frequency, therefore the window.
        window, phase = np.hanning(len(part.time)), _phases(len(part.time))
        derived = window * (part.velocity, part.acceleration)[order - 1]
        power.append(scipy.fft.dct(derived, norm="ortho") ** 2)
        gain = np.sin(phase) if order == 1 else 2.0 - 2.0 * np.cos(phase)
        noise.append(np.mean(window**2) * gain**2)
        phases.append(phase)
    y, w = np.concatenate(power), np.concatenate(phases) / period
    n = np.concatenate(noise) * variance / period ** (2 * order)
    found, least = None, math.inf
    low_pass = SplineLowPass(math.pi / period)
    while long_enough(parts, low_pass):
        gain = low_pass.gain(w)
        error = float(np.sum((1.0 - gain) ** 2 * y + (2.0 * gain - 1.0) * n))
        if error < least and gain**2 @ n <= NOISE_SHARE * float(gain**2 @ y):
            found, least = low_pass, error
        low_pass = SplineLowPass(CUTOFF_RATIO * low_pass.cutoff)
    return found


def long_enough(parts: Sequence[Piece], low_pass: LowPass) -> list[Piece]:
    """Returns the pieces that are longer than their inaccurate samples at both ends after the low-pass."""
    return [part for part in parts if len(part.time) > 2 * low_pass.margin(part.period) + 2]


def at_rows(
    parts: Sequence[Piece], low_pass: LowPass | None, order: int, n: int
) -> tuple[Float1D, NDArray[np.bool_]]:
    """Returns the low-passed velocity (order 1) or acceleration (order 2) at the n rows of the pieces (n,),
    and True if it is accurate (n,)."""
    result, defined = np.zeros(n), np.zeros(n, dtype=np.bool_)
    if low_pass is None:
        return result, defined
    for part in long_enough(parts, low_pass):
        margin = low_pass.margin(part.period)
        derived = (part.velocity, part.acceleration)[order - 1]
        result[part.rows] = part.at_rows(low_pass(derived, part.period))
        first, last = part.time[margin], part.time[len(part.time) - 1 - margin]
        defined[part.rows] = (part.row_time >= first) & (part.row_time <= last)
    return result, defined


def velocities(recordings: Sequence[Recording]) -> list[tuple[Float1D, NDArray[np.bool_]]]:
    """Returns the velocity [position unit per second] of each row (n,) of each recording as an input, and
    True for rows that have one (n,). All recordings have the same low-pass.

    Raises
    ------
    InputError
        A recording has no time, or the positions are too noisy or too short to differentiate.
    """
    return _derivatives(recordings, 1, quiet_low_pass)


def velocity(recording: Recording) -> tuple[Float1D, NDArray[np.bool_]]:
    """Returns the :func:`velocities` of one recording."""
    return velocities([recording])[0]


def derivative(recording: Recording, order: int) -> tuple[Float1D, NDArray[np.bool_]]:
    """Returns the velocity (order 1) or acceleration (order 2) of each row (n,) with the least expected
    error, and True for rows that have one (n,).

    It raises the same errors as :func:`velocities`.
    """
    return _derivatives([recording], order, least_error_low_pass)[0]


def _derivatives(
    recordings: Sequence[Recording], order: int, choose: Callable[..., LowPass | None]
) -> list[tuple[Float1D, NDArray[np.bool_]]]:
    parts = [pieces(recording) for recording in recordings]
    low_pass = choose([part for each in parts for part in each], order=order)
    if low_pass is None:
        raise InputError(
            f"the {('velocity', 'acceleration')[order - 1]} cannot be computed from "
            f"{sum(map(len, recordings))} rows: the pieces between gaps in time are too short, or the noise "
            "of the position is too large. Record whole strokes without gaps in time, with more rows in each"
        )
    return [
        at_rows(each, low_pass, order, len(recording))
        for each, recording in zip(parts, recordings, strict=True)
    ]

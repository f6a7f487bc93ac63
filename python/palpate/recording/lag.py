# SPDX-License-Identifier: Apache-2.0
"""Lag of a recorded force behind its position, with a 95 % confidence interval.

A force that is late by tau belongs to the position of the time tau earlier: F(t) = f(x(t - tau)). At speed v
it differs by about -tau v f'(x) from the force at x(t). Hysteresis and damping of the object change the force
too, by s h(x), with the direction state s, and by v B(x). Where f bends sharply, f' changes within a short
distance, and B does not. The regression therefore fits, for each tried tau,

    F(t) = f(x) + s h(x) + v B(x) + m a,   all at the time t - tau,

with splines f, h and B. It needs different speeds: at one speed, s h and v B are equal.

At one speed only the turns count. After a turn a late force still follows the previous stroke for the time
tau. Around each turn, force over position is a polynomial for each of the two strokes.

The residuals are correlated in time, for example those of a force that an instrument averages. The interval
uses this correlation (Newey and West 1987).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise, product
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BSpline
from scipy.signal import savgol_coeffs, savgol_filter
from scipy.sparse import csr_array
from scipy.special import fdtri

from .. import _core
from .._typing import Float1D, Float2D
from .motion import GAP_RATIO, strokes_from_order

if TYPE_CHECKING:
    from .recording import Recording

LONGEST_LAG_S = 0.1
"""Longest lag of a force that is searched and advised to be corrected [s]"""

LONGEST_LEAD_S = 0.02
"""Longest time by which a force may be ahead of its position in the search [s]. A lag near 0 then has an
interval on both sides of 0."""

LAG_DIGITS = 5
"""Number of decimals to which a lag in seconds is rounded before it is corrected: 10 microseconds."""

LARGEST_ERROR_S = 0.01
"""Largest half width of the confidence interval of a lag that counts as known [s]."""

LEAST_SPEED_SPREAD = 0.19
"""Least standard deviation of the speed along the motion divided by the mean speed [-], below which only the
turns of a recording are used."""

MOST_ROWS = 5000
"""Largest number of rows in the regression of strokes; of more rows an evenly spread part is used."""

MOST_MOTION_ROWS = 100_000
"""Largest number of rows of motions that are used; later motions are left out."""

MOST_STATES = 8
"""Largest number of kept direction states of all rows."""

MOST_FIRST_ROWS = 1500
"""Largest number of rows in the search of the first lag and play radius; of more rows an evenly spread part
is used."""

LEAST_ROWS = 100
"""Least number of rows for the regression of strokes."""

LEAST_CERTAINTY = 10.0
"""Least certainty of the derivative of the force over the lag [-]: the usual bound of weak instruments"""

NO_BEND = "the force bends too little for its noise, so that a lag looks like damping"
"""Text of the reason that strokes at different speeds do not determine the lag."""

LEAST_TURN_CERTAINTY = 40.0
"""Least F statistic of the best lag against the median lag around turns [-]. Several play radii and lags are
tried, and noise favours the best of them."""

NO_BEND_AT_TURNS = "the force changes too little around the turns for its noise"
"""Text of the reason that the turns of a motion do not determine the lag."""

NORMAL_QUANTILE = 1.96
"""Half width of the 95 % confidence interval of a normal variable [standard deviations]."""

SAMPLING_ERROR = 0.03
"""Standard error of a lag from positions between two samples, which are interpolated [sample periods]."""

MISSED_TURN_ERROR = 0.3
"""Standard error of the time of a turn between two samples [sample periods], as of a uniform error."""

FIRST_LAGS = 13
"""Number of lags, evenly spread over the search, of which the best one starts the refinement."""

FIRST_INTERVALS = (32, 4, 4)
"""Number of intervals of the splines f, h and B during the search of the first lag."""

INTERVALS = ((4, 8, 16, 32, 64), (2, 4, 8, 16), (4, 8, 16))
"""Numbers of intervals of the splines f, h and B, from which the Bayesian information criterion chooses."""

PLAY_RADII = (0.001, 0.004, 0.015, 0.06)
"""Play radii of the direction state that are tried first [share of the travel]. The play radius stays between
the first and the last."""

MOST_RADIUS_RATIO = 2.0
"""Largest change of the play radius in one Gauss-Newton step, as a ratio [-]."""

LEAST_STEP_SHARE = 0.01
"""Share of a Gauss-Newton step at which shorter steps are not tried [-]."""

MOST_STEPS = 12
"""Largest number of Gauss-Newton steps of the lag."""

KNOT_BINS = 400
"""Number of position cells from whose mean force the knots of the splines are placed."""

DEGREE = 5
"""Degree of the polynomial that smooths a noisy position: a lower degree makes fast motions slower."""

HALF_WINDOWS = (4, 6, 8, 12, 18, 25, 50)
"""Half widths of the window that smooths a coarse position [rows]."""

MOST_ROUNDING_ERROR = 1.5
"""Largest noise of the position that counts as rounding error [standard deviations of a rounding error]."""

MOST_SMOOTHED = 1.5
"""Largest standard deviation of the part of the position that a smoothing window removes [standard deviations
of the noise]. A larger part is motion."""

NOISY_SAMPLING_ERROR = 0.3
"""Standard error of a lag from noisy positions between two samples, which are interpolated [sample
periods]."""

SMOOTH_NOISE = 0.005
"""Largest standard deviation of the noise of a position step, after smoothing [share of the RMS step]."""

TURN_ROWS = 8
"""Least number of rows used on each side of a turn."""

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

UNKNOWN_CURE = (
    "record slow and fast strokes of an object with a sharp bend, such as a key switch, on the same machine, "
    "and give its lag as a number"
)
"""Text of the cure if a recording does not determine the lag of its force."""


@dataclass(frozen=True)
class ForceLag:
    """Time by which the force of a recording is late, with its 95 % confidence interval."""

    late_s: float
    """Estimate [s]; NaN if there is none"""
    lower_s: float
    upper_s: float
    source: str
    """Part of the recording on which the estimate is based, in words"""
    reason: str = ""
    """Reason why the lag is not known, in words; empty if it is known"""

    @property
    def known(self) -> bool:
        """True if the recording determines the lag: the interval is narrow."""
        return not self.reason

    @property
    def is_late(self) -> bool:
        """True if the lag is known and the whole interval is above 0."""
        return self.known and self.lower_s > 0.0

    def record(self) -> dict[str, Any]:
        """Returns the lag as numbers and text for a model file."""
        numbers = (self.late_s, self.lower_s, self.upper_s)
        late, lower, upper = (number if self.known else None for number in numbers)
        return {"late_s": late, "lower_s": lower, "upper_s": upper, "text": str(self)}

    def __str__(self) -> str:
        if not self.known:
            return f"not known: {self.reason}"
        interval = f"95 %: {1e3 * self.lower_s:.3g} to {1e3 * self.upper_s:.3g} ms, from {self.source}"
        if self.late_s < 0.0:
            return f"the force is {-1e3 * self.late_s:.3g} ms ahead of the position ({interval})"
        return f"the force is {1e3 * self.late_s:.3g} ms late ({interval})"


def unknown(reason: str) -> ForceLag:
    """Returns a lag that the data does not determine, with the reason."""
    return ForceLag(math.nan, math.nan, math.nan, "", reason)


def lag_of(recordings: Sequence[Recording]) -> ForceLag:
    """Returns the lag of the force in recordings of one object on one test machine.

    The lag of a recording that is already corrected is the remaining lag.
    """
    if any(recording.time is None for recording in recordings):
        return unknown("the recording has no time")
    if any(recording.input_names for recording in recordings):
        return unknown("the force depends on further inputs")
    parts: list[_Motion] = []
    for recording in recordings:
        parts += _motions(recording, MOST_MOTION_ROWS - sum(len(part.time) for part in parts))
    if not parts:
        return unknown("the motion between gaps of time is too short")
    position, force = (
        np.concatenate([getattr(part, name) for part in parts]) for name in ("position", "force_known")
    )
    if not (np.ptp(position) > 0.0 and np.ptp(force) > 0.0):
        return unknown("position or force is constant")
    if _spread_of_speeds(parts) >= LEAST_SPEED_SPREAD:
        return _checked(_Strokes.of(parts))
    return _checked(_of_turns(parts))


def _checked(found: ForceLag) -> ForceLag:
    """Returns a lag as unknown if its interval is too wide or leaves the range of the search."""
    lower, upper = max(found.lower_s, -LONGEST_LEAD_S), min(found.upper_s, LONGEST_LAG_S)
    if not found.known or (
        (lower, upper) == (found.lower_s, found.upper_s) and upper - lower <= 2.0 * LARGEST_ERROR_S
    ):
        return found
    allowed = f"any lag from {1e3 * lower:.3g} to {1e3 * upper:.3g} ms fits the {found.source}"
    return replace(found, lower_s=lower, upper_s=upper, reason=allowed)


@dataclass(frozen=True)
class _Motion:
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
                or np.std(x - savgol_filter(x, window, DEGREE)) > MOST_SMOOTHED * self.noise
            ):
                break
            chosen = half
            if self.noise * float(np.linalg.norm(savgol_coeffs(window, DEGREE, deriv=1))) <= limit:
                break
        return chosen

    def _smoothed(self, derivative: int) -> Float1D:
        return np.asarray(
            savgol_filter(
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


def _motions(recording: Recording, most: int) -> list[_Motion]:
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
            found.append(_Motion(t, position[start:stop], rows, force[start:stop]))
    return found


def _spread_of_speeds(parts: Sequence[_Motion]) -> float:
    """Returns the standard deviation of the speed divided by its mean, both averaged over the distance moved,
    so that pauses and turns have little weight."""
    speed = np.abs(np.concatenate([part.velocity for part in parts]))
    first, second, third = (float(np.sum(speed**power)) for power in (1, 2, 3))
    return math.sqrt(max(third * first / second**2 - 1.0, 0.0)) if second > 0.0 else 0.0


@dataclass(frozen=True)
class _Fit:
    """Least squares of the force for one lag, one play radius and one choice of splines."""

    columns: Any
    """(n, p) sparse"""
    gram: Float2D
    coefficients: Float1D
    residual: Float1D

    @property
    def rss(self) -> float:
        return float(self.residual @ self.residual)

    def without_columns(self, values: Float1D) -> Float1D:
        """Returns values (n,) minus their least-squares fit by the columns."""
        product = self.columns.T @ values
        return np.asarray(values - self.columns @ np.linalg.solve(self.gram, product))


class _Strokes:
    """Regression of the force on splines of the position at an earlier time."""

    def __init__(self, parts: Sequence[_Motion], most: int) -> None:
        total = sum(len(part.rows) for part in parts)
        every = -(-total // most)
        self._parts = [(part, part.rows[::every]) for part in parts]
        self._force = np.concatenate([part.force[rows] for part, rows in self._parts])
        self._sample_period = min(part.period for part in parts)
        position = np.concatenate([part.smooth for part in parts])
        self._lower, self._upper = float(position.min()), float(position.max())
        self._speed, self._acceleration = (
            float(np.sqrt(np.mean(np.concatenate([getattr(part, name) for part in parts]) ** 2))) or 1.0
            for name in ("velocity", "acceleration")
        )
        at_rows = np.concatenate([part.smooth[rows] for part, rows in self._parts])
        self._states: dict[tuple[int, float], Float1D] = {}
        self._arc = _arc_length(at_rows, self._force, self._lower, self._upper)

    @classmethod
    def of(cls, parts: Sequence[_Motion]) -> ForceLag:
        """Returns the lag from strokes at different speeds."""
        few, strokes = cls(parts, MOST_FIRST_ROWS), cls(parts, MOST_ROWS)
        if len(strokes._force) < LEAST_ROWS:
            return unknown(f"fewer than {LEAST_ROWS} rows are in motions longer than {LONGEST_LAG_S:g} s")
        lags = np.linspace(-LONGEST_LEAD_S, LONGEST_LAG_S, FIRST_LAGS)
        late, radius = min(
            product(lags.tolist(), PLAY_RADII),
            key=lambda tried: few._fit(tried[0], tried[1], FIRST_INTERVALS).rss,
        )
        late, radius = few._refined(late, radius, FIRST_INTERVALS)
        intervals = strokes._best_intervals(late, radius)
        late, radius = strokes._refined(late, radius, intervals)
        error, certainty = strokes._error(late, radius, intervals)
        exact = all(part.is_coarse or part.noise == 0.0 for part in parts)
        sampling = (SAMPLING_ERROR if exact else NOISY_SAMPLING_ERROR) * strokes._sample_period
        half = NORMAL_QUANTILE * math.hypot(error, sampling)
        found = ForceLag(late, late - half, late + half, "strokes at different speeds")
        if certainty < LEAST_CERTAINTY:
            return replace(found, reason=NO_BEND)
        return found

    def _inputs(self, late: float, radius: float) -> tuple[Float1D, tuple[Float1D, ...], Float1D]:
        """Returns position, the factors of the splines f, h and B, and acceleration at the rows, a lag
        earlier."""
        found = []
        for part, rows in self._parts:
            x = np.clip(part.at(late, part.smooth, rows), self._lower, self._upper)
            s = part.at(late, self._state(part, radius), rows)
            v = part.at(late, part.velocity, rows) / self._speed
            found.append((x, s, v, part.at(late, part.acceleration, rows) / self._acceleration))
        x, s, v, a = (np.concatenate(each) for each in zip(*found, strict=True))
        return x, (np.ones_like(x), s, v), a

    def _design(self, late: float, radius: float, intervals: tuple[int, ...]) -> Any:
        """Returns the columns (n, p) of the regression."""
        x, factors, a = self._inputs(late, radius)
        splines = [BSpline.design_matrix(x, knots, 3) for knots in self._knots(intervals)]
        first = np.cumsum([0, *(spline.shape[1] for spline in splines)])
        # in every row four cubic splines of each kind are not 0
        values = [
            factor[:, None] * each.data.reshape(-1, 4) for factor, each in zip(factors, splines, strict=True)
        ]
        columns = [start + each.indices.reshape(-1, 4) for start, each in zip(first, splines, strict=False)]
        table = np.column_stack([*values, a])
        places = np.column_stack([*columns, np.full(len(x), first[-1])])
        starts = table.shape[1] * np.arange(len(x) + 1)
        return csr_array((table.ravel(), places.ravel(), starts), shape=(len(x), int(first[-1]) + 1))

    def _force_of(self, fit: _Fit, late: float, radius: float, intervals: tuple[int, ...]) -> Float1D:
        """Returns the force (n,) of fitted coefficients for another lag or play radius."""
        x, factors, a = self._inputs(late, radius)
        total, first = a * fit.coefficients[-1], 0
        for factor, knots in zip(factors, self._knots(intervals), strict=True):
            count = len(knots) - 4
            total += factor * BSpline(knots, fit.coefficients[first : first + count], 3)(x)
            first += count
        return np.asarray(total)

    def _fit(self, late: float, radius: float, intervals: tuple[int, ...]) -> _Fit:
        columns = self._design(late, radius, intervals)
        gram = (columns.T @ columns).toarray()
        gram[np.diag_indices_from(gram)] += 1e-8 * np.trace(gram) / len(gram)
        coefficients = np.linalg.solve(gram, columns.T @ self._force)
        return _Fit(columns, gram, coefficients, self._force - columns @ coefficients)

    def _knots(self, intervals: tuple[int, ...]) -> list[Float1D]:
        """Returns the knots of the cubic splines f, h and B; those of f are close together where the force is
        steep."""
        at, arc = self._arc
        inner = [np.interp(np.linspace(0.0, arc[-1], intervals[0] + 1)[1:-1], arc, at)]
        inner += [np.linspace(self._lower, self._upper, count + 1)[1:-1] for count in intervals[1:]]
        return [np.concatenate([[self._lower] * 4, each, [self._upper] * 4]) for each in inner]

    def _state(self, part: _Motion, radius: float) -> Float1D:
        """Returns the direction state of the play operator, whose radius is a share of the travel."""
        if (id(part), radius) not in self._states:
            if len(self._states) >= MOST_STATES * len(self._parts):
                self._states.clear()
            length = radius * (self._upper - self._lower)
            x = np.ascontiguousarray(part.smooth)
            s = np.clip((x - _core.model.play(x, length, start=float(x[0]))) / length, -1.0, 1.0)
            self._states[id(part), radius] = s
        return self._states[id(part), radius]

    def _refined(self, late: float, radius: float, intervals: tuple[int, ...]) -> tuple[float, float]:
        """Returns the lag and the play radius of the least residual near the given ones, by Gauss-Newton
        steps."""
        fit = self._fit(late, radius, intervals)
        most = np.array([(LONGEST_LAG_S + LONGEST_LEAD_S) / (FIRST_LAGS - 1), math.log(MOST_RADIUS_RATIO)])
        for _ in range(MOST_STEPS):
            over = np.column_stack(self._derivatives(late, radius, intervals, fit))
            step = np.clip(np.linalg.lstsq(over, fit.residual, rcond=1e-8)[0], -most, most)
            share = 1.0
            while share > LEAST_STEP_SHARE:
                to = min(max(late + share * step[0], -LONGEST_LEAD_S), LONGEST_LAG_S)
                wide = min(max(radius * math.exp(share * step[1]), PLAY_RADII[0]), PLAY_RADII[-1])
                trial = self._fit(to, wide, intervals)
                if trial.rss < fit.rss:
                    break
                share /= 2.0
            else:
                break
            small = abs(to - late) < 1e-3 * self._sample_period and fit.rss - trial.rss < 1e-6 * fit.rss
            late, radius, fit = to, wide, trial
            if small:
                break
        return late, radius

    def _derivatives(
        self, late: float, radius: float, intervals: tuple[int, ...], fit: _Fit
    ) -> tuple[Float1D, Float1D]:
        """Returns the derivatives (n,) of the fitted force over the lag and over the logarithm of the play
        radius, without the parts that the splines can replace."""
        step, ratio = 0.25 * self._sample_period, 1.02
        ahead, behind = (self._force_of(fit, late + side * step, radius, intervals) for side in (1.0, -1.0))
        wide, narrow = (self._force_of(fit, late, radius * each, intervals) for each in (ratio, 1.0 / ratio))
        return (
            fit.without_columns((ahead - behind) / (2.0 * step)),
            fit.without_columns((wide - narrow) / (2.0 * math.log(ratio))),
        )

    def _best_intervals(self, late: float, radius: float) -> tuple[int, ...]:
        """Returns the numbers of intervals with the least Bayesian information criterion, one spline after
        the other."""
        chosen = list(FIRST_INTERVALS)
        n = len(self._force)
        samples = n * _independent_share(self._fit(late, radius, FIRST_INTERVALS).residual)
        for spline, tried in enumerate(INTERVALS):
            values = []
            for count in tried:
                fit = self._fit(late, radius, (*chosen[:spline], count, *chosen[spline + 1 :]))
                values.append(samples * math.log(fit.rss / n) + len(fit.gram) * math.log(samples))
            chosen[spline] = tried[int(np.argmin(values))]
        return tuple(chosen)

    def _error(self, late: float, radius: float, intervals: tuple[int, ...]) -> tuple[float, float]:
        """Returns the standard error of the lag for correlated residuals of any size [s], and the certainty
        of the derivative of the force over the lag.

        The certainty is the sum of squares of this derivative divided by the part that noise in the fitted
        splines adds to it. A lag with a small certainty can be anything (weak instruments, Staiger and Stock
        1997).
        """
        fit = self._fit(late, radius, intervals)
        over_lag, over_radius = self._derivatives(late, radius, intervals, fit)
        if (power := float(over_radius @ over_radius)) > 0.0:
            over_lag = over_lag - over_radius * float(over_radius @ over_lag) / power
        information = float(over_lag @ over_lag)
        if information == 0.0:
            return math.inf, 0.0
        n, step = len(fit.residual), 0.25 * self._sample_period
        freedom = max(n - len(fit.gram) - 2, 1)
        score = over_lag * fit.residual
        variance = max(_long_run(score), _long_run_of_product(over_lag, fit.residual)) * n / freedom
        ahead, behind = (self._design(late + side * step, radius, intervals) for side in (1.0, -1.0))
        change = (ahead - behind) / (2.0 * step)
        crossed = (fit.columns.T @ change).toarray()
        rest = (change.T @ change).toarray() - crossed.T @ np.linalg.solve(fit.gram, crossed)
        # covariance of the coefficients for noise of one size, and for noise that depends on the row
        even = fit.rss / freedom * fit.gram
        uneven = (fit.columns.T @ (fit.columns * (fit.residual**2 * n / freedom)[:, None])).toarray()
        by_noise = max(
            float(np.trace(np.linalg.solve(fit.gram, np.linalg.solve(fit.gram, each).T) @ rest))
            for each in (even, uneven)
        ) / _independent_share(fit.residual)
        return math.sqrt(variance) / information, information / max(by_noise, np.finfo(float).tiny)


def _arc_length(x: Float1D, force: Float1D, lower: float, upper: float) -> tuple[Float1D, Float1D]:
    """Returns positions (k,) and the length of the curve of the mean force up to them (k,), with both axes
    scaled to 1."""
    cell = np.minimum((x - lower) / (upper - lower) * KNOT_BINS, KNOT_BINS - 1).astype(np.int64)
    cell = np.maximum(cell, 0)
    count = np.bincount(cell, minlength=KNOT_BINS)
    used = count > 0
    at = np.bincount(cell, x, KNOT_BINS)[used] / count[used]
    mean = np.bincount(cell, force, KNOT_BINS)[used] / count[used]
    if len(mean) > 5:
        mean = np.convolve(np.pad(mean, 2, mode="edge"), np.ones(5) / 5.0, "valid")
    steps = np.abs(np.diff(at)) / (upper - lower) + np.abs(np.diff(mean)) / (np.ptp(mean) or 1.0)
    return at, np.concatenate([[0.0], np.cumsum(steps)])


def _independent_share(residual: Float1D, n_parameters: int = 0) -> float:
    """Returns the share of independent residuals (n,) from the correlation of neighbours.

    A fit of many parameters to few rows lowers this correlation; the lost part is about n_parameters / n.
    """
    power = float(residual @ residual)
    rho = float(residual[1:] @ residual[:-1]) / power if power > 0.0 else 0.0
    rho += n_parameters / len(residual)
    rho = min(max(rho, 0.0), 0.99)
    return (1.0 - rho) / (1.0 + rho)


def _window(n: int) -> Float1D:
    """Returns the weights of autocovariances (Bartlett window) for n values."""
    longest = max(1, min(n // 4, 10 + int(8.0 * n ** (1.0 / 3.0))))
    return np.asarray(1.0 - np.arange(longest) / longest)


def _autocovariance(values: Float1D, most: int) -> Float1D:
    """Returns the sums of products of values (n,) at distances 0 to most - 1."""
    n = len(values)
    size = 1 << (n + most).bit_length()
    spectrum = np.fft.rfft(values, size)
    return np.asarray(np.fft.irfft(spectrum * np.conj(spectrum), size)[:most])


def _long_run(score: Float1D) -> float:
    """Returns the variance of the sum of a correlated score (n,)."""
    window = _window(len(score))
    products = _autocovariance(score, len(window))
    return float(products[0] + 2.0 * window[1:] @ products[1:])


def _long_run_of_product(regressor: Float1D, residual: Float1D) -> float:
    """Returns the variance of the sum of regressor times residual (n,), for a residual whose correlation is
    the same everywhere."""
    window = _window(len(residual))
    of_residual = _autocovariance(residual, len(window)) / len(residual)
    of_regressor = _autocovariance(regressor, len(window))
    products = of_residual * of_regressor
    return float(products[0] + 2.0 * window[1:] @ products[1:])


def _of_turns(parts: Sequence[_Motion]) -> ForceLag:
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
    share = float(np.mean([_independent_share(residual, sum(TURN_DEGREES) + 2) for residual in found]))
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
    return float(fdtri(1.0, freedom, 0.95))


@dataclass(frozen=True)
class _Turn:
    """Turn of a motion, with the rows around it."""

    part: _Motion
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


def _turns(part: _Motion) -> list[_Turn]:
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

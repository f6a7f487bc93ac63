# SPDX-License-Identifier: Apache-2.0
"""Lag of a force from strokes at different speeds.

A force that is late by tau belongs to the position of the time tau earlier: F(t) = f(x(t - tau)). At speed v
it differs by about -tau v f'(x) from the force at x(t). Hysteresis and damping of the object change the force
too, by s h(x), with the direction state s, and by v B(x). Where f bends sharply, f' changes within a short
distance, and B does not. The regression therefore fits, for each tried tau,

    F(t) = f(x) + s h(x) + v B(x) + m a,   all at the time t - tau,

with splines f, h and B. It needs different speeds: at one speed, s h and v B are equal.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Any

import numpy as np
import scipy

from ... import _core
from ..._typing import Float1D, Float2D
from .correlation import independent_share, long_run_variance, long_run_variance_of_product
from .force_lag import LONGEST_LAG_S, LONGEST_LEAD_S, NORMAL_QUANTILE, SAMPLING_ERROR, ForceLag, unknown
from .motions import Motion

MOST_ROWS = 5000
"""Largest number of rows in the regression of strokes; of more rows an evenly spread part is used."""

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

NOISY_SAMPLING_ERROR = 0.3
"""Standard error of a lag from noisy positions between two samples, which are interpolated [sample
periods]."""


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


class Strokes:
    """Regression of the force on splines of the position at an earlier time."""

    def __init__(self, parts: Sequence[Motion], most: int) -> None:
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
    def of(cls, parts: Sequence[Motion]) -> ForceLag:
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
        splines = [scipy.interpolate.BSpline.design_matrix(x, knots, 3) for knots in self._knots(intervals)]
        first = np.cumsum([0, *(spline.shape[1] for spline in splines)])
        # in every row four cubic splines of each kind are not 0
        values = [
            factor[:, None] * each.data.reshape(-1, 4) for factor, each in zip(factors, splines, strict=True)
        ]
        columns = [start + each.indices.reshape(-1, 4) for start, each in zip(first, splines, strict=False)]
        table = np.column_stack([*values, a])
        places = np.column_stack([*columns, np.full(len(x), first[-1])])
        starts = table.shape[1] * np.arange(len(x) + 1)
        return scipy.sparse.csr_array(
            (table.ravel(), places.ravel(), starts), shape=(len(x), int(first[-1]) + 1)
        )

    def _force_of(self, fit: _Fit, late: float, radius: float, intervals: tuple[int, ...]) -> Float1D:
        """Returns the force (n,) of fitted coefficients for another lag or play radius."""
        x, factors, a = self._inputs(late, radius)
        total, first = a * fit.coefficients[-1], 0
        for factor, knots in zip(factors, self._knots(intervals), strict=True):
            count = len(knots) - 4
            total += factor * scipy.interpolate.BSpline(knots, fit.coefficients[first : first + count], 3)(x)
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

    def _state(self, part: Motion, radius: float) -> Float1D:
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
        samples = n * independent_share(self._fit(late, radius, FIRST_INTERVALS).residual)
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
        variance = (
            max(long_run_variance(score), long_run_variance_of_product(over_lag, fit.residual)) * n / freedom
        )
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
        ) / independent_share(fit.residual)
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

# SPDX-License-Identifier: Apache-2.0
"""Fits mass m and damping B of F = m a + B v + f(x), which is linear in m and B for given wavelets of f.

The force f over position is fitted to unfiltered positions and forces. For m and B every column is filtered
by the same low-pass L without phase: L F is regressed on L a, L v, L 1, L x and L psi_i(x) (with hysteresis
on L s, L s x, L s psi_i(x) too), which is exact for any f of these terms; L f(x) is not f(L x). Three time
constants of L are left out at both ends of a piece. Filtered samples are not independent: the number of
independent samples is computed from their autocorrelation.
"""

import math
from collections.abc import Sequence
from functools import cached_property
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from ..._typing import Float1D, Float2D
from ...recording.motion import (
    FORCE_RESOLUTION,
    LowPass,
    Piece,
    at_rows,
    least_error_low_pass,
    long_enough,
    quiet_low_pass,
    strokes_from_order,
    turns_of,
)
from ...recording.units import unit_of_dynamics
from ...verdict import FORCE_FLOOR, Finding, force_jnd, usable
from ..data.limits import LEAST_GAIN, evenly_spread
from ..data.rows import Rows, modulo
from ..data.strokes import HysteresisInput
from ..log import Decision, decided, lowered, squared_error_change
from ..network.basis import Basis
from ..network.separable import TINY, factored, solved
from ..options import IdentifyOptions
from ..search.evidence import CRITERION_NAMES, Moving, deviance, on_fitted_rows

FOLDS = 10
"""Number of groups of sections of the recording for a test of damping and mass; each group is held out once.

A group is every tenth of a hundred sections, so that it has slow and fast strokes, even if the speed rises
over the recording."""

TERMS = ("damping", "mass")
"""Names of the coefficients of velocity (damping) and of acceleration (mass)."""


class FoldedRegression:
    """Least squares of a filtered force on any choice of filtered columns, with each section of the recording
    held out once.

    A mean squared error below `least` is replaced by `least`: no force sensor resolves it.
    """

    def __init__(
        self, table: Float2D, folds: Float1D, independent: float, two_sided: bool, least: float
    ) -> None:
        self._independent, self._least, self._rows = independent, least, len(table)
        self._grams = np.array([table[folds == fold].T @ table[folds == fold] for fold in range(FOLDS)])
        self._total, n_static = self._grams.sum(axis=0), table.shape[1] - 3
        self._static = {True: n_static, False: n_static // (1 + two_sided)}

    def value(self, two_sided: bool, names: Sequence[str], criterion: str) -> float:
        """Returns the criterion of the force regression with these terms (mass, damping), with or without
        hysteresis."""
        columns = self._columns(two_sided, names)
        rss = _rss(self._total, columns, _solution(self._total, columns))
        share = max(rss / self._rows, self._least, TINY)
        p = min(len(columns), int(self._independent) - 2)
        return deviance(criterion, self._independent * share, self._independent, p)

    def solved(self, two_sided: bool, names: Sequence[str]) -> dict[str, float]:
        """Returns the fitted values of the named terms, mass or damping."""
        found = _solution(self._total, self._columns(two_sided, names))
        return dict(zip(names, found.tolist(), strict=False))

    def held_out_gain(
        self, two_sided: bool, without: Sequence[str], with_it: Sequence[str]
    ) -> tuple[float, float]:
        """Returns the relative decrease of the squared force error on held-out sections by added terms (mass,
        damping), and its standard error."""
        errors = np.array(
            [
                [self._left_out(fold, self._columns(two_sided, names)) for fold in range(FOLDS)]
                for names in (without, with_it)
            ]
        )
        before, after = errors.mean(axis=1)
        scatter = errors[1] - after / before * errors[0]
        return float(1.0 - after / before), float(scatter.std(ddof=1) / before / np.sqrt(FOLDS))

    def _left_out(self, fold: int, columns: list[int]) -> float:
        return _rss(self._grams[fold], columns, _solution(self._total - self._grams[fold], columns))

    def _columns(self, two_sided: bool, names: Sequence[str]) -> list[int]:
        """Returns the indices of columns of the least-squares table. Its columns are force, velocity,
        acceleration, basis functions of the force over position, and these functions times the direction
        state s."""
        return [*(1 + TERMS.index(name) for name in names), *range(3, 3 + self._static[two_sided])]


def _solution(gram: Float2D, columns: list[int]) -> Float1D:
    return solved(factored(gram[np.ix_(columns, columns)]), gram[columns, 0])


def _rss(gram: Float2D, columns: list[int], solution: Float1D) -> float:
    """Returns the residual sum of squares of coefficients, from a Gram matrix whose column 0 is the force."""
    quadratic = solution @ gram[np.ix_(columns, columns)] @ solution
    return max(float(gram[0, 0] - 2.0 * solution @ gram[columns, 0] + quadratic), 0.0)


SAMPLES_PER_TIME_CONSTANT = 2.0
"""Least number of samples that are kept of a filtered column in the time 1/w_c, with the cutoff w_c of the
low-pass filter [-]: more samples would be nearly equal."""

LEAST_INDEPENDENT_SAMPLES = 40.0
"""Least number of independent samples for a decision on damping and mass; each wavelet needs two more."""

SHORT_MOTION = "the motion of the recording between gaps of time is too short or too noisy"
"""Text of the decision that damping and mass are not tested, if the recorded motion is too short or too
noisy."""

CONSTANT_SPEEDS = "between its turns the tool does not accelerate above the noise of the position"
"""Text of the decision that mass is not tested, if the recording shows no acceleration."""

LEAST_SHARE = 1e-9
"""Least weight of a row before the low-pass filter [-]."""

SMOOTHING_SPEED_SHARE = 0.1
"""Speed v0 of the smoothed sign tanh(v/v0) of a velocity v [share of the RMS speed]."""

LEAST_SPEED_SPREAD = 0.19
"""Least spread of speeds at which slow and fast strokes are compared [-]: that of speeds spread evenly from 1
to 2. With a smaller spread damping cannot be distinguished from friction."""


def spread_of_speeds(velocity: Float1D) -> float:
    """Returns the standard deviation of the speed in one direction divided by its mean, both averaged over
    the distance moved, so that pauses and turns have little weight; 0 without a motion.

    Of both directions the larger one counts: one speed of all presses and another one of all releases do not
    distinguish damping from friction.
    """
    spreads = [0.0]
    for speed in (velocity[velocity > 0.0], -velocity[velocity < 0.0]):
        if len(speed):
            share = speed / speed.max()
            first, second, third = (float(np.sum(share**power)) for power in (1, 2, 3))
            spreads.append(math.sqrt(max(third * first / second**2 - 1.0, 0.0)))
    return max(spreads)


def friction_sign(velocity: Float1D) -> Float1D:
    """Returns the smoothed sign tanh(v/v0) of velocities v (n,)."""
    slow = SMOOTHING_SPEED_SHARE * float(np.sqrt(np.mean(velocity**2)))
    return np.tanh(velocity / slow) if slow > 0.0 else np.zeros_like(velocity)


class Dynamics:
    """Motion of a recording, from which mass and damping of the object are found."""

    def __init__(self, data: Rows, options: IdentifyOptions) -> None:
        parts = data.parts
        self._terms: tuple[str, ...] = TERMS
        low_pass = quiet_low_pass(parts, order=2) if parts else None
        if parts and low_pass is None:  # constant speeds have no acceleration
            low_pass, self._terms = quiet_low_pass(parts, order=1), ("damping",)
        self._low_pass = low_pass or LowPass(1.0)
        self._parts = [] if low_pass is None else long_enough(parts, low_pass)
        self._data, self._evidence = data, options.search.evidence
        self._criterion = on_fitted_rows(options.criterion)
        self._step = max(1, int(1.0 / (SAMPLES_PER_TIME_CONSTANT * self._low_pass.cutoff * parts[0].period)))
        self._fixed = [
            self._filtered(part, np.column_stack([part.force, part.velocity, part.acceleration]))
            for part in self._parts
        ]

    @property
    def accelerates(self) -> bool:
        """True if the acceleration is known. Constant speeds have none, and do not show the force between
        them."""
        return "mass" in self._terms

    def accepted(
        self, basis: Basis, strokes: HysteresisInput | None
    ) -> tuple[dict[str, float], list[Decision], list[Finding]]:
        """Returns accepted values of damping and mass for given wavelets of the force, the decisions on both,
        and a finding on a damping below zero that a hand notices.

        No passive object has one, but a late force F(t - t0) = F - t0 dF/dt shows it.
        """
        regression = self._regression(basis, strokes)
        if regression is None:
            return {}, [Decision("damping", "not tested", SHORT_MOTION), self._mass_not_tested()], []
        decisions: list[Decision] = []
        findings: list[Finding] = []
        allowed = self._terms
        spread = spread_of_speeds(np.concatenate([fixed[:, 1] for fixed in self._fixed]))
        if spread < LEAST_SPEED_SPREAD:
            reason = (
                f"the speed was nearly constant: it varies by {100 * spread:.2g} %, slow and "
                f"fast strokes with at least {100 * LEAST_SPEED_SPREAD:.2g} % are needed"
            )
            decisions.append(Decision("damping", "not tested", reason))
            allowed = tuple(name for name in allowed if name != "damping")
        if not self.accelerates:
            decisions.append(self._mass_not_tested())
        criterion = self._criterion
        valued = {
            (use, names): regression.value(use, names, criterion) + self._evidence * (len(names) + use)
            for use in ((False, True) if strokes is not None else (False,))
            for size in range(len(allowed) + 1)
            for names in combinations(allowed, size)
        }
        use, names = min(valued, key=lambda choice: valued[choice])
        for name in allowed:
            with_it = tuple(other for other in allowed if other in names or other == name)
            without = tuple(other for other in with_it if other != name)
            falls = regression.value(use, without, criterion) - regression.value(use, with_it, criterion)
            change = lowered(CRITERION_NAMES[criterion], falls)
            if name not in names:
                bound = f"must lower it by at least {self._evidence:.4g}"
                decisions.append(decided(name, False, f"{change}, {bound}"))
                continue
            known = float(np.mean(self._derivatives[TERMS.index(name)][1]))  # other rows keep their error
            share, error = (known * each for each in regression.held_out_gain(use, without, with_it))
            found = regression.solved(use, with_it)[name]
            measured = squared_error_change(share, error)
            if share - error >= LEAST_GAIN and found > 0.0:
                decisions.append(decided(name, True, f"{measured}, {change}"))
                continue
            names = tuple(other for other in names if other != name)
            reason = f"{measured}, must lower it by at least {100.0 * LEAST_GAIN:g} %"
            if not found > 0.0:
                value = found / self._data.force_unit.scale
                number = f"{value:.4g} {self._unit_of(name)}".rstrip()
                reason = f"the fitted {name} is {number}, a passive object has > 0"
                # A mass below zero proves nothing: an elastic mount of a damper shows one too.
                if name == "damping" and share - error >= LEAST_GAIN and self._noticed(found):
                    cause = "a force that is recorded late shows this; give --force-late-s SECONDS, its delay"
                    findings.append(usable(f"{reason}, and a hand notices its force: {cause}"))
            decisions.append(decided(name, False, f"{reason}; {change}"))
        return regression.solved(use, names), decisions, findings

    def _noticed(self, damping: float) -> bool:
        """True if the force of a damping is above a just noticeable difference on average."""
        velocity, known = self._derivatives[TERMS.index("damping")]
        force = self._data.force
        jnd = force_jnd(force[known], FORCE_FLOOR * float(np.abs(force).max()))
        return bool(np.mean(np.abs(damping * velocity[known]) / jnd) > 1.0)

    def _mass_not_tested(self) -> Decision:
        """Returns the decision that mass is not tested, with the mass whose force a hand would feel if each
        stroke were half a period of a sine."""
        parts, data = self._data.parts, self._data
        direction = strokes_from_order(data.path[:, 0])
        if direction is None or not parts:
            return Decision("mass", "not tested", SHORT_MOTION)
        stroke_s = sum(float(np.ptp(part.row_time)) for part in parts) / (1 + turns_of(direction))
        acceleration = 0.5 * float(data.reach[0]) * (math.pi / stroke_s) ** 2
        noticed = FORCE_FLOOR * float(np.abs(data.force).max()) / data.force_unit.scale
        mass = f"{noticed / acceleration:.2g} {self._unit_of('mass')}".rstrip()
        limit = (
            f"if each stroke is half a period of a sine, a mass above {mass} changes the force by more than "
            "a just noticeable difference"
        )
        return Decision("mass", "not tested", f"{CONSTANT_SPEEDS}; {limit}")

    def _unit_of(self, name: str) -> str:
        return unit_of_dynamics(name, self._data.force_unit.si, self._data.position_unit.si)

    def moving(self, values: dict[str, float]) -> Moving:
        """Returns given mass m and damping B with their force m a + B v at every row. Acceleration a and
        velocity v have the least expected error, because the force that is fitted next is not low-passed."""
        total, known = np.zeros(len(self._data.force)), np.ones(len(self._data.force), dtype=bool)
        for name, (derived, here) in zip(TERMS, self._derivatives, strict=True):
            if name in values:
                total, known = total + values[name] * derived, known & here
        return Moving(values.get("damping"), values.get("mass"), total, known.astype(float))

    @cached_property
    def _derivatives(self) -> tuple[tuple[Float1D, NDArray[np.bool_]], ...]:
        """Velocity and acceleration at every row (n,), each with True (n,) for the rows that have one"""
        parts, n = self._data.parts, len(self._data.force)
        return tuple(at_rows(parts, least_error_low_pass(parts, order=order), order, n) for order in (1, 2))

    def velocity(self) -> tuple[Float1D, NDArray[np.bool_]]:
        """Returns the velocity at every row (n,) as an input, and True (n,) for rows that have one."""
        return at_rows(self._parts, self._low_pass, 1, len(self._data.force))

    def share_of_velocity(self, residual: Float1D, basis: Basis) -> float:
        """Returns the share of the mean square of a residual (n,) that functions of velocity and position
        explain.

        The functions are v|v|, and v, |v|, 1 and the smoothed sign of v times 1, x and psi_i(x), with
        velocity v, position x and the wavelets psi_i of the force. The share is corrected for the number of
        functions.
        """
        velocity, known = self.velocity()
        rows = evenly_spread(np.flatnonzero(known))
        v, r, x = velocity[rows, None], residual[rows], self._data.box[rows]
        if len(rows) == 0 or not (np.ptp(v) and np.ptp(x)):
            return 0.0
        over_x = np.concatenate([np.ones_like(x), x, basis.columns(x)], 1)
        of_speed = (v, np.abs(v), np.ones_like(v), friction_sign(v))
        table = np.concatenate([v * np.abs(v), *(each * over_x for each in of_speed)], 1)
        product = table.T @ r
        share = float(product @ solved(factored(table.T @ table), product) / max(float(r @ r), TINY))
        return float(1.0 - (1.0 - share) * len(r) / max(len(r) - table.shape[1], 1))

    def _regression(self, basis: Basis, strokes: HysteresisInput | None) -> FoldedRegression | None:
        tables, folds = [], []
        rows = sum(len(fixed) for fixed in self._fixed)
        done = 0
        for part, fixed in zip(self._parts, self._fixed, strict=True):
            box = (part.position - self._data.lower[0]) / self._data.reach[0]
            box = box if self._data.period is None else modulo(box)
            plain = np.concatenate(
                [np.ones((len(box), 1)), box[:, None], basis.columns(box[:, None])],
                axis=1,
            )
            root = np.ones((len(fixed), 1))
            if strokes is not None:
                here = np.clip(part.on_grid(strokes.side[part.rows]), -1.0, 1.0)
                plain = np.concatenate([plain, here[:, None] * plain], axis=1)
                variance = 1.0 / np.maximum(part.on_grid(strokes.share[part.rows]), LEAST_SHARE)
                root = 1.0 / np.sqrt(np.maximum(self._filtered(part, variance[:, None]), 1.0))
            tables.append(root * np.concatenate([fixed, self._filtered(part, plain)], axis=1))
            folds.append((np.arange(done, done + len(fixed)) * FOLDS**2) // rows % FOLDS)
            done += len(fixed)
        if not tables:
            return None
        independent = rows * self._step / self._correlation_time()
        if independent < LEAST_INDEPENDENT_SAMPLES + 2 * len(basis):
            return None
        forces = np.concatenate([part.force for part in self._parts])
        least = (FORCE_RESOLUTION * float(np.ptp(forces))) ** 2
        return FoldedRegression(
            np.concatenate(tables), np.concatenate(folds), independent, strokes is not None, least
        )

    def _filtered(self, part: Piece, columns: Float2D) -> Float2D:
        margin = self._low_pass.margin(part.period)
        return np.column_stack(
            [
                self._low_pass(np.ascontiguousarray(column), part.period)[margin : -margin : self._step]
                for column in columns.T
            ]
        )

    def _correlation_time(self) -> float:
        """Returns the number of samples of low-pass filtered white noise that contain the information of one
        independent sample: the sum of squares of their autocorrelation."""
        period = self._parts[0].period
        impulse = np.zeros(4 * self._low_pass.margin(period) + 1)
        impulse[len(impulse) // 2] = 1.0
        response = np.fft.rfft(self._low_pass(impulse, period), 2 * len(impulse))
        correlation = np.fft.irfft(np.abs(response) ** 2)
        return float(np.sum(correlation**2) / correlation[0] ** 2)

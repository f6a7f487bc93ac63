# SPDX-License-Identifier: Apache-2.0
"""Constraints over a domain of one input: h >= 0, slope bounds, a fixed force, equal ends of a period.

Each is a bound on a *reading* of the network, a combination of its channels or the slope of one, at every
position of the domain. The least squares is solved with the bound imposed where it was found violated.
Everywhere else it is certified: on a cell [a, b] a twice differentiable reading r stays above
min(r(a), r(b)) - max|r''| (b - a)^2 / 8, where max|r''| over the cell comes from `derivative_bounds`.
Cells are halved until they are certified or shown violated; violated ones give new positions to impose,
until none is left.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag, solve_triangular
from scipy.optimize import isotonic_regression, nnls

from ..._core.model import derivative_bounds, wavelet_columns, wavelet_slope_columns
from ..._typing import Float1D, Float2D
from ..data.compression import Compressed
from .basis import Basis
from .separable import SeparableProblem, Solution, factored

IMPOSED_MARGIN = 1e-2
"""Margin by which an imposed bound is tighter than the certified one, as a share of the RMS error [-].
Without it certification may not end."""

POINT_TOLERANCE = 1e-9
"""Largest deviation from a fixed force, as a share of the range of the force [-]: rounding."""

MOST_ROUNDS = 60
"""Largest number of rounds of imposing and certifying. After it the solution is mixed with one that keeps all
bounds."""

FIRST_CELLS = 256
"""Number of cells over the domain at the start of a certification."""

MOST_HALVINGS = 40
"""Halvings after which an undecided cell counts as violated: its width is then a rounding error."""

PROJECTION_CELLS = 4096
"""Number of cells of the grid on which a force is projected onto slope bounds."""

MOST_ALTERNATIONS = 50
"""Largest number of alternating projections onto the lower and the upper slope bound."""


@dataclass(frozen=True)
class Bound:
    """sign * (reading - limit) >= 0 over the unit box; the reading is a combination of readouts."""

    readouts: tuple[float, ...]
    """Multiples of g (and h)"""
    of_slope: bool
    """True if the reading is the combination's slope [force/box]"""
    name: str
    """Name in the notes"""
    sign: float
    """+1: the reading stays above limit, -1: below"""
    limit: float
    unit: float
    """Part of the reading that weighs as much as a force of 1: 1 for a force"""
    at: float | None = None
    """The only position where it holds [box]; None: everywhere"""
    seam: bool = False
    """The reading is the difference between the two ends of the box: 0 for a force that repeats"""

    def columns(self, basis: Basis, x: Float1D) -> Float2D:
        """(k, 2 + N) the reading at positions (k,) of one channel, as a combination of its coefficients."""
        if not self.seam:
            return _columns(basis, self.of_slope, x)
        lower, upper = _columns(basis, self.of_slope, np.array([0.0, 1.0]))
        return np.tile(upper - lower, (len(x), 1))

    def channels(self, problem: SeparableProblem) -> Float1D:
        """The reading as a combination of the problem's channels."""
        return np.asarray(np.array(self.readouts) @ problem.readout)


def domain_bounds(
    problem: SeparableProblem,
    *,
    hysteresis: bool,
    slopes: tuple[float, float] | None,
    fixed: tuple[float, float] | None = None,
    periodic: bool = False,
) -> list[Bound]:
    """The bounds in force: h >= 0, and (min, max) of the slope [force/box] of the strokes g + h and g - h.

    With fixed, (position [box], force), g goes through that point: a bound from above and one from below.
    With periodic, g (and h) and their slopes are equal at both ends of the box.
    """
    two = len(problem.readout) == 2
    bounds = []
    if periodic:
        bounds += [
            Bound(part, of_slope, "equal ends of the period", sign, 0.0, 0.0, seam=True)
            for part in ([(1.0, 0.0), (0.0, 1.0)] if two else [(1.0,)])
            for of_slope in (False, True)
            for sign in (1.0, -1.0)
        ]
    if fixed is not None:
        g = (1.0, 0.0) if two else (1.0,)
        bounds += [Bound(g, False, "fixed force", sign, fixed[1], 0.0, fixed[0]) for sign in (1.0, -1.0)]
    if hysteresis and two:
        bounds.append(Bound((0.0, 1.0), False, "press force >= release force", 1.0, 0.0, 1.0))
    for stroke in [(1.0, 1.0), (1.0, -1.0)] if two else [(1.0,)]:
        for sign, limit in zip((1.0, -1.0), slopes or (), strict=False):
            if np.isfinite(limit):
                bounds.append(
                    Bound(
                        stroke, True, "slope bounds", sign, limit, max(abs(limit) / problem.force_range, 1.0)
                    )
                )
    return bounds


def moved_to_bounds(
    problem: SeparableProblem, rows: Compressed, solution: Solution, bounds: Sequence[Bound]
) -> Compressed:
    """The rows with their forces moved as the solution must move to keep the bounds, noise and all.

    Forces against the bounds are removed from these rows, so that a network grown on them has wavelets where
    the bounded force law needs them. h is projected pointwise, h := max(h, 0), slopes by isotonic regression.
    """
    bounds = [bound for bound in bounds if not bound.seam]
    grid = np.linspace(0.0, 1.0, PROJECTION_CELLS + 1)
    readings = problem.readout @ solution.coefficients @ _columns(solution.basis, False, grid).T
    before = readings.copy()
    if any(not bound.of_slope and bound.at is None for bound in bounds):
        readings[1] = np.maximum(readings[1], 0.0)
    if any(bound.of_slope for bound in bounds):
        low = max([bound.limit for bound in bounds if bound.of_slope and bound.sign > 0], default=-np.inf)
        high = min([bound.limit for bound in bounds if bound.of_slope and bound.sign < 0], default=np.inf)
        mix = np.array([[1.0, 1.0], [1.0, -1.0]])[: len(readings), : len(readings)]
        strokes = [slope_limited(grid, stroke, low, high) for stroke in mix @ readings]
        readings = np.linalg.solve(mix, np.array(strokes))
    shift = [np.interp(rows.positions[:, 0], grid, change) for change in readings - before]
    moved = rows.force + shift[0] + (shift[1] * rows.side if rows.side is not None else 0.0)
    return replace(rows, force=moved)


def impose(problem: SeparableProblem, free: Solution, bounds: Sequence[Bound]) -> Solution:
    """Least squares on the basis of the free solution, all bounds kept over the unit box and certified.

    The free solution itself is returned if it keeps them.
    """
    margin = IMPOSED_MARGIN * problem.resolved_rmse(free)
    rows: list[Float2D] = []
    limits: list[Float1D] = []
    current = free
    for _ in range(MOST_ROUNDS):
        found = [(bound, violated_positions(problem, current, bound)) for bound in bounds]
        if not any(len(x) for _, x in found):
            return current
        for bound, x in found:
            reading = np.kron(bound.channels(problem), bound.columns(free.basis, x))
            rows.append(np.asarray(bound.sign * reading, dtype=np.float64))
            limits.append(np.full(len(x), bound.sign * bound.limit + margin * bound.unit))
        coefficients = _least_squares(problem, free, np.concatenate(rows), np.concatenate(limits))
        current = problem.with_coefficients(free, coefficients)
    return _mixed_with_safe(problem, current, bounds)


def violated_positions(problem: SeparableProblem, solution: Solution, bound: Bound) -> Float1D:
    """Positions (k,) of the unit box where the bound is violated, one a stretch; none: it is certified."""
    weights = bound.channels(problem) @ solution.coefficients

    def excess(x: Float1D) -> Float1D:
        reading = bound.columns(solution.basis, x) @ weights
        return np.asarray(bound.sign * (reading - bound.limit))

    if bound.at is not None or bound.seam:
        here = np.array([bound.at or 0.0])
        return here[excess(here) < -POINT_TOLERANCE * problem.force_range]
    edges = np.linspace(0.0, 1.0, FIRST_CELLS + 1)
    left, right = edges[:-1], edges[1:]
    at_left, at_right = excess(edges)[:-1], excess(edges)[1:]
    violated: list[NDArray[np.float64]] = []
    for halving in range(MOST_HALVINGS + 1):
        lowest = np.minimum(at_left, at_right)
        bend = derivative_bounds(
            alpha=solution.basis.alpha,
            beta=solution.basis.beta,
            weight=weights[2:],
            linear=weights[1],
            bias=weights[0],
            lower=left,
            upper=right,
            order=3 if bound.of_slope else 2,
        )
        undecided = (lowest >= 0.0) & (lowest < bend * (right - left) ** 2 / 8.0)
        shown = undecided | (lowest < 0.0) if halving == MOST_HALVINGS else lowest < 0.0
        violated.append(np.stack([left[shown], right[shown]]))
        if shown[undecided].all():
            break
        middle = 0.5 * (left[undecided] + right[undecided])
        at_middle = excess(middle)
        left, right = np.append(left[undecided], middle), np.append(middle, right[undecided])
        at_left, at_right = (
            np.append(at_left[undecided], at_middle),
            np.append(at_middle, at_right[undecided]),
        )
    return _deepest(np.concatenate(violated, axis=1), excess)


def _deepest(cells: Float2D, excess: Callable[[Float1D], Float1D]) -> Float1D:
    """The deepest of nine positions in each stretch of touching cells (2, k)."""
    if cells.shape[1] == 0:
        return np.zeros(0)
    left, right = cells[:, np.argsort(cells[0])]
    samples = left[:, None] + (right - left)[:, None] * np.linspace(0.0, 1.0, 9)
    depths = excess(samples.ravel()).reshape(samples.shape)
    row, lowest = np.arange(len(left)), depths.argmin(axis=1)
    stretch = np.concatenate([[0], np.cumsum(left[1:] > right[:-1] + 1e-12)])
    order = np.lexsort((depths[row, lowest], stretch))
    first_of_stretch = np.unique(stretch[order], return_index=True)[1]
    return np.asarray(samples[row, lowest][order[first_of_stretch]])


def _columns(basis: Basis, of_slope: bool, x: Float1D) -> Float2D:
    """(k, 2 + N) bias, linear and wavelet columns of one channel, or their slopes."""
    one, zero = np.ones((len(x), 1)), np.zeros((len(x), 1))
    if of_slope:
        return np.concatenate([zero, one, wavelet_slope_columns(x, basis.alpha, basis.beta)], axis=1)
    return np.concatenate([one, x[:, None], wavelet_columns(x, basis.alpha, basis.beta)], axis=1)


def _least_squares(problem: SeparableProblem, free: Solution, rows: Float2D, limits: Float1D) -> Float2D:
    """Coefficients that minimise the objective subject to rows @ coefficients >= limits.

    In the coordinates of the Gram matrix's Cholesky factor this is a least-distance problem, which
    non-negative least squares solves (Lawson & Hanson 1974, chapter 23).
    """
    start = free.coefficients.ravel()
    factors, norms = zip(*[factored(gram) for gram in free.grams], strict=True)
    factor, norm = np.tril(block_diag(*factors)), np.concatenate(norms)
    reach = solve_triangular(factor, (rows / norm).T, lower=True)
    missing = limits - rows @ start
    size = np.abs(missing).max()
    target = np.zeros(len(norm) + 1)
    target[-1] = 1.0
    multipliers, _ = nnls(np.vstack([reach, missing / size]), target, maxiter=50 * len(limits) + 100)
    share = max(1.0 - float(multipliers @ missing) / size, float(np.finfo(float).eps))
    step = solve_triangular(factor, reach @ multipliers * (size / share), lower=True, trans="T")
    return np.asarray(start + step / norm).reshape(free.coefficients.shape)


def slope_limited(grid: Float1D, force: Float1D, low: float, high: float) -> Float1D:
    """Nearest force (k,) with slope within [low, high]: alternating isotonic regressions (Dykstra 1983)."""
    current = force
    lower_memory, upper_memory = np.zeros_like(force), np.zeros_like(force)
    for _ in range(MOST_ALTERNATIONS):
        start = current
        if np.isfinite(low):
            wanted = current + lower_memory
            current = isotonic_regression(wanted - low * grid).x + low * grid
            lower_memory = wanted - current
        if np.isfinite(high):
            wanted = current + upper_memory
            current = high * grid - isotonic_regression(high * grid - wanted).x
            upper_memory = wanted - current
        if np.abs(current - start).max() <= 1e-9 * np.ptp(force):
            break
    return np.asarray(current)


def _mixed_with_safe(problem: SeparableProblem, solution: Solution, bounds: Sequence[Bound]) -> Solution:
    """As much of the solution as keeps all bounds, the rest a straight line well inside this convex set."""
    everywhere = [bound for bound in bounds if not bound.seam]
    lows = [bound.limit for bound in everywhere if bound.of_slope and bound.sign > 0]
    highs = [bound.limit for bound in everywhere if bound.of_slope and bound.sign < 0]
    inside = {
        (False, False): 0.0,
        (True, False): max(lows, default=0.0) + problem.force_range,
        (False, True): min(highs, default=0.0) - problem.force_range,
        (True, True): 0.5 * (max(lows, default=0.0) + min(highs, default=0.0)),
    }
    readings = np.zeros((len(problem.readout), solution.coefficients.shape[1]))
    readings[0, 1] = 0.0 if any(bound.seam for bound in bounds) else inside[bool(lows), bool(highs)]
    for bound in bounds:
        if bound.at is not None:
            readings[0, 0] = bound.limit - readings[0, 1] * bound.at
    readings[1:, 0] = problem.force_range
    safe = np.linalg.solve(problem.readout, readings)
    refused, kept = 0.0, 1.0
    for _ in range(30):
        share = 0.5 * (refused + kept)
        mixed = (1.0 - share) * solution.coefficients + share * safe
        trial = problem.with_coefficients(solution, mixed)
        if any(len(violated_positions(problem, trial, bound)) for bound in bounds):
            refused = share
        else:
            kept = share
    mixed = (1.0 - kept) * solution.coefficients + kept * safe
    return problem.with_coefficients(solution, mixed)


COMPARED_POSITIONS = 2048
"""Number of positions at which press and release are compared."""

REPORTED_HEIGHT = 3.0
"""Least height of release above press that is reported [RMS errors]: larger than noise."""

LATE_SLOPE_RATIO = 2.0
"""Ratio of the slope where release lies above press to the mean slope, from which the force is late [-]."""


def crosses_where_steep(problem: SeparableProblem, free: Solution) -> bool:
    """True if release lies above press mainly where the force is steep, as a late force makes it.

    A force that is late by t makes h smaller by the slope times speed and t.
    """
    places = np.linspace(0.0, 1.0, COMPARED_POSITIONS)
    columns = wavelet_columns(places, free.basis.alpha, free.basis.beta)
    slopes = wavelet_slope_columns(places, free.basis.alpha, free.basis.beta)
    (_, slope, *of_g), (bias, tilt, *of_h) = problem.readout @ free.coefficients
    steepness = np.abs(slope + slopes @ np.asarray(of_g))
    above = np.maximum(-(bias + tilt * places + columns @ np.asarray(of_h)), 0.0)
    if not above.any():
        return False
    return bool(np.average(steepness, weights=above**2) > LATE_SLOPE_RATIO * np.mean(steepness))


@dataclass(frozen=True)
class Crossing:
    """Interval in which release lies above press."""

    height: float
    """Largest force of release minus press [force]"""
    start: float
    """[box]"""
    end: float
    """[box]"""


def crossing(problem: SeparableProblem, free: Solution) -> Crossing | None:
    """Returns the interval where release lies highest above press; None if the height is small.

    free is a solution g + s h without the bound h >= 0. Only positions measured on both strokes count.
    """
    first = max(float(block.positions.min()) for block in problem.blocks)
    last = min(float(block.positions.max()) for block in problem.blocks)
    if len(problem.readout) < 2 or last <= first:
        return None
    places = np.linspace(first, last, COMPARED_POSITIONS)
    columns = wavelet_columns(places, free.basis.alpha, free.basis.beta)
    bias, slope, *weights = problem.readout[1] @ free.coefficients
    above = -2.0 * (bias + slope * places + columns @ np.asarray(weights))
    deepest = int(np.argmax(above))
    if above[deepest] < REPORTED_HEIGHT * problem.resolved_rmse(free):
        return None
    within = np.flatnonzero(above <= 0.0)
    start = within[within < deepest].max(initial=-1) + 1
    end = within[within > deepest].min(initial=COMPARED_POSITIONS) - 1
    return Crossing(float(above[deepest]), float(places[start]), float(places[end]))

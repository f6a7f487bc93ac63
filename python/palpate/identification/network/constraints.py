# SPDX-License-Identifier: Apache-2.0
"""Constraints of a force over one position: hysteresis h >= 0, slope bounds, a fixed force, a periodic force.

Each constraint bounds a *reading* of the network, a linear combination of the mean force g and the hysteresis
h, or the slope of this combination. It applies at every position of the domain, at one position, or to the
difference of both ends. The least squares is solved with the
constraint imposed at the positions where it was found violated. Elsewhere the constraint is proved: on an
interval [a, b] a twice differentiable reading r stays above min(r(a), r(b)) - max|r''| (b - a)^2 / 8, where
max|r''| over the interval comes from `derivative_bounds`. Intervals are halved until the constraint is proved
or shown violated there. A violated interval gives a new position at which to impose the constraint, until no
interval is violated.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy
from numpy.typing import NDArray

from ..._core.model import derivative_bounds
from ..._typing import Float1D, Float2D
from ..data.compression import Compressed
from .basis import Basis
from .separable import SeparableProblem, Solution

IMPOSED_MARGIN = 1e-2
"""Margin by which an imposed inequality is tighter than the proved one, as a share of the RMS error [-].
Without the margin the proof may need endless rounds."""

POINT_TOLERANCE = 1e-9
"""Largest deviation from a fixed force, or between the ends of a period, as a share of the range of the force
[-]; allows for rounding."""

MOST_ROUNDS = 60
"""Largest number of rounds of imposing and proving the constraints. After the last round the fitted force is
mixed with a straight line that keeps all constraints."""

FIRST_CELLS = 256
"""Number of intervals of the domain at the start of the proof of a constraint."""

MOST_HALVINGS = 40
"""Number of halvings after which an undecided interval counts as a violation: its width is then a rounding
error."""

COMPARED_POSITIONS = 4097
"""Number of positions at which press and release are compared, and at which the slope of a force is
limited."""

MOST_ALTERNATIONS = 50
"""Largest number of alternating projections of a force onto the lower and the upper slope bound."""


NONNEGATIVE, FORCE_RANGE = "press force >= release force", "range of the recorded forces"
"""Names of the constraints h >= 0 and of the least and largest force, in the notes."""


@dataclass(frozen=True)
class Bound:
    """Constraint sign * (reading - limit) >= 0; the reading is a combination of mean force and hysteresis, or
    its slope."""

    readouts: tuple[float, ...]
    """Factors of the mean force g (and the hysteresis h) in the reading, the quantity that the constraint
    limits"""
    of_slope: bool
    """True if the constraint limits a slope [force/box]; False if it limits a force"""
    name: str
    """Name of the constraint in the notes"""
    sign: float
    """+1: the constrained force or slope stays above `limit`; -1: the constrained force or slope stays below
    it"""
    limit: float
    unit: float
    """Factor of the margin IMPOSED_MARGIN: 1 for a force, larger for a steep slope; 0 for an equality, which
    has no margin"""
    at: float | None = None
    """Position of a constraint that applies at one position [share of the unit box]; None: it applies at
    every position"""
    seam: bool = False
    """True if the reading is the difference between the ends of the domain, which is 0 for a periodic
    force"""

    def columns(self, basis: Basis, x: Float1D) -> Float2D:
        """Returns the factors (k, 2 + N) of the coefficients of one channel in the reading at positions
        (k,)."""
        if not self.seam:
            return _columns(basis, self.of_slope, x)
        lower, upper = _columns(basis, self.of_slope, np.array([0.0, 1.0]))
        return np.tile(upper - lower, (len(x), 1))

    def channels(self, problem: SeparableProblem) -> Float1D:
        """Returns the factor of each network of a least-squares problem in the constrained force or slope."""
        return np.asarray(np.array(self.readouts) @ problem.readout)


def domain_bounds(
    problem: SeparableProblem,
    *,
    hysteresis: bool,
    slopes: tuple[float, float] | None,
    fixed: tuple[float, float] | None = None,
    periodic: bool = False,
    forces: tuple[float, float] | None = None,
) -> list[Bound]:
    """Returns the required constraints: h >= 0, and (min, max) of force and slope [force/box] of press g + h
    and release g - h.

    `fixed` is (position [box], force): the mean force g goes through this point, by an upper and a lower
    bound. With `periodic`, g (and h) are equal at both ends of the domain.
    """
    two = len(problem.readout) == 2
    bounds = []
    if periodic:
        bounds += [
            Bound(part, False, "equal ends of the period", sign, 0.0, 0.0, seam=True)
            for part in ([(1.0, 0.0), (0.0, 1.0)] if two else [(1.0,)])
            for sign in (1.0, -1.0)
        ]
    if fixed is not None:
        g = (1.0, 0.0) if two else (1.0,)
        bounds += [Bound(g, False, "fixed force", sign, fixed[1], 0.0, fixed[0]) for sign in (1.0, -1.0)]
    if hysteresis and two:
        bounds.append(Bound((0.0, 1.0), False, NONNEGATIVE, 1.0, 0.0, 1.0))
    for stroke in [(1.0, 1.0), (1.0, -1.0)] if two else [(1.0,)]:
        for sign, limit in zip((1.0, -1.0), forces or (), strict=False):
            bounds.append(Bound(stroke, False, FORCE_RANGE, sign, limit, 1.0))
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
    """Returns the rows with their forces changed as the fitted force must change to keep h >= 0 and the slope
    bounds; noise stays.

    A network grown on the changed rows has wavelets at the positions where the constrained force law needs
    wavelets. The hysteresis is limited at each position, h := max(h, 0), and slopes by isotonic regression.
    """
    bounds = [bound for bound in bounds if not bound.seam]
    grid = np.linspace(0.0, 1.0, COMPARED_POSITIONS)
    readings = problem.readout @ solution.coefficients @ _columns(solution.basis, False, grid).T
    before = readings.copy()
    mix = np.array([[1.0, 1.0], [1.0, -1.0]])[: len(readings), : len(readings)]
    if any(bound.name == NONNEGATIVE for bound in bounds):
        readings[1] = np.maximum(readings[1], 0.0)
    if limits := sorted({bound.limit for bound in bounds if bound.name == FORCE_RANGE}):
        readings = np.linalg.solve(mix, np.clip(mix @ readings, limits[0], limits[-1]))
    if any(bound.of_slope for bound in bounds):
        low = max([bound.limit for bound in bounds if bound.of_slope and bound.sign > 0], default=-np.inf)
        high = min([bound.limit for bound in bounds if bound.of_slope and bound.sign < 0], default=np.inf)
        strokes = [slope_limited(grid, stroke, low, high) for stroke in mix @ readings]
        readings = np.linalg.solve(mix, np.array(strokes))
    shift = [np.interp(rows.positions[:, 0], grid, change) for change in readings - before]
    moved = rows.force + shift[0] + (shift[1] * rows.side if rows.side is not None else 0.0)
    return replace(rows, force=moved)


def impose(problem: SeparableProblem, free: Solution, bounds: Sequence[Bound]) -> Solution:
    """Fits the wavelets of an unconstrained solution by least squares, with all constraints proved at every
    position.

    Returns the unconstrained solution if it keeps all constraints.
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
    """Returns the worst position of each interval where a constraint is violated (k,) [box]; empty if it is
    proved."""
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
            harmonics=solution.basis.harmonics,
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
    """Returns the position of the largest violation in each group of adjacent cells (2, k), from nine
    positions per cell."""
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
    """Returns bias, linear and wavelet columns (k, 2 + N) of one channel at positions (k,), or their
    slopes."""
    one, zero = np.ones((len(x), 1)), np.zeros((len(x), 1))
    if of_slope:
        return np.concatenate([zero, one, basis.slopes(x)], axis=1)
    return np.concatenate([one, x[:, None], basis.columns(x[:, None])], axis=1)


def _least_squares(problem: SeparableProblem, free: Solution, rows: Float2D, limits: Float1D) -> Float2D:
    """Returns the coefficients that minimise the squared error subject to rows @ coefficients >= limits.

    In the coordinates of the Gram matrix's Cholesky factor this is a least-distance problem, which
    non-negative least squares solves (Lawson & Hanson 1974, chapter 23).
    """
    start = free.coefficients.ravel()
    factor = np.tril(scipy.linalg.block_diag(*free.factors))
    reach = scipy.linalg.solve_triangular(factor, rows.T, lower=True)
    missing = limits - rows @ start
    size = np.abs(missing).max()
    target = np.zeros(len(start) + 1)
    target[-1] = 1.0
    multipliers, _ = scipy.optimize.nnls(
        np.vstack([reach, missing / size]), target, maxiter=50 * len(limits) + 100
    )
    share = max(1.0 - float(multipliers @ missing) / size, float(np.finfo(float).eps))
    step = scipy.linalg.solve_triangular(factor, reach @ multipliers * (size / share), lower=True, trans="T")
    return np.asarray(start + step).reshape(free.coefficients.shape)


def slope_limited(grid: Float1D, force: Float1D, low: float, high: float) -> Float1D:
    """Returns the nearest force (k,) with slopes in [low, high], up to the error of at most MOST_ALTERNATIONS
    alternating isotonic regressions (Dykstra 1983)."""
    current = force
    lower_memory, upper_memory = np.zeros_like(force), np.zeros_like(force)
    for _ in range(MOST_ALTERNATIONS):
        start = current
        if np.isfinite(low):
            wanted = current + lower_memory
            current = scipy.optimize.isotonic_regression(wanted - low * grid).x + low * grid
            lower_memory = wanted - current
        if np.isfinite(high):
            wanted = current + upper_memory
            current = high * grid - scipy.optimize.isotonic_regression(high * grid - wanted).x
            upper_memory = wanted - current
        if np.abs(current - start).max() <= 1e-9 * np.ptp(force):
            break
    return np.asarray(current)


def _mixed_with_safe(problem: SeparableProblem, solution: Solution, bounds: Sequence[Bound]) -> Solution:
    """Mixes a solution with the least share of a straight line, such that the mixture keeps all constraints.

    The straight line keeps the inequalities with a margin.
    """
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
    limits = [bound.limit for bound in bounds if bound.name == FORCE_RANGE]
    readings[0, 0] = np.mean(limits) if limits else 0.0
    for bound in bounds:
        if bound.at is not None:
            readings[0, 0] = bound.limit - readings[0, 1] * bound.at
    readings[1:, 0] = 0.25 * np.ptp(limits) if limits else problem.force_range
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


REPORTED_HEIGHT = 3.0
"""Release force above press force is reported only from this difference on [multiples of the RMS error]:
larger than noise."""


def crossing(problem: SeparableProblem, free: Solution) -> tuple[float, float, float] | None:
    """Returns the largest release force minus press force [force], and start and end [box] of the interval in
    which it is above 0; None if it is small.

    `free` is a fitted force g + s h without the constraint h >= 0. With one block of rows for each stroke,
    only positions measured on both strokes are used.
    """
    first = max(float(block.positions.min()) for block in problem.blocks)
    last = min(float(block.positions.max()) for block in problem.blocks)
    if len(problem.readout) < 2 or last <= first:
        return None
    places = np.linspace(first, last, COMPARED_POSITIONS)
    columns = free.basis.columns(places[:, None])
    bias, slope, *weights = problem.readout[1] @ free.coefficients
    above = -2.0 * (bias + slope * places + columns @ np.asarray(weights))
    deepest = int(np.argmax(above))
    if above[deepest] < REPORTED_HEIGHT * problem.resolved_rmse(free):
        return None
    within = np.flatnonzero(above <= 0.0)
    start = within[within < deepest].max(initial=-1) + 1
    end = within[within > deepest].min(initial=COMPARED_POSITIONS) - 1
    return float(above[deepest]), float(places[start]), float(places[end])

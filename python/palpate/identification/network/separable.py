# SPDX-License-Identifier: Apache-2.0
"""Separable least-squares problem: linear in weights, slope and bias for given dilations and translations.

A network f(x) = sum_i w_i psi(alpha_i o (x - beta_i)) + c.x + b (paper eq. 4) is fitted to weighted rows.
With hysteresis, f = g(x) + s h(x), where g and h share their wavelets and each wavelet has two weights. If
the direction state s is +1 or -1 in all rows, press and release are two independent least-squares problems
over the same wavelets, for g + h and g - h: two blocks of one channel each. If s has values in between, the
problem is one block of two channels, with factors 1 and s.

Positions are scaled to the unit box of the data, so that all inputs have comparable dilations and
translations.

Refinement moves all dilations and translations at once, by bounded variable projection. Weights, slopes and
biases are eliminated (Golub & Pereyra 1973, in Kaufman's form), Levenberg-Marquardt steps are taken on
log(alpha) and beta. Without bounds, a dilation can grow without limit on measured switch curves, and the
least squares becomes singular. So dilations stay within the resolution of the positions around the wavelet,
and translations near the data, from the start on. A step is kept only if it lowers the squared error.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import accumulate, starmap

import numpy as np
import scipy
from numpy.typing import NDArray

from ..._core.model import wavelet_steps
from ..._typing import Float1D, Float2D
from ...recording.motion import FORCE_RESOLUTION, SIGNIFICANT_STANDARD_ERRORS
from ..data.compression import Compressed, HeldOutRows
from ..data.limits import NO_LIMITS, RowLimits, evenness, neighbour_correlation
from .basis import Basis, Resolution

RIDGE = 1e-11
"""Ridge of the least squares on columns of unit norm [-]: keeps nearly dependent columns solvable, far below
any noise."""


def solved(factor: Float2D, right: NDArray[np.float64]) -> NDArray[np.float64]:
    """Solves the linear system of a factored matrix."""
    found, _ = scipy.linalg.lapack.dpotrs(factor, right, lower=1)
    return np.asarray(found).reshape(right.shape)


def half_solved(factor: Float2D, right: Float2D) -> Float2D:
    """Returns M @ right, where M' M is the inverse of the factored matrix; inner products of results are
    those of projections."""
    found, _ = scipy.linalg.lapack.dtrtrs(factor, right, lower=1)
    return np.asarray(found)


def factored(gram: Float2D) -> Float2D:
    """Returns the Cholesky factor L of a positive semidefinite matrix, gram = L L'; only the lower triangle
    of L is valid.

    The ridge is raised until the factorisation succeeds. The rounding error of the factorisation does not
    depend on the units of the columns (Demmel 1989).
    """
    ridged = gram.copy()
    diagonal = np.einsum("ii->i", ridged)
    unit, ridge = np.where(diagonal > 0.0, diagonal, 1.0), RIDGE
    while True:
        diagonal[:] = (1.0 + ridge) * unit
        factor, failed = scipy.linalg.lapack.dpotrf(ridged, lower=1)
        if not failed:
            return np.asarray(factor)
        ridge *= 100.0


CORE_RADIUS = float(np.sqrt(3.0))
"""Half width of a wavelet's core, the part between its two side lobes, in the scaled distance u from the
wavelet's centre [-]; the data must resolve the core."""

LEAST_SLIDING_INPUT = 0.9
"""Absolute direction state |s| above which a row belongs to a stroke [-]."""

TINY = float(np.finfo(float).tiny)
"""Smallest normal number, which replaces 0 in quotients and logarithms."""


@dataclass(frozen=True)
class Block:
    """Weighted rows and their channels: force = sum_k channel_k * (force of network k at the position of the
    row)."""

    positions: Float2D
    """(m, d) positions in the unit box"""
    target: Float1D
    """(m,) force of each row, multiplied by the square root of the row's weight"""
    channels: Float2D
    """(m, channels) factor of each network in the force of each row, multiplied by the square root of the
    row's weight"""
    scatter: float = 0.0
    """Mean squared distance of the samples of a row from its position"""

    @staticmethod
    def weighted(rows: Compressed, channels: Float2D, on: NDArray[np.bool_] | slice = slice(None)) -> Block:
        """Returns the rows `on` as a block, with their channels (m, channels)."""
        root = np.sqrt(rows.weight[on])
        positions = np.ascontiguousarray(rows.positions[on])
        return Block(positions, root * rows.force[on], root[:, None] * channels, rows.scatter)

    def columns(self, basis: Basis) -> Float2D:
        """Returns the values (m, N) of all wavelets and harmonics at the rows.

        The mean over samples around a position reduces a harmonic of dilation alpha by
        exp(-alpha^2 scatter / 2), to second order in their distance from it.
        """
        columns = basis.columns(self.positions)
        if basis.harmonics:
            columns[:, basis.hats :] *= np.exp(-0.5 * self.scatter * basis.alpha[basis.hats :, 0] ** 2)
        return columns

    @property
    def n_channels(self) -> int:
        return int(self.channels.shape[1])

    def strokes(self) -> list[Float2D]:
        """Returns the positions of the rows of each stroke, or of all rows for one channel or an empty
        stroke; rows within the play between the strokes are left out.

        The two weights of a wavelet are determined only if the rows of both strokes resolve the wavelet.
        """
        if self.n_channels == 1:
            return [self.positions]
        side = self.channels[:, 1] / self.channels[:, 0]
        sliding = [self.positions[sign * side > LEAST_SLIDING_INPUT] for sign in (1.0, -1.0)]
        return [rows if len(rows) else self.positions for rows in sliding]

    def design(self, wavelets: Float2D) -> Float2D:
        """Returns the matrix (m, channels * (1 + d + N)) of bias, linear and wavelet columns, one channel
        after the other."""
        first, n = 1 + self.positions.shape[1], wavelets.shape[1]
        design = np.empty((self.n_channels, first + n, len(wavelets)))
        for columns, channel in zip(design, self.channels.T, strict=True):
            columns[0] = channel
            np.multiply(self.positions.T, channel, out=columns[1:first])
            np.multiply(wavelets.T, channel, out=columns[first:])
        return design.reshape(-1, len(wavelets)).T


@dataclass(frozen=True)
class Solution:
    """Solution of the least squares for fixed wavelets."""

    basis: Basis
    coefficients: Float2D
    """(channels, 1 + d + N) bias, slopes (d inputs) and weights (N wavelets) of the network of each
    channel"""
    rss: float
    """Weighted sum of squared differences between the forces of the rows and the fitted force [force^2]"""
    objective: float
    """Residual sum of squares plus the penalty on large weights [force^2]; refinement lowers this value"""
    designs: tuple[Float2D, ...]
    grams: tuple[Float2D, ...]
    """Normal matrix of least squares of each block of rows, without the penalty on large weights"""
    factors: tuple[Float2D, ...]
    """Factor of the normal matrix with this penalty"""
    residuals: tuple[Float1D, ...]


@dataclass(frozen=True)
class SeparableProblem:
    """Least-squares problem: rows, channels, and the penalty on large weights that makes all wavelets
    solvable."""

    blocks: tuple[Block, ...]
    readout: Float2D
    """(1 or 2, channels) factors of each channel's network in the mean force g (and, in row 2, in the
    hysteresis h)"""
    samples: float
    """Number of recorded rows that the compressed rows represent"""
    within: float
    """Sum of squared differences of recorded forces from the mean force of the row that represents them
    [force^2]"""
    force_range: float
    """Largest minus smallest force, above 0 [force]; for a constant force its size, or 1"""
    resolved_by: int
    """Least number of distinct positions, on every stroke, that the core of a wavelet must contain"""
    held_out: HeldOutRows | None = None
    """Held-out rows, for the criteria that use held-out rows"""
    limits: RowLimits = NO_LIMITS
    """Limits of the information in the rows"""
    every_input: bool = True
    """True if each wavelet uses every input"""
    prior: float = 0.0
    """Penalty factor of a squared weight [-]; see :meth:`with_prior`"""
    resolutions: tuple[Resolution, ...] = ()
    """Distances between the positions of the rows of each stroke; computed if not given"""

    def __post_init__(self) -> None:
        known = self.resolutions or tuple(
            Resolution(rows) for block in self.blocks for rows in block.strokes()
        )
        object.__setattr__(self, "resolutions", known)
        object.__setattr__(self, "resolved_by", min(self.resolved_by, *map(len, known)))

    @property
    def dimension(self) -> int:
        """Number of inputs of the force."""
        return int(self.blocks[0].positions.shape[1])

    @property
    def n_channels(self) -> int:
        """Number of channels (networks that are fitted together) of all blocks of rows."""
        return sum(block.n_channels for block in self.blocks)

    def n_parameters(self, basis: Basis, more: int = 0) -> int:
        """Returns the number of fitted values with these wavelets and `more` wavelets of all inputs.

        These are a dilation and a translation for each input that a wavelet uses, a weight per wavelet and
        channel, d slopes and a bias per channel, and two weights per order of harmonics and channel. An order
        is a whole number, which many rows determine without error, and does not count.
        """
        used = int(basis.used.sum()) + more * self.dimension
        return 2 * used + self.n_channels * (len(basis) + more + 1 + self.dimension)

    def total(self, rss: float) -> float:
        """Returns the sum of squared errors of all samples [force^2] for a criterion; at least the sum for
        errors of the size of the force resolution."""
        least = max(FORCE_RESOLUTION * self.force_range, self.limits.force_error)
        return max(rss + self.within, least**2 * self.samples, TINY)

    @property
    def independent(self) -> float:
        """Number of independent rows that the compressed rows represent."""
        return self.limits.independent * self.samples

    def rmse(self, solution: Solution) -> float:
        """Returns the RMS error of a solution over all recorded rows [force]."""
        return float(np.sqrt((solution.rss + self.within) / self.samples))

    def resolved_rmse(self, solution: Solution) -> float:
        """Returns the RMS error of a solution over all recorded rows [force], at least the force
        resolution."""
        return float(np.sqrt(self.total(solution.rss) / self.samples))

    def evenness(self, solution: Solution) -> float:
        """Returns the evenness of the residuals of all blocks."""
        return evenness(np.concatenate(solution.residuals))

    def structured(self, solution: Solution) -> bool:
        """True if residuals at neighbouring rows of some block are correlated."""
        return any(
            neighbour_correlation(left) * math.sqrt(len(left)) > SIGNIFICANT_STANDARD_ERRORS
            for left in solution.residuals
        )

    def force(self, solution: Solution, positions: Float2D, side: Float1D | None) -> Float1D:
        """Returns the force (k,) of a solution at positions (k, d), with direction states (k,)."""
        wavelets = solution.basis.columns(positions)
        columns = np.concatenate([np.ones((len(positions), 1)), positions, wavelets], axis=1)
        channels = columns @ (self.readout @ solution.coefficients).T
        return np.asarray(channels[:, 0] if side is None else channels[:, 0] + side * channels[:, -1])

    def with_prior(self, rss: float) -> SeparableProblem:
        """Returns the problem with a penalty on weights that are large compared with the range of the force.

        The penalty of a weight of the size of this range counts as much as one sample with the noise that
        `rss`, a residual sum of squares, shows.

        Without the penalty, a wavelet at positions where one stroke has no data could get any weight for that
        stroke.
        """
        return replace(self, prior=self.total(rss) / self.samples / self.force_range**2)

    def part(self, most: int) -> SeparableProblem:
        """Returns the problem of at most `most` random rows of each block, the same rows at each call.

        It represents the samples of these rows only.
        """
        if all(len(block.target) <= most for block in self.blocks):
            return self
        random = np.random.default_rng(0)
        blocks = []
        for block in self.blocks:
            rows = len(block.target)
            chosen = np.sort(random.choice(rows, size=min(most, rows), replace=False))
            part = (block.positions[chosen], block.target[chosen], block.channels[chosen])
            blocks.append(Block(*part, block.scatter))
        share = _weight(blocks) / _weight(self.blocks)
        samples, within = share * self.samples, share * self.within
        return replace(self, blocks=tuple(blocks), samples=samples, within=within, resolutions=())

    def finest(self, basis: Basis) -> Float2D:
        """Returns the largest dilation (N, 1) that the positions around each wavelet resolve, on every
        stroke [1/range of recorded positions]; infinite for harmonics."""
        hats = basis.without_harmonics()
        reach = np.max([each.reach(hats, self.resolved_by) for each in self.resolutions], axis=0)
        finest = CORE_RADIUS / np.maximum(reach, 1e-9)
        return np.asarray(np.append(finest, np.full(basis.harmonics, np.inf)))[:, None]

    def solve(self, basis: Basis) -> Solution:
        """Fits weights, slopes and biases of all channels for given wavelets."""
        designs = tuple(block.design(block.columns(basis)) for block in self.blocks)
        return self._solved(basis, designs, tuple(np.asarray(each.T @ each) for each in designs))

    def solve_again(self, solution: Solution) -> Solution:
        """Returns the solution of this problem with the wavelets of a given one, whose problem differs only
        in the penalty on large weights."""
        return self._solved(solution.basis, solution.designs, solution.grams)

    def _solved(self, basis: Basis, designs: tuple[Float2D, ...], grams: tuple[Float2D, ...]) -> Solution:
        factors = tuple(starmap(self._factor, zip(self.blocks, grams, strict=True)))
        tables = [
            solved(factor, design.T @ block.target).reshape(block.n_channels, -1)
            for block, design, factor in zip(self.blocks, designs, factors, strict=True)
        ]
        return self._solution(basis, np.concatenate(tables), designs, grams, factors)

    def with_coefficients(self, solution: Solution, coefficients: Float2D) -> Solution:
        """Returns a solution with the same wavelets, other coefficients (channels, 1 + d + N), and its
        errors.

        `solution` may belong to another problem that differs only in the forces.
        """
        return self._solution(
            solution.basis, coefficients, solution.designs, solution.grams, solution.factors
        )

    def _solution(
        self,
        basis: Basis,
        coefficients: Float2D,
        designs: tuple[Float2D, ...],
        grams: tuple[Float2D, ...],
        factors: tuple[Float2D, ...],
    ) -> Solution:
        residuals = tuple(
            block.target - design @ table.ravel()
            for block, design, table in zip(self.blocks, designs, self._tables(coefficients), strict=True)
        )
        rss = float(sum(residual @ residual for residual in residuals))
        weights = coefficients[:, 1 + self.dimension :]
        penalty = self.prior * float(np.vdot(weights, weights))
        return Solution(basis, coefficients, rss, rss + penalty, designs, grams, factors, residuals)

    def _tables(self, coefficients: Float2D) -> list[Float2D]:
        """Returns the bias, slopes and weights of the channels of each block of rows."""
        counts = [block.n_channels for block in self.blocks]
        return [coefficients[end - n : end] for n, end in zip(counts, accumulate(counts), strict=True)]

    def normal_equations(self, at: Solution) -> tuple[Float2D, Float1D]:
        """Returns the Gauss-Newton matrix and the descent direction of variable projection at a solution.

        With weights, slopes and biases eliminated, the residual is P y, where y holds the forces and P
        projects onto the complement of the design's columns. The Jacobian of the residual in Kaufman's form
        is -P (d design/d theta) coefficients, with dilations and translations theta (Golub & Pereyra 1973,
        Kaufman 1975). Steps are dimensionless, d log(alpha) and alpha d(beta), ordered (quantity, input,
        wavelet).
        """
        basis = at.basis
        wavelet = np.nonzero(basis.used.T)[1]
        size = 2 * len(wavelet)
        matrix, gradient = np.zeros((size, size)), np.zeros(size)
        for block, design, factor, table, residual in zip(
            self.blocks, at.designs, at.factors, self._tables(at.coefficients), at.residuals, strict=True
        ):
            jacobian = wavelet_steps(block.positions, basis.alpha, basis.beta, basis.used)
            slope = table[:, 1 + self.dimension :].T @ block.channels.T
            jacobian.T[...] *= slope[np.tile(wavelet, 2)]
            cross = design.T @ jacobian
            spanned = half_solved(factor, cross)
            matrix += jacobian.T @ jacobian - spanned.T @ spanned
            gradient += jacobian.T @ residual
        return matrix, gradient

    def removal_costs(self, solution: Solution) -> Float1D:
        """Returns, for each wavelet and each order of harmonics, the increase of the penalised squared error
        if it were removed and all weights, slopes and biases fitted again."""
        n, first, hats = len(solution.basis), 1 + self.dimension, solution.basis.hats
        alone, pairs = np.arange(hats)[:, None], np.arange(hats, n).reshape(-1, 2)
        costs = [np.zeros(len(terms)) for terms in (alone, pairs)]
        for block, factor, table in zip(
            self.blocks, solution.factors, self._tables(solution.coefficients), strict=True
        ):
            inverse = solved(factor, np.eye(len(factor)))
            for cost, terms in zip(costs, (alone, pairs), strict=True):
                shape = len(terms), block.n_channels * terms.shape[1]
                weights = table.T[first + terms].transpose(0, 2, 1).reshape(shape)
                channel = np.arange(block.n_channels)[:, None] * (first + n) + first
                columns = (channel + terms[:, None, :]).reshape(shape)
                minors = inverse[columns[:, :, None], columns[:, None, :]]
                cost += np.einsum("nk,nk->n", weights, np.linalg.solve(minors, weights[:, :, None])[:, :, 0])
        return np.concatenate(costs)

    def _factor(self, block: Block, gram: Float2D) -> Float2D:
        """Returns the factor of a normal matrix plus the penalty on large weights."""
        gram = gram.copy()
        of_weights = np.einsum("ii->i", gram).reshape(block.n_channels, -1)[:, 1 + self.dimension :]
        of_weights += self.prior
        return factored(gram)


def _weight(blocks: Sequence[Block]) -> float:
    """Returns the sum of the weights of all rows."""
    return float(sum(block.channels[:, 0] @ block.channels[:, 0] for block in blocks))


def problem_of(
    rows: Compressed, *, resolved_by: int, held_out: HeldOutRows | None = None
) -> SeparableProblem:
    """Returns the least-squares problem of compressed rows with positions in the unit box.

    Without direction state s the problem has one channel; with s = +-1 one block per stroke; else one block
    with the channels 1 and s.
    """
    if rows.side is None:
        blocks = [Block.weighted(rows, np.ones((len(rows.force), 1)))]
        readout = np.array([[1.0]])
    elif np.all(np.abs(rows.side) == 1.0) and np.unique(rows.side).size == 2:
        strokes = (rows.side > 0, rows.side < 0)
        blocks = [Block.weighted(rows, np.ones((int(on.sum()), 1)), on) for on in strokes]
        readout = np.array([[0.5, 0.5], [0.5, -0.5]])
    else:
        channels = np.column_stack([np.ones_like(rows.side), rows.side])
        blocks = [Block.weighted(rows, channels)]
        readout = np.eye(2)
    return SeparableProblem(
        tuple(blocks),
        readout,
        samples=rows.samples,
        within=rows.within,
        force_range=float(np.ptp(rows.force)) or float(np.abs(rows.force).max()) or 1.0,
        resolved_by=resolved_by,
        held_out=held_out,
        limits=rows.limits,
    )


LEAST_DILATION = 0.5
"""Smallest dilation [1/range of recorded positions]: a wider wavelet would be nearly a parabola over all
recorded positions."""

LARGEST_OVERHANG = 0.3
"""Largest distance of a translation outside the range of recorded positions, as a share of this range [-]. A
wavelet further away is nearly a straight line in this range."""

LONGEST_STEP = 0.7
"""Longest refinement step of log(dilation) and of dilation * translation [-]. For a longer step the
linearisation is not valid."""

MOST_IDLE_STEPS = 2
"""Number of successive accepted refinement steps, each with a decrease of the error below the tolerance,
after which refinement ends."""


def refine(problem: SeparableProblem, start: Solution, *, steps: int, tolerance: float) -> Solution:
    """Refines the wavelets of `start` to lower the penalised squared error, by at most `steps` accepted or
    refused steps.

    Wavelets outside the bounds, as those of a frame or of other rows can be, are moved to the bounds first:
    else every step would move them, raise the error, and be refused. Refinement ends after MOST_IDLE_STEPS
    successive accepted steps that each lowered the deviance by less than `tolerance`.
    """
    if start.basis.hats == 0:
        return start
    basis, finest = _moved(problem, start.basis, np.zeros(2 * problem.dimension * len(start.basis)))
    within = (basis.alpha == start.basis.alpha).all() and (basis.beta == start.basis.beta).all()
    best, linearised = start if within else problem.solve(basis), None
    step_damping, idle = 1e-2, 0
    for _ in range(steps):
        if linearised is not best:
            matrix, gradient = problem.normal_equations(best)
            linearised = best
        step = _bounded_step(best.basis, finest, matrix, gradient, step_damping)
        basis, finest_there = _moved(problem, best.basis, step)
        trial = problem.solve(basis)
        if trial.objective < best.objective:
            gain = problem.samples * (best.objective - trial.objective) / problem.total(trial.rss)
            best, finest, step_damping = trial, finest_there, max(step_damping / 5.0, 1e-9)
            idle = idle + 1 if gain < tolerance else 0
        else:
            step_damping *= 6.0
        if idle >= MOST_IDLE_STEPS or step_damping > 1e8:
            break
    return best


def _bounded_step(
    basis: Basis, finest: Float2D, matrix: Float2D, gradient: Float1D, step_damping: float
) -> Float1D:
    """Returns the Levenberg-Marquardt step of dilations and translations; a value at its bound does not move
    further."""
    used = basis.used.T
    above = [basis.alpha >= finest * (1 - 1e-9), basis.beta >= 1 + LARGEST_OVERHANG]
    below = [basis.alpha <= LEAST_DILATION * (1 + 1e-9), basis.beta <= -LARGEST_OVERHANG]
    held_above, held_below = (np.concatenate([each.T[used] for each in held]) for held in (above, below))
    free = np.flatnonzero(~np.where(gradient > 0, held_above, held_below))
    step = np.zeros(2 * used.size)
    if len(free) == 0:
        return step
    system = matrix[free[:, None], free]
    diagonal = system.diagonal().copy()
    floor = 1e-6 * diagonal.max() + TINY
    while True:
        system.flat[:: len(free) + 1] = diagonal + step_damping * np.maximum(diagonal, floor)
        factor, failed = scipy.linalg.lapack.dpotrf(system, lower=1)
        if not failed:
            break
        step_damping = 10.0 * step_damping + 1e-12
    found, _ = scipy.linalg.lapack.dpotrs(factor, gradient[free], lower=1)
    step[np.flatnonzero([used, used])[free]] = np.clip(found, -LONGEST_STEP, LONGEST_STEP)
    return step


def _moved(problem: SeparableProblem, basis: Basis, step: Float1D) -> tuple[Basis, Float2D]:
    """Returns the wavelets after a step, limited to the allowed values, and their largest allowed dilations
    (N, 1)."""
    grow, shift = step.reshape(2, problem.dimension, len(basis)).transpose(0, 2, 1)
    beta = np.clip(basis.beta + shift / basis.alpha, -LARGEST_OVERHANG, 1 + LARGEST_OVERHANG)
    used = basis.used
    moved = Basis(basis.alpha, np.where(used, beta, basis.beta), basis.harmonics)
    finest = problem.finest(moved)
    alpha = np.clip(basis.alpha * np.exp(grow), LEAST_DILATION, np.maximum(finest, LEAST_DILATION))
    return Basis(np.where(used, alpha, basis.alpha), moved.beta, basis.harmonics), finest

# SPDX-License-Identifier: Apache-2.0
"""Refinement: all dilations and translations at once, by bounded variable projection.

Weights, slopes and biases are eliminated (Golub & Pereyra 1973, in Kaufman's form), Levenberg-Marquardt steps
are taken on log(alpha) and beta. Unbounded, a dilation runs away on measured switch curves and the basis
turns singular. So dilations stay within what the positions around the wavelet resolve, translations within
the reach of the data, and a step is kept only if it lowers the objective: never worse than the start.
"""

import numpy as np
from scipy.linalg.lapack import dpotrf, dpotrs
from scipy.optimize import Bounds, minimize

from ..._core.model import wavelet_jacobian
from ..._typing import Float1D, Float2D
from .basis import Basis
from .separable import SeparableProblem, Solution

COARSEST = 0.5
"""Smallest dilation [1/box]: over the unit box a wider wavelet is a parabola, as this one nearly is."""

REACH = 0.3
"""How far outside the unit box a translation may stand [box]."""

LONGEST_STEP = 0.7
"""Longest step of log(alpha) and of alpha beta: beyond it the basis changes too much to be linearised."""

IDLE_STEPS = 2
"""Steps in a row with next to no gain after which refinement ends."""


def refine(problem: SeparableProblem, start: Solution, *, steps: int, tolerance: float) -> Solution:
    """Lower the objective from start by at most `steps` accepted or tried steps.

    It ends early after IDLE_STEPS steps in a row that each lowered the deviance by less than tolerance.
    """
    best, linearised = start, None
    if len(start.basis) == 0:
        return best
    damping, idle, finest = 1e-2, 0, problem.finest(best.basis.beta)
    for _ in range(steps):
        if linearised is not best:
            matrix, gradient = problem.normal_equations(best)
            linearised = best
        step = _bounded_step(best.basis, finest, matrix, gradient, damping)
        basis, finest_there = _moved(problem, best.basis, step)
        trial = problem.solve(basis)
        if trial.objective < best.objective:
            gain = problem.samples * (best.objective - trial.objective) / problem.total(trial.rss)
            best, finest, damping = trial, finest_there, max(damping / 5.0, 1e-9)
            idle = idle + 1 if gain < tolerance else 0
        else:
            damping *= 6.0
        if idle >= IDLE_STEPS or damping > 1e8:
            break
    return best


def _bounded_step(
    basis: Basis, finest: Float2D, matrix: Float2D, gradient: Float1D, damping: float
) -> Float1D:
    """Levenberg-Marquardt step over the unknowns that no bound holds against their push."""
    d = basis.alpha.shape[1]
    push_alpha, push_beta = gradient.reshape(2, d, len(basis)).transpose(0, 2, 1)
    held_alpha = (push_alpha > 0) & (basis.alpha >= finest * (1 - 1e-9))
    held_alpha |= (push_alpha < 0) & (basis.alpha <= COARSEST * (1 + 1e-9))
    held_beta = (push_beta > 0) & (basis.beta >= 1 + REACH) | (push_beta < 0) & (basis.beta <= -REACH)
    free = np.flatnonzero(~np.stack([held_alpha.T, held_beta.T]).ravel())
    step = np.zeros(len(gradient))
    if len(free) == 0:
        return step
    system = matrix[np.ix_(free, free)]
    diagonal = np.diag(system)
    floor = 1e-6 * diagonal.max() + np.finfo(float).tiny
    while True:
        damped = system.copy()
        np.einsum("ii->i", damped)[:] += damping * np.maximum(diagonal, floor)
        factor, failed = dpotrf(damped, lower=1)
        if not failed:
            break
        damping = 10.0 * damping + 1e-12
    step[free] = dpotrs(factor, gradient[free], lower=1)[0]
    return np.clip(step, -LONGEST_STEP, LONGEST_STEP)


def _moved(problem: SeparableProblem, basis: Basis, step: Float1D) -> tuple[Basis, Float2D]:
    """The basis after a step, brought back to its bounds, and the largest dilations there (N, 1)."""
    grow, shift = step.reshape(2, problem.dimension, len(basis)).transpose(0, 2, 1)
    beta = np.clip(basis.beta + shift / basis.alpha, -REACH, 1 + REACH)
    finest = problem.finest(beta)
    alpha = np.clip(basis.alpha * np.exp(grow), COARSEST, np.maximum(finest, COARSEST))
    return Basis(alpha, beta), finest


STEPS_FOR_ONE = 10
"""Quasi-Newton steps that are taken for each one of variable projection that is asked for."""


def refine_all(problem: SeparableProblem, start: Solution, *, steps: int, tolerance: float) -> Solution:
    """Lower the objective from start; never worse than it.

    The unknowns are the coefficients times the norms of their columns over that of the target, log(alpha) and
    alpha_start beta, so that all are of one size. It ends where a step lowers the deviance by less than
    tolerance, a tenth of it for each of its shorter steps.
    """
    basis, d = start.basis, problem.dimension
    if len(basis) == 0:
        return start
    size = np.sqrt(problem.total(start.rss))
    norms = np.concatenate(
        [
            np.linalg.norm(design, axis=0).reshape(block.n_channels, -1)
            for block, design in zip(problem.blocks, start.designs, strict=True)
        ]
    )
    scale = size / np.maximum(norms, 1e-6 * norms.max())
    coefficients = start.coefficients.size

    def apart(unknown: Float1D) -> tuple[Float2D, Basis]:
        table = unknown[:coefficients].reshape(scale.shape) * scale
        log_alpha, shift = unknown[coefficients:].reshape(2, len(basis), d)
        return table, Basis(np.exp(log_alpha), shift / basis.alpha)

    def objective(unknown: Float1D) -> tuple[float, Float1D]:
        table, moved = apart(unknown)
        value, by_table, by_log_alpha, by_beta = _gradient(problem, table, moved)
        slope = np.concatenate(
            [(by_table * scale).ravel(), by_log_alpha.ravel(), (by_beta / basis.alpha).ravel()]
        )
        return value / size**2, slope / size**2

    ceiling = np.broadcast_to(np.maximum(problem.finest(basis.beta), basis.alpha), basis.alpha.shape)
    free = np.full(coefficients, np.inf)
    low = [-free, np.full(basis.alpha.size, np.log(COARSEST)), (-REACH * basis.alpha).ravel()]
    high = [free, np.log(ceiling).ravel(), ((1.0 + REACH) * basis.alpha).ravel()]
    begin = [
        (start.coefficients / scale).ravel(),
        np.log(basis.alpha).ravel(),
        (basis.alpha * basis.beta).ravel(),
    ]
    found = minimize(
        objective,
        np.concatenate(begin),
        jac=True,
        method="L-BFGS-B",
        bounds=Bounds(np.concatenate(low), np.concatenate(high)),
        options={"maxiter": STEPS_FOR_ONE * steps, "ftol": tolerance / problem.samples / STEPS_FOR_ONE},
    )
    _, moved = apart(found.x)
    resolved = np.maximum(problem.finest(moved.beta), COARSEST)
    best = problem.solve(Basis(np.minimum(moved.alpha, resolved), moved.beta))
    return best if best.objective < start.objective else start


def _gradient(
    problem: SeparableProblem, table: Float2D, basis: Basis
) -> tuple[float, Float2D, Float2D, Float2D]:
    """The objective; its derivatives by coefficients (channels, 1 + d + N), log(alpha), beta (N, d)."""
    first = 1 + problem.dimension
    by_table = np.zeros_like(table)
    by_log_alpha, by_beta = np.zeros_like(basis.alpha), np.zeros_like(basis.beta)
    weights = table[:, first:]
    value = problem.prior * float((weights**2).sum())
    by_table[:, first:] = 2.0 * problem.prior * weights
    row = 0
    for block in problem.blocks:
        own = slice(row, row + block.n_channels)
        row += block.n_channels
        columns, by_alpha, by_centre = wavelet_jacobian(block.positions, basis.alpha, basis.beta)
        design = block.design(columns)
        rest = block.target - design @ table[own].ravel()
        value += float(rest @ rest)
        by_table[own] -= 2.0 * (design.T @ rest).reshape(block.n_channels, -1)
        pull = -2.0 * rest[:, None] * (block.channels @ weights[own])
        for k in range(problem.dimension):
            by_log_alpha[:, k] += np.einsum("mn,mn->n", pull, by_alpha[k]) * basis.alpha[:, k]
            by_beta[:, k] += np.einsum("mn,mn->n", pull, by_centre[k])
    return value, by_table, by_log_alpha, by_beta

# SPDX-License-Identifier: Apache-2.0
"""Refinement as published: quasi-Newton on all parameters at once (Zhang 1997; paper section 3).

Weights, slopes, biases, dilations and translations descend together by L-BFGS within the bounds of
:mod:`.refinement`. Variable projection needs a tenth of its steps, so it is the default; this is here to be
compared with.
"""

import numpy as np
from scipy.optimize import Bounds, minimize

from .._core.model import wavelet_jacobian
from .._typing import Float1D, Float2D
from .refinement import COARSEST, REACH
from .separable import Basis, SeparableProblem, Solution

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

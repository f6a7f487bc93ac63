# SPDX-License-Identifier: Apache-2.0
"""The paper's identification: wavelets selected from a frame, quasi-Newton refinement, and the force without
an assumed mass and damping."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy

from .._core.dynamics import environment_filters, paper_sample_time_s
from .._core.model import wavelet_jacobian
from .._typing import Float1D, Float2D
from ..arguments import number_of, shown
from ..errors import InputError
from ..identification import IdentifyOptions
from ..identification.data.compression import Compressor
from ..identification.network.basis import Basis
from ..identification.network.separable import (
    LARGEST_OVERHANG,
    LEAST_DILATION,
    SeparableProblem,
    Solution,
    problem_of,
)
from ..identification.search.evidence import criterion_of
from ..identification.search.growth import Growth
from ..identification.search.selection import Library, OrthogonalSelection
from ..identification.threads import one_thread
from ..recording import Recording

MOST_STEPS = 300
"""Largest number of quasi-Newton steps."""

STORED_STEPS = 100
"""Number of steps from which the quasi-Newton method estimates the curvature: with 10 it needs more than ten
times as many steps."""

PERIOD_TOLERANCE = 0.01
"""Largest relative difference between the time step of a recording and that of the paper's filters [-]."""


@dataclass
class PaperNetwork:
    """Identifies f(x) = sum_i w_i psi(alpha_i o (x - beta_i)) + c.x + b (paper eq. 4) as the paper does.

    Selects wavelets from a frame (Zhang 1997); BIC chooses their number. If `quasi_newton` is True, a
    quasi-Newton method (L-BFGS-B, Byrd et al. 1995) then moves all parameters at once.

    Parameters
    ----------
    selection : str
        Order in which wavelets are selected. "orthogonal" adds the wavelet that reduces the error most
        (Chen, Billings & Luo 1989), "residual" the one that fits the residual best. "backward" removes
        wavelets from a larger orthogonal selection.
    quasi_newton : bool
        False keeps the dilations and translations of the frame.
    max_wavelets : int
        Largest number of wavelets.

    Raises
    ------
    palpate.InputError
        The selection is unknown.
    """

    selection: str = "orthogonal"
    quasi_newton: bool = False
    max_wavelets: int = IdentifyOptions.max_wavelets

    def __post_init__(self) -> None:
        if self.selection not in [*SELECTIONS]:
            raise InputError(f"selection is {shown(self.selection)}: must be one of {', '.join(SELECTIONS)}")

    def fit(self, X: Float2D, y: Float1D) -> PaperNetwork:
        """Fits the network to the inputs X (n, d) and the force y (n,).

        Raises
        ------
        palpate.InputError
            A value is not finite, or a column of X does not vary.
        """
        for name, values in (("X", X), ("y", y)):
            if len(bad := values[~np.isfinite(values)]):
                raise InputError(f"{name} contains {bad[0]}: every value must be a finite number")
        self.lower_, self.reach_ = X.min(axis=0), np.ptp(X, axis=0)
        if not self.reach_.all():
            column = int(np.argmin(self.reach_))
            raise InputError(f"column {column} of X is {X[0, column]:g} in every row: it must vary")
        options, d = IdentifyOptions(), X.shape[1]
        cells = options.search.cells(d)
        with one_thread():
            rows = Compressor(self._box(X), y, max_positions=cells).rows()
            problem = problem_of(rows, resolved_by=options.search.resolved_by)
            library = Growth(options).library(problem)
            line, more = (problem.n_parameters(Basis.empty(d), more) for more in (0, 1))
            fewer_than_rows = (len(y) - 1 - line) // (more - line)
            most = max(0, min(self.max_wavelets, fewer_than_rows))
            order = SELECTIONS[self.selection](problem, library, most)
            networks = [solved(problem, library.members(order[:size])) for size in range(len(order) + 1)]
            best = networks[int(np.argmin([criterion_of(problem, each, "bic") for each in networks]))]
            if self.quasi_newton:
                best = refine_all(problem.with_prior(best.rss), best)
        self.basis_, self.coefficients_ = best.basis, best.coefficients[0]
        self.n_wavelets_, self.n_parameters_ = len(best.basis), problem.n_parameters(best.basis)
        return self

    def predict(self, X: Float2D) -> Float1D:
        """Returns the force (n,) at the rows of X."""
        box = self._box(X)
        columns = np.column_stack([np.ones(len(box)), box, self.basis_.columns(box)])
        return np.asarray(columns @ self.coefficients_)

    def _box(self, X: Float2D) -> Float2D:
        """Returns the inputs X (n, d) in the unit box of the fitted rows."""
        return np.ascontiguousarray((X - self.lower_) / self.reach_)


def solved(problem: SeparableProblem, basis: Basis) -> Solution:
    """Returns the least squares for given wavelets, with the weight penalty for their own error."""
    return problem.with_prior(problem.solve(basis).rss).solve(basis)


def orthogonal_order(problem: SeparableProblem, library: Library, most: int) -> list[int]:
    """Returns at most `most` candidates, each the one that reduces the error most after those before it."""
    selection = OrthogonalSelection(library, problem.solve(Basis.empty(problem.dimension)))
    order: list[int] = []
    while len(order) < most and (gains := selection.gains()).max(initial=0.0) > 0.0:
        order.append(int(np.argmax(gains)))
        selection.take(order[-1])
    return order


def residual_order(problem: SeparableProblem, library: Library, most: int) -> list[int]:
    """Returns at most `most` candidates, each the one that fits the residual of those before it best."""
    (columns,), (gram,), order = library.columns, library.grams, list[int]()
    while len(order) < min(most, len(library)):
        (residual,) = solved(problem, library.members(order)).residuals
        falls = (columns[0] @ residual.astype(np.float32)) ** 2 / gram[0, 0]
        falls[order] = -1.0
        order.append(int(np.argmax(falls)))
    return order


def backward_order(problem: SeparableProblem, library: Library, most: int) -> list[int]:
    """Returns an orthogonal selection in the reverse order of removal: the candidate whose removal raises the
    error least comes last."""
    left, removed = orthogonal_order(problem, library, most), []
    while left:
        costs = problem.removal_costs(solved(problem, library.members(left)))
        removed.append(left.pop(int(np.argmin(costs))))
    return removed[::-1]


SELECTIONS = {"orthogonal": orthogonal_order, "residual": residual_order, "backward": backward_order}
"""Function of each selection, which orders candidates: the first k are the network of k wavelets."""


def refine_all(problem: SeparableProblem, start: Solution) -> Solution:
    """Refines all parameters of a single-valued network by L-BFGS-B; the result is never worse than `start`.

    The unknowns are coefficients times the norm of their column over the root of the squared error of
    `start`, log(alpha), and alpha_start beta, so that all have a similar size. Dilations and translations
    keep the bounds of the main refinement.
    """
    basis, d = start.basis, problem.dimension
    if len(basis) == 0:
        return start
    (design,) = start.designs
    size = np.sqrt(problem.total(start.rss))
    norms = np.linalg.norm(design, axis=0)
    scale = size / np.maximum(norms, 1e-6 * norms.max())

    def apart(unknown: Float1D) -> tuple[Float1D, Basis]:
        log_alpha, shift = unknown[len(scale) :].reshape(2, len(basis), d)
        return unknown[: len(scale)] * scale, Basis(np.exp(log_alpha), shift / basis.alpha)

    def objective(unknown: Float1D) -> tuple[float, Float1D]:
        value, by_coefficients, by_log_alpha, by_beta = gradient(problem, *apart(unknown))
        slopes = by_coefficients * scale, by_log_alpha.ravel(), (by_beta / basis.alpha).ravel()
        return value / size**2, np.concatenate(slopes) / size**2

    def unknowns(coefficients: Float1D, alpha: Float2D, beta: Float2D) -> Float1D:
        return np.concatenate([coefficients, np.log(alpha).ravel(), (basis.alpha * beta).ravel()])

    free, ones = np.full(len(scale), np.inf), np.ones_like(basis.alpha)
    finest = np.maximum(problem.finest(basis), basis.alpha)
    low = unknowns(-free, LEAST_DILATION * ones, -LARGEST_OVERHANG * ones)
    high = unknowns(free, finest, (1.0 + LARGEST_OVERHANG) * ones)
    found = scipy.optimize.minimize(
        objective,
        unknowns(start.coefficients[0] / scale, basis.alpha, basis.beta),
        jac=True,
        method="L-BFGS-B",
        bounds=scipy.optimize.Bounds(low, high),
        options={"maxiter": MOST_STEPS, "maxcor": STORED_STEPS, "ftol": 0.0},
    )
    moved = apart(found.x)[1]
    finest = np.maximum(problem.finest(moved), LEAST_DILATION)
    best = problem.solve(Basis(np.minimum(moved.alpha, finest), moved.beta))
    return best if best.objective < start.objective else start


def gradient(
    problem: SeparableProblem, coefficients: Float1D, basis: Basis
) -> tuple[float, Float1D, Float2D, Float2D]:
    """Returns the penalised squared error and its derivatives by coefficients (1 + d + N), log(alpha) and
    beta (N, d)."""
    (block,), first = problem.blocks, 1 + problem.dimension
    weights = coefficients[first:]
    columns, by_alpha, by_centre = wavelet_jacobian(block.positions, basis.alpha, basis.beta)
    design = block.design(columns)
    rest = block.target - design @ coefficients
    by_coefficients = -2.0 * (design.T @ rest)
    by_coefficients[first:] += 2.0 * problem.prior * weights
    pull = -2.0 * (rest * block.channels[:, 0])[:, None] * weights
    by_log_alpha, by_beta = (np.einsum("mn,kmn->nk", pull, by) for by in (by_alpha, by_centre))
    value = float(rest @ rest) + problem.prior * float(weights @ weights)
    return value, by_coefficients, by_log_alpha * basis.alpha, by_beta


def paper_force(recording: Recording, *, mass: float, damping: float | None = None) -> Float1D:
    """Returns the recorded force (n,) minus that of an assumed mass and damping, F - m a - B_o v.

    The velocity v and the acceleration a are those of the paper's published differentiators: figure 11
    without damping, figure 13 with it. They lag behind the motion from 2 Hz on. The paper's curve is
    ``identify(recording.position, force, inputs="position")`` for this force.

    Parameters
    ----------
    recording : Recording
        With a time step of 0.001 s.
    mass : float
        Object mass m [force s^2/position]; 0.001 in the paper.
    damping : float, optional
        Object damping B_o [force s/position]; 0.5 in the paper.

    Raises
    ------
    palpate.InputError
        The recording has no time, its time step is not that of the paper's filters, or a number is not
        finite.
    """
    mass = number_of("mass", mass)
    if recording.time is None:
        raise InputError("the recording has no time, which the paper's filters need: read it with time=NAME")
    steps = np.diff(recording.time)
    if np.abs(steps / paper_sample_time_s - 1.0).max() > PERIOD_TOLERANCE:
        raise InputError(
            f"the time steps of the recording are {steps.min():g} to {steps.max():g} s: the paper's filters "
            f"need {paper_sample_time_s:g} s"
        )
    filters = environment_filters("implicit" if damping is None else "explicit", "paper")
    velocity = filters.g2.filter(recording.position - recording.position[0])
    force = recording.force - mass * filters.g1.filter(velocity)
    return np.asarray(force if damping is None else force - number_of("damping", damping) * velocity)

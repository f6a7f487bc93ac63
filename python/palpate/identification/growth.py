# SPDX-License-Identifier: Apache-2.0
"""How many wavelets? Grow one, refine all, and when the criterion has had enough, prune and refine again.

Growth takes the best frame member by one step of forward orthogonal selection against the refined network, so
it sees what is still missing. Pruning removes what refinement made superfluous, coincident wavelets first of
all, since of two that coincide one costs nothing to remove. N is thus decided again on the refined network.
"""

from dataclasses import dataclass

import numpy as np

from .options import IdentifyOptions
from .refinement import refine
from .selection import Library, OrthogonalSelection
from .separable import Basis, SeparableProblem, Solution
from .stopping import CRITERIA, deviance

PRUNE_CANDIDATES = 3
"""Wavelets tried for removal before pruning gives up."""

PRUNE_HOPE = 6.0
"""A removal is tried if refinement would have to win back at most this many times the wavelet's own price."""


GROWING_TOLERANCE = 1e-3
"""While the size is open, refinement ends at steps that gain less than this share of the squared error."""

FINAL_TOLERANCE = 1e-4
"""The same for the accepted network."""


@dataclass(frozen=True)
class PathPoint:
    """One network on the way: rmse in the unit of force, criterion as a deviance (see stopping)."""

    rung: str
    n_wavelets: int
    rmse: float
    criterion: float


@dataclass(frozen=True)
class Grown:
    """The network that a rung settled on."""

    solution: Solution
    criterion: float
    stop_reason: str
    path: tuple[PathPoint, ...]


def judge(problem: SeparableProblem, solution: Solution, options: IdentifyOptions) -> float:
    """Criterion of a solution: the smaller the better."""
    p = problem.n_parameters(len(solution.basis))
    return deviance(options.criterion, problem.total(solution.rss), problem.samples, p)


def grow(
    problem: SeparableProblem, library: Library, start: Basis, rung: str, options: IdentifyOptions
) -> Grown:
    """Grow from the wavelets of start until the criterion stops it, prune, refine to the end.

    Growth goes on for `patience` wavelets past the best size, and pruning starts from there: a few wavelets
    too many let refinement find a better arrangement of those that stay.
    """
    problem.set_prior(problem.solve(start).rss)
    current = _improved(problem, problem.solve(start), options.refine_steps, options)
    path = [_point(problem, current, rung, options)]
    best, since, stop_reason = path[0].criterion, 0, "max_wavelets"
    while len(current.basis) < options.max_wavelets:
        added = _with_best_candidate(problem, library, current)
        if added is None:
            stop_reason = "data"
            break
        current = _improved(problem, added, options.refine_steps, options)
        path.append(_point(problem, current, rung, options))
        since = 0 if path[-1].criterion < best else since + 1
        best = min(best, path[-1].criterion)
        if since >= options.patience:
            stop_reason = options.criterion
            break
    pruned = prune(problem, current, options)
    final = _improved(problem, pruned, options.final_steps, options, tolerance=FINAL_TOLERANCE)
    path.append(_point(problem, final, rung, options))
    if len(final.basis) < options.max_wavelets and stop_reason == "max_wavelets":
        stop_reason = options.criterion
    return Grown(final, path[-1].criterion, stop_reason, tuple(path))


def prune(problem: SeparableProblem, start: Solution, options: IdentifyOptions) -> Solution:
    """Remove wavelets, the cheapest first, while the refined remainder has a smaller criterion."""
    current, value = start, judge(problem, start, options)
    removed = True
    while removed and len(current.basis):
        removed = False
        costs = problem.removal_costs(current)
        for index in np.argsort(costs)[:PRUNE_CANDIDATES]:
            rest = problem.solve(current.basis.without(int(index)))
            if judge(problem, rest, options) > value + PRUNE_HOPE * _price(problem, current, options):
                break
            trial = _improved(problem, rest, options.refine_steps, options)
            if judge(problem, trial, options) < value:
                current, value, removed = trial, judge(problem, trial, options), True
                break
    return current


def _price(problem: SeparableProblem, solution: Solution, options: IdentifyOptions) -> float:
    """What the criterion charges for one of the solution's wavelets."""
    price, n = CRITERIA[options.criterion], len(solution.basis)
    return price(problem.samples, problem.n_parameters(n)) - price(
        problem.samples, problem.n_parameters(n - 1)
    )


def _with_best_candidate(problem: SeparableProblem, library: Library, current: Solution) -> Solution | None:
    """The network with the frame member that helps most, or None where data allow no further wavelet."""
    if len(library) == 0 or problem.n_parameters(len(current.basis) + 1) >= problem.samples:
        return None
    gains = OrthogonalSelection(library, current).gains()
    index = int(np.argmax(gains))
    if gains[index] <= 0.0:
        return None
    chosen = Basis(library.basis.alpha[[index]], library.basis.beta[[index]])
    return problem.solve(current.basis.joined(chosen))


def _improved(
    problem: SeparableProblem,
    solution: Solution,
    steps: int,
    options: IdentifyOptions,
    tolerance: float = GROWING_TOLERANCE,
) -> Solution:
    """Refine, then let the prior on the weights follow the noise level that is left."""
    if options.refine:
        solution = refine(problem, solution, steps=steps, tolerance=tolerance)
    problem.set_prior(solution.rss)
    return problem.solve(solution.basis)


def _point(problem: SeparableProblem, solution: Solution, rung: str, options: IdentifyOptions) -> PathPoint:
    return PathPoint(rung, len(solution.basis), problem.rmse(solution), judge(problem, solution, options))

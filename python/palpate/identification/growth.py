# SPDX-License-Identifier: Apache-2.0
"""How many wavelets? Grow one, refine all, and when the criterion has had enough, prune and refine again.

Growth takes the best frame member by one step of forward orthogonal selection against the refined network, so
it sees what is still missing. Pruning removes what refinement made superfluous, coincident wavelets first of
all, since of two that coincide one costs nothing to remove. N is thus decided again on the refined network.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from .._typing import Float1D
from ..errors import InputError
from .frame import resolved_frame
from .fresh import FreshRows
from .options import IdentifyOptions
from .progress import report
from .quasi_newton import refine_all
from .refinement import refine
from .selection import Library, orthogonal_gains, residual_gains, select_backward
from .separable import RESOLVED, TINY, Basis, SeparableProblem, Solution
from .stopping import CRITERIA, ON_FRESH_ROWS, choice, deviance, enough

PRUNE_CANDIDATES = 3
"""Wavelets tried for removal before pruning gives up."""

PRUNE_HOPE = 6.0
"""A removal is tried if refinement would have to win back at most this many times the wavelet's own price."""

WITHOUT_NOISE = 5
"""Positions that a wavelet's core must hold where there is hardly any noise to be taken for structure."""

EVEN = 0.5
"""Evenness of what a network leaves from which it is noise, and no finer wavelet is tried."""

WORTH_FINER = 4.0
"""How many times smaller the error must become by wavelets finer than noise would allow."""

ALIKE = 3.0
"""Standard errors of the correlation of what is left at neighbouring positions from which it is no noise."""

SMOOTH = 0.25
"""Share of the positions that a core holds at least while a force over several inputs is tried as smooth."""

STRETCHED = 64
"""Members of the frame that are tried stretched along each input, where there are several."""

STARTS = 5
"""Of these, candidates that are refined before one is taken."""

FIRST_STEPS = 4
"""Refinement steps that they are judged by."""

GROWING_TOLERANCE = 0.4
"""While the size is open, refinement ends at steps that lower the deviance by less."""

FINAL_TOLERANCE = 0.04
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
    if options.criterion not in ON_FRESH_ROWS:
        return problem.deviance(options.criterion, solution.rss, p)
    if problem.fresh is None:
        raise InputError(f"criterion is {options.criterion!r}, but no rows were kept back to judge on")
    return fresh_deviance(options.criterion, problem.fresh, problem.fresh_errors(solution, problem.fresh))


def fresh_deviance(criterion: str, fresh: FreshRows, errors: Float1D) -> float:
    """Criterion of a network that leaves these errors on rows that were kept back."""
    counted = fresh.felt(errors) if criterion == "perceptual" else errors
    smallest = (1e-12 * float(np.ptp(fresh.force))) ** 2 * len(counted)
    return deviance(criterion, max(float(counted @ counted), smallest, TINY), len(counted), 0)


def grow(
    problem: SeparableProblem,
    library: Library,
    start: Basis,
    rung: str,
    options: IdentifyOptions,
    *,
    single: bool = True,
) -> Grown:
    """Grow from the wavelets of start; where what is left is no noise, then finer than noise would allow.

    Noise is as large everywhere, and differs from each position to the next. Finer wavelets are taken where
    they leave a fraction of the error, or where neighbours agree about what is left and the criterion falls
    as for a rung of the ladder. A smooth force over several inputs is left to wide wavelets. All that is for
    a force known to be a single one, not for wavelets that stay on the frame, nor where fresh rows judge.
    Noise that is correlated, and the steps of a force, look like structure and are not.
    """
    coarse = not options.refine or options.selection == "backward" or options.criterion in ON_FRESH_ROWS
    free = single and not coarse and problem.n_channels == 1
    wide = free and problem.dimension > 1
    found = _grown(problem, library, start, rung, options, wide=wide)
    settled = wide and _little(problem, problem.rmse(found.solution))
    if not free or settled or len(found.solution.basis) == 0:
        return found
    limits = problem.limits
    if limits.independent < 1.0 or problem.rmse(found.solution) <= WORTH_FINER * limits.force_error:
        return found
    alike = problem.likeness(found.solution) > ALIKE
    if problem.resolved_by <= WITHOUT_NOISE or not (alike or problem.evenness(found.solution) < EVEN):
        return found
    before, problem.resolved_by = problem.resolved_by, WITHOUT_NOISE
    fine = Library(problem, resolved_frame(problem, options))
    finer = _grown(problem, fine, found.solution.basis, rung, options)
    earned = alike and finer.criterion + options.rung_evidence < found.criterion
    if earned or problem.rmse(finer.solution) * WORTH_FINER < problem.rmse(found.solution):
        return replace(finer, path=(*found.path[:-1], finer.path[-1]))
    problem.resolved_by = before
    problem.set_prior(found.solution.rss)
    return found


def _grown(
    problem: SeparableProblem,
    library: Library,
    start: Basis,
    rung: str,
    options: IdentifyOptions,
    *,
    starts: int = STARTS,
    wide: bool = False,
) -> Grown:
    """Grow from the wavelets of start until the criterion stops it, prune, refine to the end.

    Growth goes on for `patience` wavelets past the best size, and pruning starts from there: a few wavelets
    too many let refinement find a better arrangement of those that stay. Where fresh rows judge, the size is
    theirs to choose and nothing is pruned. With wide, wide wavelets alone have one try, once the error has
    come half the way, in digits, from the force's range to what a sensor resolves.
    """
    problem.set_prior(problem.solve(start).rss)
    if options.selection == "backward":
        start = _eliminated(problem, library, start, options)
    current = _improved(problem, problem.solve(start), options.refine_steps, options)
    path, grown = [_point(problem, current, rung, options)], [current]
    best, since, stop_reason = path[0].criterion, 0, "max_wavelets"
    while len(current.basis) < options.max_wavelets:
        report(rung, len(current.basis))
        if enough(options.criterion, path[-1].criterion) or options.selection == "backward":
            stop_reason = options.criterion
            break
        if wide and problem.rmse(current) <= np.sqrt(RESOLVED) * problem.force_range:
            wide = False
            if (smooth := _smooth(problem, start, rung, options)) is not None:
                return smooth
        added = _with_candidate(problem, library, current, options, starts)
        if added is None:
            stop_reason = "data"
            break
        current = _improved(problem, added, options.refine_steps, options)
        path.append(_point(problem, current, rung, options))
        grown.append(current)
        since = 0 if path[-1].criterion < best else since + 1
        best = min(best, path[-1].criterion)
        if since >= options.patience * problem.dimension:
            stop_reason = options.criterion
            break
    if problem.fresh is not None and options.criterion in ON_FRESH_ROWS:
        values = [point.criterion for point in path]
        pruned = grown[choice(options.criterion, values, len(problem.fresh.force))]
    else:
        pruned = prune(problem, current, options)
    final = _improved(problem, pruned, options.final_steps, options, tolerance=FINAL_TOLERANCE)
    path.append(_point(problem, final, rung, options))
    if len(final.basis) < options.max_wavelets and stop_reason == "max_wavelets":
        stop_reason = options.criterion
    return Grown(final, path[-1].criterion, stop_reason, tuple(path))


def _smooth(problem: SeparableProblem, start: Basis, rung: str, options: IdentifyOptions) -> Grown | None:
    """A network of wide wavelets, if it leaves little.

    The best candidates are mostly narrow: they mend a few rows each, and rows are far apart over several
    inputs, so that a network of them reads the rows well and errs between and beside them. Wide ones cannot.
    Where rows of one cell differ by more there is no need to try.
    """
    if not _little(problem, np.sqrt(problem.within / problem.samples)):
        return None
    before, prior = problem.resolved_by, problem.prior
    problem.resolved_by = max(before, int(SMOOTH * len(problem.blocks[0].positions)))
    library = Library(problem, resolved_frame(problem, options))
    found = _grown(problem, library, start, rung, options, starts=1)
    problem.resolved_by = before
    if _little(problem, problem.rmse(found.solution)):
        return found
    problem.prior = prior
    return None


def _little(problem: SeparableProblem, error: float) -> bool:
    """Whether an error is so near to what a sensor resolves that finer wavelets are not worth trying."""
    return bool(error <= WORTH_FINER * RESOLVED * problem.force_range)


def _eliminated(problem: SeparableProblem, library: Library, start: Basis, options: IdentifyOptions) -> Basis:
    """The wavelets of start, and those that backward elimination leaves of the library."""
    selected = select_backward(
        problem, library, max_wavelets=options.max_wavelets, criterion=options.criterion
    )
    return start.joined(library.members(selected.order[: selected.best]))


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
    return price(problem.independent, problem.n_parameters(n)) - price(
        problem.independent, problem.n_parameters(n - 1)
    )


def _with_candidate(
    problem: SeparableProblem, library: Library, current: Solution, options: IdentifyOptions, starts: int
) -> Solution | None:
    """The network with the frame member that helps most, or None where data allow no further wavelet.

    The frame has one dilation for all inputs. Where there are several, members are tried stretched along each
    of them as well, and a few that differ are refined a little before one is taken: what fits best unrefined
    often ends in a worse minimum.
    """
    if len(library) == 0 or problem.n_parameters(len(current.basis) + 1) >= problem.independent:
        return None
    measured = residual_gains if options.selection == "residual" else orthogonal_gains
    gains = measured(library, current)
    several = problem.dimension > 1 and options.refine
    if several:
        library = library.stretched(problem, _falling(gains)[:STRETCHED])
        gains = measured(library, current)
    chosen = library.unlike(_falling(gains), starts if several else 1)
    tried = [problem.solve(current.basis.joined(library.members([index]))) for index in chosen]
    if len(tried) > 1:
        tried = [_refined(problem, start, FIRST_STEPS, options, GROWING_TOLERANCE) for start in tried]
    return min(tried, key=lambda solution: solution.objective, default=None)


def _improved(
    problem: SeparableProblem,
    solution: Solution,
    steps: int,
    options: IdentifyOptions,
    tolerance: float = GROWING_TOLERANCE,
) -> Solution:
    """Refine, then let the prior on the weights follow the noise level that is left."""
    if options.refine:
        solution = _refined(problem, solution, steps, options, tolerance)
    problem.set_prior(solution.rss)
    return problem.solve(solution.basis)


def _falling(gains: Float1D) -> NDArray[np.intp]:
    """The numbers of the candidates that gain anything, the best first."""
    return np.argsort(-gains, kind="stable")[: np.count_nonzero(gains > 0.0)]


def _refined(
    problem: SeparableProblem, start: Solution, steps: int, options: IdentifyOptions, tolerance: float
) -> Solution:
    descend = refine_all if options.refinement == "quasi-newton" else refine
    return descend(problem, start, steps=steps, tolerance=tolerance)


def _point(problem: SeparableProblem, solution: Solution, rung: str, options: IdentifyOptions) -> PathPoint:
    return PathPoint(rung, len(solution.basis), problem.rmse(solution), judge(problem, solution, options))

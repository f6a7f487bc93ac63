# SPDX-License-Identifier: Apache-2.0
"""Number of wavelets: grow one, refine all, and when the criterion stops growth, prune and refine again.

Growth takes the best frame member by one step of forward orthogonal selection against the refined network, so
it fits the part that is still missing. Pruning removes wavelets that refinement made superfluous, coincident
ones first, since of two that coincide one costs nothing to remove. N is decided again on the refined network.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..._typing import Float1D
from ..data.limits import FORCE_RESOLUTION
from ..network.basis import COARSEST_CANDIDATE, MOST_LIBRARY_ENTRIES, Basis, truncated_frame
from ..network.fitted import PathPoint
from ..network.separable import SeparableProblem, Solution, refine, refine_all
from ..options import IdentifyOptions
from .evidence import CRITERIA, ON_HELD_OUT_ROWS, choice, criterion_of, enough, report
from .selection import Library, orthogonal_gains, residual_gains, select_backward

MOST_PRUNE_TRIALS = 3
"""Largest number of wavelets tried for removal in succession. The cheapest ones come first, so more rarely
succeed."""

MOST_REMOVAL_COST = 6.0
"""Largest cost of a removal before refinement, in prices of one wavelet, that is tried [-]. Refinement seldom
recovers more."""

LEAST_CORE_POSITIONS = 5
"""Least number of positions in a wavelet's core if noise is too small to be taken for structure."""

LEAST_NOISE_EVENNESS = 0.5
"""Least evenness of a residual that is noise [-]: 1 for normal noise. Finer wavelets are then not tried."""

FINER_ERROR_RATIO = 4.0
"""Least factor by which finer wavelets must reduce the error [-]. Fitted noise reduces it by less."""

SIGNIFICANT_CORRELATION = 3.0
"""Correlation of neighbouring residuals above which they are structure [standard errors]."""

SMOOTH_CORE_SHARE = 0.25
"""Least share of the positions in a core while a smooth force over several inputs is tried [-]."""

MOST_STRETCHED = 64
"""Largest number of frame members that are also tried stretched along each of several inputs."""

MOST_REFINED_CANDIDATES = 5
"""Largest number of these candidates that are refined before one is chosen."""

CANDIDATE_STEPS = 4
"""Refinement steps of each of these candidates: enough to compare them."""

GROWING_TOLERANCE = 0.4
"""Fall of the deviance by one step below which refinement ends during growth [-]: far below the penalty of a
wavelet."""

FINAL_TOLERANCE = 0.04
"""The same for the accepted network [-]."""


@dataclass(frozen=True)
class Grown:
    """The network that growth settled on."""

    problem: SeparableProblem
    """Which the solution solves, with the prior and the resolution that growth ended with"""
    solution: Solution
    criterion: float
    stop_reason: str
    path: tuple[PathPoint, ...]


class Growth:
    """Grows networks by the search settings of an identification.

    Parameters
    ----------
    options : IdentifyOptions
    single : bool
        The force is known to be single-valued: two strokes that a motion samples at different places look
        like one force that needs ever more wavelets.
    """

    def __init__(self, options: IdentifyOptions, *, single: bool = True) -> None:
        self._search, self._criterion, self._most = options.search, options.criterion, options.max_wavelets
        self._single = single
        self._refine = refine_all if options.search.refinement == "quasi-newton" else refine

    def grow(
        self,
        problem: SeparableProblem,
        start: Basis,
        model_class: str,
        *,
        most: int | None = None,
        library: Library | None = None,
    ) -> Grown:
        """Grows from the wavelets of start to `most` wavelets at most.

        If the residual is still structured, it continues with narrower wavelets than noise would allow. Noise
        is as large everywhere, and differs from each position to the next. Finer wavelets are taken where
        they leave a fraction of the error, or where neighbouring residuals are correlated and the criterion
        falls as for a model class. This holds for a single-valued force alone, not for wavelets that stay on
        the frame, nor where held-out rows judge. A smooth force over several inputs is left to wide wavelets.
        Correlated noise, and the steps of a force, look like structure and are not.
        """
        search = self._search
        most = self._most if most is None else most
        coarse = not search.refine or search.selection == "backward"
        free = self._single and not coarse and problem.n_channels == 1
        free = free and self._criterion not in ON_HELD_OUT_ROWS
        wide = free and problem.dimension > 1
        library = library or self.library(problem)
        found = self._grown(problem, library, start, model_class, most, wide=wide)
        problem = found.problem
        settled = wide and _below_resolution(problem, problem.rmse(found.solution))
        if not free or settled or len(found.solution.basis) == 0:
            return found
        limits = problem.limits
        if limits.independent < 1.0 or problem.rmse(found.solution) <= FINER_ERROR_RATIO * limits.force_error:
            return found
        correlated = problem.neighbour_correlation(found.solution) > SIGNIFICANT_CORRELATION
        is_even = problem.evenness(found.solution) >= LEAST_NOISE_EVENNESS
        if problem.resolved_by <= LEAST_CORE_POSITIONS or (is_even and not correlated):
            return found
        fine = replace(problem, resolved_by=LEAST_CORE_POSITIONS)
        finer = self._grown(fine, self.library(fine), found.solution.basis, model_class, most)
        accepted = correlated and finer.criterion + search.evidence < found.criterion
        if accepted or problem.rmse(finer.solution) * FINER_ERROR_RATIO < problem.rmse(found.solution):
            return replace(finer, path=(*found.path[:-1], finer.path[-1]))
        return replace(found, problem=problem.with_prior(found.solution.rss))

    def library(self, problem: SeparableProblem) -> Library:
        """The truncated frame over the rows of a problem, down to their resolution."""
        search = self._search
        positions = np.concatenate([block.positions for block in problem.blocks])
        frame = truncated_frame(
            positions,
            coarsest=COARSEST_CANDIDATE,
            finest=float(problem.finest(positions).max()),
            frame_scale=search.frame_scale,
            frame_step=search.frame_step,
            max_candidates=max(1, min(search.max_candidates, MOST_LIBRARY_ENTRIES // len(positions))),
        )
        return Library(problem, frame)

    def prune(self, problem: SeparableProblem, start: Solution) -> tuple[SeparableProblem, Solution]:
        """Removes wavelets, the cheapest first, while the refined remainder has a smaller criterion.

        The prior of the problem that is returned is that of the last trial.
        """
        current, value = start, self._criterion_of(problem, start)
        removed = True
        while removed and len(current.basis):
            removed = False
            costs = problem.removal_costs(current)
            for index in np.argsort(costs)[:MOST_PRUNE_TRIALS]:
                rest = problem.solve(current.basis.without(int(index)))
                if self._criterion_of(problem, rest) > value + MOST_REMOVAL_COST * self._price(
                    problem, current
                ):
                    break
                problem, trial = self._improved(problem, rest, self._search.refine_steps)
                if self._criterion_of(problem, trial) < value:
                    current, value, removed = trial, self._criterion_of(problem, trial), True
                    break
        return problem, current

    def _grown(
        self,
        problem: SeparableProblem,
        library: Library,
        start: Basis,
        model_class: str,
        most: int,
        *,
        starts: int = MOST_REFINED_CANDIDATES,
        wide: bool = False,
    ) -> Grown:
        """Grows from the wavelets of start until the criterion stops it, prunes, refines to the end.

        Growth continues for `patience` wavelets past the best size, and pruning starts from there: a few
        wavelets too many let refinement find a better arrangement of the others. Where held-out rows judge,
        they choose the size and nothing is pruned. With wide, wide wavelets alone have one try, once the
        error is half way, in digits, from the force's range to the resolution of a sensor.
        """
        search, criterion = self._search, self._criterion
        problem = problem.with_prior(problem.solve(start).rss)
        if search.selection == "backward":
            selected = select_backward(problem, library, max_wavelets=most, criterion=criterion)
            start = start.joined(library.members(selected.order[: selected.best]))
        problem, current = self._improved(problem, problem.solve(start), search.refine_steps)
        path, grown = [self._point(problem, current, model_class)], [current]
        best, since, stop_reason = path[0].criterion, 0, "max_wavelets"
        while len(current.basis) < most:
            report(model_class, len(current.basis))
            if enough(criterion, path[-1].criterion) or search.selection == "backward":
                stop_reason = criterion
                break
            if wide and problem.rmse(current) <= np.sqrt(FORCE_RESOLUTION) * problem.force_range:
                wide = False
                if (smooth := self._smooth(problem, start, model_class, most)) is not None:
                    return smooth
            added = self._with_candidate(problem, library, current, starts)
            if added is None:
                stop_reason = "data"
                break
            problem, current = self._improved(problem, added, search.refine_steps)
            path.append(self._point(problem, current, model_class))
            grown.append(current)
            since = 0 if path[-1].criterion < best else since + 1
            best = min(best, path[-1].criterion)
            if since >= search.patience * problem.dimension:
                stop_reason = criterion
                break
        if problem.held_out is not None and criterion in ON_HELD_OUT_ROWS:
            values = [point.criterion for point in path]
            pruned = grown[choice(criterion, values, len(problem.held_out.force))]
        else:
            problem, pruned = self.prune(problem, current)
        problem, final = self._improved(problem, pruned, search.final_steps, FINAL_TOLERANCE)
        path.append(self._point(problem, final, model_class))
        if len(final.basis) < most and stop_reason == "max_wavelets":
            stop_reason = criterion
        return Grown(problem, final, path[-1].criterion, stop_reason, tuple(path))

    def _smooth(self, problem: SeparableProblem, start: Basis, model_class: str, most: int) -> Grown | None:
        """A network of wide wavelets, if its error is small.

        The best candidates are mostly narrow: each corrects a few rows, and rows are far apart over several
        inputs, so that a network of them fits the rows well and errs between them. Wide ones
        cannot. Where rows of one cell differ by more, they are not tried.
        """
        if not _below_resolution(problem, np.sqrt(problem.within / problem.samples)):
            return None
        held = max(problem.resolved_by, int(SMOOTH_CORE_SHARE * len(problem.blocks[0].positions)))
        smooth = replace(problem, resolved_by=held)
        found = self._grown(smooth, self.library(smooth), start, model_class, most, starts=1)
        if not _below_resolution(problem, problem.rmse(found.solution)):
            return None
        return replace(found, problem=replace(found.problem, resolved_by=problem.resolved_by))

    def _price(self, problem: SeparableProblem, solution: Solution) -> float:
        """Price of one of the solution's wavelets by the criterion."""
        penalty, n = CRITERIA[self._criterion], len(solution.basis)
        return penalty(problem.independent, problem.n_parameters(n)) - penalty(
            problem.independent, problem.n_parameters(n - 1)
        )

    def _with_candidate(
        self, problem: SeparableProblem, library: Library, current: Solution, starts: int
    ) -> Solution | None:
        """The network with the frame member that helps most, or None where data allow no further wavelet.

        The frame has one dilation for all inputs. Where there are several, members are tried stretched along
        each of them as well. A few that differ are refined a little before one is taken: the one that fits
        best unrefined often ends in a worse minimum.
        """
        search = self._search
        if len(library) == 0 or problem.n_parameters(len(current.basis) + 1) >= problem.independent:
            return None
        measured = residual_gains if search.selection == "residual" else orthogonal_gains
        gains = measured(library, current)
        several = problem.dimension > 1 and search.refine
        if several:
            library = library.stretched(problem, _falling(gains)[:MOST_STRETCHED])
            gains = measured(library, current)
        chosen = library.distinct(_falling(gains), starts if several else 1)
        tried = [problem.solve(current.basis.joined(library.members([index]))) for index in chosen]
        if len(tried) > 1:
            tried = [
                self._refine(problem, each, steps=CANDIDATE_STEPS, tolerance=GROWING_TOLERANCE)
                for each in tried
            ]
        return min(tried, key=lambda solution: solution.objective, default=None)

    def _improved(
        self, problem: SeparableProblem, solution: Solution, steps: int, tolerance: float = GROWING_TOLERANCE
    ) -> tuple[SeparableProblem, Solution]:
        """Refines, then lets the prior on the weights follow the noise level that is left."""
        if self._search.refine:
            solution = self._refine(problem, solution, steps=steps, tolerance=tolerance)
        problem = problem.with_prior(solution.rss)
        return problem, problem.solve(solution.basis)

    def _criterion_of(self, problem: SeparableProblem, solution: Solution) -> float:
        return criterion_of(problem, solution, self._criterion)

    def _point(self, problem: SeparableProblem, solution: Solution, model_class: str) -> PathPoint:
        return PathPoint(
            model_class, len(solution.basis), problem.rmse(solution), self._criterion_of(problem, solution)
        )


def _below_resolution(problem: SeparableProblem, error: float) -> bool:
    """True if an error is so near to the resolution of a sensor that finer wavelets are not worth trying."""
    return bool(error <= FINER_ERROR_RATIO * FORCE_RESOLUTION * problem.force_range)


def _falling(gains: Float1D) -> NDArray[np.intp]:
    """The numbers of the candidates that gain anything, the best first."""
    return np.argsort(-gains, kind="stable")[: np.count_nonzero(gains > 0.0)]

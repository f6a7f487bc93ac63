# SPDX-License-Identifier: Apache-2.0
"""Finds the number of wavelets: adds one wavelet, refines all, repeats until the criterion stops growth, then
removes superfluous wavelets and refines again.

Growth adds the wavelet of the frame that reduces the error of the refined network most, by one step of
forward orthogonal selection. Pruning removes wavelets that refinement made superfluous, the one first whose
removal raises the error least.
"""

from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from ..._core.model import most_wavelets
from ..._typing import Float1D
from ...recording.motion import FORCE_RESOLUTION
from ..data.limits import LEAST_NOISE_EVENNESS
from ..log import PathPoint
from ..network.basis import COARSEST_CANDIDATE, MOST_LIBRARY_ENTRIES, Basis, truncated_frame
from ..network.separable import (
    LEAST_DILATION,
    SeparableProblem,
    Solution,
    refine,
)
from ..options import IdentifyOptions
from .evidence import CRITERIA, ON_HELD_OUT_ROWS, choice, criterion_of, enough, report
from .selection import Library, orthogonal_gains, select_orders

MOST_PRUNE_TRIALS = 3
"""Largest number of wavelets tried for removal in succession. Wavelets whose removal raises the error least
come first, so that later trials rarely succeed."""

MOST_REMOVAL_COST = 6.0
"""Largest rise of the criterion by the removal of a wavelet, before refinement, for which the removal is
tried [penalty of one wavelet]. Refinement seldom recovers a larger rise."""

LEAST_CORE_POSITIONS = 5
"""Least number of distinct positions in a wavelet's core if the residuals are not noise."""

FINER_ERROR_RATIO = 4.0
"""Narrower wavelets that the criterion does not accept are still accepted if they divide the RMS error by
more than this factor [-]. Wavelets that fit noise divide the error by less."""

SMOOTH_CORE_SHARE = 0.25
"""While only wide wavelets are tried for several inputs, at least this share of all positions must lie in the
core of each wavelet, the part between its side lobes [-]."""

SMOOTH_PATIENCE = 3
"""While only wide wavelets are tried, growth continues for this factor times as many wavelets. The force has
no noise then, and a network that stops early has a large error outside the recorded positions."""

MOST_STRETCHED = 64
"""Largest number of wavelets of the frame that are also tried with a changed dilation along each of several
inputs."""

MOST_SMOOTH_ROWS = 1024
"""With more rows over several inputs, wide wavelets alone are not tried: the rows are near enough to each
other to show a wrong force between them."""

LEAST_PART_ROWS = 8192
"""Of more rows over several inputs a random part shows which candidate wavelet is the best, and a network
grows on a part before it grows on all."""

PART_SHARE = 0.25
"""Share of the rows over several inputs on which a network grows first [-]."""

MOST_CANDIDATE_INPUTS = 2
"""Candidate wavelets use at most this number of several inputs, or all of them. With two inputs they use
both: networks that may use one have a tenth fewer parameters, but an error that is up to a fifth larger."""

IDLE_DILATION = 1.001 * LEAST_DILATION
"""Dilation below which a wavelet may not need an input [1/range of recorded positions]: at the lower bound of
refinement, apart from rounding."""

MOST_RESOLVED_PLACES = 512
"""Largest number of positions over several inputs at which the narrowest candidate wavelets are looked up."""

MOST_REFINED_CANDIDATES = 5
"""Largest number of candidate wavelets that are refined before one of them is chosen."""

CANDIDATE_STEPS = 4
"""Number of refinement steps of each candidate wavelet before one is chosen: enough to compare them."""

MOST_WITH_HARMONICS = most_wavelets // 4
"""Largest number of wavelets and orders of harmonics: with hysteresis an order has two harmonics, and each
takes as long as two wavelets."""

GROWING_TOLERANCE = 0.4
"""Decrease of the deviance below which a refinement step during growth is too small to continue [-]: far
below the penalty of one wavelet."""

FINAL_TOLERANCE = 0.04
"""Decrease of the deviance (-2 log likelihood) below which a refinement step of the accepted network is too
small to continue [-]."""


@dataclass(frozen=True)
class Grown:
    """Result of the growth of a network."""

    problem: SeparableProblem
    """Least-squares problem of the solution, with the weight penalty and the least number of positions in a
    core at the end of growth"""
    solution: Solution
    criterion: float
    stop_reason: str
    path: tuple[PathPoint, ...]


class Growth:
    """Grows networks by the search settings of an identification.

    `single` is True if the force is known to be single-valued. Otherwise press and release, sampled at
    different positions, can look like one force that needs ever more wavelets.
    """

    def __init__(self, options: IdentifyOptions, *, single: bool = True) -> None:
        self._search, self._criterion, self._most = options.search, options.criterion, options.max_wavelets
        self._single, self._periodic = single, options.period is not None

    def grow(
        self, problem: SeparableProblem, start: Basis, model_class: str, *, most: int | None = None
    ) -> Grown:
        """Grows from the wavelets of start to `most` wavelets at most; an order of harmonics counts as one.

        A periodic force grows twice: from harmonics, to which wavelets are added, and from wavelets alone, as
        long as these have fewer parameters. The criterion decides.
        """
        most, criterion = self._most if most is None else most, self._criterion
        if not self._periodic:
            return self._grown_finer(problem, start, model_class, most)
        problem = problem.with_prior(problem.solve(start).rss)
        few = min(most, MOST_WITH_HARMONICS)
        orders = select_orders(
            problem, start, max_wavelets=few, criterion=criterion, patience=self._search.patience
        )
        both = self._grown_finer(problem, orders[-1].basis, model_class, few)
        passed = tuple(self._point(problem, each, model_class) for each in orders)
        both = replace(both, path=(*passed, *both.path))
        fewer = problem.n_parameters(both.solution.basis) // (2 * problem.dimension + problem.n_channels)
        alone = self._grown_finer(problem, start.without_harmonics(), model_class, min(most, fewer))
        if alone.stop_reason == "max_wavelets" and fewer < most:
            alone = replace(alone, stop_reason=criterion)
        compared = problem.independent if problem.held_out is None else len(problem.held_out.force)
        return (alone, both)[choice(criterion, [alone.criterion, both.criterion], compared)]

    def _grown_finer(self, problem: SeparableProblem, start: Basis, model_class: str, most: int) -> Grown:
        """Grows from the wavelets and harmonics of start to `most` of both by wavelets.

        If the residual is not noise, growth continues with narrower wavelets. Noise has the same size at all
        positions and no correlation between neighbouring positions. Narrower wavelets are accepted if they
        reduce the error by a large factor, or if neighbouring residuals are correlated and the criterion
        decreases as much as for a new model class. Narrower wavelets are tried only for a single-valued
        force and without a criterion on held-out rows. They are not tried if noise is correlated, if the
        error is near the resolution of the force, or if wide wavelets fit a force over several inputs.
        """
        free = self._single and problem.n_channels == 1 and self._criterion not in ON_HELD_OUT_ROWS
        several = problem.dimension > 1
        wide = free and several
        problem = replace(problem, every_input=problem.dimension <= MOST_CANDIDATE_INPUTS)
        found = self._grown(problem, start, model_class, most, wide=wide, in_parts=several)
        problem = found.problem
        settled = wide and _below_resolution(problem, problem.rmse(found.solution))
        if not free or settled or len(found.solution.basis) == 0:
            return found
        limits = problem.limits
        if limits.independent < 1.0 or problem.rmse(found.solution) <= FINER_ERROR_RATIO * limits.force_error:
            return found
        correlated = not several and problem.structured(found.solution)
        is_even = problem.evenness(found.solution) >= LEAST_NOISE_EVENNESS
        if problem.resolved_by <= LEAST_CORE_POSITIONS or (is_even and not correlated):
            return found
        fine = replace(problem, resolved_by=LEAST_CORE_POSITIONS)
        finer = self._grown(fine, found.solution.basis, model_class, most)
        accepted = correlated and finer.criterion + self._search.evidence < found.criterion
        if accepted or problem.rmse(finer.solution) * FINER_ERROR_RATIO < problem.rmse(found.solution):
            return replace(finer, path=(*found.path[:-1], finer.path[-1]))
        return replace(found, problem=problem.with_prior(found.solution.rss))

    def library(self, problem: SeparableProblem) -> Library:
        """Returns the candidate wavelets: the frame over the positions of a problem, down to the narrowest
        wavelet that the positions resolve.

        With three or more inputs there is a frame over each single input, each pair and all inputs. Most
        forces are sums of functions of few inputs, and wavelets of few inputs are resolved by far fewer rows.
        """
        search, d = self._search, problem.dimension
        positions = np.concatenate([block.positions for block in problem.blocks])
        sizes = {d} if problem.every_input else {*range(1, min(d, MOST_CANDIDATE_INPUTS) + 1), d}
        subsets = [inputs for size in sorted(sizes) for inputs in combinations(range(d), size)]
        places = positions if d == 1 else positions[:: max(1, len(positions) // MOST_RESOLVED_PLACES)]
        left = max(1, min(search.max_candidates, MOST_LIBRARY_ENTRIES // len(positions)))
        candidates = Basis.empty(d)
        for index, inputs in enumerate(subsets):
            columns = list(inputs)
            at_places = Basis(np.ones((len(places), len(inputs))), places[:, columns]).over(inputs, d)
            frame = truncated_frame(
                positions[:, columns],
                coarsest=COARSEST_CANDIDATE,
                finest=float(problem.finest(at_places).max()),
                frame_scale=search.frame_scale,
                frame_step=search.frame_step,
                max_candidates=max(1, (left - len(candidates)) // (len(subsets) - index)),
            )
            candidates = candidates.joined(frame.over(inputs, d))
        return Library(problem, candidates)

    def prune(self, problem: SeparableProblem, start: Solution) -> tuple[SeparableProblem, Solution]:
        """Removes wavelets while the refined remaining network has a smaller criterion.

        Tries first the wavelet whose removal raises the error least. The returned problem has the weight
        penalty of the last trial.
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
        start: Basis,
        model_class: str,
        most: int,
        *,
        patience: int | None = None,
        wide: bool = False,
        in_parts: bool = False,
    ) -> Grown:
        """Grows the network of `start` until the criterion stops growth, then prunes and refines the network.

        Growth continues for `patience` wavelets after the best criterion, by default for those of the options
        per input. Pruning starts from the largest network: a few surplus wavelets let refinement find a
        better arrangement. If the criterion uses held-out rows, it chooses the size and nothing is pruned.
        With `wide`, a network of wide wavelets alone is tried once, when the RMS error is below
        sqrt(`FORCE_RESOLUTION`) times the range of the force. It is taken if its error is small, or in the
        end not larger.

        With `in_parts` the network grows on a part of many rows first, which shows most of its wavelets. On
        all rows it then continues for `patience` wavelets only.
        """
        search, criterion = self._search, self._criterion
        patience, begin, smooth = patience or search.patience * problem.dimension, start, None
        rows = max(len(block.target) for block in problem.blocks)
        if in_parts and rows > LEAST_PART_ROWS:
            part = problem.part(max(LEAST_PART_ROWS, int(PART_SHARE * rows)))
            grown_there = self._grown(part, start, model_class, most, wide=wide, in_parts=True)
            start, patience, wide = grown_there.solution.basis, search.patience, False
        compared = problem if problem.dimension == 1 else problem.part(LEAST_PART_ROWS)
        library = self.library(compared)
        problem = problem.with_prior(problem.solve(start).rss)
        problem, current = self._improved(problem, problem.solve(start), search.refine_steps)
        path, grown = [self._point(problem, current, model_class)], [current]
        best, since, stop_reason = path[0].criterion, 0, "max_wavelets"
        while current.basis.size < most:
            report(model_class, current.basis.size)
            if enough(criterion, path[-1].criterion):
                stop_reason = criterion
                break
            if wide and problem.rmse(current) <= np.sqrt(FORCE_RESOLUTION) * problem.force_range:
                wide, smooth = False, self._smooth(problem, begin, model_class, most)
                if smooth is not None and _below_resolution(problem, problem.rmse(smooth.solution)):
                    return smooth
            added = self._with_candidate(problem, compared, library, current)
            if added is None:
                stop_reason = "data"
                break
            problem, current = self._improved(problem, added, search.refine_steps)
            path.append(self._point(problem, current, model_class))
            grown.append(current)
            since = 0 if path[-1].criterion < best else since + 1
            best = min(best, path[-1].criterion)
            if since >= patience:
                stop_reason = criterion
                break
        if problem.held_out is not None and criterion in ON_HELD_OUT_ROWS:
            values = [point.criterion for point in path]
            pruned = grown[choice(criterion, values, len(problem.held_out.force))]
        else:
            problem, pruned = self.prune(problem, current)
        problem, final = self._improved(problem, pruned, search.final_steps, FINAL_TOLERANCE)
        if smooth is not None and problem.rmse(smooth.solution) <= problem.rmse(final):
            return smooth
        path.append(self._point(problem, final, model_class))
        if final.basis.size < most and stop_reason == "max_wavelets":
            stop_reason = criterion
        return Grown(problem, final, path[-1].criterion, stop_reason, tuple(path))

    def _smooth(self, problem: SeparableProblem, start: Basis, model_class: str, most: int) -> Grown | None:
        """Returns a network of wide wavelets that use every input; None if there are many rows or much noise.

        Few rows over several inputs are far apart. A narrow wavelet then corrects the force at a few rows,
        and the network fits the rows well but has large errors between them. Wide wavelets avoid this. They
        are not tried if the forces inside one cell differ by more than the small error.
        """
        rows = len(problem.blocks[0].positions)
        if rows > MOST_SMOOTH_ROWS or not _below_resolution(
            problem, np.sqrt(problem.within / problem.samples)
        ):
            return None
        held = max(problem.resolved_by, int(SMOOTH_CORE_SHARE * rows))
        smooth = replace(problem, resolved_by=held, every_input=True)
        patience = SMOOTH_PATIENCE * self._search.patience * problem.dimension
        found = self._grown(smooth, start, model_class, most, patience=patience)
        given = replace(found.problem, resolved_by=problem.resolved_by, every_input=problem.every_input)
        return replace(found, problem=given)

    def _price(self, problem: SeparableProblem, solution: Solution) -> float:
        """Returns the increase of the penalty in the criterion by the last wavelet of the solution."""
        penalty, size = CRITERIA[self._criterion], solution.basis.size
        return penalty(problem.independent, problem.n_parameters(solution.basis)) - penalty(
            problem.independent, problem.n_parameters(solution.basis.without(size - 1))
        )

    def _with_candidate(
        self, problem: SeparableProblem, compared: SeparableProblem, library: Library, current: Solution
    ) -> Solution | None:
        """Returns the network with the candidate wavelet that improves it most; None if no wavelet can be
        added.

        Candidates are compared on the rows of `compared`, a part of the problem. A wavelet of the frame has
        one dilation for all inputs that it uses. With several inputs, wavelets with a changed dilation along
        one input are tried as well. A few different candidates are refined by some steps before one is taken,
        because the candidate that fits best before refinement often ends in a worse minimum.
        """
        if len(library) == 0 or problem.n_parameters(current.basis, more=1) >= problem.independent:
            return None
        whole = compared.blocks is problem.blocks
        compared = replace(compared, prior=problem.prior)
        start = current if whole else compared.solve(current.basis)
        gains = self._gains(compared, library, start)
        if problem.dimension > 1:
            library = library.stretched(compared, _falling(gains)[:MOST_STRETCHED])
            gains = self._gains(compared, library, start)
        chosen = library.distinct(_falling(gains), MOST_REFINED_CANDIDATES if problem.dimension > 1 else 1)
        tried = [compared.solve(start.basis.joined(library.members([index]))) for index in chosen]
        if not tried:
            return None
        if len(tried) > 1:
            tried = [
                refine(compared, each, steps=CANDIDATE_STEPS, tolerance=GROWING_TOLERANCE) for each in tried
            ]
        best = min(tried, key=lambda solution: self._criterion_of(compared, solution))
        return best if whole else problem.solve(best.basis)

    def _gains(self, problem: SeparableProblem, library: Library, current: Solution) -> Float1D:
        """Returns a value (candidates,) that is larger for a better candidate, and 0 for a useless one.

        If all candidates use the same number of inputs, the value is the decrease of the squared error.
        Otherwise it is exp(-change of the criterion / n), because wavelets of more inputs have more
        parameters.
        """
        gains = orthogonal_gains(library, current)
        if problem.every_input or len(library) == 0:
            return gains
        penalty, n, p = CRITERIA[self._criterion], problem.independent, problem.n_parameters(current.basis)
        price = [penalty(n, p + 2 * k + problem.n_channels) for k in range(problem.dimension + 1)]
        more = np.array(price)[library.basis.used.sum(axis=1)] - penalty(n, p)
        left = np.maximum(1.0 - gains / problem.total(current.rss), FORCE_RESOLUTION**2)
        return np.where(gains > 0.0, np.exp(-more / n) / left, 0.0)

    def _without_idle_inputs(self, problem: SeparableProblem, current: Solution) -> Solution:
        """Returns the solution without each use of an input by a wavelet that the criterion does not need.

        Refinement has made the wavelet as wide as allowed along such an input.
        """
        value = self._criterion_of(problem, current)
        for index, k in np.argwhere(current.basis.used & (current.basis.alpha <= IDLE_DILATION)):
            if np.count_nonzero(current.basis.used[index]) > 1:
                trial = problem.solve(current.basis.without_input(int(index), int(k)))
                if self._criterion_of(problem, trial) < value:
                    current, value = trial, self._criterion_of(problem, trial)
        return current

    def refined(self, problem: SeparableProblem, basis: Basis) -> Solution:
        """Returns the network with these wavelets, refined by as many steps as follow each added wavelet."""
        return self._improved(problem, problem.solve(basis), self._search.refine_steps)[1]

    def _improved(
        self, problem: SeparableProblem, solution: Solution, steps: int, tolerance: float = GROWING_TOLERANCE
    ) -> tuple[SeparableProblem, Solution]:
        """Refines the solution, then sets the weight penalty of the problem from the remaining error."""
        solution = refine(problem, solution, steps=steps, tolerance=tolerance)
        if not problem.every_input:
            solution = self._without_idle_inputs(problem, solution)
        problem = problem.with_prior(solution.rss)
        return problem, problem.solve_again(solution)

    def _criterion_of(self, problem: SeparableProblem, solution: Solution) -> float:
        return criterion_of(problem, solution, self._criterion)

    def _point(self, problem: SeparableProblem, solution: Solution, model_class: str) -> PathPoint:
        return PathPoint(
            model_class, solution.basis.size, problem.rmse(solution), self._criterion_of(problem, solution)
        )


def _below_resolution(problem: SeparableProblem, error: float) -> bool:
    """True if an RMS error is so near the resolution of a force sensor that narrower wavelets are not
    tried."""
    return bool(error <= FINER_ERROR_RATIO * FORCE_RESOLUTION * problem.force_range)


def _falling(gains: Float1D) -> NDArray[np.intp]:
    """Returns the indices of the candidates with a gain above 0, the largest gain first."""
    return np.argsort(-gains, kind="stable")[: np.count_nonzero(gains > 0.0)]

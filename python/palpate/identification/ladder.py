# SPDX-License-Identifier: Apache-2.0
"""The ladder: constant, linear, position, hysteresis. Model no more than a scene needs.

Every rung is judged on the same samples by the same criterion, with its constraints imposed. It is climbed
only if the criterion falls by `rung_evidence` or more and if the error falls on fresh rows too, on which no
weight was fitted. What a rung gains, or would have gained, stands in the notes, its networks in the path.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from .. import _core
from .._typing import Float1D, Float2D
from ..errors import InputError
from .compression import Compressed, Compressor
from .constraints import domain_bounds, impose, moved_to_bounds
from .frame import truncated_frame
from .fresh import FreshRows, gain, kept_back
from .growth import Grown, PathPoint, grow, judge, prune
from .options import IdentifyOptions
from .rung import Rung
from .selection import Library
from .separable import Basis, SeparableProblem, Solution, problem_of
from .stopping import ON_FRESH_ROWS, enough, standard_error

COARSEST_CANDIDATE = 1.0
"""Dilation of the frame's coarsest level [1/box]."""

LIBRARY_ENTRIES = 2**23
"""Numbers that a library may hold: with many rows it has fewer candidates."""

WORTH_REGROWING = 1.01
"""Ratio of the RMS errors with and without constraints from which wavelets are grown to suit them."""

GAINS_ENERGY = 2.0
"""Ratio of the RMS errors with and without h >= 0 above which the loop is run through the wrong way."""

LEAST_FRESH = 20
"""Fresh rows below which they are too few to refuse a rung."""


class Ladder:
    """One climb over one recording, in the unit box of its positions.

    Parameters
    ----------
    box : (n, d)
        Positions in the unit box.
    force : (n,)
    weight : (n,) or None
        Samples that a row stands for.
    side : (n,) or None
        +1, -1: the stroke of each row.
    starts : sequence of int or None
        Rows at which a motion starts, from which the play operator gives a hysteresis input (d = 1).
    network : str
        Name of the rung that a network over the inputs is.
    lower, reach : float
        Corner and length of the box along the position.
    max_positions : int
    within : float
        Sum of squares of the force inside rows that stand for several samples.
    """

    def __init__(
        self,
        box: Float2D,
        force: Float1D,
        weight: Float1D | None,
        side: Float1D | None,
        starts: Sequence[int] | None,
        options: IdentifyOptions,
        *,
        network: str,
        lower: float,
        reach: float,
        max_positions: int,
        within: float = 0.0,
    ) -> None:
        self.notes: list[str] = []
        self.path: list[PathPoint] = []
        self._options, self._name, self._slope_unit = options, network, reach
        self._fixed_force = None
        if options.fixed_force is not None:
            place, fixed = options.fixed_force
            if not lower <= place <= lower + reach:
                raise InputError(
                    f"fixed_force is at {place:g}, outside the positions from {lower:g} to {lower + reach:g}"
                )
            self._fixed_force = (place - lower) / reach, fixed
        self._box, self._force, self._side = box, force, side
        self._starts = starts if side is None and box.shape[1] == 1 else None
        self._compressor = Compressor(box, force, weight=weight, max_positions=max_positions, within=within)
        self._fresh = kept_back(len(force), starts)
        if weight is not None:
            self._fresh &= weight > 0.0
        if side is None and self._starts is None and "hysteresis" in options.inputs:
            raise InputError(
                "inputs names hysteresis, but the recording has neither both directions nor time; "
                "name a direction column or leave hysteresis out"
            )
        given = len(force) if weight is None else int(np.count_nonzero(weight))
        if (used := self._compressor.rows_used) < given:
            self.notes.append(f"{used} of {given} rows, evenly spread, stand for all of them")

    def climb(self) -> Rung:
        """The highest rung that earned its place, or the one that the inputs name."""
        rows = self._rows(None)
        best = self._better(self._constant(rows), self._straight(rows))
        if self._options.max_wavelets > 0:
            best = self._better(best, self._network(rows, self._name, Basis.empty(rows.positions.shape[1])))
        if not (self._options.inputs == "auto" or "hysteresis" in self._options.inputs):
            return best
        if self._side is not None:
            return self._hysteresis(best, self._side, None)
        if self._starts is not None:
            return self._hysteresis(best, *self._best_play(best.solution.basis))
        return best

    def _rows(self, side: Float1D | None) -> Compressed:
        """Compressed rows: all of them, or those that are not kept back for the criterion."""
        only = ~self._fresh if self._options.criterion in ON_FRESH_ROWS else None
        return self._compressor.rows(side, only)

    def _problem(self, rows: Compressed, side: Float1D | None) -> SeparableProblem:
        fresh = self._fresh_rows(side) if self._options.criterion in ON_FRESH_ROWS else None
        return problem_of(rows, resolved_by=self._options.resolved_by, fresh=fresh)

    def _fresh_rows(self, side: Float1D | None) -> FreshRows:
        return FreshRows.of(self._box, self._force, side, self._fresh)

    def _constant(self, rows: Compressed) -> Rung:
        straight = self._straight_solution(rows)
        mean = float(np.average(rows.force, weights=rows.weight))
        coefficients = np.zeros_like(straight.solution.coefficients)
        coefficients[0, 0] = mean
        level = straight.problem.solution(straight.solution.basis, coefficients, straight.solution.designs)
        return self._recorded(replace(straight, name="constant", solution=level, n_parameters=1))

    def _straight(self, rows: Compressed) -> Rung:
        return self._recorded(self._constrained(self._straight_solution(rows)))

    def _straight_solution(self, rows: Compressed) -> Rung:
        problem = self._problem(rows, None)
        solution = problem.solve(Basis.empty(problem.dimension))
        return Rung("linear", rows, problem, solution, problem.n_parameters(0), self._options.criterion)

    def _network(self, rows: Compressed, name: str, start: Basis) -> Rung:
        """A network grown from the wavelets of start, with its constraints."""
        problem, grown = self._grown(rows, None, name, start)
        n_parameters = problem.n_parameters(len(grown.solution.basis))
        return self._constrained(Rung(name, rows, problem, grown.solution, n_parameters, grown.stop_reason))

    def _grown(
        self, rows: Compressed, side: Float1D | None, name: str, start: Basis
    ) -> tuple[SeparableProblem, Grown]:
        problem = self._problem(rows, side)
        frame = truncated_frame(
            rows.positions,
            coarsest=COARSEST_CANDIDATE,
            finest=float(problem.finest(rows.positions).max()),
            frame_scale=self._options.frame_scale,
            frame_step=self._options.frame_step,
            max_candidates=min(self._options.max_candidates, LIBRARY_ENTRIES // len(rows.force)),
        )
        grown = grow(problem, Library(problem, frame), start, name, self._options)
        self.path.extend(grown.path)
        return problem, grown

    def _hysteresis(self, below: Rung, side: Float1D, radius: float | None) -> Rung:
        """g + s h on top of the wavelets of the rung below, if it earns its place or is named.

        h >= 0 has a mean, which the wavelets of g, the slope and the bias show at once: if the criterion does
        not fall at all with these, growing a network would be in vain.
        """
        options, named = self._options, self._options.inputs != "auto"
        extra = 0 if radius is None else 1
        rows = self._rows(side)
        problem = self._problem(rows, side)
        first = problem.solve(below.solution.basis)

        def rung(of: SeparableProblem, solution: Solution, stop_reason: str) -> Rung:
            n_parameters = of.n_parameters(len(solution.basis)) + extra
            return Rung("hysteresis", rows, of, solution, n_parameters, stop_reason, side, radius)

        free = rung(problem, first, options.criterion)
        if named or free.criterion(options) < below.criterion(options):
            problem, grown = self._grown(rows, side, "hysteresis", first.basis)
            free = rung(problem, grown.solution, grown.stop_reason)
        if not named and self._better(below, free) is below:
            return below
        kept = self._constrained(free)
        if named or kept is free:
            return kept
        best = self._better(self._single_valued(kept) if len(below.solution.basis) else below, kept)
        if best.name != "hysteresis" and kept.rmse > GAINS_ENERGY * free.rmse:
            self.notes.append(
                "press and release differ, but the loop would gain energy; if position or force is turned, "
                "give --negate position or --negate force"
            )
        return best

    def _single_valued(self, hysteresis: Rung) -> Rung:
        """A force of position alone on the wavelets of a hysteresis rung, those it does not need removed.

        Where hysteresis is there but not with h >= 0, this is what remains of it. A network grown on position
        alone will not do: strokes that a periodic motion samples at different places look like one rapidly
        changing force.
        """
        rows = self._rows(None)
        problem = self._problem(rows, None)
        start = problem.solve(hysteresis.solution.basis)
        problem.set_prior(start.rss)
        solution = prune(problem, problem.solve(start.basis), self._options)
        n_parameters = problem.n_parameters(len(solution.basis))
        name = "position" if len(solution.basis) else "linear"
        return self._recorded(
            self._constrained(Rung(name, rows, problem, solution, n_parameters, hysteresis.stop_reason))
        )

    def _best_play(self, basis: Basis) -> tuple[Float1D, float]:
        """The hysteresis input (n,) of that play radius [box] which helps most on given wavelets."""
        assert self._starts is not None
        motions = np.split(self._box[:, 0], list(self._starts)[1:])
        tried = []
        for radius in self._options.play_radius:
            play = np.concatenate([_core.play(motion, radius) for motion in motions])
            side = np.clip((self._box[:, 0] - play) / radius, -1.0, 1.0)
            problem = self._problem(self._rows(side), side)
            tried.append((problem.total(problem.solve(basis).rss), radius, side))
        _, radius, side = min(tried, key=lambda candidate: candidate[0])
        return side, radius

    def _better(self, below: Rung, above: Rung) -> Rung:
        """The upper rung if it earns its place, else the lower one; and a note on what it gains."""
        options, name = self._options, self._options.criterion
        if enough(name, below.criterion(options)):
            self.notes.append(f"{above.name} refused: {below.name} is already closer than a hand can tell")
            return below
        falls = below.criterion(options) - above.criterion(options)
        changes = f"falls by {falls:.4g}" if falls > 0 else f"rises by {-falls:.4g}"
        fresh = self._fresh_rows(above.side)
        evidence = options.rung_evidence
        if name in ON_FRESH_ROWS:
            evidence = max(evidence, standard_error(len(fresh.force)))
        if falls < evidence:
            self.notes.append(
                f"{above.name} refused: {name} {changes}, it has to fall by {evidence:.4g} or more"
            )
            return below
        share, error = self._fresh_gain(below, above)
        if share <= 0.0 and len(fresh.force) >= LEAST_FRESH:
            self.notes.append(
                f"{above.name} refused: {name} {changes}, but the squared error on fresh rows rises by "
                f"{-100 * share:.3g} %"
            )
            return below
        self.notes.append(
            f"{above.name} taken: {name} {changes}, the squared error on fresh rows falls by "
            f"{100 * share:.4g} +- {100 * error:.2g} %"
        )
        return above

    def _fresh_gain(self, below: Rung, above: Rung) -> tuple[float, float]:
        """Fall of the squared error on fresh rows as a share, and its standard error."""
        errors = []
        for rung in (below, above):
            kept = self._compressor.rows(rung.side, ~self._fresh)
            problem = problem_of(kept, resolved_by=self._options.resolved_by)
            errors.append(rung.fresh_errors(problem, self._fresh_rows(rung.side)))
        return gain(*errors)

    def _constrained(self, rung: Rung) -> Rung:
        """The rung with its constraints, their price in the notes.

        If they cost more than a little, the network is grown further on forces that keep them; the result is
        taken if the criterion prefers it once the constraints are imposed on the true forces again.
        """
        options, problem, slopes = self._options, rung.problem, self._options.slope_limits
        box_slopes = None if slopes is None else (slopes[0] * self._slope_unit, slopes[1] * self._slope_unit)
        bounds = domain_bounds(
            problem, hysteresis=options.hysteresis_nonnegative, slopes=box_slopes, fixed=self._fixed_force
        )
        if problem.dimension > 1 or not bounds:
            return rung
        kept = impose(problem, rung.solution, bounds)
        if kept is rung.solution:
            return rung
        if options.refine and problem.rmse(kept) > WORTH_REGROWING * rung.rmse and len(kept.basis):
            moved = moved_to_bounds(problem, rung.rows, rung.solution, bounds)
            compatible, regrown = self._grown(moved, rung.side, rung.name, rung.solution.basis)
            trial = impose(problem, problem.solve(regrown.solution.basis), bounds)
            if _judged_on(compatible, trial, options) < _judged_on(compatible, kept, options):
                kept = trial
        names = " and ".join(dict.fromkeys(bound.name for bound in bounds))
        price = f"RMS error {problem.rmse(kept):.4g} with, {rung.rmse:.4g} without"
        self.notes.append(f"{rung.name}: {names} imposed over the domain, {price}")
        more = problem.n_parameters(len(kept.basis)) - problem.n_parameters(len(rung.solution.basis))
        return replace(rung, solution=kept, n_parameters=rung.n_parameters + more)

    def _recorded(self, rung: Rung) -> Rung:
        n_wavelets = len(rung.solution.basis)
        self.path.append(PathPoint(rung.name, n_wavelets, rung.rmse, rung.criterion(self._options)))
        return rung


def _judged_on(problem: SeparableProblem, solution: Solution, options: IdentifyOptions) -> float:
    """Criterion of a solution on the rows of another problem of the same form."""
    return judge(problem, problem.solution_of(solution), options)

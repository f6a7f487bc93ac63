# SPDX-License-Identifier: Apache-2.0
"""The ladder: constant, linear, position, hysteresis. Model no more than a scene needs.

Every rung is judged on the same samples by the same criterion, with its constraints imposed. It is climbed
only if the criterion falls by `rung_evidence` or more and if the error falls on fresh rows too, on which no
weight was fitted. What a rung gains, or would have gained, stands in the notes, its networks in the path.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from .._typing import Float1D, Float2D
from ..errors import InputError
from .compression import Compressed, Compressor
from .constraints import domain_bounds, impose, moved_to_bounds
from .crossing import crossing
from .evidence import Evidence
from .fresh import kept_back
from .growth import Grown, PathPoint, judge, prune
from .hysteresis_input import HysteresisInput
from .options import IdentifyOptions
from .play import PlaySearch
from .rung import Rung
from .separable import Basis, SeparableProblem, Solution
from .stopping import ON_FRESH_ROWS, enough, standard_error

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
    before : Ladder, optional
        A climb over nearly the same rows: what was grown on it is where growth begins.
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
        before: "Ladder | None" = None,
    ) -> None:
        self.notes: list[str] = []
        self.path: list[PathPoint] = list(before.path) if before else []
        self._grown_before: dict[str, Basis] = dict(before._grown_before) if before else {}
        self._options, self._name = options, network
        self._lower, self._slope_unit = lower, reach
        self._fixed_force = None
        if options.fixed_force is not None:
            place, fixed = options.fixed_force
            if not lower <= place <= lower + reach:
                raise InputError(
                    f"fixed_force is at {place:g}, outside the positions from {lower:g} to {lower + reach:g}"
                )
            self._fixed_force = (place - lower) / reach, fixed
        fresh = kept_back(len(force), starts)
        if weight is not None:
            fresh &= weight > 0.0
        compressor = Compressor(box, force, weight=weight, max_positions=max_positions, within=within)
        single = side is None and starts is None
        self._evidence = Evidence(box, force, fresh, compressor, options, single=single)
        self._side = side
        self._play = None
        if side is None and starts is not None and box.shape[1] == 1:
            self._play = PlaySearch(self._evidence, starts, options)
        if side is None and self._play is None and "hysteresis" in options.inputs:
            raise InputError(
                "inputs names hysteresis, but the recording has neither both directions nor time; "
                "name a direction column or leave hysteresis out"
            )
        given = len(force) if weight is None else int(np.count_nonzero(weight))
        if (used := compressor.rows_used) < given:
            self.notes.append(f"{used} of {given} rows, evenly spread, stand for all of them")

    def climb(self) -> Rung:
        """The highest rung that earned its place, or the one that the inputs name."""
        rows = self._evidence.rows()
        best = self._better(self._constant(rows), self._straight(rows))
        if self._options.max_wavelets > 0:
            best = self._better(best, self._network(rows))
        if not (self._options.inputs == "auto" or "hysteresis" in self._options.inputs):
            return best
        if self._side is not None:
            return self._hysteresis(best, HysteresisInput.of_strokes(self._side))
        if self._play is None:
            return best
        strokes = self._play.best_tried(best.solution.basis)
        if strokes is not None:
            return self._play.with_first_states(self._hysteresis(best, strokes))
        untold = "the motions between gaps of time are too short to tell it, or never turn back"
        if "hysteresis" in self._options.inputs:
            raise InputError(f"inputs names hysteresis, but {untold}")
        self.notes.append(f"hysteresis was not tried: {untold}")
        return best

    def _constant(self, rows: Compressed) -> Rung:
        straight = self._straight_solution(rows)
        mean = float(np.average(rows.force, weights=rows.weight))
        coefficients = np.zeros_like(straight.solution.coefficients)
        coefficients[0, 0] = mean
        level = straight.problem.with_coefficients(straight.solution, coefficients)
        return self._recorded(replace(straight, name="constant", solution=level, n_parameters=1))

    def _straight(self, rows: Compressed) -> Rung:
        return self._recorded(self._constrained(self._straight_solution(rows)))

    def _straight_solution(self, rows: Compressed) -> Rung:
        problem = self._evidence.problem(rows)
        solution = problem.solve(Basis.empty(problem.dimension))
        return Rung("linear", rows, problem, solution, problem.n_parameters(0), self._options.criterion)

    def _network(self, rows: Compressed) -> Rung:
        """A network with its constraints."""
        start = self._grown_before.get(self._name, Basis.empty(rows.positions.shape[1]))
        problem, grown = self._grown(rows, None, self._name, start)
        self._grown_before[self._name] = grown.solution.basis
        n_parameters = problem.n_parameters(len(grown.solution.basis))
        return self._constrained(
            Rung(self._name, rows, problem, grown.solution, n_parameters, grown.stop_reason)
        )

    def _grown(
        self, rows: Compressed, strokes: HysteresisInput | None, name: str, start: Basis
    ) -> tuple[SeparableProblem, Grown]:
        problem, grown = self._evidence.grown(rows, strokes, name, start, self._options)
        self.path.extend(grown.path)
        return problem, grown

    def _hysteresis(self, below: Rung, strokes: HysteresisInput) -> Rung:
        """g + s h on top of the wavelets of the rung below, if it earns its place or is named.

        h >= 0 has a mean, which the wavelets of g, the slope and the bias show at once: if the criterion does
        not fall at all with these, growing a network would be in vain.
        """
        options, named = self._options, self._options.inputs != "auto"
        rows = self._evidence.rows(strokes)
        problem = self._evidence.problem(rows, strokes)
        first = problem.solve(below.solution.basis)
        free = _hysteresis_rung(strokes, rows, problem, first, options.criterion)
        if named or free.criterion(options) < below.criterion(options):
            start = self._grown_before.get("hysteresis", first.basis)
            problem, grown = self._grown(rows, strokes, "hysteresis", start)
            self._grown_before["hysteresis"] = grown.solution.basis
            free = _hysteresis_rung(strokes, rows, problem, grown.solution, grown.stop_reason)
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
        rows = self._evidence.rows()
        problem = self._evidence.problem(rows)
        start = problem.solve(hysteresis.solution.basis)
        problem.set_prior(start.rss)
        solution = prune(problem, problem.solve(start.basis), self._options)
        line = self._straight(rows)
        if len(solution.basis) == 0:
            return line
        n_parameters = problem.n_parameters(len(solution.basis))
        rung = Rung("position", rows, problem, solution, n_parameters, hysteresis.stop_reason)
        return self._better(line, self._recorded(self._constrained(rung)))

    def _better(self, below: Rung, above: Rung) -> Rung:
        """The upper rung if it earns its place, else the lower one; and a note on what it gains."""
        options, name = self._options, self._options.criterion
        if enough(name, below.criterion(options)):
            self.notes.append(f"{above.name} refused: {below.name} is already closer than a hand can tell")
            return below
        falls = below.criterion(options) - above.criterion(options)
        changes = f"falls by {falls:.4g}" if falls > 0 else f"rises by {-falls:.4g}"
        fresh = self._evidence.fresh_rows(above.strokes)
        evidence = options.rung_evidence
        if name in ON_FRESH_ROWS:
            evidence = max(evidence, standard_error(len(fresh.force)))
        if falls < evidence:
            self.notes.append(
                f"{above.name} refused: {name} {changes}, it has to fall by {evidence:.4g} or more"
            )
            return below
        share, error = self._evidence.fresh_gain(below, above)
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
            compatible, regrown = self._grown(moved, rung.strokes, rung.name, rung.solution.basis)
            trial = impose(problem, problem.solve(regrown.solution.basis), bounds)
            if _judged_on(compatible, trial, options) < _judged_on(compatible, kept, options):
                kept = trial
        names = " and ".join(dict.fromkeys(bound.name for bound in bounds))
        price = f"RMS error {problem.rmse(kept):.4g} with, {rung.rmse:.4g} without"
        crossed = ""
        if options.hysteresis_nonnegative:
            crossed = crossing(problem, rung.solution, self._lower, self._slope_unit)
        self.notes.append(f"{rung.name}: {names} imposed over the domain, {price}{crossed}")
        more = problem.n_parameters(len(kept.basis)) - problem.n_parameters(len(rung.solution.basis))
        return replace(rung, solution=kept, n_parameters=rung.n_parameters + more)

    def _recorded(self, rung: Rung) -> Rung:
        n_wavelets = len(rung.solution.basis)
        self.path.append(PathPoint(rung.name, n_wavelets, rung.rmse, rung.criterion(self._options)))
        return rung


def _judged_on(problem: SeparableProblem, solution: Solution, options: IdentifyOptions) -> float:
    """Criterion of a solution on the rows of another problem of the same form."""
    return judge(problem, problem.with_coefficients(solution, solution.coefficients), options)


def _hysteresis_rung(
    strokes: HysteresisInput,
    rows: Compressed,
    problem: SeparableProblem,
    solution: Solution,
    stop_reason: str,
) -> Rung:
    n_parameters = problem.n_parameters(len(solution.basis)) + (strokes.play_radius is not None)
    return Rung("hysteresis", rows, problem, solution, n_parameters, stop_reason, strokes)

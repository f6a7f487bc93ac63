# SPDX-License-Identifier: Apache-2.0
"""The ladder: constant, linear, position, hysteresis. Model no more than a scene needs.

Every rung is judged on the same samples by the same criterion, with its constraints imposed. It is climbed
only if the criterion falls by `rung_evidence` or more and if the error falls on fresh rows too, on which no
weight was fitted. What a rung gains, or would have gained, stands in the notes, its networks in the path.
"""

import math
from collections.abc import Sequence
from copy import copy
from dataclasses import replace

import numpy as np

from .._typing import Float1D, Float2D
from ..errors import InputError
from ..verdict import Finding, usable
from .compression import Compressed, Compressor
from .constraints import Bound, domain_bounds, impose, moved_to_bounds
from .crossing import crosses_where_steep, crossing
from .evidence import Evidence, Judgement
from .fresh import EVERY, kept_back
from .growth import Grown, PathPoint, judge, prune
from .hysteresis_input import HysteresisInput
from .judgement import USABLE_NRMSE
from .limits import NO_LIMITS, RowLimits
from .options import IdentifyOptions
from .play import PlaySearch
from .rung import Rung
from .separable import Basis, SeparableProblem, Solution

WORTH_REGROWING = 1.01
"""Ratio of the RMS errors with and without constraints from which wavelets are grown to suit them."""

GAINS_ENERGY = 2.0
"""Ratio of the RMS errors with and without h >= 0 above which a cure is named."""

SMALLER_ERRORS = 3.0
"""Standard errors by which a smaller network must improve on held-back rows: each further try may succeed by
chance."""

HELD_BACK = "held-back rows"
"""Reason for which growth stopped, if held-back rows refused a larger network."""

FIRST_SIZE = 4
"""Wavelets with hysteresis until the play radius is sought again."""

RADIUS_ROUNDS = 6
"""Times that it is sought at most."""


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
    path : (n,)
        Positions as they were moved through, not taken modulo a period.
    network : str
        Name of the rung that a network over the inputs is.
    lower, reach : float
        Corner and length of the box along the position.
    max_positions : int
    within : float
        Sum of squares of the force inside rows that stand for several samples.
    before : Ladder, optional
        A climb over nearly the same rows: what was grown on it is where growth begins.
    limits : RowLimits
        What limits the information in the rows.
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
        path: Float1D,
        network: str,
        lower: float,
        reach: float,
        max_positions: int,
        within: float = 0.0,
        before: "Ladder | None" = None,
        limits: RowLimits = NO_LIMITS,
    ) -> None:
        self.notes: list[str] = []
        self.findings: list[Finding] = []
        self.sign_findings: list[Finding] = []
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
            counted = np.flatnonzero(weight > 0.0)
            fresh &= weight > 0.0
            if 2 * EVERY * np.count_nonzero(fresh) < len(counted):
                # rows that repeat others can stand at every place that is kept back
                fresh[:] = False
                fresh[counted] = kept_back(len(counted), starts)
        compressor = Compressor(
            box, force, weight=weight, max_positions=max_positions, within=within, limits=limits
        )
        single = side is None and (starts is None or box.shape[1] > 1)
        self._evidence = Evidence(box, force, fresh, compressor, options, single=single)
        self._side = side
        self._play = None
        if side is None and starts is not None and box.shape[1] == 1:
            self._play = PlaySearch(self._evidence, path, starts, options)
        if side is None and self._play is None and "hysteresis" in options.inputs:
            raise InputError(
                "inputs names hysteresis, but the recording has neither both directions nor time; "
                "name a direction column or leave hysteresis out"
            )
        self._spread = float(np.std(force)) or 1.0
        given = len(force) if weight is None else int(np.count_nonzero(weight))
        if (used := compressor.rows_used) < given:
            self.notes.append(f"{used} of {given} rows, evenly spread, stand for all of them")

    def climb(self) -> Rung:
        """The highest rung that earned its place, or the one that the inputs name."""
        best = self._climbed()
        self._tell_limit(best)
        return best

    def _tell_limit(self, best: Rung) -> None:
        """Tell that growth ended at max_wavelets while neighbouring rows still err alike."""
        limit = self._options.max_wavelets
        if best.stop_reason != "max_wavelets" or not best.problem.structured(best.solution):
            return
        period = "" if self._options.period or best.problem.dimension > 1 else ", or --period if it repeats"
        self.findings.append(
            usable(
                f"growth ended at the limit of {limit} wavelets and the error is still structured "
                f"(NRMSE {best.rmse / self._spread:.3g}); give --max-wavelets {4 * limit}{period}"
            )
        )

    def _climbed(self) -> Rung:
        rows = self._evidence.rows()
        best = self._better(self._constant(rows), self._straight(rows))
        if self._options.max_wavelets > 0:
            best = self._with_network(best, rows)
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

    def _with_network(self, below: Rung, rows: Compressed) -> Rung:
        """The network that earns its place, or the rung below.

        If held-back rows refuse a network that the criterion prefers, networks of half its size are tried.
        """
        size, errors = self._options.max_wavelets, 1.0
        while size > 0:
            above = self._network(rows, size)
            judged = self._evidence.judged(below, above, errors=errors)
            self._note(above, judged)
            if judged.earned:
                return above
            size = len(above.solution.basis) // 2 if judged.criterion_falls else 0
            errors = SMALLER_ERRORS
        return below

    def _network(self, rows: Compressed, size: int) -> Rung:
        """A network of at most that many wavelets, with its constraints."""
        whole = size == self._options.max_wavelets
        start = Basis.empty(rows.positions.shape[1])
        if whole:
            start = self._grown_before.get(self._name, start)
        problem, grown = self._grown(rows, None, self._name, start, size)
        if whole:
            self._grown_before[self._name] = grown.solution.basis
        n_parameters = problem.n_parameters(len(grown.solution.basis))
        reason = grown.stop_reason if whole else HELD_BACK
        return self._constrained(Rung(self._name, rows, problem, grown.solution, n_parameters, reason))

    def _grown(
        self, rows: Compressed, strokes: HysteresisInput | None, name: str, start: Basis, size: int
    ) -> tuple[SeparableProblem, Grown]:
        options = replace(self._options, max_wavelets=size)
        problem, grown = self._evidence.grown(rows, strokes, name, start, options)
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
        if named or self._evidence.fall(below, free) > 0.0:
            free = self._grown_hysteresis(below, free, named=named)
        if not named and not self._evidence.earned(below, free):
            return self._better(below, free)
        kept = self._constrained(free)
        if named:
            self._tell_sign(kept, kept, free)
            return kept
        single = self._single_valued(kept) if kept is not free and len(below.solution.basis) else below
        best = self._better(single, kept)
        if best is single and (left := len(best.solution.basis)) < len(below.solution.basis):
            self.notes.append(f"{left} wavelets over position are left: the others were of the loop")
        self._tell_sign(best, kept, free)
        return best

    def _tell_sign(self, best: Rung, kept: Rung, free: Rung) -> None:
        """Name the cure if h >= 0 costs much: the other sign, or h of either sign."""
        if kept.rmse <= GAINS_ENERGY * free.rmse:
            return
        spread = self._spread
        price = f"{kept.rmse / spread:.3g} with h >= 0, {free.rmse / spread:.3g} without"
        turned = self._turned_rmse(free)
        if turned < math.sqrt(kept.rmse * free.rmse):
            cure = (
                f"with the sign of the force turned it is {turned / spread:.3g}: press and release seem to "
                "be exchanged; give --negate force or --negate position"
            )
        elif crosses_where_steep(free.problem, free.solution):
            cure = (
                "release lies above press where the force is steep, as if the force were recorded late; give "
                "--force-late-s"
            )
        else:
            cure = (
                f"with the sign of the force turned it is {turned / spread:.3g}, which does not help: the "
                "object seems to release stored energy, as a latch does; give --no-hysteresis-nonnegative"
            )
        sentence = f"hysteresis gains energy on a part of the loop (NRMSE {price}); {cure}"
        if best.rmse > USABLE_NRMSE * spread:
            self.sign_findings.append(usable(sentence))
            self.findings.append(usable(sentence))
        else:
            self.notes.append(sentence)

    def _turned_rmse(self, free: Rung) -> float:
        """RMS error of a hysteresis rung with h <= 0, as with the sign of the force turned."""
        if free.problem.dimension > 1:
            return math.inf
        turned = copy(free.problem)
        turned.readout = free.problem.readout * np.array([[1.0], [-1.0]])
        return turned.rmse(impose(turned, free.solution, self._bounds(turned)))

    def _grown_hysteresis(self, below: Rung, rung: Rung, *, named: bool) -> Rung:
        """A network with hysteresis; the play radius is found once it is sure that there is hysteresis.

        Wavelets grown at a wrong radius model what is wrong with it, as those of a single force do, and a
        radius found on few wavelets makes up for those that are missing: growth begins anew, and the radius
        is sought again whenever the network may be twice as large.
        """
        assert rung.strokes is not None
        strokes, most = rung.strokes, self._options.max_wavelets
        basis = self._grown_before.get(rung.name, rung.solution.basis)
        begun, complete = rung.name in self._grown_before, False
        for _ in range(RADIUS_ROUNDS):
            before = strokes
            if self._play and (named or self._evidence.earned(below, rung)):
                strokes = self._play.nearer(strokes, basis)
                basis, begun = (basis if begun else Basis.empty(1)), True
            if complete and strokes is before:
                break
            rows = self._evidence.rows(strokes)
            limit = min(most, max(FIRST_SIZE, 2 * len(basis))) if self._play else most
            options = replace(self._options, max_wavelets=limit)
            problem, grown = self._evidence.grown(rows, strokes, rung.name, basis, options)
            self.path.extend(grown.path)
            basis = self._grown_before[rung.name] = grown.solution.basis
            rung = _hysteresis_rung(strokes, rows, problem, grown.solution, grown.stop_reason)
            complete = limit == most or max(point.n_wavelets for point in grown.path) < limit
        return rung

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
        rung = self._recorded(self._constrained(rung))
        return rung if self._evidence.earned(line, rung) else line

    def _better(self, below: Rung, above: Rung) -> Rung:
        """The upper rung if it earns its place, else the lower one; and a note on what it gains."""
        judged = self._evidence.judged(below, above)
        self._note(above, judged)
        return above if judged.earned else below

    def _note(self, above: Rung, judged: Judgement) -> None:
        self.notes.append(f"{above.name} {'taken' if judged.earned else 'refused'}: {judged.why}")

    def _constrained(self, rung: Rung) -> Rung:
        """The rung with its constraints, their price in the notes.

        If they cost more than a little, the network is grown further on forces that keep them; the result is
        taken if the criterion prefers it once the constraints are imposed on the true forces again.
        """
        options, problem = self._options, rung.problem
        bounds = self._bounds(problem)
        if problem.dimension > 1 or not bounds:
            return rung
        kept = impose(problem, rung.solution, bounds)
        if kept is rung.solution:
            return rung
        if problem.rmse(kept) > WORTH_REGROWING * rung.rmse and any(bound.seam for bound in bounds):
            # Equal slopes at both ends of a period may cost more than the corner that they avoid.
            bounds = [bound for bound in bounds if not (bound.seam and bound.of_slope)]
            kept = impose(problem, rung.solution, bounds)
        worse = problem.rmse(kept) > WORTH_REGROWING * rung.rmse
        if options.refine and worse and len(kept.basis) and not all(bound.seam for bound in bounds):
            moved = moved_to_bounds(problem, rung.rows, rung.solution, bounds)
            compatible, regrown = self._grown(
                moved, rung.strokes, rung.name, rung.solution.basis, options.max_wavelets
            )
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

    def _bounds(self, problem: SeparableProblem) -> list[Bound]:
        """The bounds that the options ask for."""
        slopes = self._options.slope_limits
        box_slopes = None if slopes is None else (slopes[0] * self._slope_unit, slopes[1] * self._slope_unit)
        return domain_bounds(
            problem,
            hysteresis=self._options.hysteresis_nonnegative,
            slopes=box_slopes,
            fixed=self._fixed_force,
            periodic=self._options.period is not None,
        )

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

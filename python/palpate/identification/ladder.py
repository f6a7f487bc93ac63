# SPDX-License-Identifier: Apache-2.0
"""The ladder: constant, linear, position, hysteresis. Model no more than a scene needs.

Every rung is judged on the same samples by the same criterion, with its constraints imposed, and is climbed
only if the criterion falls by `rung_evidence` or more. What a refused rung would have gained stands in the
notes, its networks stand in the path.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from .. import _core
from .._typing import Float1D, Float2D
from ..errors import InputError
from .compression import Compressed, Compressor, binning_error
from .constraints import domain_bounds, impose, moved_to_bounds
from .frame import truncated_frame
from .growth import Grown, PathPoint, grow, judge, prune
from .identified import IdentifiedNetwork, Readings
from .options import IdentifyOptions
from .selection import Library
from .separable import Basis, SeparableProblem, Solution, problem_of
from .stopping import deviance

LEAST_ROWS = 10
"""Rows below which nothing is identified."""

LEAST_POSITIONS = 3
"""Distinct positions below which nothing is identified."""

COARSEST_CANDIDATE = 1.0
"""Dilation of the frame's coarsest level [1/box]."""

BINNING_SHARE = 0.05
"""Error that cells of positions may add, as a share of the RMS error; above it the cells are halved."""

MOST_HALVINGS = 3
"""Times that cells are halved at most."""

WORTH_REGROWING = 1.01
"""Ratio of the RMS errors with and without constraints from which wavelets are grown to suit them."""


def fit_environment(
    positions: Float2D,
    force: Float1D,
    side: Float1D | None = None,
    options: IdentifyOptions | None = None,
    *,
    starts: Sequence[int] | None = None,
) -> IdentifiedNetwork:
    """Identify a force law from arrays.

    Parameters
    ----------
    positions : (n, d)
        Positions, growing into the object.
    force : (n,)
        Force of the object against the tool.
    side : (n,), optional
        +1 in rows of a stroke into the object, -1 out of it, 0 for neither (left out to judge hysteresis).
    options : IdentifyOptions, optional
    starts : sequence of int, optional
        Rows at which a continuous motion starts. With it, and without side, hysteresis is tried with the play
        operator, s = (x - pi)/r (d = 1).

    Returns
    -------
    IdentifiedNetwork

    Raises
    ------
    palpate.InputError
        For data that cannot be identified, and for a hysteresis input that the data cannot give.
    """
    options = options or IdentifyOptions()
    _require_usable(positions, force)
    limit = options.max_positions
    ladder = _Ladder(positions, force, side, starts, options)
    best = ladder.climb()
    for _ in range(MOST_HALVINGS):
        if not best.cells_too_wide():
            break
        limit *= 2
        ladder = _Ladder(positions, force, side, starts, replace(options, max_positions=limit))
        best = ladder.climb()
    found = ladder.finish(best)
    if side is None or best.name == "hysteresis" or ladder.samples == len(force):
        return found
    # hysteresis was refused, so there is no reason any more to leave out rows that have no direction
    every_row = fit_environment(positions, force, None, options)
    return replace(every_row, path=found.path + every_row.path, notes=found.notes + every_row.notes)


@dataclass(frozen=True)
class _Rung:
    """A candidate model: one solution of a problem over compressed rows."""

    name: str
    rows: Compressed
    problem: SeparableProblem
    solution: Solution
    n_parameters: int
    stop_reason: str
    play_radius: float | None = None

    @property
    def rmse(self) -> float:
        return self.problem.rmse(self.solution)

    def criterion(self, options: IdentifyOptions) -> float:
        total = self.problem.total(self.solution.rss)
        return deviance(options.criterion, total, self.problem.samples, self.n_parameters)

    def cells_too_wide(self) -> bool:
        """Whether gathering positions in cells may have moved the fit by more than it should (d = 1)."""
        if self.problem.dimension > 1 or not self.rows.spread.any():
            return False
        alpha, beta = self.solution.basis.alpha[:, 0], self.solution.basis.beta[:, 0]
        bend = _core.mexican_hat_curvature(alpha * (self.rows.positions - beta))
        by_channel = bend @ (alpha**2 * self.solution.coefficients[:, 2:]).T
        error = binning_error(self.rows, np.abs(by_channel).max(axis=1))
        return error > BINNING_SHARE * self.problem.resolved_rmse(self.solution)


class _Ladder:
    """One climb over one recording, in the unit box of its positions."""

    def __init__(
        self,
        positions: Float2D,
        force: Float1D,
        side: Float1D | None,
        starts: Sequence[int] | None,
        options: IdentifyOptions,
    ) -> None:
        self._options = options
        self._lower, self._reach = positions.min(axis=0), np.ptp(positions, axis=0)
        self._notes: list[str] = []
        self._path: list[PathPoint] = []
        if side is not None and not ((side > 0).any() and (side < 0).any()):
            side = None
        if side is not None and self._wants_hysteresis and not side.all():
            self._notes.append(
                f"{np.count_nonzero(side == 0)} rows without a direction were left out to judge hysteresis"
            )
            positions, force, side = positions[side != 0], force[side != 0], side[side != 0]
        self._positions = (positions - self._lower) / self._reach
        self._force = force
        self._side = None if side is None else np.sign(side).astype(float)
        self._starts = starts if side is None and positions.shape[1] == 1 else None
        self._compressor = Compressor(self._positions, force, max_positions=options.max_positions)
        if self._side is None and self._starts is None and "hysteresis" in options.inputs:
            raise InputError(
                "inputs names hysteresis, but the recording has neither both directions nor time; "
                "name a direction column or leave hysteresis out"
            )

    @property
    def samples(self) -> int:
        """Rows that the ladder stands on."""
        return len(self._force)

    @property
    def _wants_hysteresis(self) -> bool:
        return self._options.inputs == "auto" or "hysteresis" in self._options.inputs

    def climb(self) -> _Rung:
        """The highest rung that earned its place, or the one that the inputs name."""
        rows = self._compressor.rows()
        best = self._better(self._constant(rows), self._straight(rows))
        if self._options.max_wavelets > 0:
            best = self._better(best, self._network(rows, "position", Basis.empty(rows.positions.shape[1])))
        if self._side is not None and self._wants_hysteresis:
            return self._hysteresis(best, self._compressor.rows(self._side), None)
        if self._starts is not None and self._wants_hysteresis:
            radius, rows = self._best_play(best.solution.basis)
            return self._hysteresis(best, rows, radius)
        return best

    def finish(self, rung: _Rung) -> IdentifiedNetwork:
        """The rung in the units of the data."""
        law = Readings.of(rung.solution, rung.problem.readout, self._lower, self._reach)
        two = len(law.bias) == 2
        spread = float(np.std(self._force))
        near_zero = max(rung.rmse, self._options.contact_share * float(np.ptp(self._force)))
        left_there = len(self._lower) == 1 and abs(law.at_lower) <= near_zero
        return IdentifiedNetwork(
            alpha=law.alpha,
            beta=law.beta,
            weight=law.weights[0],
            linear=law.linear[0],
            bias=float(law.bias[0]),
            weight_hysteresis=law.weights[1] if two else None,
            linear_hysteresis=law.linear[1] if two else None,
            bias_hysteresis=float(law.bias[1]) if two else None,
            lower=self._lower,
            upper=self._lower + self._reach,
            below="free" if left_there else "linear",
            above="linear",
            play_radius=None if rung.play_radius is None else rung.play_radius * float(self._reach[0]),
            rung=rung.name,
            stop_reason=rung.stop_reason,
            n_parameters=rung.n_parameters,
            rmse=rung.rmse,
            nrmse=rung.rmse / spread if spread > 0 else 0.0,
            path=tuple(self._path),
            notes=tuple(self._notes),
        )

    def _constant(self, rows: Compressed) -> _Rung:
        straight = self._straight_solution(rows)
        mean = float(np.average(rows.force, weights=rows.weight))
        coefficients = np.zeros_like(straight.solution.coefficients)
        coefficients[0, 0] = mean
        level = straight.problem.solution(straight.solution.basis, coefficients, straight.solution.designs)
        return self._recorded(replace(straight, name="constant", solution=level, n_parameters=1))

    def _straight(self, rows: Compressed) -> _Rung:
        return self._recorded(self._constrained(self._straight_solution(rows)))

    def _straight_solution(self, rows: Compressed) -> _Rung:
        problem = problem_of(rows, resolved_by=self._options.resolved_by)
        solution = problem.solve(Basis.empty(problem.dimension))
        return _Rung("linear", rows, problem, solution, problem.n_parameters(0), self._options.criterion)

    def _network(self, rows: Compressed, name: str, start: Basis) -> _Rung:
        """A network grown from the wavelets of start, with its constraints."""
        problem, grown = self._grown(rows, name, start)
        n_parameters = problem.n_parameters(len(grown.solution.basis))
        return self._constrained(_Rung(name, rows, problem, grown.solution, n_parameters, grown.stop_reason))

    def _grown(self, rows: Compressed, name: str, start: Basis) -> tuple[SeparableProblem, Grown]:
        problem = problem_of(rows, resolved_by=self._options.resolved_by)
        frame = truncated_frame(
            rows.positions,
            coarsest=COARSEST_CANDIDATE,
            finest=float(problem.finest(rows.positions).max()),
            frame_scale=self._options.frame_scale,
            frame_step=self._options.frame_step,
            max_candidates=self._options.max_candidates,
        )
        grown = grow(problem, Library(problem, frame), start, name, self._options)
        self._path.extend(grown.path)
        return problem, grown

    def _hysteresis(self, below: _Rung, rows: Compressed, radius: float | None) -> _Rung:
        """g + s h on top of the wavelets of the rung below, if it earns its place or is named.

        h >= 0 has a mean, which the wavelets of g, the slope and the bias show at once: if the criterion does
        not fall at all with these, growing a network would be in vain.
        """
        options, named = self._options, self._options.inputs != "auto"
        extra = 0 if radius is None else 1
        problem = problem_of(rows, resolved_by=options.resolved_by)
        first = problem.solve(below.solution.basis)
        n_parameters = problem.n_parameters(len(first.basis)) + extra
        free = _Rung("hysteresis", rows, problem, first, n_parameters, options.criterion, radius)
        if named or free.criterion(options) < below.criterion(options):
            problem, grown = self._grown(rows, "hysteresis", first.basis)
            n_parameters = problem.n_parameters(len(grown.solution.basis)) + extra
            free = _Rung("hysteresis", rows, problem, grown.solution, n_parameters, grown.stop_reason, radius)
        if not named and self._better(below, free) is below:
            return below
        kept = self._constrained(free)
        if named or kept is free:
            return kept
        return self._better(self._single_valued(kept) if len(below.solution.basis) else below, kept)

    def _single_valued(self, hysteresis: _Rung) -> _Rung:
        """A force of position alone on the wavelets of a hysteresis rung, those it does not need removed.

        Where hysteresis is there but not with h >= 0, this is what remains of it. A network grown on position
        alone will not do: strokes that a periodic motion samples at different places look like one rapidly
        changing force.
        """
        rows = self._compressor.rows()
        problem = problem_of(rows, resolved_by=self._options.resolved_by)
        start = problem.solve(hysteresis.solution.basis)
        problem.set_prior(start.rss)
        solution = prune(problem, problem.solve(start.basis), self._options)
        n_parameters = problem.n_parameters(len(solution.basis))
        name = "position" if len(solution.basis) else "linear"
        return self._recorded(
            self._constrained(_Rung(name, rows, problem, solution, n_parameters, hysteresis.stop_reason))
        )

    def _best_play(self, basis: Basis) -> tuple[float, Compressed]:
        """The play radius [box] whose input helps most on given wavelets, and the rows that it gives."""
        assert self._starts is not None
        motions = np.split(self._positions[:, 0], list(self._starts)[1:])
        tried = []
        for radius in self._options.play_radius:
            play = np.concatenate([_core.play(motion, radius) for motion in motions])
            rows = self._compressor.rows(np.clip((self._positions[:, 0] - play) / radius, -1.0, 1.0))
            problem = problem_of(rows, resolved_by=self._options.resolved_by)
            tried.append((problem.total(problem.solve(basis).rss), radius, rows))
        _, radius, rows = min(tried, key=lambda candidate: candidate[0])
        return radius, rows

    def _better(self, below: _Rung, above: _Rung) -> _Rung:
        """The upper rung if the criterion falls enough, else the lower one, and a note."""
        gain = below.criterion(self._options) - above.criterion(self._options)
        if gain >= self._options.rung_evidence:
            return above
        changes = f"falls by {gain:.4g}" if gain > 0 else f"rises by {-gain:.4g}"
        self._notes.append(
            f"{above.name} refused: {self._options.criterion} {changes}, "
            f"it has to fall by {self._options.rung_evidence:g} or more"
        )
        return below

    def _constrained(self, rung: _Rung) -> _Rung:
        """The rung with its constraints, their price in the notes.

        If they cost more than a little, the network is grown further on forces that keep them; the result is
        taken if the criterion prefers it once the constraints are imposed on the true forces again.
        """
        options, problem, slopes = self._options, rung.problem, self._options.slope_limits
        box_slopes = None if slopes is None else (slopes[0] * self._reach[0], slopes[1] * self._reach[0])
        bounds = domain_bounds(problem, hysteresis=options.hysteresis_nonnegative, slopes=box_slopes)
        if problem.dimension > 1 or not bounds:
            return rung
        kept = impose(problem, rung.solution, bounds)
        if kept is rung.solution:
            return rung
        if options.refine and problem.rmse(kept) > WORTH_REGROWING * rung.rmse and len(kept.basis):
            moved = moved_to_bounds(problem, rung.rows, rung.solution, bounds)
            compatible, regrown = self._grown(moved, rung.name, rung.solution.basis)
            trial = impose(problem, problem.solve(regrown.solution.basis), bounds)
            if _judged_on(compatible, trial, options) < _judged_on(compatible, kept, options):
                kept = trial
        names = " and ".join(dict.fromkeys(bound.name for bound in bounds))
        price = f"RMS error {problem.rmse(kept):.4g} with, {rung.rmse:.4g} without"
        self._notes.append(f"{rung.name}: {names} imposed over the domain, {price}")
        more = problem.n_parameters(len(kept.basis)) - problem.n_parameters(len(rung.solution.basis))
        return replace(rung, solution=kept, n_parameters=rung.n_parameters + more)

    def _recorded(self, rung: _Rung) -> _Rung:
        n_wavelets = len(rung.solution.basis)
        self._path.append(PathPoint(rung.name, n_wavelets, rung.rmse, rung.criterion(self._options)))
        return rung


def _judged_on(problem: SeparableProblem, solution: Solution, options: IdentifyOptions) -> float:
    """Criterion of a solution on the rows of another problem of the same form."""
    return judge(problem, problem.solution_of(solution), options)


def _require_usable(positions: Float2D, force: Float1D) -> None:
    if positions.ndim != 2 or force.shape != (len(positions),):
        raise InputError(
            f"positions are {positions.shape} and force {force.shape}; (n, d) and (n,) are needed"
        )
    if len(force) < LEAST_ROWS:
        raise InputError(f"the recording has {len(force)} rows; {LEAST_ROWS} or more are needed")
    for name, values in (("position", positions), ("force", force[:, None])):
        bad = np.flatnonzero(~np.isfinite(values).all(axis=1))
        if len(bad):
            raise InputError(
                f"{name} in row {bad[0]} is {values[bad[0]]}; every value must be a finite number"
            )
    for number, column in enumerate(positions.T):
        if column.min() == column.max():
            raise InputError(f"all positions are {column[0]:g}; identifying needs a position that moves")
        if len(np.unique(column)) < LEAST_POSITIONS:
            raise InputError(
                f"position {number} takes only {len(np.unique(column))} distinct values; "
                f"{LEAST_POSITIONS} or more are needed"
            )

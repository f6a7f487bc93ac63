# SPDX-License-Identifier: Apache-2.0
"""The ladder: constant, linear, position, hysteresis. Model no more than a scene needs.

Every rung is judged on the same samples by the same criterion, and is climbed only if the criterion falls by
`rung_evidence` or more. What a refused rung would have gained stands in the notes, its networks in the path.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from .. import _core
from .._typing import Float1D, Float2D
from ..errors import InputError
from .compression import Compressed, Compressor, binning_error
from .constraints import domain_bounds, impose, moved_to_bounds
from .frame import truncated_frame
from .growth import PathPoint, grow, judge
from .options import IdentifyOptions
from .selection import Library
from .separable import Basis, SeparableProblem, Solution, problem_of
from .stopping import deviance

LEAST_ROWS = 10
LEAST_POSITIONS = 3

BINNING_SHARE = 0.05
"""Error that gathering positions in cells may add, as a share of the RMS error; above it the cells are halved."""

MOST_HALVINGS = 3
"""Times the cells are halved at most."""


WORTH_REGROWING = 1.01
"""Ratio of the RMS errors with and without the constraints from which wavelets are moved to suit them."""


@dataclass(frozen=True)
class IdentifiedNetwork:
    """An identified force law f = g(x) + s h(x) and how it came about; all in the units of the data."""

    alpha: Float2D
    beta: Float2D
    weight: Float1D
    linear: Float1D
    bias: float
    weight_hysteresis: Float1D | None
    linear_hysteresis: Float1D | None
    bias_hysteresis: float | None
    lower: Float1D
    upper: Float1D
    below: str
    above: str
    play_radius: float | None
    rung: str
    stop_reason: str
    n_parameters: int
    rmse: float
    """On the samples of the identification"""
    nrmse: float
    path: tuple[PathPoint, ...]
    notes: tuple[str, ...]


@dataclass(frozen=True)
class _Rung:
    """A candidate model: the solution of a problem over compressed rows."""

    name: str
    criterion: float
    stop_reason: str
    n_parameters: int
    rows: Compressed
    problem: SeparableProblem
    solution: Solution
    play_radius: float | None = None


def fit_environment(
    positions: Float2D,
    force: Float1D,
    side: Float1D | None = None,
    options: IdentifyOptions | None = None,
    *,
    starts: Sequence[int] | None = None,
) -> IdentifiedNetwork:
    """Identify a force law from arrays: the ladder on compressed data.

    Parameters
    ----------
    positions : (n, d)
        Positions; growing into the object.
    force : (n,)
        Force of the object against the tool.
    side : (n,), optional
        +1 for rows of a stroke into the object, -1 out of it, 0 for neither (kept out of a hysteresis model).
    options : IdentifyOptions, optional
    starts : sequence of int, optional
        Rows at which a continuous motion starts. Given, and without side, the hysteresis rung is tried with the play
        operator pi_k = min(x_k + r, max(x_k - r, pi_(k-1))), s = (x - pi)/r (d = 1).

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
    for halving in range(MOST_HALVINGS + 1):
        ladder = _Ladder(positions, force, side, starts, replace(options, max_positions=limit))
        best = ladder.climb()
        if halving == MOST_HALVINGS or not _cells_too_wide(best):
            break
        limit *= 2
    return ladder.finish(best)


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
        self.options = options
        self.lower = positions.min(axis=0)
        self.reach = np.ptp(positions, axis=0)
        self.upper = self.lower + self.reach
        self.notes: list[str] = []
        self.path: list[PathPoint] = []
        self._wants_hysteresis = options.inputs == "auto" or "hysteresis" in options.inputs
        strokes = side is not None and bool((side > 0).any() and (side < 0).any())
        if strokes and self._wants_hysteresis:
            assert side is not None
            kept = side != 0
            if not kept.all():
                self.notes.append(
                    f"{int((~kept).sum())} rows without a direction were left out, to judge hysteresis"
                )
                positions, force, side = positions[kept], force[kept], side[kept]
        self._positions = (positions - self.lower) / np.where(self.reach > 0, self.reach, 1.0)
        self._force = np.asarray(force, dtype=float)
        self._side = np.sign(side).astype(float) if strokes and side is not None else None
        self._compressor = Compressor(self._positions, self._force, max_positions=options.max_positions)
        self._starts = starts if positions.shape[1] == 1 else None
        if (
            self._side is None
            and self._starts is None
            and "hysteresis" in options.inputs
            and options.inputs != "auto"
        ):
            raise InputError(
                'inputs asks for "hysteresis", but the recording has neither both directions nor a time column; '
                'name a direction column, or leave "hysteresis" out'
            )

    def climb(self) -> _Rung:
        """The highest rung that earned its place, or that the options name."""
        rows = self._compressor.rows()
        best = self._straight(rows, "constant")
        best = self._better(best, self._straight(rows, "linear"))
        if self.options.max_wavelets > 0:
            best = self._better(best, self._network(rows, "position", Basis.empty(self._positions.shape[1])))
        if self._wants_hysteresis and (self._side is not None or self._starts is not None):
            hysteresis = self._hysteresis(best)
            named = self.options.inputs != "auto"
            best = hysteresis if named and hysteresis is not None else self._better(best, hysteresis)
        return best

    def finish(self, rung: _Rung) -> IdentifiedNetwork:
        """Constraints, then back to the units of the data."""
        rung = self._constrained(rung)
        solution = rung.solution
        readings = rung.problem.readout @ solution.coefficients
        d = self._positions.shape[1]
        linear = readings[:, 1 : 1 + d] / np.where(self.reach > 0, self.reach, 1.0)
        bias = readings[:, 0] - linear @ self.lower
        weights = readings[:, 1 + d :]
        two = len(readings) == 2
        rmse = float(np.sqrt(rung.problem.total(solution.rss) / rung.problem.samples))
        spread = float(np.std(self._force))
        at_lower = readings[0] @ np.concatenate(
            [
                [1.0],
                np.zeros(d),
                _core.wavelet_columns(np.zeros((1, d)), solution.basis.alpha, solution.basis.beta)[0],
            ]
        )
        contact = abs(at_lower) <= max(rmse, self.options.contact_share * float(np.ptp(self._force)))
        return IdentifiedNetwork(
            alpha=solution.basis.alpha / self.reach,
            beta=self.lower + solution.basis.beta * self.reach,
            weight=weights[0],
            linear=linear[0],
            bias=float(bias[0]),
            weight_hysteresis=weights[1] if two else None,
            linear_hysteresis=linear[1] if two else None,
            bias_hysteresis=float(bias[1]) if two else None,
            lower=self.lower,
            upper=self.upper,
            below="free" if d == 1 and contact else "linear",
            above="linear",
            play_radius=None if rung.play_radius is None else rung.play_radius * float(self.reach[0]),
            rung=rung.name,
            stop_reason=rung.stop_reason,
            n_parameters=rung.n_parameters,
            rmse=rmse,
            nrmse=rmse / spread if spread > 0 else 0.0,
            path=tuple(self.path),
            notes=tuple(self.notes),
        )

    def _straight(self, rows: Compressed, name: str) -> _Rung:
        """Constant or linear: no wavelets."""
        problem = problem_of(rows, resolved_by=self.options.resolved_by)
        solution = problem.solve(Basis.empty(problem.dimension))
        n_parameters = problem.n_parameters(0)
        if name == "constant":
            mean = float(np.average(rows.force, weights=rows.weight))
            coefficients = np.zeros_like(solution.coefficients)
            coefficients[0, 0] = mean
            rss = float(rows.weight @ (rows.force - mean) ** 2)
            solution, n_parameters = replace(solution, coefficients=coefficients, rss=rss), 1
        total = problem.total(solution.rss)
        criterion = deviance(self.options.criterion, total, problem.samples, n_parameters)
        self.path.append(PathPoint(name, 0, float(np.sqrt(total / problem.samples)), criterion))
        return _Rung(name, criterion, self.options.criterion, n_parameters, rows, problem, solution)

    def _network(self, rows: Compressed, name: str, start: Basis, play_radius: float | None = None) -> _Rung:
        """A network grown from the wavelets of start."""
        options = self.options
        problem = problem_of(rows, resolved_by=options.resolved_by)
        frame = truncated_frame(
            rows.positions,
            coarsest=1.0,
            finest=float(problem.finest(rows.positions).max()),
            frame_scale=options.frame_scale,
            frame_step=options.frame_step,
        )
        grown = grow(problem, Library(problem, frame), start, name, options)
        self.path.extend(grown.path)
        n_parameters = problem.n_parameters(len(grown.solution.basis))
        return _Rung(
            name, grown.criterion, grown.stop_reason, n_parameters, rows, problem, grown.solution, play_radius
        )

    def _hysteresis(self, below: _Rung) -> _Rung | None:
        """g + s h on the wavelets of the rung below, s from the strokes or from the play radius that fits best."""
        start = below.solution.basis
        if self._side is not None:
            rows = self._compressor.rows(self._side)
            return self._network(rows, "hysteresis", start)
        tried = []
        for radius in self.options.play_radius:
            rows = self._compressor.rows(self._play_side(radius))
            problem = problem_of(rows, resolved_by=self.options.resolved_by)
            p = problem.n_parameters(len(start)) + 1
            total = problem.total(problem.solve(start).rss)
            tried.append((deviance(self.options.criterion, total, problem.samples, p), radius, rows))
        value, radius, rows = min(tried, key=lambda item: item[0])
        if self.options.inputs == "auto" and value > below.criterion - self.options.rung_evidence:
            self.notes.append(_refusal("hysteresis", below.criterion - value, self.options))
            return None
        rung = self._network(rows, "hysteresis", start, radius)
        price = deviance(self.options.criterion, 1.0, rows.samples, rung.n_parameters + 1) - deviance(
            self.options.criterion, 1.0, rows.samples, rung.n_parameters
        )
        return replace(rung, criterion=rung.criterion + price, n_parameters=rung.n_parameters + 1)

    def _play_side(self, radius: float) -> Float1D:
        """Hysteresis input (n,) of the recorded motion for a play radius [box]; each motion starts at rest, s = 0."""
        assert self._starts is not None
        motions = np.split(self._positions[:, 0], list(self._starts)[1:])
        play = np.concatenate([_core.play(motion, radius) for motion in motions])
        return np.clip((self._positions[:, 0] - play) / radius, -1.0, 1.0)

    def _better(self, below: _Rung, above: _Rung | None) -> _Rung:
        """The upper rung if the criterion falls enough, else the lower one; says so when it was refused."""
        if above is None:
            return below
        gain = below.criterion - above.criterion
        if gain >= self.options.rung_evidence:
            return above
        self.notes.append(_refusal(above.name, gain, self.options))
        return below

    def _constrained(self, rung: _Rung) -> _Rung:
        """The rung with the constraints imposed, their price told in the notes.

        If they cost more than a little, the network is grown further on forces that keep them, and what that
        gives is taken if the criterion prefers it once the constraints are imposed on the true forces again.
        """
        options, problem = self.options, rung.problem
        slopes = options.slope_limits
        bounds = domain_bounds(
            problem,
            nonnegative_hysteresis=options.hysteresis_nonnegative,
            slopes=None if slopes is None else (slopes[0] * self.reach[0], slopes[1] * self.reach[0]),
        )
        if problem.dimension > 1 or not bounds:
            return rung
        kept = impose(problem, rung.solution, bounds)
        if kept is rung.solution:
            return rung
        free = problem.rmse(rung.solution)
        n_parameters = rung.n_parameters
        if options.refine and problem.rmse(kept) > WORTH_REGROWING * free:
            rows = moved_to_bounds(problem, rung.rows, rung.solution, bounds)
            grown = self._network(rows, rung.name, rung.solution.basis)
            trial = impose(problem, problem.solve(grown.solution.basis), bounds)
            if judge(problem, trial, options) < judge(problem, kept, options):
                extra = rung.n_parameters - problem.n_parameters(len(rung.solution.basis))
                n_parameters = grown.n_parameters + extra
                kept = trial
        names = [
            name
            for name, asked in (("h >= 0", options.hysteresis_nonnegative), ("slope bounds", slopes))
            if asked
        ]
        self.notes.append(
            f"{' and '.join(names)} imposed over the domain: RMS error {problem.rmse(kept):.4g} with, {free:.4g} without"
        )
        return replace(rung, solution=kept, n_parameters=n_parameters)


def _require_usable(positions: Float2D, force: Float1D) -> None:
    if positions.ndim != 2 or force.shape != (len(positions),):
        raise InputError(
            f"positions have shape {positions.shape} and force {force.shape}; (n, d) and (n,) are needed"
        )
    if len(force) < LEAST_ROWS:
        raise InputError(
            f"the recording has {len(force)} rows; at least {LEAST_ROWS} are needed to identify a force"
        )
    for name, values in (("position", positions), ("force", force)):
        bad = np.flatnonzero(~np.isfinite(values).reshape(len(values), -1).all(axis=1))
        if len(bad):
            raise InputError(
                f"{name} is {values[bad[0]]} in row {bad[0]}; every value must be a finite number"
            )
    for k, column in enumerate(positions.T):
        if column.min() == column.max():
            raise InputError(
                f"all positions are {column[0]:g}; a force over position needs a position that moves"
            )
        if len(column) < 10_000 and len(np.unique(column)) < LEAST_POSITIONS:
            raise InputError(
                f"input {k} takes only {len(np.unique(column))} distinct values; {LEAST_POSITIONS} or more are needed"
            )


def _cells_too_wide(rung: _Rung) -> bool:
    """Whether gathering positions in cells (d = 1) may have moved the fit by more than its share of the RMS error."""
    rows, problem, solution = rung.rows, rung.problem, rung.solution
    if not rows.spread.any() or problem.dimension > 1:
        return False
    basis = solution.basis
    u = basis.alpha[:, 0] * (rows.positions - basis.beta[:, 0])
    by_channel = _core.mexican_hat_curvature(u) @ (basis.alpha[:, 0] ** 2 * solution.coefficients[:, 2:]).T
    curvature: NDArray[np.float64] = np.abs(by_channel).max(axis=1)
    allowed = BINNING_SHARE * np.sqrt(problem.total(solution.rss) / problem.samples)
    return binning_error(rows, curvature) > allowed


def _refusal(rung: str, gain: float, options: IdentifyOptions) -> str:
    return f"{rung} refused: {options.criterion} falls by {gain:.4g}, {options.rung_evidence:g} is asked for"

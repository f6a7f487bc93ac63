# SPDX-License-Identifier: Apache-2.0
"""Regression over any inputs: weighted rows in, a network out, however few or odd the rows are.

The ladder of :mod:`.ladder` knows what a position and a stroke are; here there are only columns. The rungs
are constant, linear and network, judged on n = sum of the weights samples, and none is tried that has as many
parameters as there are samples.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from .._typing import Float1D, Float2D
from ..errors import InputError
from .cells import MOST_HALVINGS, cells_too_wide
from .compression import Compressed, Compressor
from .frame import truncated_frame
from .growth import PathPoint, grow, judge
from .identified import Readings
from .ladder import COARSEST_CANDIDATE
from .options import IdentifyOptions
from .selection import Library
from .separable import Basis, SeparableProblem, Solution, problem_of
from .stopping import deviance

NARROWEST = 1e-12
"""A column whose range is below this share of its largest value is constant but for rounding."""


@dataclass(frozen=True)
class Regression:
    """A network over those columns of X that vary."""

    columns: NDArray[np.int64]
    """(d,) which columns of X the network has as inputs: the constant ones are left out"""
    lower: Float1D
    """(d,) least value of each"""
    upper: Float1D
    """(d,) largest value of each"""
    readings: Readings
    """Wavelets, weights, slopes and bias in the units of X and y"""
    rung: str
    """constant, linear or network"""
    stop_reason: str
    n_parameters: int
    rmse: float
    """On the weighted rows [y]"""
    path: tuple[PathPoint, ...]


def fit_regression(X: Float2D, y: Float1D, weight: Float1D | None, options: IdentifyOptions) -> Regression:
    """Fit f(x) = sum_i w_i psi(alpha_i o (x - beta_i)) + c'x + b (paper eq. 4) to rows of any meaning.

    Parameters
    ----------
    X : (n, d)
        Finite numbers.
    y : (n,)
        Finite numbers.
    weight : (n,), optional
        How many samples each row stands for, >= 0; 1 without it. A row of weight 0 is no row: nothing is
        learned from its position either.
    options : IdentifyOptions

    Raises
    ------
    palpate.InputError
        No row has a weight above 0.
    """
    if weight is None:
        weight = np.ones(len(y))
    counted = weight > 0.0
    if not counted.any():
        raise InputError("the sample weights are all zero; at least one row must count")
    X, y, weight = X[counted], y[counted], weight[counted]
    reach = np.ptp(X, axis=0)
    varies = reach > NARROWEST * np.abs(X).max(axis=0)
    # a network needs an input: where none varies, the first stands in a box of its own width
    columns = np.flatnonzero(varies) if varies.any() else np.zeros(1, dtype=np.int64)
    lower, upper = X[:, columns].min(axis=0), X[:, columns].max(axis=0)
    if not varies.any():
        lower, upper = lower - 0.5 * _unit(lower), upper + 0.5 * _unit(upper)
    box = (X[:, columns] - lower) / (upper - lower)
    with threadpool_limits(limits=1, user_api="blas"):
        limit = options.max_positions * 2 ** (len(columns) - 1)
        for _ in range(MOST_HALVINGS + 1):
            rows = Compressor(box, y, weight=weight, max_positions=limit).rows()
            found = _climbed(rows, options)
            if not cells_too_wide(found.problem, rows, found.solution):
                break
            limit *= 2
        readings = Readings.of(found.solution, found.problem.readout, lower, upper - lower)
    return Regression(
        columns=columns,
        lower=lower,
        upper=upper,
        readings=readings,
        rung=found.name,
        stop_reason=found.stop_reason,
        n_parameters=found.n_parameters,
        rmse=found.problem.rmse(found.solution),
        path=tuple(found.path),
    )


def _unit(value: Float1D) -> Float1D:
    """A width that a number of this size can be moved by."""
    return np.maximum(1.0, np.abs(value))


@dataclass
class _Climb:
    """The best rung so far, and what was considered."""

    name: str
    problem: SeparableProblem
    solution: Solution
    n_parameters: int
    stop_reason: str
    criterion: float
    path: list[PathPoint]


def _climbed(rows: Compressed, options: IdentifyOptions) -> _Climb:
    """Constant, linear, network: as far as each lowers the criterion by `rung_evidence` or more."""
    problem = problem_of(rows, resolved_by=options.resolved_by)
    straight = problem.solve(Basis.empty(problem.dimension))
    level = np.zeros_like(straight.coefficients)
    level[0, 0] = np.average(rows.force, weights=rows.weight)
    best = _constant(problem, problem.solution(straight.basis, level, straight.designs), options)
    if problem.n_parameters(0) >= problem.samples:
        return best
    criterion = judge(problem, straight, options)
    best.path.append(PathPoint("linear", 0, problem.rmse(straight), criterion))
    if best.criterion - criterion >= options.rung_evidence:
        best.name, best.solution, best.criterion = "linear", straight, criterion
        best.n_parameters, best.stop_reason = problem.n_parameters(0), options.criterion
    if options.max_wavelets == 0 or problem.n_parameters(1) >= problem.samples:
        return best
    frame = truncated_frame(
        rows.positions,
        coarsest=COARSEST_CANDIDATE,
        finest=float(problem.finest(rows.positions).max()),
        frame_scale=options.frame_scale,
        frame_step=options.frame_step,
        max_candidates=options.max_candidates,
    )
    grown = grow(problem, Library(problem, frame), Basis.empty(problem.dimension), "network", options)
    best.path.extend(grown.path)
    if best.criterion - grown.criterion >= options.rung_evidence:
        best.name, best.solution, best.criterion = "network", grown.solution, grown.criterion
        best.n_parameters = problem.n_parameters(len(grown.solution.basis))
        best.stop_reason = grown.stop_reason
    return best


def _constant(problem: SeparableProblem, level: Solution, options: IdentifyOptions) -> _Climb:
    criterion = deviance(options.criterion, problem.total(level.rss), problem.samples, 1)
    stop_reason = options.criterion if problem.n_parameters(0) < problem.samples else "data"
    path = [PathPoint("constant", 0, problem.rmse(level), criterion)]
    return _Climb("constant", problem, level, 1, stop_reason, criterion, path)

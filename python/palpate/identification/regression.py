# SPDX-License-Identifier: Apache-2.0
"""Regression over any inputs: weighted rows in, a network out, however few or odd the rows are.

The ladder of :mod:`.ladder` knows what a position and a stroke are; here there are only columns. The rungs
are constant, linear and network, judged on n = sum of the weights samples, and none is tried that has as many
parameters as there are samples.
"""

from copy import copy
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from .._typing import Float1D, Float2D
from ..errors import InputError
from .compression import Compressed, Compressor
from .distinct import distinct_rows
from .environment import MOST_HALVINGS
from .frame import resolved_frame
from .fresh import FreshRows, kept_back
from .growth import PathPoint, grow
from .identified import Readings
from .options import IdentifyOptions
from .robust import robust_weights, suspects
from .row_error import RowError
from .rung import Rung
from .scaling import ForceScale
from .selection import Library
from .separable import Basis, SeparableProblem, Solution, problem_of
from .stopping import ON_FRESH_ROWS
from .usable import LARGEST

NARROWEST = 1e-12
"""A column whose range is below this share of its largest value is constant but for rounding."""

MOST_ROWS = 200_000
"""Rows, evenly spread, that the error is computed on: more change its third digit at most."""


@dataclass(frozen=True)
class Regression:
    """A network over those columns of X that vary."""

    columns: NDArray[np.int64]
    """(d,) which columns of X the network has as inputs: the constant ones are left out"""
    lower: Float1D
    """(d,) least value of each, less the margin of a sample"""
    upper: Float1D
    """(d,) largest value of each, plus that margin"""
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
    largest = max(float(np.abs(X).max()), float(np.abs(y).max()))
    if largest > LARGEST:
        raise InputError(f"the data hold {largest:.3g}; the limit is {LARGEST:g}. Use other units")
    if scale := ForceScale.of(y, options):
        scaled = fit_regression(X, scale.scaled(y), weight, scale.scaled_options(options))
        return replace(
            scaled,
            readings=scale.unscaled_readings(scaled.readings),
            rmse=scaled.rmse / scale.factor,
            path=tuple(replace(point, rmse=point.rmse / scale.factor) for point in scaled.path),
        )
    reach = np.ptp(X, axis=0)
    varies = reach > NARROWEST * np.abs(X).max(axis=0)
    # a network needs an input: where none varies, the first stands in a box of its own width
    columns = np.flatnonzero(varies) if varies.any() else np.zeros(1, dtype=np.int64)
    lower, upper = X[:, columns].min(axis=0), X[:, columns].max(axis=0)
    if not varies.any():
        lower, upper = lower - 0.5 * _unit(lower), upper + 0.5 * _unit(upper)
    box = (X[:, columns] - lower) / (upper - lower)
    fresh = kept_back(len(y), None) if options.criterion in ON_FRESH_ROWS else None
    if fresh is not None and not fresh.any():
        raise InputError(f"criterion {options.criterion!r} keeps rows back; {len(y)} are too few for that")
    with threadpool_limits(limits=1, user_api="blas"):
        found, path = _fitted(_Rows(box, y, fresh), weight, options)
        rows = slice(None, None, max(1, -(-len(y) // MOST_ROWS)))
        error = RowError(y[rows] - found.modelled(box[rows]), y[rows], weight[rows])
        readings = Readings.of(found.solution, found.problem.readout, lower, upper - lower)
    margin = _margin(box) * (upper - lower)
    return Regression(
        columns=columns,
        lower=lower - margin,
        upper=upper + margin,
        readings=readings,
        rung=found.name,
        stop_reason=found.stop_reason,
        n_parameters=found.n_parameters,
        rmse=error.rmse,
        path=tuple(path),
    )


def _margin(box: Float2D) -> float:
    """How far the range that rows were drawn from reaches beyond them, on each side [box].

    The extremes of m values drawn evenly from a range fall short of it by 1/(m + 1) of it on average, which
    is 1/(m - 1) of what they span: no more than a few rows of a wavelet's core.
    """
    distinct = np.unique(box) if box.shape[1] == 1 else distinct_rows(box)[0]
    return 1.0 / max(len(distinct) - 1, 1)


def _unit(value: Float1D) -> Float1D:
    """A width that a number of this size can be moved by."""
    return np.maximum(1.0, np.abs(value))


@dataclass(frozen=True)
class _Rows:
    """Rows in the unit box, and those of them that are kept back where the criterion asks for it."""

    box: Float2D
    y: Float1D
    fresh: NDArray[np.bool_] | None

    def compressed(self, weight: Float1D, cells: int) -> Compressed:
        only = None if self.fresh is None else ~self.fresh
        return Compressor(self.box, self.y, weight=weight, max_positions=cells).rows(None, only)

    def problem(self, rows: Compressed, options: IdentifyOptions) -> SeparableProblem:
        fresh = None if self.fresh is None else FreshRows.of(self.box, self.y, None, self.fresh)
        return problem_of(rows, resolved_by=options.resolved_by, fresh=fresh)


def _fitted(data: _Rows, weight: Float1D, options: IdentifyOptions) -> tuple[Rung, list[PathPoint]]:
    """Climb with cells that are fine enough, again with outliers weighed down where that is asked for."""
    cells = options.max_positions * 2 ** (data.box.shape[1] - 1)
    given, robust = weight, options.loss == "huber"
    suspect = suspects(data.box, data.y, None, weight) if robust else np.zeros(len(weight), dtype=bool)
    if robust:
        weight = np.where(suspect, 0.0, weight)
    best, path = _climbed(data, weight, cells, options, Basis.empty(data.box.shape[1]))
    for _ in range(MOST_HALVINGS):
        if not best.cells_too_wide():
            break
        cells *= 2
        best, further = _climbed(data, weight, cells, options, best.solution.basis)
        path += further
    if robust:
        start = best.solution.basis
        found = robust_weights(
            lambda weights: _climbed(data, weights, cells, options, start)[0],
            best,
            data.box,
            data.y,
            given,
            suspect,
        )
        best, further = _climbed(data, found.weight, cells, options, start)
        path += further
    return best, path


def _climbed(
    data: _Rows, weight: Float1D, cells: int, options: IdentifyOptions, start: Basis
) -> tuple[Rung, list[PathPoint]]:
    """Constant, linear, network: as far as each lowers the criterion by `rung_evidence` or more.

    The network grows from the wavelets of start.
    """
    rows = data.compressed(weight, cells)
    problem = data.problem(rows, options)
    straight = problem.solve(Basis.empty(problem.dimension))
    mean = np.zeros_like(straight.coefficients)
    mean[0, 0] = np.average(rows.force, weights=rows.weight)
    level = problem.with_coefficients(straight, mean)

    def rung(of: SeparableProblem, name: str, solution: Solution, n_parameters: int, reason: str) -> Rung:
        return Rung(name, rows, of, solution, n_parameters, reason)

    best = rung(problem, "constant", level, 1, options.criterion)
    path = [_point(best, options)]
    if problem.n_parameters(0) >= problem.samples:
        return replace(best, stop_reason="data"), path
    line = rung(problem, "linear", straight, problem.n_parameters(0), options.criterion)
    path.append(_point(line, options))
    best = _better(best, line, options)
    if options.max_wavelets == 0 or problem.n_parameters(1) >= problem.samples:
        return best, path
    apart = copy(problem)  # growth sets a prior of its own in its problem
    library = Library(apart, resolved_frame(apart, options))
    grown = grow(apart, library, start, "network", options)
    path.extend(grown.path)
    n_parameters = apart.n_parameters(len(grown.solution.basis))
    return _better(
        best, rung(apart, "network", grown.solution, n_parameters, grown.stop_reason), options
    ), path


def _better(below: Rung, above: Rung, options: IdentifyOptions) -> Rung:
    falls = below.criterion(options) - above.criterion(options)
    return above if falls >= options.rung_evidence else below


def _point(rung: Rung, options: IdentifyOptions) -> PathPoint:
    return PathPoint(rung.name, 0, rung.rmse, rung.criterion(options))

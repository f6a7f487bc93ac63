# SPDX-License-Identifier: Apache-2.0
"""Least squares of a force at rest and of branches that relax or slip, over the time of recordings.

The force is f = g(x) + p(x) sum_j k_j e_j, with de_j/dt = p(x) dx/dt - e_j / tau_j or |e_j| <= Y_j. g is the
force at rest, p the ratio. Each branch has a stiffness k_j >= 0, and a time constant tau_j or a yield stretch
Y_j. For given p, tau and Y the force is linear in g and k_j: they follow from least squares with k_j >= 0.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
import scipy
from numpy.typing import NDArray

from ..._core.model import ForceModel, play, stretches
from ..._typing import Float1D, Float2D
from ..data.compression import HELD_OUT_EVERY
from ..data.limits import independent_share, neighbour_correlation
from ..search.evidence import deviance

MOST_ROUGHNESS = 1e-3
"""Largest weight of the curvature of the force at rest [spread of the force for a curvature of 1 in the unit
box]."""

ROUGHNESS_SHARE = 0.04
"""Weight of the curvature of the force at rest, divided by the RMS error of the memory [-]. A larger weight
would bias the time constants."""

ROUGHNESS_POINTS = 33
"""Number of positions at which the curvature of the force at rest is computed."""

STEPS = 12
"""Largest number of refinement steps after each added branch or wavelet."""

LEAST_RATIO = 0.02
"""Smallest ratio over the domain, as a share of its mean [-]."""

CURVE_POINTS = 257
"""Number of positions at which the least ratio is computed, and at which the force at rest is passed on to
its identification."""

LEAST_INDEPENDENT = 30.0
"""Least number of rows that count as independent."""

SECTION_ROWS = 10
"""Number of successive rows in a section; each fifth section is held out."""

UNDETERMINED = 0.03
"""Singular value, as a share of the largest one, below which rows do not determine a combination of
coefficients [-]."""


@dataclass(frozen=True)
class Motion:
    """Rows of one recording, as shares of the travel and of the spread of the force."""

    time: Float1D
    position: Float1D
    force: Float1D
    touched: NDArray[np.bool_]
    """(n,) True for the rows that are fitted: without contact the force is zero in any state of the object"""


@dataclass(frozen=True)
class Ranges:
    """Smallest and largest parameters of a branch that recordings resolve."""

    log_tau: tuple[float, float] | None
    """Logarithms of time constants [s]; None without time"""
    log_yield: tuple[float, float]
    """Logarithms of yield stretches [travel]"""


@dataclass(frozen=True)
class Shape:
    """Time constants and yield stretches of the branches, and parameters of the ratio p = 1 + c (x - 1/2) +
    sum_i w_i psi(...)."""

    log_tau: Float1D = field(default_factory=lambda: np.empty(0))
    """Logarithm of the time constant of each branch that relaxes [s]"""
    log_yield: Float1D = field(default_factory=lambda: np.empty(0))
    """Logarithm of the yield stretch of each branch that slips [travel]"""
    slope: float = 0.0
    wavelets: Float2D = field(default_factory=lambda: np.zeros((0, 3)))
    """(m, 3) weight, translation and logarithm of the dilation of each wavelet"""
    sloped: bool = False
    """True if the slope c is fitted"""

    @property
    def n_parameters(self) -> int:
        """Number of fitted values, stiffnesses included."""
        return 2 * self.n_branches + int(self.sloped) + self.wavelets.size

    @property
    def n_branches(self) -> int:
        return len(self.log_tau) + len(self.log_yield)

    def vector(self) -> Float1D:
        slope = [self.slope] if self.sloped else []
        return np.concatenate([self.log_tau, self.log_yield, slope, self.wavelets.ravel()])

    def at(self, vector: Float1D) -> Shape:
        """Returns the shape with the parameters of `vector`."""
        sizes = (len(self.log_tau), len(self.log_yield), int(self.sloped))
        log_tau, log_yield, slope, wavelets = np.split(vector, np.cumsum(sizes))
        return replace(
            self,
            log_tau=log_tau,
            log_yield=log_yield,
            slope=float(slope.sum()),
            wavelets=wavelets.reshape(-1, 3),
        )

    def bounds(self, ranges: Ranges) -> tuple[Float1D, Float1D]:
        """Returns the smallest and the largest values of `vector`."""
        low, high = np.array(
            [
                *[ranges.log_tau or (0.0, 0.0)] * len(self.log_tau),
                *[ranges.log_yield] * len(self.log_yield),
                *[(-10.0, 10.0)] * int(self.sloped),
                *[(-5.0, 5.0), (-0.3, 1.3), (0.0, 2.5)] * len(self.wavelets),
            ]
        ).T
        return low, high

    @cached_property
    def ratio(self) -> Ratio:
        """Network of the ratio over the unit box as arguments of :class:`ForceModel`; its least value is
        positive."""
        weight, beta, log_alpha = self.wavelets.T
        free = Ratio(np.exp(log_alpha), beta, weight, self.slope, 1.0 - 0.5 * self.slope)
        values = np.asarray(free.network.force(np.linspace(0.0, 1.0, CURVE_POINTS)))
        lift = max(0.0, LEAST_RATIO * max(float(values.mean()), LEAST_RATIO) - float(values.min()))
        largest = float(values.max()) + lift
        return Ratio(free.alpha, beta, weight / largest, self.slope / largest, (free.bias + lift) / largest)


@dataclass(frozen=True)
class Ratio:
    """Network of the ratio p over the unit box, at most 1."""

    alpha: Float1D
    beta: Float1D
    weight: Float1D
    linear: float
    bias: float

    @cached_property
    def network(self) -> ForceModel:
        """The ratio as a force; its energy is the coordinate u."""
        return ForceModel(
            alpha=self.alpha[:, None],
            beta=self.beta[:, None],
            weight=self.weight,
            linear=[self.linear],
            bias=self.bias,
            lower=[0.0],
            upper=[1.0],
        )


Resting = Callable[[Float1D], Float2D]
"""Returns the columns (n, m) of the force at rest at positions (n,) in the unit box"""


class MemoryFit:
    """Least-squares fits of memories to rows in contact, with fixed columns `resting` for the force at rest.

    A small weight on the curvature of this force decides where the rows do not: the ramps of a relaxation
    test determine only the sum of the force at rest and of the branches. The weight depends on the expected
    error `rms`. No force sensor resolves a mean squared error below `least`.
    """

    def __init__(
        self, motions: Sequence[Motion], resting: Resting, least: float, rms: float = np.inf
    ) -> None:
        self.motions, self.least = motions, least
        columns = resting(np.concatenate([m.position[m.touched] for m in motions]))
        self._force = np.concatenate([m.force[m.touched] for m in motions])
        self.n_rows = len(self._force)
        bends = (
            np.diff(resting(np.linspace(0.0, 1.0, ROUGHNESS_POINTS)), 2, axis=0) * (ROUGHNESS_POINTS - 1) ** 2
        )
        bends *= min(MOST_ROUGHNESS, ROUGHNESS_SHARE * rms) * np.sqrt(self.n_rows / len(bends))
        self._resting = np.concatenate([columns, bends])
        self._space = np.linalg.qr(self._resting)[0]
        self._target = self._free(self._force[:, None])[:, 0]

    def _padded(self, columns: Float2D) -> Float2D:
        """Returns columns (n, m) with zeros in the rows of the curvature."""
        return np.concatenate([columns, np.zeros((len(self._resting) - len(columns), columns.shape[1]))])

    def _free(self, columns: Float2D) -> Float2D:
        """Returns columns without the part that the force at rest can fit."""
        padded = self._padded(columns)
        return padded - self._space @ (self._space.T @ padded)

    def columns(self, shape: Shape) -> Float2D:
        """Returns the force of each branch at stiffness 1, at the rows of all motions."""
        ratio = shape.ratio.network
        tau = np.exp(shape.log_tau)
        parts = []
        for motion in self.motions:
            coordinate = np.ascontiguousarray(ratio.energy(motion.position))
            found = [
                *stretches(motion.time, coordinate[:, None], tau)[:, 0].T,
                *(
                    coordinate - play(coordinate, most, start=coordinate[0])
                    for most in np.exp(shape.log_yield)
                ),
            ]
            force = np.asarray(ratio.force(motion.position))[:, None] * np.column_stack(found)
            parts.append(force[motion.touched])
        return np.concatenate(parts)

    def residual(self, shape: Shape | None) -> Float1D:
        """Returns force minus fitted force at the rows, then the weighted curvature of the fitted force
        at rest; without branches for None."""
        if shape is None:
            return self._target
        free = self._free(self.columns(shape))
        return self._target - free @ _nonnegative(free, self._target)

    def solved(self, shape: Shape) -> tuple[Float1D, Float1D]:
        """Returns the coefficients of the force at rest and the stiffnesses of the branches."""
        columns = self.columns(shape)
        stiffness = _nonnegative(self._free(columns), self._target)
        target = self._padded((self._force - columns @ stiffness)[:, None])[:, 0]
        return np.linalg.lstsq(self._resting, target, rcond=None)[0], stiffness

    def refined(self, shape: Shape, ranges: Ranges, steps: int = STEPS) -> Shape:
        """Returns the shape with refined branches and ratio, of no larger error."""
        low, high = shape.bounds(ranges)
        start = np.clip(shape.vector(), low + 1e-6, high - 1e-6)

        def residual(vector: Float1D) -> Float1D:
            return self.residual(shape.at(vector))

        found = scipy.optimize.least_squares(
            residual,
            start,
            bounds=(low, high),
            diff_step=[1e-4],
            max_nfev=steps,
            x_scale=np.maximum(0.1, np.abs(start)),
        )
        better = shape.at(found.x)
        return better if self.rss(better) < self.rss(shape) else shape

    def finished(self, shape: Shape, ranges: Ranges) -> Shape | None:
        """Returns the shape refined by more steps, without branches of stiffness 0; None if none is left."""
        shape = self.refined(shape, ranges, 3 * STEPS)
        relaxing, slipping = np.split(self.solved(shape)[1] > 0.0, [len(shape.log_tau)])
        left = replace(shape, log_tau=shape.log_tau[relaxing], log_yield=shape.log_yield[slipping])
        return left if left.n_branches else None

    def rss(self, shape: Shape | None) -> float:
        """Returns the residual sum of squares; without branches for None."""
        residual = self.residual(shape)
        return float(residual @ residual)

    def error(self, shape: Shape | None) -> Float1D:
        """Returns force minus fitted force at the rows; without branches for None."""
        return self.residual(shape)[: self.n_rows]

    def independent(self, shape: Shape | None) -> float:
        """Returns the number of independent rows of a residual; that without branches for None."""
        residual = self.error(shape)
        rho = max(0.0, neighbour_correlation(residual))
        return max(LEAST_INDEPENDENT, independent_share(rho) * len(residual))

    def value(self, shape: Shape | None, rows: float, criterion: str) -> float:
        """Returns the criterion of a memory on a number of independent rows; without branches for None."""
        mean = max(self.rss(shape) / self.n_rows, self.least)
        n_parameters = 0 if shape is None else shape.n_parameters
        p = min(n_parameters + self._resting.shape[1], int(rows) - 2)
        return deviance(criterion, rows * mean, rows, p)

    def held_out_errors(self, shape: Shape, weight: Float1D) -> Float1D:
        """Returns the mean squared error, with the weights (n,) of the rows, on each held-out fifth of the
        sections, fitted without it.

        Coefficients that the other sections do not determine keep their values: in a relaxation test each
        position is visited once.
        """
        columns = np.concatenate([self._resting[: self.n_rows], self.columns(shape)], axis=1)
        columns /= np.linalg.norm(columns, axis=0) + np.finfo(float).tiny
        section = np.concatenate(
            [(np.arange(len(m.time)) // SECTION_ROWS % HELD_OUT_EVERY)[m.touched] for m in self.motions]
        )
        residual = self.error(shape)
        errors = []
        for fold in np.unique(section):
            out = section == fold
            change = np.linalg.lstsq(columns[~out], residual[~out], rcond=UNDETERMINED)[0]
            squares = (residual[out] - columns[out] @ change) ** 2
            errors.append(float(np.average(squares, weights=weight[out])))
        return np.array(errors)


def _nonnegative(columns: Float2D, target: Float1D) -> Float1D:
    """Returns the least-squares coefficients >= 0 of columns."""
    triangle = np.asarray(np.linalg.qr(np.column_stack([columns, target]), mode="r"))
    table, right = triangle[:, :-1], triangle[:, -1]
    size = np.linalg.norm(table, axis=0)
    size[size == 0.0] = 1.0
    return np.asarray(scipy.optimize.nnls(table / size, right)[0] / size)

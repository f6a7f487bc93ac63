# SPDX-License-Identifier: Apache-2.0
"""Tests whether press and release are shifted against each other, as by backlash of the tester or a late
force."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
import scipy

from ..._typing import Float1D
from ..data.strokes import HysteresisInput
from ..network.constraints import impose
from ..network.separable import SeparableProblem, Solution
from ..search.evidence import Candidate, Samples, criterion_of
from .class_selection import ClassSelection

SHIFTS = 2.0 ** np.arange(-10.0, -2.0, 0.5)
"""Distances between press and release that are tried [travel], from the width of a click to a quarter of the
travel."""

REFINEMENTS = 8
"""Number of steps of the search between two of these distances."""


@dataclass(frozen=True)
class Shift:
    """Distance between press and release that explains the rows better than the model alone."""

    distance: float
    """[travel]"""
    lag_s: float | None
    """Lag of the force that makes this distance at the largest speed [s]; None for the same distance at every
    speed, as with backlash"""
    before: float
    """RMS error of the model on the rows [force]"""
    without: Candidate
    """Model of the rows without the shift"""


def shift_of(selection: ClassSelection, best: Candidate) -> Shift | None:
    """Returns the shift of press against release that explains most of a release above the press; None
    without such a release, or if no shift explains it.

    Backlash of a distance d between the position sensor and the object shows the force of the object at
    x - s d/2, with the direction s; a force that is late by t shows that at x(time - t). Where the force
    rises, the press is then below the release, which a passive object excludes. If a hysteresis of any sign
    lowers BIC as much as a model class must, the wavelets of the model are refined on moved rows.
    """
    data, options = best.data, selection.options
    side = data.order if data.side is None else data.side
    if side is None or len(data.names) > 1:
        return None
    known = side != 0.0
    weight = best.error_on(data.weight).weight * known
    fastest = max((float(np.abs(part.velocity).max()) for part in data.parts), default=0.0)

    def moved(distance: float, late: bool) -> Float1D:
        """Returns the position of the object at each row (n,)."""
        position = data.positions[:, 0] - 0.5 * distance * data.reach[0] * side
        for part in data.parts if late else ():
            at = part.row_time - 0.5 * distance * data.reach[0] / fastest
            position[part.rows] = np.interp(at, part.time, part.position)
        return np.asarray(position)

    def refined(position: Float1D, strokes: HysteresisInput | None) -> tuple[SeparableProblem, Solution]:
        """Returns the refined wavelets for other positions (n,) of the rows."""
        ends = data.lower, data.lower + data.reach
        rows = replace(
            data, positions=position[:, None], force=best.static_force, corners=ends, weight=weight
        )
        samples = Samples(rows, options, selection.cells)
        problem = samples.problem(samples.rows(strokes), strokes)
        return problem, selection.growth.refined(problem, best.solution.basis)

    def constrained(problem: SeparableProblem, found: Solution) -> Candidate:
        return replace(best, problem=problem, solution=impose(problem, found, selection.bounds(problem)))

    def at(position: Float1D) -> Candidate:
        """Returns the model for other positions (n,) of the rows."""
        return constrained(*refined(position, best.strokes))

    unmoved = at(data.positions[:, 0])
    problem, free = refined(data.positions[:, 0], best.strokes or HysteresisInput(side, known))
    error = problem.rmse(free)
    if criterion_of(problem, free, "bic") + options.search.evidence > unmoved.criterion("bic"):
        return None
    causes = [False, True] if fastest > 0.0 else [False]
    late, near = min(product(causes, SHIFTS.tolist()), key=lambda each: at(moved(each[1], each[0])).rmse)
    distance = 2.0 ** float(
        scipy.optimize.minimize_scalar(
            lambda power: at(moved(2.0**power, late)).rmse,
            bounds=(math.log2(near) - 0.5, math.log2(near) + 0.5),
            method="bounded",
            options={"maxiter": REFINEMENTS},
        ).x
    )
    without = at(moved(distance, late))
    grown = selection.growth.grow(without.problem, without.solution.basis, best.model_class)
    without = min(without, constrained(grown.problem, grown.solution), key=lambda each: each.rmse)
    if unmoved.rmse**2 - without.rmse**2 < 0.5 * (unmoved.rmse**2 - error**2):
        return None
    lag_s = 0.5 * distance * float(data.reach[0]) / fastest if late else None
    return Shift(distance, lag_s, unmoved.rmse, without)

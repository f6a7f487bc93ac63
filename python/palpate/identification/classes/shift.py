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
from ...recording.motion import LONGEST_LAG_S, noise_of
from ..data.limits import LEAST_GAIN
from ..data.strokes import HysteresisInput
from ..network.constraints import impose
from ..network.separable import SeparableProblem, Solution
from ..search.evidence import Candidate, Samples, criterion_of
from .class_selection import ClassSelection
from .repeatability import left_out_residual

DISTANCES = 2.0 ** np.arange(-10.0, -4.0, 0.5)
"""Distances between press and release that are tried [travel]: from those of measured domes to one beyond
which a straight line with exchanged strokes looks shifted. One value in each octave misses a narrow click."""

LAGS_S = LONGEST_LAG_S * 2.0 ** np.arange(-7.0, 0.5, 0.5)
"""Lags of the force that are tried [s]."""

REFINEMENTS = 8
"""Number of steps of the search between two of these values. Without them the error left by a late force is
so large that velocity explains it."""


@dataclass(frozen=True)
class Shift:
    """Distance between press and release that explains the rows better than the model alone."""

    amount: float
    """Distance [travel], or lag of the force [s]"""
    late: bool
    """True for a lag"""
    before: float
    """RMS error of the model on the rows [force]"""
    without: Candidate
    """Model of the rows without the shift"""


def shift_of(selection: ClassSelection) -> Shift | None:
    """Returns the shift of press against release that explains most of a release above the press; None
    without such a release, or if no shift explains it.

    Backlash of a distance d between the position sensor and the object shows the force of the object at
    x - s d/2, with the direction s; a force that is late by t shows that at x(time - t). Where the force
    rises, the press is then below the release, which a passive object excludes. If a hysteresis of any sign
    lowers BIC as much as a model class must, and the squared error by more than the force between rows adds
    to it, the wavelets of the model are refined on moved rows. The shift must explain a quarter of the
    squared error that is not noise, as velocity must.
    """
    best, options = selection.best, selection.options
    data = best.data
    side = data.direction
    if side is None or len(data.names) > 1 or best.moving is not None:
        return None  # a late force also looks like a mass and a damping, which are subtracted here
    known = side != 0.0
    weight = best.error_on(data.weight).weight * known

    def moved(amount: float, late: bool) -> Float1D:
        """Returns the position of the object at each row (n,) for a distance [travel] or a lag [s]."""
        if not late:
            return np.asarray(data.positions[:, 0] - 0.5 * amount * data.reach[0] * side)
        position = data.positions[:, 0].copy()
        for part in data.parts:
            position[part.rows] = np.interp(part.row_time - amount, part.time, part.position)
        return position

    def refined(position: Float1D, strokes: HysteresisInput | None) -> tuple[SeparableProblem, Solution]:
        """Returns the refined wavelets for positions (n,) of the rows."""
        ends = data.lower, data.lower + data.reach
        rows = replace(data, positions=position[:, None], corners=ends, weight=weight)
        problem = Samples(rows, options).problem(strokes)
        return problem, selection.growth.refined(problem, best.solution.basis)

    def constrained(problem: SeparableProblem, free: Solution) -> Candidate:
        return replace(best, problem=problem, solution=impose(problem, free, selection.bounds(problem)))

    def at(amount: float, late: bool) -> Candidate:
        """Returns the model without a shift of the rows."""
        return constrained(*refined(moved(amount, late), best.strokes))

    problem, free = refined(data.positions[:, 0], best.strokes)
    unmoved = constrained(problem, free)
    if best.strokes is None:
        problem, free = refined(data.positions[:, 0], HysteresisInput(side, known))
    allowed = criterion_of(unmoved.problem, unmoved.solution, "bic") - options.search.evidence
    if criterion_of(problem, free, "bic") > allowed:
        return None
    explained = unmoved.rmse**2 - problem.rmse(free) ** 2
    between = replace(best.error, residual=selection.once(left_out_residual))
    if explained < between.rmse**2 - best.error.rmse**2:
        return None  # rows that are far apart explain as much
    amounts = [*product(DISTANCES.tolist(), [False]), *product(LAGS_S.tolist() if data.parts else [], [True])]
    near, late = min(amounts, key=lambda each: at(*each).rmse)
    amount = 2.0 ** float(
        scipy.optimize.minimize_scalar(
            lambda power: at(2.0**power, late).rmse,
            bounds=(math.log2(near) - 0.5, math.log2(near) + 0.5),
            method="bounded",
            options={"maxiter": REFINEMENTS},
        ).x
    )
    without = at(amount, late)
    structured = max(unmoved.rmse**2 - noise_of(data.force) ** 2, 0.0)
    if unmoved.rmse**2 - without.rmse**2 < max(0.5 * explained, LEAST_GAIN * structured):
        return None
    return Shift(amount, late, unmoved.rmse, without)

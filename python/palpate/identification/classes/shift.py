# SPDX-License-Identifier: Apache-2.0
"""Tests whether press and release are shifted against each other, as by backlash of the tester or a late
force."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from ..network.constraints import impose
from ..network.separable import TINY
from ..search.evidence import Candidate, Samples
from .class_selection import ClassSelection

SHIFTS = 2.0 ** np.arange(-10.0, -4.0, 0.5)
"""Distances between press and release that are tried [travel], from the width of a click to a distance that
is seen in a plot."""


@dataclass(frozen=True)
class Shift:
    """Distance between press and release that explains the rows better than the model alone."""

    distance: float
    """[travel]"""
    before: float
    """RMS error of the model on the rows [force]"""
    without: Candidate
    """Model of the rows without the shift"""


def shift_of(selection: ClassSelection) -> Shift | None:
    """Returns the distance between press and release that lowers BIC as much as a model class must; None if
    there is none.

    With a late force, or with backlash between the position sensor and the object, the force of the rows is
    g + s h at x - s d/2 for the direction s and the distance d. Where g rises, this lowers the press below the
    release, which a hysteresis h >= 0 excludes. The wavelets of the model are therefore refined on moved rows,
    and the errors are compared under the constraints. A single-valued force is the mean of both strokes, which
    the shift hardly changes.
    """
    best, data, options = selection.best, selection.best.data, selection.options
    side = data.order if data.side is None else data.side
    if best.strokes is None or side is None or len(data.names) > 1:
        return None
    weight = best.error_on(data.weight).weight * (side != 0.0)

    def moved(shift: float) -> Candidate:
        """Returns the model with refined wavelets of rows that are moved by a shift [travel]."""
        rows = replace(
            data,
            positions=data.positions - 0.5 * shift * data.reach * side[:, None],
            force=best.static_force,
            corners=(data.lower, data.lower + data.reach),
            weight=weight,
        )
        samples = Samples(rows, options, selection.cells)
        problem = samples.problem(samples.rows(best.strokes), best.strokes)
        found = selection.growth.refined(problem, best.solution.basis)
        return replace(best, problem=problem, solution=impose(problem, found, selection.bounds(problem)))

    unmoved, tried = moved(0.0).rmse, [moved(shift) for shift in SHIFTS]
    least = min(range(len(SHIFTS)), key=lambda each: tried[each].rmse)
    ratio, n = (tried[least].rmse + TINY) / (unmoved + TINY), best.problem.independent
    if -2.0 * n * math.log(ratio) - math.log(n) < options.search.evidence:
        return None
    return Shift(float(SHIFTS[least]), unmoved, tried[least])

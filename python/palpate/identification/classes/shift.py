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
    """Returns the distance between press and release that explains most of a release above the press; None
    without such a release, or if no distance explains it.

    With a late force, or with backlash between the position sensor and the object, the force of the rows is
    g + s h at x - s d/2 for the direction s and the distance d. Where g rises, this lowers the press below
    the release, which a hysteresis h >= 0 excludes. If this constraint raises the criterion as much as a
    model class must lower it, the wavelets of the model are refined on moved rows. A single-valued force is
    the mean of both strokes, which the shift hardly changes.
    """
    best, data, options = selection.best, selection.best.data, selection.options
    side = data.order if data.side is None else data.side
    if best.strokes is None or side is None or len(data.names) > 1:
        return None
    weight = best.error_on(data.weight).weight * (side != 0.0)

    def moved(shift: float) -> tuple[float, Candidate]:
        """Returns the model with refined wavelets of rows that are moved by a shift [travel], and its RMS
        error without the constraints."""
        rows = replace(
            data,
            positions=data.positions - 0.5 * shift * data.reach * side[:, None],
            force=best.static_force,
            corners=(data.lower, data.lower + data.reach),
            weight=weight,
        )
        samples = Samples(rows, options, selection.cells)
        problem = samples.problem(samples.rows(best.strokes), best.strokes)
        free = selection.growth.refined(problem, best.solution.basis)
        kept = impose(problem, free, selection.bounds(problem))
        return problem.rmse(free), replace(best, problem=problem, solution=kept)

    free, kept = moved(0.0)
    if (
        2.0 * best.problem.independent * math.log((kept.rmse + TINY) / (free + TINY))
        < options.search.evidence
    ):
        return None
    distance, (_, without) = min(((d, moved(d)) for d in SHIFTS.tolist()), key=lambda each: each[1][1].rmse)
    if kept.rmse**2 - without.rmse**2 < 0.5 * (kept.rmse**2 - free**2):
        return None
    return Shift(distance, kept.rmse, without)

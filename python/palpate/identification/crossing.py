# SPDX-License-Identifier: Apache-2.0
"""Where measured strokes cross: release above press, by which a loop would gain energy."""

import numpy as np

from .._core.model import wavelet_columns, wavelet_slope_columns
from .separable import SeparableProblem, Solution

GRID = 2048
"""Places that are looked at."""

WORTH_TELLING = 3.0
"""RMS errors that release has to lie above press."""


STEEP = 2.0
"""Ratio of the slope where release lies above press to the mean slope, from which a force is late."""


def crosses_where_steep(problem: SeparableProblem, free: Solution) -> bool:
    """True if release lies above press mainly where the force is steep, as a late force makes it.

    A force that is late by t makes h smaller by the slope times speed and t.
    """
    places = np.linspace(0.0, 1.0, GRID)
    columns = wavelet_columns(places, free.basis.alpha, free.basis.beta)
    slopes = wavelet_slope_columns(places, free.basis.alpha, free.basis.beta)
    (_, slope, *of_g), (bias, tilt, *of_h) = problem.readout @ free.coefficients
    steepness = np.abs(slope + slopes @ np.asarray(of_g))
    above = np.maximum(-(bias + tilt * places + columns @ np.asarray(of_h)), 0.0)
    if not above.any():
        return False
    return bool(np.average(steepness, weights=above**2) > STEEP * np.mean(steepness))


def crossing(problem: SeparableProblem, free: Solution, lower: float, reach: float) -> str:
    """How far release lies above press at most, and where, as the end of a sentence; empty where hardly.

    free is a solution g + s h that h >= 0 was not imposed on, over one input from lower to lower + reach.
    Only places where both strokes were measured count.
    """
    first = max(float(block.positions.min()) for block in problem.blocks)
    last = min(float(block.positions.max()) for block in problem.blocks)
    if len(problem.readout) < 2 or last <= first:
        return ""
    places = np.linspace(first, last, GRID)
    columns = wavelet_columns(places, free.basis.alpha, free.basis.beta)
    bias, slope, *weights = problem.readout[1] @ free.coefficients
    above = -2.0 * (bias + slope * places + columns @ np.asarray(weights))
    deepest = int(np.argmax(above))
    if above[deepest] < WORTH_TELLING * problem.resolved_rmse(free):
        return ""
    within = np.flatnonzero(above <= 0.0)
    start = within[within < deepest].max(initial=-1) + 1
    end = within[within > deepest].min(initial=GRID) - 1
    near, far = lower + reach * places[start], lower + reach * places[end]
    return (
        f"; release lies above press by up to {above[deepest]:.3g} between {near:.4g} and {far:.4g}, "
        "which no passive object does, but a force that is recorded late (--force-late-s)"
    )

# SPDX-License-Identifier: Apache-2.0
"""What a force lacks for its slopes to lie within limits: the nearest such force, its kinks rounded."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import gaussian_filter1d

from .._typing import Float1D, Float2D
from ..identification.network.constraints import slope_limited
from ..model import Model


def changes_needed(
    x: Float1D, strokes: Float2D, low: float, high: float, sigma: float, model: Model, restoring: bool
) -> Float2D:
    """What strokes (k, n) lack for their slopes to lie within limits, kinks rounded; zero elsewhere."""
    n, step = len(x), x[1] - x[0]
    margin = int(np.ceil(6.0 * sigma / step))
    before = after = 0
    if model.period is not None:
        before = after = n - 1
        wide = [np.concatenate([f[:-1] - f[-1] + f[0], f, f[1:] + f[-1] - f[0]]) for f in strokes]
    else:
        # Where contact is lost there is no force to begin with, and none may be needed to stay within limits.
        before, after = (n if side == "free" else 0 for side in (model.below, model.above))
        wide = [np.pad(force, (before, after)) for force in strokes]
    grid = x[0] + step * (np.arange(len(wide[0])) - before)
    nearest = np.array([slope_limited(grid, force, low, high) for force in wide])
    if restoring and model.period is None:
        rise, fall = high * (grid - x[0]), high * (grid - x[-1])
        nearest = np.minimum(nearest, np.maximum(rise, 0.0) if model.below == "free" else rise)
        nearest = np.maximum(nearest, np.minimum(fall, 0.0) if model.above == "free" else fall)
    if len(strokes) == 2 and model.below == "free" and model.period is None:
        nearest = _begun_together(grid, nearest, before, margin // 2, high)
    inside = slice(margin + before, margin + before + n)
    changes = []
    for force, limited in zip(strokes, nearest, strict=True):
        extended = _extended(limited, margin)
        smooth = gaussian_filter1d(extended, sigma / step, mode="nearest")[inside]
        touched = np.abs(extended[inside] - force) > 1e-9 * np.ptp(force)
        near = gaussian_filter1d(touched.astype(float), sigma / step, mode="nearest") > 1e-4
        changes.append(np.where(near, smooth - force, 0.0))
    return np.array(changes)


def _begun_together(grid: Float1D, strokes: Float2D, edge: int, near: int, high: float) -> Float2D:
    """Pressing (2, n) lowered where contact begins, if it would be too steep beyond the lower edge.

    Beyond it h dies out along with g, over g / g', and the slope of pressing is g' (1 + h / g). Where it
    rises as steeply as it may, that is too much if it begins above `high` / slope times where releasing
    ends, the slope being that of releasing over the `near` samples that the rounding of kinks reaches.
    """
    press, release = strokes
    first = release[edge]
    slope = np.diff(release[edge : edge + near + 1]).max() / (grid[1] - grid[0])
    if first <= 0.0 or slope <= 0.0:
        return strokes
    begin = release[edge + near] + first * (high / slope - 1.0)
    return np.array([np.minimum(press, begin + high * (grid - grid[edge + near])), release])


def _extended(force: Float1D, margin: int) -> Float1D:
    """A force and its straight continuations."""
    steps = np.arange(1, margin + 1)
    before = force[0] - steps[::-1] * (force[1] - force[0])
    after = force[-1] + steps * (force[-1] - force[-2])
    return np.concatenate([before, force, after])

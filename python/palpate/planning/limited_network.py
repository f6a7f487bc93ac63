# SPDX-License-Identifier: Apache-2.0
"""Search for the nearest network that a device can render: slopes limited, otherwise as identified.

The nearest force with slopes between two limits is an isotonic regression. This force differs from the model
on intervals around slopes that are too steep, and has kinks at the ends of these intervals. Smoothing by a
narrow positive kernel rounds the kinks and keeps the slope limits. Further wavelets represent only the change
of the force; they are chosen one by one (orthogonal least squares, values and slopes). A final least squares
over all wavelets imposes the slope limits, so that they are proved. Elsewhere the model does not change.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache

import numpy as np
import scipy

from .._core import stability
from .._core.device import DeviceProfile
from .._core.model import ForceModel
from .._core.rendering import fewest_encoder_steps_in_play
from .._core.stability import ForceBounds, force_bounds
from .._typing import Float1D, Float2D
from ..identification.network.basis import Basis
from ..identification.network.constraints import domain_bounds, impose, slope_limited
from ..identification.network.fitted import parameters_of
from ..identification.network.separable import Block, SeparableProblem
from ..identification.threads import one_thread
from .plan import SAMPLES, strokes, with_network

LONGEST_PLAY = 0.1
"""Largest play radius [share of the travel]; a larger play radius feels like play, not like hysteresis."""

_USED_SLOPE = 1.02
"""Ratio of the slopes that a device must render to the slopes of the model [-]; above 1, because a network is
fitted just below its slope limits"""

_ATTEMPTS = ((0.005, False), (0.005, True), (0.02, True))
"""Tried pairs. First: standard deviation of the smoothing kernel [share of the travel]. Second: True if the
force must be restoring at both ends of the domain, <= 0 at the lower and >= 0 at the upper end; otherwise the
force can be too steep there."""

_PROJECTED_SHARE = 0.985
"""Share of a slope limit that the nearest force may reach; the remaining share allows for the error of the
network [-]"""

_IMPOSED_SHARE = 0.997
"""Share of a slope limit that is imposed on the network; the remaining share allows for proved bounds wider
than the true slopes [-]"""

_SUFFICIENT_ERROR = 2e-5
"""RMS error of the network with limited slopes, at which no further wavelets are added [share of the force's
range]"""

_SUFFICIENT_SLOPE_ERROR = 0.01
"""Error of the slope of the network with limited slopes, at which no further wavelets are added [share of the
smaller slope limit]"""

_MOST_WAVELETS = 64
"""Largest number of wavelets that are added to the wavelets of the model [-]"""

_LEAST_NEW_SHARE = 1e-5
"""A candidate wavelet can be added only if at least this share of its squared norm is orthogonal to the
chosen wavelets [-]"""

_SCALE_RATIO = 1.6
"""Ratio of adjacent dilations in the frame of the candidates [-]."""
_SCALE_STEP = 0.75
"""Translation step divided by the width of a wavelet in the frame of the candidates [-]."""

_STICKLESS_PLAY = 1e9
"""Play radius that is so large that the direction state adds no slope to the force [multiples of the
travel]"""


@lru_cache(maxsize=8)
def sliding_bounds(model: ForceModel, force_limit: float = math.inf) -> ForceBounds:
    """Returns proved bounds of the slopes of both strokes, continuations included, without the slope after a
    reversal."""
    travel = float(model.upper[0] - model.lower[0])
    return force_bounds(model, _STICKLESS_PLAY * travel if model.hysteretic else 0.0, force_limit)


def sliding_slopes(model: ForceModel) -> tuple[float, float]:
    """Returns the smallest and the largest slope of the model's force over position, from proved bounds."""
    bounds = sliding_bounds(model)
    return bounds.slope_min, bounds.slope_max


def renderable_slopes(
    device: DeviceProfile, stick: float = 0.0, model: ForceModel | None = None
) -> tuple[float, float]:
    """Returns the (lowest, highest) slope for which direct rendering is certified, divided as in the model.

    With hysteresis these are the slopes of the strokes; after a reversal the slope is larger by `stick` =
    h/r.
    """
    low, high = (-math.inf, math.inf) if model is None else sliding_slopes(model)
    return stability.renderable_slopes(
        device, stick, rising=max(0.0, _USED_SLOPE * high), falling=max(0.0, -_USED_SLOPE * low)
    )


def play_radius_for(model: ForceModel, device: DeviceProfile) -> float:
    """Returns the narrowest certified play radius for direct rendering, at least 4 encoder steps.

    Returns infinity if no play radius up to `LONGEST_PLAY` is certified.
    """
    longest = LONGEST_PLAY * float(model.upper[0] - model.lower[0])
    narrowest = fewest_encoder_steps_in_play * device.encoder_step
    radius = stability.narrowest_play(sliding_bounds(model, device.force_limit), device, narrowest, longest)
    # A slightly larger play radius: the certificate computes the slope bounds again, with rounding errors.
    return radius if radius == narrowest else 1.000001 * radius


def limit_slopes(model: ForceModel, low: float, high: float) -> ForceModel | None:
    """Returns a network whose slopes are proved to be within limits, or None if no such network was found.

    Parameters
    ----------
    model : ForceModel
        A model of one position.
    low, high : float
        Slopes of either stroke [force/position]; may be infinite.
    """
    travel = float(model.upper[0] - model.lower[0])
    for smoothing, restoring in _ATTEMPTS:
        with one_thread():
            limited = _limited_once(model, low, high, smoothing * travel, restoring)
        if limited is None:
            continue
        found = sliding_slopes(limited)
        if found[0] >= low and found[1] <= high:
            return limited
    return None


def scale_hysteresis(model: ForceModel, share: float) -> ForceModel:
    """Returns the model with its hysteresis h multiplied by a share."""
    names = ("weight_hysteresis", "linear_hysteresis", "bias_hysteresis")
    return with_network(model, **{name: share * getattr(model, name) for name in names})


def _limited_once(
    model: ForceModel, low: float, high: float, sigma: float, restoring: bool
) -> ForceModel | None:
    """Returns the model plus the fitted change of its force, or None if a continuation can be steeper than
    the slope limit."""
    x = np.linspace(model.lower[0], model.upper[0], SAMPLES)
    forces = strokes(model, x)
    changes = _changes_needed(
        x, forces, _PROJECTED_SHARE * low, _PROJECTED_SHARE * high, sigma, model, restoring
    )
    wanted = forces + changes
    middle, travel = wanted.mean(axis=0), x[-1] - x[0]
    pushed_out = model.period is None and (middle[0] > 0.0 or middle[-1] < 0.0)
    if not restoring and pushed_out and np.abs(middle).max() > high * travel:
        return None
    if len(changes) == 2:  # from press and release force to mean force g and hysteresis h
        changes = np.array([0.5 * (changes[0] + changes[1]), 0.5 * (changes[0] - changes[1])])
    alpha, beta = _candidates(x, np.any(changes != 0.0, axis=0), sigma)
    close = min(
        _SUFFICIENT_ERROR * float(np.ptp(forces)), _SUFFICIENT_SLOPE_ERROR * sigma * min(abs(low), abs(high))
    )
    before = Basis(model.alpha, model.beta, model.harmonics)
    chosen = _chosen(x, changes, before, Basis(alpha[:, None], beta[:, None]), sigma, close)
    return _fitted(model, x, wanted, alpha[chosen], beta[chosen], _IMPOSED_SHARE * low, _IMPOSED_SHARE * high)


def _changes_needed(
    x: Float1D, strokes: Float2D, low: float, high: float, sigma: float, model: ForceModel, restoring: bool
) -> Float2D:
    """Returns the changes (k, n) of the force of each stroke that limit its slope, with rounded kinks; a
    change is 0 at positions where no limit is needed."""
    n, step = len(x), x[1] - x[0]
    margin = int(np.ceil(6.0 * sigma / step))
    before = after = 0
    if model.period is not None:
        before = after = n - 1
        wide = [np.concatenate([f[:-1] - f[-1] + f[0], f, f[1:] + f[-1] - f[0]]) for f in strokes]
    else:
        # At a free end the tool leaves the object with force 0: the change must keep this force.
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
        smooth = scipy.ndimage.gaussian_filter1d(extended, sigma / step, mode="nearest")[inside]
        touched = np.abs(extended[inside] - force) > 1e-9 * np.ptp(force)
        near = scipy.ndimage.gaussian_filter1d(touched.astype(float), sigma / step, mode="nearest") > 1e-4
        changes.append(np.where(near, smooth - force, 0.0))
    return np.array(changes)


def _begun_together(grid: Float1D, strokes: Float2D, edge: int, near: int, high: float) -> Float2D:
    """Returns strokes (2, n) with less press force at the start of contact if the press force is too steep
    there.

    Below the domain the mean force g and the hysteresis h decrease to 0 over the length g / g', so that the
    slope of press is g' (1 + h / g). This slope is above the limit `high` if press starts above `high` /
    slope times the end of release, where slope is the release slope over the `near` samples that the rounding
    of kinks changes.
    """
    press, release = strokes
    first = release[edge]
    slope = np.diff(release[edge : edge + near + 1]).max() / (grid[1] - grid[0])
    if first <= 0.0 or slope <= 0.0:
        return strokes
    begin = release[edge + near] + first * (high / slope - 1.0)
    return np.array([np.minimum(press, begin + high * (grid - grid[edge + near])), release])


def _extended(force: Float1D, margin: int) -> Float1D:
    """Returns a force with straight continuations at both ends."""
    steps = np.arange(1, margin + 1)
    before = force[0] - steps[::-1] * (force[1] - force[0])
    after = force[-1] + steps * (force[-1] - force[-2])
    return np.concatenate([before, force, after])


def _fitted(
    model: ForceModel, x: Float1D, wanted: Float2D, alpha: Float1D, beta: Float1D, low: float, high: float
) -> ForceModel:
    """Fits the wavelets of the model and further wavelets by least squares, with slope limits and, if the
    model has it, h >= 0 imposed."""
    lower, travel = model.lower, model.upper - model.lower
    box = ((x - lower) / travel)[:, None]
    one = np.ones((len(x), 1))
    hysteretic = len(wanted) == 2
    problem = SeparableProblem(
        tuple(Block(box, stroke, one) for stroke in wanted),
        np.array([[0.5, 0.5], [0.5, -0.5]]) if hysteretic else np.array([[1.0]]),
        samples=wanted.size,
        within=0.0,
        force_range=float(np.ptp(wanted)) or 1.0,
        resolved_by=1,
    )
    basis = Basis(model.alpha * travel, (model.beta - lower) / travel, model.harmonics).joined(
        Basis(alpha[:, None] * travel, (beta[:, None] - lower) / travel)
    )
    slopes = (low * float(travel[0]), high * float(travel[0]))
    lossy = hysteretic and sliding_bounds(model).loss_min >= 0.0
    bounds = domain_bounds(problem, hysteresis=lossy, slopes=slopes)
    solution = impose(problem, problem.solve(basis), bounds)
    found = parameters_of(solution, problem.readout, lower, travel)
    new = {
        name: value for name, value in found.items() if name not in ("lower", "upper") and value is not None
    }
    limited = with_network(model, **new)
    if not lossy:
        return limited
    least = sliding_bounds(limited).loss_min
    if least >= 0.0:
        return limited
    # The least squares keeps h >= 0 only up to rounding, but h >= 0 must be proved: add the missing
    # difference to h.
    return with_network(limited, bias_hysteresis=new["bias_hysteresis"] - 1.01 * least)


def _candidates(x: Float1D, changed: Float1D, finest: float) -> tuple[Float1D, Float1D]:
    """Returns dilations and translations (k,) of wavelets where the force changes, from width `finest` to the
    travel."""
    travel = x[-1] - x[0]
    at = x[changed][::4] if changed.any() else x[:1]
    alpha, beta = [], []
    width = finest
    while width < travel:
        centres = np.arange(x[0] - 3.0 * width, x[-1] + 3.0 * width, _SCALE_STEP * width)
        centres = centres[np.abs(centres[:, None] - at).min(axis=1) < 3.0 * width]
        alpha.append(np.full(len(centres), 1.0 / width))
        beta.append(centres)
        width *= _SCALE_RATIO
    return np.concatenate(alpha), np.concatenate(beta)


def _chosen(
    x: Float1D,
    changes: Float2D,
    before: Basis,
    candidates: Basis,
    sigma: float,
    close: float,
) -> Sequence[int]:
    """Chooses candidate wavelets one by one for changes (outputs, n) of the force, in addition to a line and
    the model's wavelets.

    Forces and slopes are fitted together; `sigma` times an error of the slope counts as much as an error of
    the force.
    """

    def both(values: Float2D, slopes: Float2D) -> Float2D:
        return np.concatenate([values, sigma * slopes])

    rates = np.gradient(changes, x, axis=1)
    targets = both(changes.T, rates.T)
    ones, zeros = np.ones_like(x), np.zeros_like(x)

    def wavelets(basis: Basis) -> Float2D:
        return both(basis.columns(x[:, None]), basis.slopes(x))

    line = both(np.column_stack([ones, x]), np.column_stack([zeros, ones]))
    always = np.concatenate([line, wavelets(before)], axis=1)
    basis = np.linalg.qr(always)[0]
    residual = targets - basis @ (basis.T @ targets)
    rest, sufficient = float(np.square(residual).sum()), residual.size * close**2
    if rest <= sufficient:
        return []
    columns = wavelets(candidates)
    left = columns - basis @ (basis.T @ columns)
    norms = np.square(columns).sum(axis=0)
    # Each step extends a pivoted Cholesky factor of the candidates' Gram matrix.
    gram, products = left.T @ left, left.T @ residual
    size = np.diag(gram).copy()
    factor = np.empty((_MOST_WAVELETS, len(size)))
    chosen: list[int] = []
    while len(chosen) < _MOST_WAVELETS and rest > sufficient:
        new = size > _LEAST_NEW_SHARE * norms
        gains = np.where(new, np.square(products).sum(axis=1) / np.where(new, size, 1.0), 0.0)
        best = int(np.argmax(gains))
        if gains[best] <= 0.0:
            break
        k, root = len(chosen), np.sqrt(size[best])
        factor[k] = (gram[best] - factor[:k, best] @ factor[:k]) / root
        products = products - np.outer(factor[k], products[best] / root)
        size = size - np.square(factor[k])
        rest -= float(gains[best])
        chosen.append(best)
    return chosen

# SPDX-License-Identifier: Apache-2.0
"""The nearest force that a device can render: slopes limited, everything else left as it was identified.

The nearest force with slopes between two limits is an isotonic regression; it differs from the model on whole
stretches around what is too steep, and has kinks at their ends. Smoothing by a narrow positive kernel rounds
the kinks and keeps the limits. The change alone is then given to further wavelets, chosen one by one
(orthogonal least squares, values and slopes), so that elsewhere the model stays what it was. What comes out
is certified; where a slope still stands out, the limits are drawn in by as much and it is done again.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.ndimage import gaussian_filter1d

from .. import _core
from .._typing import Float1D, Float2D
from ..identification.constraints import slope_limited
from ..model import Model

_SAMPLES = 1001
"""Positions over the domain [-]"""

_SMOOTHINGS = (0.005, 0.02)
"""Standard deviations of the kernel that are tried [share of the travel]"""

_CLOSE = 5e-5
"""RMS error at which no further wavelets are taken [share of the force's range]"""

_CLOSE_SLOPE = 0.01
"""The same of the slope [share of the smaller limit]"""

_MOST = 64
"""Further wavelets at most [-]"""

_ROUNDS = 4
"""How often the limits are drawn in before a wider kernel is tried [-]"""

_SCALE_RATIO = 1.6
_SCALE_STEP = 0.75
"""Frame of the candidates: ratio of neighbouring dilations, translation step over width [-]"""

_WIDE = 1e9
"""A play of so many travels adds no slope while it sticks [-]"""


@dataclass(frozen=True)
class Loss:
    """How far the rendered force is from the identified one, over the domain and both strokes [force]."""

    largest: float
    rms: float


def sliding_slopes(model: Model) -> tuple[float, float]:
    """Proved (smallest, largest) slope while sliding, continuations included."""
    travel = float(model.upper[0] - model.lower[0])
    bounds = _core.force_bounds(model, _WIDE * travel if model.hysteretic else 0.0)
    return bounds.slope_min, bounds.slope_max


def limit_slopes(model: Model, low: float, high: float) -> Model | None:
    """The model with every slope proved to lie within limits; None where no such network was found.

    Parameters
    ----------
    model : Model
        A model of one position.
    low, high : float
        Slopes of either stroke [force/position]; may be infinite.
    """
    for smoothing in _SMOOTHINGS:
        sigma = smoothing * float(model.upper[0] - model.lower[0])
        inner = [low, high]
        for _ in range(_ROUNDS):
            if not inner[0] < inner[1]:
                break
            limited = _limited_once(model, inner[0], inner[1], sigma)
            found = sliding_slopes(limited)
            if found[0] >= low and found[1] <= high:
                return limited
            inner[0] += max(0.0, 1.1 * (low - found[0]))
            inner[1] -= max(0.0, 1.1 * (found[1] - high))
    return None


def scale_loss(model: Model, share: float) -> Model:
    """The model with h multiplied by a share: less of what press and release differ by."""
    network = model.to_dict()["network"]
    return changed_network(
        model,
        weight_hysteresis=[share * weight for weight in network["weight_hysteresis"]],
        linear_hysteresis=[share * slope for slope in network["linear_hysteresis"]],
        bias_hysteresis=share * network["bias_hysteresis"],
    )


def loss_between(identified: Model, rendered: Model) -> Loss:
    """What is lost where `rendered` stands in for `identified`."""
    x = np.linspace(identified.lower[0], identified.upper[0], _SAMPLES)
    difference = _strokes(rendered, x) - _strokes(identified, x)
    return Loss(float(np.abs(difference).max()), float(np.sqrt(np.mean(difference**2))))


def changed_network(model: Model, **network: Any) -> Model:
    """The model with other numbers in its network, and without plan, certificate and slope bounds."""
    content = model.to_dict()
    content["network"].update(network)
    added = len(content["network"]["weight"]) - content["fit"]["n_wavelets"]
    content["fit"]["n_wavelets"] += added
    content["fit"]["n_parameters"] += added * (4 if model.hysteretic else 3)
    content.update(plan=None, certificate=None, slope_bounds=None)
    return Model.from_dict(content)


def _strokes(model: Model, x: Float1D) -> Float2D:
    """(1, n) the force, or (2, n) pressing and releasing."""
    sides = (1.0, -1.0) if model.hysteretic else (None,)
    return np.array([model.force(x, direction=side) for side in sides])


def _limited_once(model: Model, low: float, high: float, sigma: float) -> Model:
    x = np.linspace(model.lower[0], model.upper[0], _SAMPLES)
    strokes = _strokes(model, x)
    changes = [_change(x, stroke, low, high, sigma, model) for stroke in strokes]
    if len(changes) == 2:  # of g and h
        changes = [0.5 * (changes[0] + changes[1]), 0.5 * (changes[0] - changes[1])]
    alpha, beta = _candidates(x, np.any(np.array(changes) != 0.0, axis=0), sigma)
    close = min(_CLOSE * float(np.ptp(strokes)), _CLOSE_SLOPE * sigma * min(abs(low), abs(high)))
    before = model.alpha[:, 0], model.beta[:, 0]
    chosen, coefficients = _fit(x, np.array(changes), before, (alpha, beta), sigma, close)
    network = model.to_dict()["network"]
    new: dict[str, Any] = {
        "alpha": network["alpha"] + [[a] for a in alpha[chosen].tolist()],
        "beta": network["beta"] + [[b] for b in beta[chosen].tolist()],
    }
    for row, suffix in zip(coefficients, ("", "_hysteresis"), strict=False):
        row[: 2 + model.n_wavelets] += [
            network[f"bias{suffix}"],
            network[f"linear{suffix}"][0],
            *network[f"weight{suffix}"],
        ]
        new[f"bias{suffix}"] = float(row[0])
        new[f"linear{suffix}"] = [float(row[1])]
        new[f"weight{suffix}"] = row[2:].tolist()
    limited = changed_network(model, **new)
    if model.hysteretic and _least_loss(model) >= 0.0 > (least := _least_loss(limited)):
        # The fit may pull h below zero by its own small error.
        limited = changed_network(limited, bias_hysteresis=new["bias_hysteresis"] - 1.1 * least)
    return limited


def _least_loss(model: Model) -> float:
    return float(_core.force_bounds(model, float(model.upper[0] - model.lower[0])).loss_min)


def _change(x: Float1D, force: Float1D, low: float, high: float, sigma: float, model: Model) -> Float1D:
    """What has to be added to a force for its slopes to lie within limits, kinks rounded; zero elsewhere."""
    n, step = len(x), x[1] - x[0]
    margin = int(np.ceil(6.0 * sigma / step))
    before = after = 0
    wide = force
    if model.period is not None:
        before = after = n - 1
        wide = np.concatenate([force[:-1] - force[-1] + force[0], force, force[1:] + force[-1] - force[0]])
    else:
        # Where contact is lost there is no force to begin with, and none may be needed to stay within limits.
        before, after = (n if side == "free" else 0 for side in (model.below, model.above))
        wide = np.pad(force, (before, after))
    grid = x[0] + step * (np.arange(len(wide)) - before)
    nearest = _extended(slope_limited(grid, wide, low, high), margin)
    inside = slice(margin + before, margin + before + n)
    smooth = gaussian_filter1d(nearest, sigma / step, mode="nearest")[inside]
    touched = np.abs(nearest[inside] - force) > 1e-9 * np.ptp(force)
    near = gaussian_filter1d(touched.astype(float), sigma / step, mode="nearest") > 1e-4
    return np.where(near, smooth - force, 0.0)


def _extended(force: Float1D, margin: int) -> Float1D:
    """A force and its straight continuations."""
    steps = np.arange(1, margin + 1)
    before = force[0] - steps[::-1] * (force[1] - force[0])
    after = force[-1] + steps * (force[-1] - force[-2])
    return np.concatenate([before, force, after])


def _candidates(x: Float1D, changed: Float1D, finest: float) -> tuple[Float1D, Float1D]:
    """Dilations and translations (k,) of wavelets from the finest width to the travel, near a change."""
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


def _fit(
    x: Float1D,
    changes: Float2D,
    before: tuple[Float1D, Float1D],
    candidates: tuple[Float1D, Float1D],
    sigma: float,
    close: float,
) -> tuple[Sequence[int], Float2D]:
    """Candidates chosen one by one, and coefficients (outputs, 2 + N + chosen) of bias, slope, what was there
    before, and the chosen.

    Slopes are fitted beside the values, sigma times a slope weighing as much as a value.
    """

    def both(values: Float2D, slopes: Float2D) -> Float2D:
        return np.concatenate([values, sigma * slopes])

    rates = np.gradient(changes, x, axis=1)
    targets = both(changes.T, rates.T)
    ones, zeros = np.ones_like(x), np.zeros_like(x)

    def wavelets(alpha: Float1D, beta: Float1D) -> Float2D:
        values = _core.wavelet_columns(x[:, None], alpha[:, None], beta[:, None])
        return both(values, _core.wavelet_slope_columns(x, alpha[:, None], beta[:, None]))

    line = both(np.column_stack([ones, x]), np.column_stack([zeros, ones]))
    always = np.concatenate([line, wavelets(*before)], axis=1)
    columns = wavelets(*candidates)
    basis = np.linalg.qr(always)[0]
    residual = targets - basis @ (basis.T @ targets)
    left = columns - basis @ (basis.T @ columns)
    norms = np.square(columns).sum(axis=0)
    # Everything from here on is in products: a pivoted Cholesky factor of the candidates' Gram matrix.
    gram, products = left.T @ left, left.T @ residual
    size = np.diag(gram).copy()
    rest = float(np.square(residual).sum())
    factor = np.empty((_MOST, len(size)))
    chosen: list[int] = []
    while len(chosen) < _MOST and rest > residual.size * close**2:
        new = size > 1e-6 * norms
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
    design = np.concatenate([always, columns[:, chosen]], axis=1)
    coefficients = np.linalg.lstsq(design, targets, rcond=None)[0]
    return chosen, np.asarray(coefficients.T)

# SPDX-License-Identifier: Apache-2.0
"""Provides six identification problems with known force: noisy rows for the fit, exact rows for the test."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicHermiteSpline
from scipy.signal import lfilter

Array = NDArray[np.float64]

NAMES = ("P1", "P2", "P3", "P4", "P5", "P6")

TITLES = {
    "P1": "spring and wall, 10^4 rows",
    "P2": "tactile switch, 10^4 rows",
    "P3": "Hunt-Crossley over position and velocity, 2 10^4 rows",
    "P4": "Zhang and Benveniste 1-D, 200 rows, no noise",
    "P5": "Zhang and Benveniste 2-D, 400 rows, no noise",
    "P6": "spring and wall, 10^6 rows",
}


@dataclass(frozen=True)
class Problem:
    """Identification problem: noisy rows to which a model is fitted, and exact rows to test the model."""

    name: str
    X: Array
    """(n, d)"""
    y: Array
    """(n,) with noise"""
    X_test: Array
    truth: Array
    """Without noise"""

    def nrmse(self, predicted: Array) -> float:
        """Returns the RMS error divided by the standard deviation of the true force."""
        return float(np.sqrt(np.mean((predicted - self.truth) ** 2)) / np.std(self.truth))


def problem(name: str, draw: int = 0) -> Problem:
    """Returns one of NAMES. Positions and noise differ between draws.

    Draw 0 of P4 is the uniform grid; in the other draws each inner position moves by up to half a step. The
    ends do not move, because test rows must not need extrapolation.
    """
    noise = np.random.default_rng([int(name[1]), draw])
    if name in ("P1", "P6"):
        x = hand(np.random.default_rng([11, draw]), 10_000 if name == "P1" else 1_000_000, 0.0, 0.6)
        return _one_input(name, x, spring_wall, 0.02, noise, seed=901)
    if name == "P2":
        x = hand(np.random.default_rng([12, draw]), 10_000, 0.0, 4.0)
        return _one_input(name, x, tactile_switch, 0.005, noise, seed=902)
    if name == "P3":
        lower, upper = [-0.002, -0.2], [0.01, 0.2]
        X = np.random.default_rng([103, draw]).uniform(lower, upper, (20_000, 2))
        X_test = np.random.default_rng(903).uniform(lower, upper, (10_000, 2))
        force = _hunt_crossley(X)
        y = force + noise.normal(0.0, 0.01 * force.std(), len(force))
        return Problem(name, X, y, X_test, _hunt_crossley(X_test))
    if name == "P4":
        x, step = np.linspace(-10.0, 10.0, 200, retstep=True)
        if draw:
            x[1:-1] += step * np.random.default_rng([104, draw]).uniform(-0.5, 0.5, len(x) - 2)
        x_test = np.random.default_rng(904).uniform(-10.0, 10.0, 200)
        return Problem(name, x[:, None], _zhang_1d(x), x_test[:, None], _zhang_1d(x_test))
    if name == "P5":
        X = np.random.default_rng([105, draw]).uniform(-10.0, 10.0, (400, 2))
        side = np.linspace(-10.0, 10.0, 20)
        X_test = np.stack(np.meshgrid(side, side), axis=-1).reshape(-1, 2)
        return Problem(name, X, _zhang_2d(X), X_test, _zhang_2d(X_test))
    raise KeyError(name)


def _one_input(name: str, x: Array, force, sigma: float, noise: np.random.Generator, seed: int) -> Problem:
    x_test = np.random.default_rng(seed).uniform(x.min(), x.max(), 10_000)
    return Problem(
        name, x[:, None], force(x) + noise.normal(0.0, sigma, len(x)), x_test[:, None], force(x_test)
    )


def hand(random: np.random.Generator, n: int, lower: float, upper: float) -> Array:
    """Returns hand positions at 1 kHz: a slow oscillation of varying frequency and amplitude, with jitter."""
    n_knots = max(8, n // 1500)
    row, knot_rows = np.arange(n), np.linspace(0, n, n_knots)
    frequency = np.interp(row, knot_rows, random.uniform(0.2, 0.9, n_knots))
    width = np.interp(row, knot_rows, random.uniform(0.42, 0.53, n_knots))
    jitter = lfilter([1.0], [1.0, -0.995], random.normal(0.0, 4e-4, n))
    u = np.abs(0.5 - width * np.cos(2.0 * np.pi * np.cumsum(frequency) * 1e-3) + jitter)
    return lower + (upper - lower) * (1.0 - np.abs(1.0 - u))


def spring_wall(x: Array) -> Array:
    """Returns a force with slope 2 N*m/rad below 0.4 rad and 60 N*m/rad above; 0.01 rad smooth the kink."""
    return 2.0 * x + 58.0 * 0.01 * np.logaddexp(0.0, (x - 0.4) / 0.01)


_SWITCH = CubicHermiteSpline(
    [0.0, 1.0, 1.2, 1.6, 1.8, 4.2], [0.0, 0.5, 0.6, 0.35, 0.42, 1.62], [0.5, 0.5, 0.0, 0.0, 0.5, 0.5]
)


def tactile_switch(x: Array) -> Array:
    """Returns a force [N] over position [mm]: a bump with kinks, and a stop of 20 N/mm at 3.8 mm."""
    return _SWITCH(x) + 20.0 * 0.01 * np.logaddexp(0.0, (x - 3.8) / 0.01)


def _hunt_crossley(X: Array) -> Array:
    depth, velocity = np.maximum(X[:, 0], 0.0), X[:, 1]
    return 800.0 * depth**1.5 * (1.0 + 1.2 * velocity)


def _zhang_1d(x: Array) -> Array:
    wave = 10.0 * np.exp(-0.05 * x - 0.5) * np.sin((0.03 * x + 0.7) * x)
    return np.select([x < -2.0, x < 0.0], [-2.186 * x - 12.864, 4.246 * x], wave)


def _zhang_2d(X: Array) -> Array:
    return (X[:, 0] ** 2 - X[:, 1] ** 2) * np.sin(0.5 * X[:, 0])

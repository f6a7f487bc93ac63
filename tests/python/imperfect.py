# SPDX-License-Identifier: Apache-2.0
"""Simulated objects with known force, and recordings of them with one kind of measurement error."""

from collections.abc import Callable

import numpy as np
import numpy.typing as npt
from scipy.signal import lfilter

import palpate

Array = npt.NDArray[np.float64]
Law = Callable[[Array], Array]

TRAVEL = 0.6
NOISE = 0.02


def line(x: Array) -> Array:
    return 2.0 * x + 1.0


def wall(x: Array) -> Array:
    """Returns the force of a soft spring with a wall at position 0.4."""
    return 2.0 * x + 0.58 * np.logaddexp(0.0, (x - 0.4) / 0.01)


def sweep(n: int) -> Array:
    """Returns evenly spaced positions of one stroke."""
    return np.linspace(0.0, TRAVEL, n)


def wandering(n: int, seed: int) -> Array:
    """Returns a motion in [0, 1] that reverses at random positions and starts anywhere."""
    rng = np.random.default_rng(seed)
    turns = rng.uniform(0.0, 1.0, n // 200 + 2)
    return np.interp(np.arange(n) / 200.0, np.arange(len(turns)), turns)


def strokes(n: int, cycles: float = 7.0) -> Array:
    """Returns the positions of alternating strokes into the object and out of it."""
    return TRAVEL * (0.5 - 0.5 * np.cos(2.0 * np.pi * cycles * np.arange(n) / n))


def noise(n: int, seed: int = 7, correlation: float = 0.0) -> Array:
    """Returns normal noise of standard deviation NOISE; adjacent values have the given correlation."""
    white = np.random.default_rng(seed).normal(0.0, NOISE * np.sqrt(1.0 - correlation**2), n + 500)
    return np.asarray(lfilter([1.0], [1.0, -correlation], white)[500:])


def recorded(x: Array, y: Array, time: Array | None = None) -> palpate.Recording:
    return palpate.Recording.from_arrays(x, y, time=time)


def true_nrmse(model: palpate.Model, law: Law, travel: float = TRAVEL) -> float:
    """Returns the NRMSE of a model against the force law without noise, over the recorded positions."""
    x = np.linspace(0.0, travel, 2001)
    return float(np.sqrt(np.mean((model.force(x) - law(x)) ** 2)) / np.std(law(x)))


def press_and_release(rows: int = 150, depth: float = 4.0) -> Array:
    """Returns the positions of one press and one release at constant speed."""
    press = np.linspace(0.0, depth, rows)
    return np.concatenate([press, press[::-1]])


def loop(x: Array) -> Array:
    """Returns the force of a hardening contact with friction over a press and a release of equal length."""
    way = np.repeat([1.0, -1.0], len(x) // 2)
    return 40.0 * np.tanh(x / 0.6) + 12.0 * x + 3.0 * way * np.tanh(x)


def knob(degrees: Array, detents: int = 24) -> Array:
    """Returns the torque [mN m] of a knob without friction at its angles."""
    angle = np.radians(detents * degrees)
    return 8.0 * np.sin(angle) + 1.5 * np.sin(2.0 * angle)

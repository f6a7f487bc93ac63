# SPDX-License-Identifier: Apache-2.0
"""Of rival causes, the one that explains most of what differs between strokes is named."""

import re

import numpy as np
import pytest

from imperfect import Array
from palpate import Model, Recording, identify
from palpate.identification.classes.dynamics import LEAST_SPEED_SPREAD, spread_of_speeds

VELOCITY = ("position", "hysteresis")


def cycles(amplitudes: tuple[float, ...], period_s: float = 1.0) -> tuple[Array, Array]:
    """Returns time and position of three periods of a sine of each amplitude, 100 rows a period."""
    time = period_s / 100.0 * np.arange(300.0 * len(amplitudes))
    return time, np.repeat(amplitudes, 300) * np.sin(2.0 * np.pi * time / period_s)


def model(time: Array | None, x: Array, force: Array, **options: object) -> Model:
    noise = np.random.default_rng(3).normal(0.0, 0.004 * force.std(), len(x))
    return identify(Recording.from_arrays(x, force + noise, time=time), **options)


def damper(time: Array, x: Array) -> Array:
    """Returns the force of a magnetorheological damper, a function of position and velocity."""
    velocity = np.gradient(x, time)
    return np.asarray(np.tanh(velocity / 0.5) + 0.05 * velocity + 0.1 * x)


def test_velocity_is_not_mistaken_for_the_position_of_the_last_turn() -> None:
    """A larger amplitude of one frequency is faster."""
    time, x = cycles((0.3, 0.6, 1.0))
    (reason,) = model(time, x, damper(time, x), inputs=VELOCITY, max_wavelets=12).verdict.reasons[:1]
    assert "with the speed, from the slowest to the fastest by" in reason
    assert "last turn" not in reason


@pytest.mark.full
def test_velocity_that_a_hand_notices_becomes_an_input() -> None:
    """Rows behind turns count less, so that the stated error alone is that of a good model."""
    time, x = cycles((0.3, 0.6, 1.0))
    assert model(time, x, damper(time, x)).inputs == ("position", "velocity")


def test_a_change_of_opposite_sign_in_press_and_release_is_found() -> None:
    """The loop grows by 4 % of the largest force, the mean force of both strokes is constant."""
    x = np.tile(np.r_[np.linspace(0.0, 1.0, 100), np.linspace(1.0, 0.0, 100)], 3)
    grown = np.linspace(0.0, 0.08, len(x)) * np.tile(np.repeat([1.0, -1.0], 100), 3)
    (reason,) = model(None, x, 2.0 + x + grown).verdict.reasons
    assert "the zero of the force, the speed or the object changed" in reason


def test_speeds_are_compared_within_each_direction() -> None:
    fast, slow = np.ones(100), 0.2 * np.ones(500)
    assert spread_of_speeds(np.r_[fast, -slow]) == pytest.approx(0.0, abs=1e-6)
    assert spread_of_speeds(np.r_[fast, -fast, slow, -slow]) > LEAST_SPEED_SPREAD


def test_a_mass_that_is_not_tested_has_a_limit() -> None:
    """A sine of amplitude 1 and 1 Hz has an acceleration of 39.5, and 1 % of the largest force is 0.01."""
    time = np.arange(0.0, 3.01, 0.05)
    x = np.cos(2.0 * np.pi * time)
    decisions = model(time, x, x).notes["model_selection"]
    (limit,) = (each for each in decisions if each.startswith("mass: not tested"))
    (mass,) = re.findall(r"a mass above (\S+) changes the force", limit)
    assert float(mass) == pytest.approx(0.01 / 39.5, rel=0.05)


@pytest.mark.parametrize("seed", [1, 3])
def test_noise_of_the_position_at_a_turn_is_not_called_a_first_press(seed: int) -> None:
    """A later stroke reaches beyond the first one in some rows of the last place."""
    random, time = np.random.default_rng(seed), 0.01 * np.arange(1000.0)
    x = np.abs((0.4 * time + 1.0) % 2.0 - 1.0)
    force = np.gradient(x, time) + 0.02 * x
    noise = random.normal(0.0, 3e-4, len(x)), random.normal(0.0, 0.004 * force.std(), len(x))
    assert identify(Recording.from_arrays(x + noise[0], force + noise[1])).verdict.level == "good"

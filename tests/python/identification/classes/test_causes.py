# SPDX-License-Identifier: Apache-2.0
"""Of rival causes, the one that explains most of what differs between strokes is named."""

import re

import numpy as np
import pytest

from imperfect import Array
from palpate import Model, Recording, identify
from palpate.identification.classes.causes import Judged
from palpate.identification.classes.dynamics import LEAST_SPEED_SPREAD, spread_of_speeds
from palpate.identification.classes.findings import drift_findings, place_findings
from palpate.identification.data.rows import Rows

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


def test_a_row_at_rest_at_the_largest_position_belongs_to_the_last_place() -> None:
    """One release and one press share no place in the same direction, so that no cause can be known."""
    x = np.r_[np.linspace(1.0, 0.0, 180), np.linspace(0.0, 1.0, 181)[1:]]
    force = np.r_[-np.ones(180), np.ones(179), 0.0] + 0.1 * x
    assert model(0.01 * np.arange(360.0), x, force).verdict.level == "good"


@pytest.mark.full
def test_rows_between_which_the_tool_turns_do_not_change_the_position_of_the_turn() -> None:
    """Seven times faster, the row behind a turn is further from the turn."""
    random, time = np.random.default_rng(2), 0.0025 * np.arange(1820.0)
    way = np.where(time < 4.0, time, 4.0 + 7.3 * (time - 4.0))
    x = 1.0 - np.abs(1.0 - way % 2.0)
    force = 0.1 * x + np.where(way % 2.0 < 1.0, 1.0, -1.0) * np.where(time < 4.0, 1.0 / 7.3, 1.0)
    noise = random.normal(0.0, 2e-5, len(x)), random.normal(0.0, 0.003, len(x))
    found = identify(Recording.from_arrays(x + noise[0], force + noise[1], time=time))
    assert "last turn" not in str(found.verdict)


def judged(x: Array, residual: Array, side: Array) -> Judged:
    rows = Rows(("position",), x[:, None], np.ones(len(x)) + residual)
    return Judged(rows, residual, np.ones(len(x)), side, "position")


@pytest.mark.parametrize("seed", [5, 6])
def test_the_rows_of_a_slow_stroke_at_a_place_count_once(seed: int) -> None:
    """The force differs at random between places of strokes; most rows are at the start, as with a hand."""
    random = np.random.default_rng(seed)
    press = np.r_[np.linspace(0.0, 0.02, 60, endpoint=False), np.linspace(0.02, 1.0, 200)]
    x, stroke = np.tile(np.r_[press, press[::-1]], 4), np.repeat(np.arange(8), len(press))
    place = np.minimum((100 * x).astype(np.intp), 99)
    residual = 0.012 * random.normal(0.0, 1.0, (8, 100))[stroke, place]
    residual += random.normal(0.0, 0.002, len(x))
    assert judged(x, residual, 1.0 - 2.0 * (stroke % 2)).cause is None


def test_strokes_that_differ_as_a_whole_have_a_cause() -> None:
    """The zero moves behind the fourth of six strokes, which a straight line over time does not explain."""
    x = np.tile(np.r_[np.linspace(0.0, 1.0, 200), np.linspace(1.0, 0.0, 200)], 3)
    stroke = np.arange(len(x)) // 200
    residual = 0.05 * (stroke > 3) + np.random.default_rng(0).normal(0.0, 1e-3, len(x))
    cause = judged(x, residual, 1.0 - 2.0 * (stroke % 2)).cause
    assert cause is not None
    assert cause.perceptible


def test_a_place_is_not_explained_by_a_cause_that_a_hand_does_not_notice() -> None:
    """The zero of the force moves by a tenth of a just noticeable difference."""
    x = np.tile(np.r_[np.linspace(0.0, 1.0, 400), np.linspace(1.0, 0.0, 400)], 3)
    residual = np.linspace(-5e-4, 5e-4, len(x)) + 0.2 * ((x > 0.5) & (x < 0.51))
    found = judged(x, residual, np.tile(np.repeat([1.0, -1.0], 400), 3))
    assert drift_findings(found) == []
    (finding,) = place_findings(found)
    assert "the force there depends on more than position" in finding.sentence

# SPDX-License-Identifier: Apache-2.0
"""A periodic force gets the harmonics of its period, with wavelets only where these need fewer parameters."""

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from conftest import sampled
from palpate import Recording, identify, load_model, read_recording

Array = NDArray[np.float64]

TURN = 2.0 * np.pi
ORDERS = {7: (0.8, 0.4), 12: (0.1, -2.0), 28: (0.3, 3.0), 36: (0.2, 1.0)}
"""Amplitude [N*m] and phase [rad] of each order of a motor"""


def cogging(angle: Array) -> Array:
    return np.asarray(sum(size * np.cos(n * angle - phase) for n, (size, phase) in ORDERS.items()))


def recorded(angle: Array, force: Array, noise: float = 0.01, **more: Array) -> Recording:
    noisy = force + np.random.default_rng(3).normal(0.0, noise, len(angle))
    return Recording.from_arrays(angle, noisy, units={"position": "rad", "force": "N*m"}, **more)


def map_of_a_turn(rows: int = 512, begin: float = 0.0) -> Recording:
    angle = begin + TURN * np.arange(rows) / rows
    return recorded(angle, cogging(angle))


@pytest.mark.parametrize("begin", [0.0, -40.0])
def test_cogging_gets_its_orders_with_amplitudes_and_phases(begin: float, tmp_path: Path) -> None:
    model = identify(map_of_a_turn(begin=begin), period=TURN)
    assert model.orders.tolist() == list(ORDERS)
    assert model.n_wavelets == model.harmonics == 4
    assert model.linear == 0.0
    frame = load_model(model.save(tmp_path / "motor.json")).to_frame()
    size, phase = np.array(list(ORDERS.values())).T
    assert frame["weight_Nm"].to_numpy() == pytest.approx(size, abs=0.003)
    assert np.exp(1j * frame["phase_rad"].to_numpy()) == pytest.approx(np.exp(1j * phase), abs=0.03)
    x = np.linspace(begin - 10.0, begin + 10.0, 4001)
    assert np.abs(model.force(x) - cogging(x)).max() < 0.006


def test_the_largest_number_of_wavelets_limits_the_harmonics_too() -> None:
    model = identify(map_of_a_turn(), period=TURN, max_wavelets=2)
    assert model.orders.tolist() == [7, 28]
    assert model.stop_reason == "max_wavelets"


@pytest.mark.parametrize(("width", "most"), sampled([(0.01, 45), (0.03, 35)], (0.03, 35)))
def test_narrow_detents_get_wavelets(width: float, most: int) -> None:
    x = np.linspace(0.0, 5.0, 3000)
    force = np.exp(-0.5 * ((np.mod(x, 1.0) - 0.4) / width) ** 2)
    model = identify(recorded(x, force, 0.003), period=1.0)
    assert model.n_wavelets > model.harmonics
    assert model.n_parameters <= most
    assert np.sqrt(np.mean((model.force(x) - force) ** 2)) < 0.002


@pytest.mark.full
def test_friction_of_a_periodic_force_has_its_own_harmonics() -> None:
    time = 1e-3 * np.arange(8000)
    angle = TURN * (1.0 - np.cos(TURN * time / 4.0))
    way = np.sign(np.gradient(angle))
    force = np.sin(3.0 * angle) + way * (0.3 + 0.1 * np.cos(3.0 * angle))
    model = identify(recorded(angle, force, direction=way), period=TURN)
    assert model.hysteretic
    assert set(model.orders.tolist()) == {3.0}
    x = np.linspace(0.0, TURN, 500)
    loop = np.asarray(model.force(x, direction=1)) - model.force(x, direction=-1)
    assert np.abs(loop - 0.6 - 0.2 * np.cos(3.0 * x)).max() < 0.01
    assert model.terms == "1 harmonic"


def test_periods_on_top_of_each_other_do_not_make_orders_that_the_recording_does_not_resolve() -> None:
    # Seven poles hide twelve slots: with the period of one pole, each row has another place in the period.
    random = np.random.default_rng(5)
    angle = TURN * np.arange(512) / 512
    force = np.sin(7.0 * angle) + 0.3 * np.cos(12.0 * angle)
    model = identify(Recording.from_arrays(angle, force + random.normal(0.0, 0.01, 512)), period=0.8943)
    rows_in_a_period = 512 * 0.8943 / TURN
    assert model.orders.max(initial=0.0) <= rows_in_a_period / 2.0


def test_a_worn_detent_makes_a_periodic_model_no_good_one() -> None:
    """The mean of twelve detents, one of them 70 % as high, was called good."""
    angle = np.radians(np.r_[np.linspace(0.0, 360.0, 800), np.linspace(360.0, 0.0, 800)])
    height = np.where((np.degrees(angle) >= 150.0) & (np.degrees(angle) < 180.0), 0.07, 0.1)
    force = height * np.sin(12.0 * angle) + np.repeat([0.02, -0.02], 800)
    model = identify(recorded(angle, force, 0.002))
    assert model.period == pytest.approx(np.radians(30.0), rel=0.01)
    (reason,) = model.verdict.reasons
    assert "the repeats of the force differ" in reason
    place = float(reason.removeprefix("at ").split()[0])
    assert np.radians(150.0) < place < np.radians(180.0)
    assert identify(recorded(angle, force, 0.002), inputs=("position", "hysteresis")).verdict.level == "good"


@pytest.mark.parametrize("criterion", ["aicc", "fresh", "perceptual"])
def test_every_criterion_chooses_among_the_orders(criterion: str) -> None:
    model = identify(map_of_a_turn(256), period=TURN, criterion=criterion)
    assert {7, 28} <= set(model.orders.tolist())


def test_a_force_without_period_has_no_harmonics() -> None:
    x = np.linspace(0.0, 1.0, 400)
    model = identify(recorded(x, np.sin(5.0 * x)))
    assert model.period is None
    assert model.harmonics == 0
    assert "harmonics" not in model.to_dict()["network"]


@pytest.mark.full
def test_measured_cogging_is_a_sum_of_few_orders(data: Path) -> None:
    errors, sizes = [], []
    for path in sorted((data / "motor_cogging").glob("map_*.csv")):
        recording = read_recording(path, position="angle_rad", force="hold_current_A")
        kept, held = recording.split(5)
        model = identify(kept)
        assert model.period == TURN
        error = held.force - np.asarray(model.force(held.position))
        errors.append(float(np.sqrt(np.mean(error**2)) / np.std(held.force)))
        sizes.append(model.n_parameters)
    assert np.median(errors) < 0.05
    assert max(errors) < 0.135
    assert np.median(sizes) <= 120

# SPDX-License-Identifier: Apache-2.0
"""The period of a force that repeats over position is found, and a force that does not repeat has none."""

from collections.abc import Callable

import numpy as np
import pytest

import palpate
from conftest import sampled
from imperfect import Array, knob, press_and_release
from palpate import Recording
from palpate._core.model import play
from palpate.identification.data.period import period_of, revolution_of
from palpate.identification.data.rows import period_notes

TURN = 2.0 * np.pi
TURNS = press_and_release(3600, 1080.0)


def turned(angle: Array, torque: Array, unit: float = 1.0) -> Recording:
    """Returns a recording of a knob with friction; angles are in `unit`, torques in 1/`unit`."""
    way = np.sign(np.gradient(angle))
    torque = torque + 2.5 * way + np.random.default_rng(1).normal(0.0, 0.25, len(angle))
    return Recording.from_arrays(unit * angle, torque / unit)


def test_the_period_of_a_knob_is_found_over_three_turns() -> None:
    assert period_of([turned(TURNS, knob(TURNS))]) == pytest.approx(15.0, rel=3e-5)


@pytest.mark.parametrize("detents", [5, 12, 36])
def test_the_period_is_that_of_the_detents(detents: int) -> None:
    assert period_of([turned(TURNS, knob(TURNS, detents))]) == pytest.approx(360.0 / detents, rel=3e-4)


@pytest.mark.parametrize("detents", [5, 6])
def test_few_detents_with_a_gap_between_them_have_their_period(detents: int) -> None:
    angle = press_and_release(1000, 1.0)
    torque = np.sin(2.0 * np.pi * detents * angle) + np.random.default_rng(0).normal(0.0, 0.02, len(angle))
    rows = (angle < 0.3) | (angle > 0.65)
    way = np.repeat([1.0, -1.0], 1000)
    recording = Recording.from_arrays(angle[rows], torque[rows], direction=way[rows])
    assert period_of([recording]) == pytest.approx(1.0 / detents, rel=1e-3)


def test_a_coarse_encoder_and_several_recordings_give_the_same_period() -> None:
    step = 360.0 / 1024
    coarse = np.round(TURNS / step) * step
    assert period_of([turned(coarse, knob(TURNS))]) == pytest.approx(15.0, rel=3e-4)
    halves = [turned(TURNS[rows], knob(TURNS[rows])) for rows in (slice(None, 3600), slice(3600, None))]
    assert period_of(halves) == pytest.approx(15.0, rel=3e-4)


@pytest.mark.parametrize("unit", [1e-90, 1e-9, 1e90])
def test_the_period_does_not_depend_on_the_unit(unit: float) -> None:
    assert period_of([turned(TURNS, knob(TURNS), unit)]) == pytest.approx(15.0 * unit, rel=3e-5)


def test_rows_that_are_held_out_do_not_change_the_period() -> None:
    train, _ = turned(TURNS, knob(TURNS)).split(5)
    assert period_of([train]) == pytest.approx(15.0, rel=3e-5)


@pytest.mark.parametrize("wrong", [0, 12])
@pytest.mark.parametrize("travel", [35.0, 55.0])
def test_friction_that_reverses_and_wrong_readings_do_not_shift_the_period(travel: float, wrong: int) -> None:
    angle, random = press_and_release(400, travel), np.random.default_rng(3)
    side = np.concatenate([np.minimum(angle[:400] - 1.0, 1.0), np.maximum(angle[400:] - travel + 1.0, -1.0)])
    torque = knob(angle) + 2.5 * side + random.normal(0.0, 0.02, 800)
    torque[random.choice(800, wrong, replace=False)] += 40.0
    assert period_of([Recording.from_arrays(angle, torque)]) == pytest.approx(15.0, rel=3e-5)


@pytest.mark.parametrize("seed", [1, 14])
def test_friction_of_a_hand_that_trembles_while_it_holds_does_not_lengthen_the_period(seed: int) -> None:
    random, step = np.random.default_rng(seed), 0.005
    start = random.uniform(0.0, 5.0)
    time = np.arange(0.0, 73.0, step)
    hold = np.interp(time, [0.0, 36.0, 36.5, 72.5], [start, start + 1080.0, start + 1080.0, start])
    angle = hold + 0.15 * np.sin(2.0 * np.pi * 0.7 * time + seed)
    torque = knob(angle) + 2.5 * np.tanh(np.gradient(angle, step) / 2.0) + random.normal(0.0, 0.25, len(time))
    assert period_of(
        [Recording.from_arrays(np.round(angle * 4096 / 360) / 4096 * 360, torque)]
    ) == pytest.approx(15.0, rel=3e-5)


def detents_of_motor(angle: Array, friction: float) -> Recording:
    """Returns two cycles of a motor with 84 waves a turn; its friction reverses over half a degree."""
    state = (angle - play(angle, 0.25, start=0.0)) / 0.25
    wave, noise = np.radians(84.0 * angle), np.random.default_rng(0).normal(0.0, 0.004, len(angle))
    torque = np.sin(wave + 1.0) + 0.2 * np.sin(2.0 * wave) + friction * state + noise
    return Recording.from_arrays(np.round(angle / 0.045) * 0.045, torque)


def test_friction_that_reverses_at_the_same_turns_does_not_give_a_longer_period() -> None:
    way = np.abs((np.arange(6122) / 1530.7 + 1.0) % 2.0 - 1.0)
    angle = 189.0 * np.interp(way, [0.0, 0.015, 0.985, 1.0], [0.0, 0.003, 0.997, 1.0])
    assert period_of([detents_of_motor(angle, 0.5)]) == pytest.approx(360.0 / 84.0, rel=1e-4)


def test_rounded_positions_that_repeat_do_not_give_a_longer_period() -> None:
    angle = np.tile(press_and_release(2901, 378.0), 2)
    assert period_of([detents_of_motor(angle, 0.3)]) == pytest.approx(360.0 / 84.0, rel=1e-4)


def spring(x: Array) -> Array:
    return 2.0 * x


def dome(x: Array) -> Array:
    return 1.5 * np.tanh(4.0 * x) - 0.9 / (1.0 + np.exp(-(x - 2.0) / 0.1)) + 8.0 * np.maximum(x - 3.4, 0.0)


def one_cycle(x: Array) -> Array:
    return np.asarray(np.sin(2.0 * np.pi * x / 4.0))


@pytest.mark.parametrize("law", [spring, dome, one_cycle, np.zeros_like])
def test_a_force_that_does_not_repeat_has_no_period(law: Callable[[Array], Array]) -> None:
    x = press_and_release(1000)
    noise = np.random.default_rng(0).normal(0.0, 0.01, len(x))
    recording = Recording.from_arrays(x, law(x) + noise)
    assert period_of([recording]) is None
    assert palpate.identify(recording).period is None


@pytest.mark.parametrize("rows", [10, 20])
def test_few_rows_have_no_period(rows: int) -> None:
    x = np.linspace(0.0, 1080.0, rows)
    assert period_of([Recording.from_arrays(x, knob(x))]) is None


@pytest.mark.parametrize("rows", [8, 16, 24])
@pytest.mark.parametrize("detents", [4, 10])
def test_few_rows_in_each_detent_give_the_period_of_one_detent(rows: int, detents: int) -> None:
    x = press_and_release(rows * detents, 15.0 * detents)
    torque = np.sin(2.0 * np.pi * x / 15.0)
    assert period_of([turned(x, 10.0 * torque)]) == pytest.approx(15.0, rel=0.01)


@pytest.mark.parametrize("step", [2.5, 2.86, 3.09, 3.19, 3.27, 3.57])
def test_many_detents_of_six_rows_give_the_period_of_one_detent(step: float) -> None:
    x = press_and_release(int(324.0 / step) + 1, 324.0)
    torque = np.sin(TURN * x / 20.0) + 0.2 * np.sin(2.0 * TURN * x / 20.0)
    assert period_of([turned(x, 100.0 * torque)]) == pytest.approx(20.0, rel=1e-4)


def test_the_model_of_many_detents_of_six_rows_is_good() -> None:
    x = press_and_release(102, 324.0)
    torque = np.sin(TURN * x / 20.0) + 0.2 * np.sin(2.0 * TURN * x / 20.0)
    model = palpate.identify(turned(x, 100.0 * torque), max_wavelets=8)
    assert model.period == pytest.approx(20.0, rel=1e-4)
    assert (model.verdict.level, sorted(set(model.orders))) == ("good", [1.0, 2.0])


def test_narrow_detents_give_the_period_of_one_detent() -> None:
    x = press_and_release(136, 51.0)
    phase = np.mod(x / 15.0 + 0.3, 1.0) - 0.5
    assert period_of([turned(x, -400.0 * phase * np.exp(-200.0 * phase**2))]) == pytest.approx(15.0, rel=3e-3)


@pytest.mark.parametrize("cycles", [1, 3])
def test_an_offset_between_strokes_does_not_give_a_multiple_of_the_period(cycles: int) -> None:
    x = np.concatenate([press_and_release(270, 73.0)] * cycles)
    force = 8.0 * np.sin(TURN * x / 15.0) + 0.4 * np.linspace(0.0, 1.0, len(x))
    assert period_of([turned(x, force)]) == pytest.approx(15.0, rel=1e-3)


def test_shuffled_rows_and_further_inputs_have_no_period() -> None:
    order = np.random.default_rng(0).permutation(len(TURNS))
    shuffled = Recording.from_arrays(TURNS[order], knob(TURNS)[order])
    assert period_of([shuffled]) is None
    further = Recording.from_arrays(TURNS, knob(TURNS), inputs={"depth": TURNS})
    assert period_of([further]) is None


def test_the_model_of_a_knob_has_the_period_and_names_it() -> None:
    turns = press_and_release(600, 1080.0)
    model = palpate.identify(turned(turns, knob(turns)))
    assert model.period == pytest.approx(15.0, rel=3e-5)
    assert model.verdict.level == "good"
    assert "The force repeats every 15" in str(model.notes["identification"])
    at = np.linspace(0.0, 360.0, 4001)
    error = model.force(at, direction=np.ones(len(at))) - (knob(at) + 2.5)
    assert float(np.sqrt(np.mean(error**2))) < 0.1


def test_a_periodic_force_on_a_slope_is_not_taken_as_periodic() -> None:
    x = press_and_release(600, 60.0)
    force = knob(x) + 2.0 * x + np.random.default_rng(0).normal(0.0, 0.1, len(x))
    model = palpate.identify(Recording.from_arrays(x, force))
    at = np.linspace(0.0, 60.0, 2001)
    assert model.period is None
    assert float(np.sqrt(np.mean((model.force(at) - knob(at) - 2.0 * at) ** 2))) < 0.5


@pytest.mark.full
def test_a_given_period_is_not_searched() -> None:
    model = palpate.identify(turned(TURNS, knob(TURNS)), period=30.0)
    assert model.period == 30.0
    assert "The force repeats every" not in str(model.notes["identification"])


def motor(angle: Array) -> Array:
    return np.asarray(np.sin(3.0 * angle) + 0.5 * np.cos(7.0 * angle + 1.0) + 0.2 * np.sin(angle))


def torsion_spring(angle: Array) -> Array:
    return np.asarray(0.5 * angle + 0.1 * np.sin(7.0 * angle))


def at_angles(law: Callable[[Array], Array], turns: float, unit: str = "rad", rows: int = 400) -> Recording:
    angle = np.round(TURN * np.arange(int(rows * turns)) / rows, 6)
    noise = np.random.default_rng(4).normal(0.0, 0.01, len(angle))
    return Recording.from_arrays(angle, law(angle) + noise, units={"position": unit, "force": "N*m"})


@pytest.mark.parametrize("turns", [1.0, 1.4])
def test_an_angle_that_closes_a_revolution_has_the_period_of_a_turn(turns: float) -> None:
    recording = at_angles(motor, turns)
    assert revolution_of([recording]) == TURN
    model = palpate.identify(recording, max_wavelets=3)
    assert model.period == TURN
    assert any("repeats every 6.283 rad" in note for note in model.notes["identification"])


@pytest.mark.parametrize(
    ("law", "turns", "unit"),
    [(motor, 0.97, "rad"), (motor, 1.0, "m"), (torsion_spring, 1.0, "rad"), (torsion_spring, 1.4, "rad")],
)
def test_an_open_revolution_a_length_or_a_spring_has_no_period_of_a_turn(
    law: Callable[[Array], Array], turns: float, unit: str
) -> None:
    recording = at_angles(law, turns, unit)
    assert revolution_of([recording]) is None
    assert palpate.identify(recording, max_wavelets=6).period is None


def with_friction(law: Callable[[Array], Array], turns: float, seed: int, unit: str = "rad") -> Recording:
    """Returns a recording of a motor whose friction reverses over 0.01 rad."""
    press, random = np.linspace(0.0, TURN * turns, int(900 * turns)), np.random.default_rng(seed)
    angle = np.concatenate([press, press[::-1]])
    friction = np.concatenate([np.minimum(press / 0.005 - 1.0, 1.0), 1.0 - np.minimum(press / 0.005, 2.0)])
    torque = law(angle) + 30.0 * friction + random.normal(0.0, 2.0, len(angle))
    return Recording.from_arrays(angle, torque, units={"position": unit, "force": "N*m"})


def cogging(angle: Array) -> Array:
    return np.asarray(20.0 * np.sin(84.0 * angle) + 8.0 * np.sin(12.0 * angle + 1.0) + 7.0 * np.sin(angle))


@pytest.mark.parametrize("seed", range(3))
def test_the_period_holds_every_wave_of_the_force(seed: int) -> None:
    assert period_of([with_friction(cogging, 2.05, seed, "m")]) == pytest.approx(TURN, rel=3e-5)


def test_the_period_is_exactly_a_part_of_a_closed_revolution() -> None:
    recording = with_friction(lambda angle: 40.0 * np.sin(24.0 * angle), 2.05, 0)
    assert period_of([recording]) == TURN / 24


def test_a_revolution_with_friction_that_reverses_is_the_period() -> None:
    assert revolution_of([with_friction(cogging, 1.2, 0)]) == TURN
    recording = with_friction(lambda angle: 20.0 * np.sin(12.0 * angle) + 9.0 * np.sin(angle), 1.2, 0)
    assert palpate.identify(recording, max_wavelets=3).period == TURN


@pytest.mark.parametrize("turns", [1.0, 1.2])
def test_a_spring_with_friction_that_reverses_does_not_close_a_revolution(turns: float) -> None:
    assert revolution_of([with_friction(lambda angle: 40.0 * angle, turns, 0)]) is None


@pytest.mark.parametrize("seed", sampled([30, 33, 40], 40))
@pytest.mark.full
def test_a_period_is_found_below_noise_of_which_each_model_counts_other_independent_rows(
    seed: int,
) -> None:
    random = np.random.default_rng(seed)
    x, way = np.r_[np.linspace(0.0, 4.3, 900), np.linspace(4.3, 0.0, 900)], np.repeat([1.0, -1.0], 900)
    force = np.sin(TURN * x) + 0.4 * np.sin(2.0 * TURN * x + 1.0) + 0.2 * way
    slow = np.zeros(len(x))
    for k, each in enumerate(random.normal(0.0, 0.066, len(x) - 1), start=1):
        slow[k] = 0.8 * slow[k - 1] + each
    step = 0.3
    recording = Recording.from_arrays(x, step * np.round((force + slow) / step), direction=way)
    model = palpate.identify(recording)
    assert model.fit.nrmse > 0.1
    assert model.period == pytest.approx(1.0, rel=0.01)


def test_counts_of_an_encoder_leave_no_gap_in_a_period() -> None:
    counts = np.concatenate([np.arange(0.0, 769.0), np.arange(768.0, -1.0, -1.0)])
    note, findings = period_notes(counts, 16.0, "count")
    assert "48 periods" in note
    assert findings == []
    _, (finding,) = period_notes(counts[counts % 16.0 < 13.0], 16.0, "count")
    assert "no position lies between 12 and 16" in finding.sentence

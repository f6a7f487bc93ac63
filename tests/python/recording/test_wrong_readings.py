# SPDX-License-Identifier: Apache-2.0
"""Wrong readings are dropped, counted and named."""

from functools import cache
from itertools import product
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import palpate
from conftest import sampled
from imperfect import (
    TRAVEL,
    Array,
    loop,
    noise,
    press_and_release,
    recorded,
    strokes,
    sweep,
    true_nrmse,
    wall,
)
from palpate.identification.identify_files import identify_files
from palpate.recording.checks.wrong_readings import repeated_rows, wrong_readings
from palpate.recording.roles import Informative

N = 5_000


def changed(values: Array, at: dict[int, float]) -> Array:
    changed_values = values.copy()
    changed_values[list(at)] = list(at.values())
    return changed_values


@cache
def clean_wall() -> palpate.Model:
    x = strokes(N)
    return palpate.identify(recorded(x, wall(x) + noise(N)))


@pytest.mark.parametrize(
    "at",
    [{2500: 6e5}, {100: 6e5, 1000: -1e3, 2500: 20.0, 3500: 1e12}],
    ids=["one", "several"],
)
def test_position_spikes_are_left_out_and_counted(at: dict[int, float]) -> None:
    x = strokes(N)
    y = wall(x) + noise(N)
    clean = clean_wall()
    model = palpate.identify(recorded(changed(x, at), y))
    assert true_nrmse(model, wall) < 1.5 * true_nrmse(clean, wall) < 0.002
    assert model.fit.nrmse == pytest.approx(clean.fit.nrmse, rel=0.01)
    assert model.domain[1][0] == pytest.approx(TRAVEL, rel=1e-3)
    (note,) = (each for each in model.notes["rows"] if "wrong readings" in each)
    assert note.startswith(f"{len(at)} of {N} rows dropped (wrong readings)")


def test_force_spikes_are_left_out_and_counted() -> None:
    x = strokes(N)
    y = wall(x) + noise(N)
    model = palpate.identify(recorded(x, changed(y, {2550: 1.4e7, 100: -1e9, 999: 500.0})))
    assert true_nrmse(model, wall) < 0.001
    assert any(f"3 of {N} rows dropped (wrong readings)" in each for each in model.notes["rows"])
    assert any("row 100: -1e+09 at " in each for each in model.notes["rows"])


def test_one_spike_in_few_rows_is_left_out() -> None:
    x = sweep(50)
    model = palpate.identify(recorded(changed(x, {25: 6e5}), wall(x)))
    assert true_nrmse(model, wall) < 0.02
    assert any("1 of 50 rows" in each for each in model.notes["rows"])


def test_position_far_from_all_others_is_named_if_rows_have_no_order() -> None:
    rows = np.random.default_rng(0).permutation(N)
    x = strokes(N)
    model = palpate.identify(recorded(changed(x[rows], {2500: 3.0}), (wall(x) + noise(N))[rows]))
    assert "the recording has no rows from 0.6 to 3, 80% of the travel" in str(model.verdict)


def test_more_than_a_tenth_of_wrong_readings_give_no_good_error() -> None:
    x = strokes(N)
    x[::9] = 6e5
    model = palpate.identify(recorded(x, wall(strokes(N)) + noise(N)))
    assert model.fit.nrmse > 0.5
    assert model.verdict.level == "no"


@pytest.mark.parametrize(
    "x",
    [
        np.geomspace(1e-6, 1.0, 12),
        np.geomspace(1e-12, 1.0, 12),
        np.geomspace(1e-12, 1.0, 200),
        np.arange(12.0),
    ],
    ids=["12-log", "12-wide-log", "200-log", "12-even"],
)
def test_sparse_recordings_stay_whole(x: Array) -> None:
    model = palpate.identify(recorded(x, 3.0 * x))
    assert not any("left out" in reason for reason in model.verdict.reasons)
    assert model.domain[1][0] == x.max()


@pytest.mark.parametrize("stiffness", [1e5, 1e8])
def test_wall_that_is_touched_briefly_stays(stiffness: float) -> None:
    x = 0.5 - 0.5 * np.cos(6.0 * np.pi * np.linspace(0.0, 1.0, 1001))
    y = x + stiffness * np.maximum(x - 0.99999, 0.0)
    assert 0 < np.count_nonzero(x > 0.99999) < 10
    assert wrong_rows(x, y) == []


def test_short_fast_motion_after_a_long_rest_stays() -> None:
    random = np.random.default_rng(1)
    x = np.concatenate([random.normal(0.0, 1e-6, 2000), np.linspace(0.1, 1.0, 10)])
    assert wrong_rows(x, 2.0 * x) == []


def test_strokes_after_a_long_exact_rest_stay() -> None:
    at_rest = np.zeros(5000)
    assert wrong_rows(np.r_[at_rest, PRESS[::2]], np.r_[at_rest, 2.0 * PRESS[::2]]) == []


def at_a_slower_rate(values: np.ndarray, rows: float) -> np.ndarray:
    """Returns values as a sensor gives them that measures once in a number of rows."""
    measured = np.unique(np.ceil(np.arange(0.0, len(values), rows)).astype(int))
    return values[measured[np.searchsorted(measured, np.arange(len(values)), side="right") - 1]]


@pytest.mark.parametrize(
    ("slower", "rows"),
    sampled(product(("force", "position"), (2, 2.5, 8)), ("force", 2.5), ("position", 8)),
)
def test_rows_that_repeat_a_slower_sensor_are_neither_fitted_nor_compared(slower: str, rows: float) -> None:
    """A repeated reading is late: press and release of a spring without loss would differ."""
    random = np.random.default_rng(0)
    x = 2.0 - 2.0 * np.cos(np.linspace(0.0, 2.0 * np.pi, 1200)) + random.normal(0.0, 1e-4, 1200)
    force = 3.0 * x**2 + random.normal(0.0, 0.01, len(x))
    late = {
        "position": at_a_slower_rate(x, rows) if slower == "position" else x,
        "force": at_a_slower_rate(force, rows) if slower == "force" else force,
    }
    recording = palpate.Recording.from_arrays(**late)
    model = palpate.identify(recording)
    assert model.kind == "position"
    at = np.linspace(0.1, 0.9 * x.max(), 100)
    np.testing.assert_allclose(model.force(at), 3.0 * at**2, atol=0.02)
    expected = len(x) - len(np.unique(np.ceil(np.arange(0.0, len(x), rows))))
    assert model.notes["roles"]["repeated"] == pytest.approx(expected, rel=0.01)
    assert model.verdict.level == "good"
    check = palpate.verify(model, recording)
    assert check.n == pytest.approx(len(x) - expected, rel=0.05)
    assert check.nrmse == pytest.approx(model.fit.nrmse, rel=0.1)


def test_an_input_that_is_constant_in_each_press_is_not_a_slower_sensor() -> None:
    random = np.random.default_rng(1)
    depth, place = np.tile(np.linspace(0.0, 1e-3, 8), 60), np.repeat(random.uniform(0.0, 0.06, 60), 8)
    force = 500.0 * depth * (1.0 + place) + random.normal(0.0, 1e-3, len(depth))
    assert not repeated_rows(palpate.Recording.from_arrays(depth, force, inputs={"place": place})).any()


@pytest.mark.parametrize("noise_steps", [0.0, 0.2, 1.0])
def test_a_coarse_sensor_is_not_a_slower_one(noise_steps: float) -> None:
    random, step = np.random.default_rng(1), 0.2
    x = press_and_release(3000)
    force = np.round((3.0 * x**2 + noise_steps * step * random.normal(size=len(x))) / step) * step
    assert not repeated_rows(palpate.Recording.from_arrays(x, force)).any()
    position = np.round(x / 0.01) * 0.01
    assert not repeated_rows(
        palpate.Recording.from_arrays(position, 3.0 * x**2 + random.normal(0.0, 0.01, len(x)))
    ).any()


def test_a_slower_position_at_a_constant_speed_is_not_a_coarse_one() -> None:
    """A tester that reads its position every 20 ms got the verdict "no" after a minute."""
    x = np.abs((np.arange(6000) / 1000.0 + 1.0) % 2.0 - 1.0)
    position = at_a_slower_rate(x + np.random.default_rng(3).normal(0.0, 1e-4, len(x)), 20)
    assert np.count_nonzero(~repeated_rows(palpate.Recording.from_arrays(position, 3.0 * x**2))) == 300


def test_a_relaxation_hold_keeps_its_rows_when_the_position_sensor_is_slower() -> None:
    random = np.random.default_rng(2)
    x = np.r_[np.linspace(0.0, 1.0, 500), np.full(2000, 1.0)] + random.normal(0.0, 1e-4, 2500)
    hold = np.exp(-np.arange(2000) / 500.0)
    force = np.r_[np.linspace(0.0, 1.0, 500), 0.7 + 0.3 * hold] + random.normal(0.0, 1e-3, 2500)
    recording = palpate.Recording.from_arrays(at_a_slower_rate(x, 4), force)
    assert np.count_nonzero(~repeated_rows(recording)[500:]) == 500


def test_wrong_reading_of_a_further_input_is_dropped() -> None:
    x = strokes(N)
    frame = pd.DataFrame({"position_rad": x, "torque_Nm": wall(x), "side_rad": np.sin(3.0 * x) + noise(N)})
    frame.loc[[100, 2500], "side_rad"] = [9.0, -1e6]
    recording = palpate.Recording.from_frame(frame, inputs=["side_rad"])
    found = Informative([recording])
    (kept,), (note,) = found.recordings, found.notes
    assert len(kept) == N - 2
    assert note.startswith(f"2 of {N} rows dropped (wrong readings)")


def in_a_file(rows: int) -> pd.DataFrame:
    x = strokes(rows)
    return pd.DataFrame({"position_rad": x, "torque_Nm": wall(x) + noise(rows)})


@pytest.fixture(scope="module")
def without_two_rows(tmp_path_factory: pytest.TempPathFactory) -> palpate.Model:
    """Returns the model of the file from which the rows with wrong readings are removed."""
    path = tmp_path_factory.mktemp("files") / "clean.csv"
    in_a_file(N).drop([2550, 3500]).to_csv(path, index=False)
    return identify_files(path)


@pytest.mark.parametrize("column", ["position_rad", "torque_Nm"])
def test_files_read_part_by_part_drop_and_count_wrong_readings(
    tmp_path: Path, without_two_rows: palpate.Model, column: str
) -> None:
    wrong = in_a_file(N)
    wrong.loc[[2550, 3500], column] = [6e5, -3e3]
    wrong.to_csv(tmp_path / "wrong.csv", index=False)
    model = identify_files(tmp_path / "wrong.csv")
    assert np.array_equal(without_two_rows.weight, model.weight)
    (note,) = [note for note in model.notes["rows"] if "wrong reading" in note]
    assert note == "dropped 2 rows with a wrong reading (first: line 2552)"


PRESS = press_and_release(400)
FORCE = loop(PRESS) + np.random.default_rng(0).normal(0.0, 0.05, len(PRESS))


@cache
def clean_press() -> palpate.Model:
    return palpate.identify(recorded(PRESS, FORCE))


def difference_from_clean(model: palpate.Model) -> float:
    """Returns the largest difference of a model from that of the recording without wrong readings."""
    clean = clean_press()
    x, press = np.linspace(0.0, 4.0, 500), np.ones(500)
    return float(np.abs(model.force(x, direction=press) - clean.force(x, direction=press)).max())


def wrong_rows(x: Array, y: Array) -> list[int]:
    return np.flatnonzero(wrong_readings(x, x, y)).tolist()


@pytest.mark.parametrize(
    "at",
    [
        pytest.param({100: 0.0}, id="zero", marks=pytest.mark.full),
        pytest.param({300: 60.0}, id="moderate", marks=pytest.mark.full),
        pytest.param({100: 500.0, 101: 500.0}, id="pair", marks=pytest.mark.full),
        pytest.param({200: 20.0, 500: -60.0, 600: 30.0}, id="several"),
        pytest.param({0: 2000.0}, id="first", marks=pytest.mark.full),
        pytest.param({799: -200.0}, id="last"),
    ],
)
def test_wrong_forces_are_dropped_and_named_by_default(at: dict[int, float]) -> None:
    y = changed(FORCE, at)
    assert wrong_rows(PRESS, y) == list(at)
    model = palpate.identify(recorded(PRESS, y))
    assert difference_from_clean(model) < 0.1
    (note,) = [note for note in model.notes["rows"] if "wrong readings" in note]
    row, force = next(iter(at.items()))
    assert note.startswith(f"{len(at)} of 800 rows dropped (wrong readings)")
    assert f": row {row}: {force:g} at " in note


@pytest.mark.parametrize("begin", [1, 2])
@pytest.mark.parametrize("reverse", [False, True])
def test_a_fast_ramp_before_or_after_a_hold_has_no_wrong_position(begin: int, reverse: bool) -> None:
    hold, ramp = np.full(100, 0.128), np.linspace(0.128, 1.0, 300)
    x = np.concatenate([[0.0, 0.08][:begin], hold, ramp])
    y = np.concatenate([[-0.03, 0.43][:begin], 0.45 + 0.24 * np.exp(-np.arange(100) / 12.0), 0.45 + ramp])
    if reverse:
        x, y = x[::-1], y[::-1]
    assert wrong_rows(x, y) == []
    first = np.flatnonzero(x < 0.1)
    assert wrong_rows(x, np.where(x < 0.1, 0.69, y)) == first.tolist()


@pytest.mark.parametrize(
    "at",
    [{0: -3.0}, {799: 3.0}, {399: 0.0}, {399: 8.0}, {100: 8.0}],
    ids=["first", "last", "turn", "far", "inner"],
)
def test_wrong_positions_are_found_in_every_row(at: dict[int, float]) -> None:
    assert wrong_rows(changed(PRESS, at), FORCE) == list(at)


@pytest.mark.parametrize("length", [1e-90, 1e-9, 1e90])
@pytest.mark.parametrize("force", [1e-90, 1e-9, 1e90])
def test_wrong_readings_do_not_depend_on_the_units(length: float, force: float) -> None:
    assert wrong_rows(length * PRESS, force * changed(FORCE, {100: 0.0, 300: 500.0})) == [100, 300]


def test_rows_with_the_value_of_wrong_readings_are_wrong_near_the_right_force_too() -> None:
    x = np.concatenate([np.zeros(20), press_and_release(400, 1.0)])
    y = np.maximum(x - 0.1, 0.0) + np.where(x > 0.0, np.random.default_rng(0).normal(0.0, 0.016, len(x)), 0.0)
    far, near = [300, 340, 380, 460], [100, 740]  # at 6 times the noise
    wrong = wrong_rows(x, changed(y, dict.fromkeys([*far, *near], 0.0)))
    assert wrong == sorted([*far, *near])  # the 20 rows at rest in air are right
    assert wrong_rows(x, changed(y, dict.fromkeys(near, 0.0))) == []


def test_four_equal_readings_in_sequence_belong_to_the_object() -> None:
    assert wrong_rows(PRESS, changed(FORCE, dict.fromkeys(range(100, 104), 50.0))) == []


def test_neighbouring_readings_far_beyond_all_others_are_wrong() -> None:
    at = [100, 101, 103, 104, 600, 601, 602, 603]
    assert wrong_rows(PRESS, changed(FORCE, dict.fromkeys(at, 500.0))) == at
    assert wrong_rows(PRESS, changed(FORCE, dict.fromkeys([*at, 399], -500.0))) == at


def test_more_than_a_tenth_of_the_rows_are_not_wrong_readings() -> None:
    at = np.arange(5, 795, 9)[:80]
    assert wrong_rows(PRESS, changed(FORCE, dict.fromkeys(at.tolist(), 900.0))) == at.tolist()
    y = changed(FORCE, dict.fromkeys([*at.tolist(), 790], 900.0))
    assert wrong_rows(PRESS, y) == []
    assert palpate.identify(recorded(PRESS, y)).verdict.level == "no"


def test_a_clean_steep_start_a_wall_and_a_click_have_no_wrong_reading() -> None:
    assert wrong_rows(PRESS, FORCE) == []
    assert wrong_rows(PRESS, 40.0 * (1.0 - np.exp(-PRESS / 0.015)) + 12.0 * PRESS) == []
    assert wrong_rows(PRESS[:400], 2.0 * PRESS[:400] + 3e4 * np.maximum(PRESS[:400] - 3.995, 0.0)) == []
    assert wrong_rows(PRESS, FORCE - 20.0 * (PRESS > 2.0)) == []


@pytest.mark.parametrize("offset", [0.2, 0.5, 0.8])
def test_a_single_peak_over_several_rows_has_no_wrong_reading(offset: float) -> None:
    x = np.arange(-10.0, 150.0) + offset
    glide = (8.5 + 3.0 * np.exp(-(((x - 3.0) / 2.0) ** 2))) * np.tanh(np.maximum(x, 0.0) / 1.2)
    y = glide + np.random.default_rng(1).normal(0.0, 0.03, len(x))
    assert wrong_rows(x, y) == []
    assert wrong_rows(x, changed(y, {80: 11.0, 81: 11.1, 120: 0.0})) == [80, 81, 120]


@pytest.mark.parametrize("rows", [10, 16])
def test_few_rows_have_no_wrong_reading(rows: int) -> None:
    x = np.linspace(0.0, 4.0, rows)
    assert wrong_rows(x, changed(2.0 * x, {rows // 2: 500.0})) == []


def test_each_part_of_a_recording_names_its_wrong_readings() -> None:
    recording = recorded(PRESS, changed(FORCE, {100: 0.0, 104: 500.0}))
    train, test = recording.split(5)
    found = Informative([train, test])
    kept, notes = found.recordings, found.notes
    assert [len(part) for part in kept] == [639, 159]
    assert [note.split(": ", 2)[:2] for note in notes] == [
        ["recording 1", "1 of 640 rows dropped (wrong readings)"],
        ["recording 2", "1 of 160 rows dropped (wrong readings)"],
    ]
    assert ["row 80:" in notes[0], "row 20:" in notes[1]] == [True, True]


def test_a_wrong_reading_on_a_steep_part_is_found_with_the_model() -> None:
    """The force changes more from row to row than the reading is wrong. One note names it and the others."""
    x = press_and_release(200)
    y = 40.0 * x + np.random.default_rng(0).normal(0.0, 0.01, len(x))
    y[[150, 250]] += [3.0, 900.0]
    assert wrong_rows(x, y) == [250]
    model = palpate.identify(x, y)
    (note,) = (each for each in model.notes["rows"] if "wrong reading" in each)
    assert note.startswith("2 of 400 rows dropped (wrong readings): row 150: ")
    assert ", row 250: 1020 at " in note
    assert model.notes["roles"]["wrong reading"] == 2
    assert model.fit.nrmse < 1e-3


@pytest.mark.parametrize("row", [0, 1, 2, -3, -2, -1])
def test_the_first_and_the_last_rows_are_not_judged_by_rows_on_one_side(row: int) -> None:
    """A steep end of three rows, as of a contact or a wall, looks the same."""
    at = row % len(FORCE)
    assert wrong_rows(PRESS, changed(FORCE, {at: float(FORCE[at]) + 0.5 * np.ptp(FORCE)})) == []
    assert wrong_rows(PRESS, changed(FORCE, {at: float(FORCE[at]) + 20.0 * np.ptp(FORCE)})) == [at]


def test_a_first_reading_that_is_not_judged_changes_the_curve_little() -> None:
    assert difference_from_clean(palpate.identify(recorded(PRESS, changed(FORCE, {0: 30.0})))) < 0.1


def test_real_rows_where_one_of_several_strokes_lets_go_are_not_wrong_readings() -> None:
    """One of three pulls lets go three rows earlier than the model."""
    x = np.tile(np.arange(0.0, 14.0, 0.03), 3)
    first = np.arange(len(x)) < len(x) // 3
    let_go = np.where(first, 8.9, 9.0)
    noise = np.random.default_rng(0).normal(0.0, 0.05, len(x))
    force = np.where(x < let_go, 30.0 * np.tanh(x / 6.0) + 0.8 * x, 0.0) + noise
    residual = force - np.where(x < 9.0, 30.0 * np.tanh(x / 6.0) + 0.8 * x, 0.0)
    assert not wrong_readings(x, x, force, (), residual).any()
    force[200], residual[200] = force[200] + 20.0, residual[200] + 20.0
    assert np.flatnonzero(wrong_readings(x, x, force, (), residual)).tolist() == [200]


def test_an_error_of_the_model_that_occurs_again_is_not_a_wrong_reading() -> None:
    x = np.tile(np.concatenate([PRESS[:400:8], PRESS[400::8]]), 4)
    contact = 0.4 * x.max()
    at_contact = np.flatnonzero((x[:-1] < contact) != (x[1:] < contact))
    random = np.random.default_rng(3).normal(0.0, 0.01, len(x))
    once = np.zeros(len(x))
    once[130] = 5.0
    residual = random + once
    assert np.flatnonzero(wrong_readings(x, x, 10.0 * x + residual, (), residual)).tolist() == [130]
    residual[at_contact] += np.random.default_rng(4).uniform(2.0, 5.0, len(at_contact))
    assert np.flatnonzero(wrong_readings(x, x, 10.0 * x + residual, (), residual)).tolist() == [130]


@pytest.mark.parametrize("seed", [0, 4])
def test_rows_of_a_contact_with_a_preload_stay(seed: int) -> None:
    random = np.random.default_rng(seed)
    preload, friction = random.uniform(150.0, 400.0), random.uniform(8.0, 20.0)
    half = 104.5 / 12.0
    t = np.arange(0.0, 6.0 * half, 0.1) + random.uniform(0.0, 0.1)
    x, way = (
        -9.5 + 12.0 * (half - np.abs(t % (2.0 * half) - half)),
        np.where(t % (2.0 * half) < half, 1.0, -1.0),
    )
    spring = preload / (1.0 - 0.0025 * np.maximum(x, 0.0)) + friction * way
    force = np.clip(x / 0.5, 0.0, 1.0) * spring + random.normal(0.0, 0.5, len(x))
    model = palpate.identify(np.round(x, 2), 10.0 * np.round(10.2 * force))
    assert not any("wrong" in each for each in model.notes["rows"])


@pytest.mark.full
def test_the_largest_forces_of_the_fastest_press_of_a_relaxing_object_stay() -> None:
    random, corners = np.random.default_rng(3), [(0.0, -1.2)]
    stiffness, tau = np.array([0.117, 0.05]), np.array([0.52, 5.9])
    for speed in (0.3, 1.0, 3.0):
        for place, wait in ((8.0 * random.uniform(0.97, 1.0), 4.0), (-1.2, 3.0)):
            before, at = corners[-1]
            arrived = before + abs(place - at) / (4.0 * speed)
            corners += [(arrived, place), (arrived + wait, place)]
    t = np.arange(0.0, corners[-1][0], 0.02)
    x = np.interp(t, *np.transpose(corners))
    depth, state, relaxing = np.maximum(x, 0.0), np.zeros(2), np.zeros(len(t))
    left = np.exp(-0.02 / tau)
    for row, step in enumerate(np.diff(depth, prepend=0.0)):
        state = left * state + stiffness * step * tau / 0.02 * (1.0 - left)
        relaxing[row] = state.sum()
    force = np.where(x > 0.0, np.maximum(0.5 * np.expm1(0.35 * depth) + relaxing, 0.0), 0.0)
    model = palpate.identify(x, force + random.normal(0.0, 0.005, len(t)), time=t)
    assert model.memory is not None
    assert not any("wrong" in each for each in model.notes["rows"])

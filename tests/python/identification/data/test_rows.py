# SPDX-License-Identifier: Apache-2.0
"""Inputs by name and positions modulo a period."""

import json
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import palpate
from palpate import InputError, Model, Recording, identify, load_model, read_recording, verify
from palpate.cli.main import main
from palpate.identification import IdentifyOptions, SearchOptions, fit_environment
from palpate.identification.data.rows import Rows, modulo, rows_of


def hunt_crossley(x: np.ndarray, v: np.ndarray) -> np.ndarray:
    return 800.0 * np.maximum(x, 0.0) ** 1.5 * (1.0 + 1.2 * v)


def contact(seed: int, n: int = 4000) -> Recording:
    random = np.random.default_rng(seed)
    x, v = random.uniform(-0.002, 0.01, n), random.uniform(-0.2, 0.2, n)
    force = hunt_crossley(x, v)
    noisy = force + random.normal(0.0, 0.01 * force.std(), n)
    return Recording.from_arrays(x, noisy, inputs={"velocity": v}, units={"position": "m", "force": "N"})


def test_a_force_of_position_and_velocity_is_identified_and_verified_on_fresh_data() -> None:
    model = identify(contact(0), max_wavelets=6)
    assert (model.kind, model.inputs, model.fit.model_class) == (
        "position_velocity",
        ("position", "velocity"),
        "velocity",
    )
    assert model.n_parameters == 5 * model.n_wavelets + 3
    random = np.random.default_rng(9)
    X = random.uniform([-0.002, -0.2], [0.01, 0.2], (5000, 2))
    truth = hunt_crossley(*X.T)
    assert np.sqrt(np.mean((model.predict(X) - truth) ** 2)) < 0.004 * truth.std()
    fresh = verify(model, contact(1))
    assert fresh.fresh
    assert fresh.nrmse == pytest.approx(0.01, rel=0.1)


def test_refinement_gives_each_input_a_separate_dilation() -> None:
    random = np.random.default_rng(1)
    X = random.uniform(0.0, 1.0, (1500, 2))
    r2 = (20.0 * (X[:, 0] - 0.4)) ** 2 + (4.0 * (X[:, 1] - 0.6)) ** 2
    y = (r2 - 2.0) * np.exp(-0.5 * r2) + random.normal(0.0, 0.01, len(X))
    network = fit_environment(X, y)
    assert len(network.weight) == 1
    assert network.alpha[0] == pytest.approx([20.0, 4.0], rel=0.02)
    assert network.beta[0] == pytest.approx([0.4, 0.6], abs=0.005)


def test_input_without_influence_gets_no_wavelet() -> None:
    random = np.random.default_rng(2)
    X = random.uniform(0.0, 1.0, (600, 3))
    network = fit_environment(X, 3.0 * X[:, 0] - X[:, 1] + random.normal(0.0, 0.1, len(X)))
    assert (network.model_class, len(network.weight), network.n_parameters) == ("linear", 0, 4)


def test_six_inputs_and_many_rows_need_no_grid() -> None:
    random = np.random.default_rng(3)
    X = random.uniform(-1.0, 1.0, (12_000, 6))
    truth = np.exp(-2.0 * (X[:, 0] ** 2 + X[:, 3] ** 2)) + 0.5 * X[:, 1]
    network = fit_environment(
        X,
        truth + random.normal(0.0, 0.02, len(X)),
        None,
        IdentifyOptions(max_wavelets=4, search=SearchOptions(max_positions=64, max_candidates=1024)),
    )
    assert network.errors.nrmse < 0.5
    assert any("rows are used, evenly spread" in note for note in network.log.rows)


def test_columns_are_named_as_in_the_file_and_their_units_converted(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    for seed, name in enumerate(("a.csv", "b.csv")):
        random = np.random.default_rng(seed)
        depth, place = random.uniform(0.0, 3.0, 500), random.uniform(0.0, 40.0, 500)
        force = depth * (1.0 + 0.5 * np.exp(-(((place - 20.0) / 6.0) ** 2))) + random.normal(0, 0.02, 500)
        rows = np.column_stack([place, depth, force])
        np.savetxt(name, rows, delimiter=",", header="place_mm,depth_mm,force_N", comments="")
    reading = ["--position", "depth_mm"]
    assert main(["identify", "a.csv", *reading, "--inputs", "position,place_mm", "-o", "m.json"]) == 0
    model = palpate.load_model("m.json")
    assert model.inputs == ("position", "place_m")
    assert model.upper[1] == pytest.approx(0.04, rel=0.05)
    capsys.readouterr()
    assert main(["verify", "m.json", "b.csv", *reading, "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["fresh"] is True
    assert found["nrmse"] < 0.05


def test_velocity_is_derived_from_time_without_a_column() -> None:
    t = np.arange(0.0, 8.0, 1e-3)
    x = 0.5 - 0.5 * np.cos(2.0 * np.pi * (0.5 * t + 0.02 * t**2))
    v = np.gradient(x, t)
    noise = np.random.default_rng(4).normal(0.0, 0.01, len(t))
    recording = Recording.from_arrays(x, 2.0 * x + 0.3 * v + noise, time=t)
    model = identify(recording, inputs="position,velocity")
    assert (model.kind, model.n_wavelets) == ("position_velocity", 0)
    assert model.linear == pytest.approx([2.0, 0.3], rel=5e-3)
    assert verify(model, recording).rmse == pytest.approx(0.01, rel=0.05)


@pytest.mark.parametrize(
    ("inputs", "reported"),
    [
        ("position,place", "has no input place, only position, velocity; read the recording with"),
        ("position,hysteresis,velocity", "hysteresis needs position as the only other input"),
        ("position,position", "inputs is 'position,position'"),
        ("velocity", r"inputs is 'velocity'; .* \(position,velocity; velocity needs time\)"),
    ],
)
def test_unavailable_input_is_refused_in_one_sentence(inputs: str, reported: str) -> None:
    with pytest.raises(InputError, match=reported):
        identify(contact(0, 100), inputs=inputs)


def test_a_velocity_without_time_is_refused() -> None:
    x = np.linspace(0.0, 1.0, 100)
    with pytest.raises(
        InputError, match="velocity needs time, and the recording has no time: name its column"
    ):
        identify(Recording.from_arrays(x, x), inputs="position,velocity")


def test_hysteresis_is_not_tested_if_one_recording_lacks_direction() -> None:
    x = np.concatenate([np.linspace(0.0, 1.0, 200), np.linspace(1.0, 0.0, 200)])
    side = np.repeat([1.0, -1.0], 200)
    force = x + 0.2 * side + np.random.default_rng(0).normal(0.0, 0.01, 400)
    stated = Recording.from_arrays(x, force, direction=side)
    order = np.random.default_rng(1).permutation(400)
    shuffled = Recording.from_arrays(x[order], force[order])
    model = identify([stated, shuffled])
    assert "hysteresis: not tested (the rows of recording 2 have no direction" in str(
        model.notes["model_selection"]
    )
    assert model.verdict.level == "no"
    assert identify([stated, stated]).kind == "hysteresis"
    assert identify([stated, Recording.from_arrays(x, force)]).kind == "hysteresis"


@pytest.mark.full
def test_measured_probing_of_organs_is_a_force_of_depth_and_place(data: Path) -> None:
    """The models have three inputs (depth and two coordinates of the place); every fifth row is held out."""
    errors = []
    for path in sorted((data / "organ_probing").glob("*.csv"))[::3]:
        recording = palpate.read_recording(
            path, position="depth_mm", force="normal_force_N", inputs=("contact_x_mm", "contact_y_mm")
        )
        train, test = recording.split(5)
        errors.append(verify(identify(train), test).nrmse)
    assert np.median(errors) < 0.4


TURN = 2.0 * np.pi


def knob(turns: float, n: int = 400, *, end: bool = False, seed: int = 0) -> Recording:
    """Returns one revolution with seven detents from 0.3 rad on; without `end` the last step is missing."""
    x = 0.3 + np.linspace(0.0, turns * TURN, n, endpoint=end)
    force = np.sin(7.0 * x) + 0.3 * np.cos(x) + np.random.default_rng(seed).normal(0.0, 0.01, n)
    return Recording.from_arrays(x, force)


def test_period_with_a_missing_step_is_closed_and_the_gap_reported(tmp_path: Path) -> None:
    model = identify(knob(1.0), period=TURN)
    assert float(model.upper[0] - model.lower[0]) == pytest.approx(TURN, rel=1e-12)
    assert model.fit.nrmse < 0.03
    (note,) = (
        note
        for note in model.notes["identification"]
        if note.startswith("The positions leave a gap of 0.01571")
    )
    assert "0.25 % of the period" in note
    assert model.verdict.level == "good"
    again = load_model(model.save(tmp_path / "knob.json"))
    assert again.period == TURN


@pytest.mark.parametrize("turns", [1.0, 2.3])
def test_the_force_is_continuous_over_the_seam(turns: float) -> None:
    model = identify(knob(turns, int(400 * turns)), period=TURN)
    network = {name: getattr(model, name) for name in ("alpha", "beta", "weight", "linear", "bias")}
    lower, upper = float(model.lower[0]), float(model.upper[0])

    def evaluated(x: float) -> float:
        u = (network["alpha"] * (x - network["beta"]))[:, 0]
        is_hat = np.arange(len(u)) < len(u) - model.harmonics
        wavelets = np.where(is_hat, (u * u - 1.0) * np.exp(-0.5 * u * u), np.cos(u))
        return float(network["weight"] @ wavelets + network["linear"][0] * x + network["bias"])

    assert evaluated(upper) == pytest.approx(evaluated(lower), abs=1e-7)
    x = np.linspace(lower - 1.0, upper + 1.0, 3000)
    assert np.abs(model.force(x) - np.sin(7.0 * x) - 0.3 * np.cos(x)).max() < 0.1
    assert verify(model, knob(1.7, 900, seed=5)).nrmse < 0.03


def test_data_longer_than_a_period_are_taken_modulo_the_period() -> None:
    model = identify(knob(2.3, 1200), period=TURN)
    assert any("span 2.298 periods" in note for note in model.notes["identification"])
    assert verify(model, knob(3.0, 1000, seed=1)).extrapolated == 0


@cache
def forth_and_back() -> tuple[Recording, Model]:
    """Returns two revolutions of a knob with friction forth and back, and their model."""
    time = 2e-3 * np.arange(4000)
    x = TURN * (1.0 - np.cos(2.0 * np.pi * time / 4.0))
    friction = 0.2 * np.sign(np.gradient(x))
    force = np.sin(3.0 * x) + friction + np.random.default_rng(2).normal(0.0, 0.01, len(x))
    recording = Recording.from_arrays(x, force, time)
    return recording, identify(recording, period=TURN)


def test_hysteresis_of_a_knob_follows_the_motion_and_not_the_wrapped_position() -> None:
    """The play operator must not jump where the position wraps to zero."""
    _, model = forth_and_back()
    assert model.kind == "hysteresis"
    # NRMSE 0.2: the play operator jumps at the end of the period; 0.05: friction with a smaller play radius
    assert model.fit.nrmse < 0.06


def test_the_force_stays_near_the_recorded_range_where_a_stroke_has_no_rows() -> None:
    """The motion reverses at the start of the play: the rows contain no pressed force there."""
    recording, model = forth_and_back()
    span = float(np.ptp(recording.force))
    q = np.linspace(0.0, 0.02, 200)
    largest = max(np.abs(model.force(q, direction=np.full(200, side))).max() for side in (1.0, -1.0))
    assert largest < 1.2 * span


@pytest.mark.parametrize(("missing", "level"), [(0.02, "good"), (0.2, "usable"), (0.7, "no")])
def test_a_part_of_the_period_without_rows_is_a_finding(missing: float, level: str) -> None:
    verdict = identify(knob(1.0 - missing), period=TURN, max_wavelets=6).verdict
    assert verdict.level == level
    assert any("no position lies between" in reason for reason in verdict.reasons) == (level != "good")


def test_a_period_of_several_inputs_is_refused() -> None:
    random = np.random.default_rng(0)
    X = random.uniform(0.0, 1.0, (200, 2))
    with pytest.raises(
        InputError, match="the inputs are position, load: period needs position as the only input"
    ):
        fit_environment(X, X.sum(axis=1), None, IdentifyOptions(period=1.0), names=("position", "load"))


@pytest.mark.full
def test_measured_turns_are_identified_with_their_period(data: Path) -> None:
    for path in sorted((data / "motor_cogging").glob("map_*.csv")):
        kept, held = read_recording(path, position="angle_rad", force="hold_current_A").split(5)
        model = identify(kept, period=6.283185307179586)
        assert model.period == 6.283185307179586, path.name
        assert verify(model, held).nrmse < 1.3 * verify(identify(kept), held).nrmse, path.name


def test_positions_modulo_the_period_are_below_one() -> None:
    assert modulo(np.array([-1e-17, -0.25, 0.0, 1.0, 2.75])).tolist() == [0.0, 0.75, 0.0, 0.0, 0.75]


def test_fewer_rows_keep_their_share_of_the_scatter_within_a_row() -> None:
    rows = Rows(("position",), np.arange(6.0)[:, None], np.zeros(6), within=3.0)
    kept = np.array([True, True, True, True, False, False])
    assert rows.only(kept).within == pytest.approx(2.0)
    weighted = Rows(("position",), np.arange(6.0)[:, None], np.zeros(6), weight=np.arange(6.0), within=3.0)
    assert weighted.only(kept).within == pytest.approx(3.0 * 6.0 / 15.0)


@pytest.mark.parametrize(("first", "starts"), [(25, (0,)), (75, (0, 75))], ids=["moves on", "turns"])
def test_a_play_follows_a_motion_over_a_gap_in_which_the_tool_moves_on(
    first: int, starts: tuple[int]
) -> None:
    time = 0.01 * np.arange(400)
    position = 0.5 - 0.5 * np.cos(np.pi * time)
    kept = np.delete(np.arange(400), slice(first, first + 50))
    recording = Recording.from_arrays(position[kept], position[kept], time=time[kept])
    assert rows_of([recording], IdentifyOptions()).starts == starts


@pytest.mark.parametrize(("pause_s", "starts"), [(0.01, (0,)), (1.0, (0, 100))], ids=["goes on", "later"])
def test_a_play_follows_a_motion_from_file_to_file(pause_s: float, starts: tuple[int]) -> None:
    time = 0.01 * np.arange(200)
    position = 0.5 - 0.5 * np.cos(np.pi * time)
    time[100:] += pause_s - 0.01
    position[100:] += 0.1 * (pause_s - 0.01)  # the tool moved during the pause
    parts = [
        Recording.from_arrays(position[rows], position[rows], time=time[rows])
        for rows in (slice(100), slice(100, 200))
    ]
    assert rows_of(parts, IdentifyOptions()).starts == starts

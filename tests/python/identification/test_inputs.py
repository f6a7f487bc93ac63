# SPDX-License-Identifier: Apache-2.0
"""A force of several inputs, from the file to the verified model."""

import json
from pathlib import Path

import numpy as np
import pytest

import palpate
from palpate import InputError, Recording, identify, verify
from palpate.cli.main import main
from palpate.identification import IdentifyOptions, SearchOptions, fit_environment


def hunt_crossley(x: np.ndarray, v: np.ndarray) -> np.ndarray:
    return 800.0 * np.maximum(x, 0.0) ** 1.5 * (1.0 + 1.2 * v)


def contact(seed: int, n: int = 4000) -> Recording:
    random = np.random.default_rng(seed)
    x, v = random.uniform(-0.002, 0.01, n), random.uniform(-0.2, 0.2, n)
    force = hunt_crossley(x, v)
    noisy = force + random.normal(0.0, 0.01 * force.std(), n)
    return Recording.from_arrays(x, noisy, inputs={"velocity": v}, units={"position": "m", "force": "N"})


def test_a_force_of_position_and_velocity_is_identified_and_verified_on_fresh_data() -> None:
    model = identify(contact(0))
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


def test_each_input_has_a_dilation_of_its_own_after_refinement() -> None:
    random = np.random.default_rng(1)
    X = random.uniform(0.0, 1.0, (3000, 2))
    r2 = (20.0 * (X[:, 0] - 0.4)) ** 2 + (4.0 * (X[:, 1] - 0.6)) ** 2
    y = (r2 - 2.0) * np.exp(-0.5 * r2) + random.normal(0.0, 0.01, len(X))
    network = fit_environment(X, y)
    assert len(network.weight) == 1
    assert network.alpha[0] == pytest.approx([20.0, 4.0], rel=0.02)
    assert network.beta[0] == pytest.approx([0.4, 0.6], abs=0.005)


def test_an_input_without_influence_earns_no_wavelet() -> None:
    random = np.random.default_rng(2)
    X = random.uniform(0.0, 1.0, (2000, 3))
    network = fit_environment(X, 3.0 * X[:, 0] - X[:, 1] + random.normal(0.0, 0.1, len(X)))
    assert (network.model_class, len(network.weight), network.n_parameters) == ("linear", 0, 4)


def test_six_inputs_and_many_rows_need_no_grid() -> None:
    random = np.random.default_rng(3)
    X = random.uniform(-1.0, 1.0, (30_000, 6))
    truth = np.exp(-2.0 * (X[:, 0] ** 2 + X[:, 3] ** 2)) + 0.5 * X[:, 1]
    network = fit_environment(
        X,
        truth + random.normal(0.0, 0.02, len(X)),
        None,
        IdentifyOptions(max_wavelets=6, search=SearchOptions(max_positions=64)),
    )
    assert network.nrmse < 0.5
    assert any("evenly spread, stand for all of them" in note for note in network.notes)


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


def test_velocity_comes_from_time_where_it_is_no_column() -> None:
    t = np.arange(0.0, 20.0, 1e-3)
    x = 0.5 - 0.5 * np.cos(2.0 * np.pi * (0.5 * t + 0.02 * t**2))
    v = np.gradient(x, t)
    noise = np.random.default_rng(4).normal(0.0, 0.01, len(t))
    recording = Recording.from_arrays(x, 2.0 * x + 0.3 * v + noise, time=t)
    model = identify(recording, inputs="position,velocity")
    assert (model.kind, model.n_wavelets) == ("position_velocity", 0)
    assert model.linear == pytest.approx([2.0, 0.3], rel=5e-3)
    assert verify(model, recording).rmse == pytest.approx(0.01, rel=0.05)


@pytest.mark.parametrize(
    ("inputs", "told"),
    [
        ("position,place", "has no input place, only position, velocity; read the recording with"),
        ("position,hysteresis,velocity", "hysteresis is identified over position alone"),
        ("position,position", "inputs is 'position,position'"),
    ],
)
def test_an_input_that_cannot_be_had_is_refused_in_one_sentence(inputs: str, told: str) -> None:
    with pytest.raises(InputError, match=told):
        identify(contact(0, 100), inputs=inputs)


def test_a_velocity_without_time_is_refused() -> None:
    x = np.linspace(0.0, 1.0, 100)
    with pytest.raises(InputError, match="velocity needs time"):
        identify(Recording.from_arrays(x, x), inputs="position,velocity")


def test_strokes_that_one_recording_does_not_state_leave_hysteresis_untested_and_say_so() -> None:
    x = np.concatenate([np.linspace(0.0, 1.0, 200), np.linspace(1.0, 0.0, 200)])
    side = np.repeat([1.0, -1.0], 200)
    force = x + 0.2 * side + np.random.default_rng(0).normal(0.0, 0.01, 400)
    stated = Recording.from_arrays(x, force, direction=side)
    order = np.random.default_rng(1).permutation(400)
    shuffled = Recording.from_arrays(x[order], force[order])
    told = str(identify([stated, shuffled]).verdict)
    assert "hysteresis was not tested: recording 2 has no direction" in told
    assert identify([stated, stated]).kind == "hysteresis"
    assert identify([stated, Recording.from_arrays(x, force)]).kind == "hysteresis"


def test_measured_probing_of_organs_is_a_force_of_depth_and_place(data: Path) -> None:
    """Three inputs; every fifth row held out."""
    errors = []
    for path in sorted((data / "organ_probing").glob("*.csv"))[::3]:
        recording = palpate.read_recording(
            path, position="depth_mm", force="normal_force_N", inputs=("contact_x_mm", "contact_y_mm")
        )
        train, test = recording.split(5)
        errors.append(verify(identify(train), test).nrmse)
    assert np.median(errors) < 0.4

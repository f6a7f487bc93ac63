# SPDX-License-Identifier: Apache-2.0
"""A flight record of a model with hysteresis is verified with the play operator of the rendering."""

import json
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from control_program import control, needs_program
from models_by_hand import model_by_hand
from palpate import Model, Recording, identify, read_recording, verify
from palpate.cli.main import main
from palpate.verification.prediction import flight_of

UNITS = {"position": "m", "force": "N"}


@cache
def keyswitch() -> Model:
    """Returns a switch that is pressed and released: the file states directions, and no play radius."""
    x = np.concatenate([np.linspace(0.0, 4e-3, 400), np.linspace(4e-3, 0.0, 400)])
    side = np.repeat([1, -1], 400)
    force = 120.0 * x + 0.1 * np.exp(-(((x - 2e-3) / 4e-4) ** 2)) + side * 0.05
    force = force + np.random.default_rng(0).normal(0.0, 1e-3, len(x))
    return identify(Recording.from_arrays(x, force, direction=side, units=UNITS))


@needs_program
@pytest.mark.parametrize(("structure", "predict"), [("direct", 0), ("massless", 0), ("direct", 4)])
def test_a_flight_record_of_a_model_with_hysteresis_is_verified(
    structure: str, predict: int, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    model = keyswitch()
    assert model.kind == "hysteresis"
    assert model.play_radius is None
    model.save(tmp_path / "k.json")
    out = tmp_path / "again.csv"
    words = ["--duration-s", 2, "--record", out, "--structure", structure, "--predict", predict]
    answer = control(tmp_path / "k.json", *words)
    assert answer.returncode == 0, answer.stderr
    assert main(["verify", str(tmp_path / "k.json"), str(out), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["nrmse"] < 1e-6
    assert main(["verify", str(tmp_path / "k.json"), str(out), "--verbose"]) == 0
    assert "that of the flight record" in " ".join(capsys.readouterr().out.split())
    wrong = verify(model, read_recording(out), play_radius=4e-4)
    assert wrong.nrmse > 0.01


def test_other_recordings_have_no_flight_record_statements() -> None:
    recording = Recording.from_arrays(np.arange(20.0), np.arange(20.0), metadata={"hand": "r = 3"})
    assert flight_of(recording).play_radius is None
    assert flight_of(recording).object_position is None


@needs_program
def test_a_flight_record_of_a_prediction_is_compared_at_the_predicted_position(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    model_by_hand().save(tmp_path / "m.json")
    out = tmp_path / "felt.csv"
    answer = control(tmp_path / "m.json", "--duration-s", 2, "--record", out, "--predict", 4)
    assert answer.returncode == 0, answer.stderr
    assert read_recording(out).metadata["structure"] == "direct, predict 4"
    assert main(["verify", str(tmp_path / "m.json"), str(out), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["nrmse"] < 1e-6
    assert main(["verify", str(tmp_path / "m.json"), str(out), "--verbose"]) == 0
    assert "predicted half a sample ahead of the handle" in " ".join(capsys.readouterr().out.split())

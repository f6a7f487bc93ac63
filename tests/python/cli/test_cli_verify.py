# SPDX-License-Identifier: Apache-2.0
"""palpate verify and palpate show: numbers, figures, and messages about wrong model files."""

import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure

from conftest import ROOT
from models_by_hand import keyswitch_by_hand, model_by_hand
from palpate import Recording, load_model, read_recording, verify
from palpate.cli.figures import close_loops, picture_closed_loops, picture_verification
from palpate.cli.main import main

JSON_FIELDS = [
    "nrmse",
    "settled_nrmse",
    "rmse",
    "mse",
    "r2",
    "worst",
    "within_jnd",
    "within_band",
    "n",
    "fresh",
]
JSON_FIELDS += ["extrapolated", "verdict", "units"]
UNITS = {"position": "rad", "force": "N*m"}


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Returns a folder with a model and a recording whose force is the model's force plus noise."""
    monkeypatch.chdir(tmp_path)
    model = model_by_hand()
    model.save("m.json")
    random = np.random.default_rng(0)
    time = np.arange(2000) * 1e-3
    position = 0.25 - 0.25 * np.cos(2 * np.pi * time)
    force = model.force(position) + random.normal(0.0, 0.01, time.size)
    Recording.from_arrays(position, force, time, units=UNITS).write("a.csv")
    return tmp_path


def test_the_share_of_rows_in_the_band_is_printed(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    load_model(ROOT / "tests" / "models" / "good" / "band.json").save("band.json")
    model = load_model("band.json")
    position = np.linspace(0.0, 0.6, 200)
    offset = np.where(position < 0.3, 0.0, 0.1)
    Recording.from_arrays(position, model.force(position) + offset, units=UNITS).write("b.csv")
    main(["verify", "band.json", "b.csv", "--plot", "b.png"])
    assert "band" in capsys.readouterr().out
    main(["verify", "band.json", "b.csv", "--json"])
    assert json.loads(capsys.readouterr().out)["within_band"] == 0.5
    main(["show", "band.json"])
    printed = " ".join(capsys.readouterr().out.split())
    assert "95% band of a further recording of the same object: +- 0.01 to 0.03 N*m" in printed
    assert "RMS error 0.008 N*m, 93.8% of its rows in the band" in printed
    main(["show", "band.json", "--json"])
    assert json.loads(capsys.readouterr().out)["band"]["repeat"] == [0.01, 0.03]
    assert main(["report", "band.json", "b.csv", "-o", "b.html"]) == 0
    assert "The grey band should contain 95% of the rows of a further recording" in Path("b.html").read_text()


def test_numbers_go_to_standard_output_and_progress_to_standard_error(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["verify", "m.json", "a.csv"]) == 0
    captured = capsys.readouterr()
    assert captured.err.startswith("read a.csv: 2000 rows; position is position_rad")
    assert [line.split()[0] for line in captured.out.splitlines()][:5] == [
        "verdict:",
        "error",
        "largest",
        "felt",
        "rows",
    ]
    assert "fresh" in captured.out


def test_only_held_out_rows_of_the_identified_recording_are_compared(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["identify", "a.csv", "-o", "own.json", "--hold-out-every", "5"]) == 0
    capsys.readouterr()
    assert main(["verify", "own.json", "a.csv", "--plot-closed-loop", "loop.png"]) == 0
    captured = capsys.readouterr()
    assert "the model was identified on the other rows: every 5th row is compared" in captured.err
    assert "400 of 400 compared" in captured.out
    assert "recording  held-out rows, new to the model\n" in captured.out
    assert captured.out.startswith("verdict: good\n")


def test_the_named_cause_is_not_an_input_that_the_model_has(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    model = keyswitch_by_hand()
    model.save("key.json")
    lower, upper = float(model.lower[0]), float(model.upper[0])
    position = np.concatenate([np.linspace(lower, upper, 500), np.linspace(upper, lower, 500)])
    direction = np.repeat([1, -1], 500)
    phase = 12.0 * (position - lower) / (upper - lower)
    force = model.force(position, direction=direction) * (1.0 + 0.5 * np.sin(phase))
    Recording.from_arrays(position, force, direction=direction, units=model.units).write("other.csv")
    main(["verify", "key.json", "other.csv"])
    printed = " ".join(capsys.readouterr().out.split())
    assert "its zero position is not the same" in printed
    assert "such as velocity, memory or another column" in printed


def test_json_is_one_object_with_the_fields_of_the_contract(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["verify", "m.json", "a.csv", "--json"]) == 0
    result = json.loads(capsys.readouterr().out)
    assert list(result) == JSON_FIELDS
    expected = verify(load_model("m.json"), read_recording("a.csv"))
    assert result["nrmse"] == expected.nrmse
    assert result["fresh"] is True
    assert result["n"] == 2000
    assert result["units"] == UNITS


def test_identify_and_verify_print_one_error(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The friction reverses over a tenth of the travel as no play operator does."""
    time = np.arange(0.0, 8.0, 0.008)
    x = np.abs((time / 2.0 + 1.0) % 2.0 - 1.0)
    way = np.where(np.gradient(x) > 0.0, 1.0, -1.0)
    since = np.where(way > 0.0, x, 1.0 - x)
    side = way * np.where(time < 1.0, 1.0, 1.0 - 2.0 * np.exp(-((since / 0.08) ** 5)))
    noise = np.random.default_rng(0).normal(0.0, 0.001, len(x))
    Recording.from_arrays(x, 0.02 * x + 0.1 * side + noise, time, units=UNITS).write("f.csv")
    errors = []
    for command in (["identify", "f.csv", "-o", "f.json"], ["verify", "f.json", "f.csv"]):
        main(command)
        printed = " ".join(capsys.readouterr().out.split())
        found = re.search(r"NRMSE (\S+) on .*?, (\S+) if rows that wait or in which", printed)
        assert found is not None
        errors.append([float(each) for each in found.groups()])
    np.testing.assert_allclose(*errors, rtol=1e-3)
    assert errors[0][0] > 0.1 > errors[0][1]


def test_a_verdict_of_no_exits_with_code_1_and_names_the_cure(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["verify", "m.json", "a.csv", "--negate", "force"]) == 1
    assert capsys.readouterr().out.startswith("verdict: no\n")
    assert main(["verify", "m.json", "a.csv", "--negate", "force", "--json"]) == 1
    verdict = json.loads(capsys.readouterr().out)["verdict"]
    assert verdict.startswith("no: the NRMSE on 2000 rows is ")
    assert "give --negate force" in verdict


def test_both_figures_are_drawn(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    arguments = ["verify", "m.json", "a.csv", "--plot", "a.png", "--plot-closed-loop", "b.pdf"]
    assert main(arguments) == 0
    assert Path("a.png").read_bytes().startswith(b"\x89PNG")
    assert Path("b.pdf").read_bytes().startswith(b"%PDF")
    assert "force-driven, explicit, m = 0.001, B_o = 0.5" in capsys.readouterr().out


@pytest.mark.parametrize(("metadata", "name"), [({"simulated": "yes"}, "simulated data"), ({}, "measured")])
def test_a_simulated_recording_is_never_called_measured(
    metadata: dict[str, str], name: str, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    recording = replace(read_recording("a.csv"), metadata=metadata)
    model = load_model("m.json")
    legends: list[str] = []

    def record_legends(figure: Figure, *_: Any, **__: Any) -> None:
        captured = [*figure.legends, *(axes.get_legend() for axes in figure.axes)]
        legends.extend(text.get_text() for legend in captured if legend for text in legend.get_texts())

    monkeypatch.setattr(Figure, "savefig", record_legends)
    picture_verification(Path("a.png"), model, [(recording, verify(model, recording))])
    assert legends == [name, "model"]
    legends.clear()
    picture_closed_loops(Path("b.png"), recording, close_loops(model, recording))
    assert set(legends) == {"recorded (simulated)" if metadata else "recorded", "rendered"}


def test_a_recording_with_strokes_is_drawn(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    keyswitch = keyswitch_by_hand()
    keyswitch.save("k.json")
    direction = np.repeat([1, 0, -1], 100)
    position = np.concatenate([np.linspace(0, 0.004, 100), np.full(100, 0.004), np.linspace(0.004, 0, 100)])
    force = keyswitch.force(position, direction=direction.astype(float))
    units = {"position": "m", "force": "N"}
    Recording.from_arrays(position, force, direction=direction, units=units).write("k.csv")
    assert main(["verify", "k.json", "k.csv", "--plot", "k.png", "--plot-closed-loop", "l.png"]) == 0
    captured = capsys.readouterr()
    assert "assumed" in captured.out, "a stroke speed without a measurement is called assumed"
    assert Path("k.png").exists()
    assert Path("l.png").exists()


def test_two_figures_with_one_name_are_refused(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    arguments = ["verify", "m.json", "a.csv", "--plot", "a.png", "--plot-closed-loop", "a.png"]
    assert main(arguments) == 2
    assert "two results" in capsys.readouterr().err


def test_units_that_do_not_match_are_reported_in_one_sentence(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    keyswitch_by_hand().save("k.json")
    assert main(["verify", "k.json", "a.csv", "--json"]) == 2
    assert "the position of the model is in m" in json.loads(capsys.readouterr().out)["error"]


def with_changed_field(content: dict[str, Any], path: str, value: Any) -> str:
    """Returns a model file with one field changed; the value None removes the field."""
    *parents, last_name = path.split(".")
    parent = content
    for name in parents:
        parent = parent[name]
    if value is None:
        del parent[last_name]
    else:
        parent[last_name] = value
    return json.dumps(content)


BAD_FIELDS = {
    "missing field": ("network.bias", None, "network.bias"),
    "alpha <= 0": ("network.alpha", [[-20.0]], "-20"),
    "unknown version": ("version", 99, "99"),
    "unknown key": ("colour", "red", "colour"),
    "another format": ("format", "stone-tablet", "stone-tablet"),
    "wrong shape": ("network.weight", [0.1, 0.2], "network.weight"),
}


@pytest.mark.parametrize("verb", ["show bad.json", "simulate bad.json", "verify bad.json a.csv"])
@pytest.mark.parametrize("case", BAD_FIELDS)
def test_a_bad_model_is_reported_in_one_sentence_that_names_the_field(
    case: str, verb: str, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path, value, expected = BAD_FIELDS[case]
    Path("bad.json").write_text(with_changed_field(json.loads(Path("m.json").read_text()), path, value))
    assert main(verb.split()) == 2
    captured = capsys.readouterr()
    sentence = captured.err.splitlines()[-1]
    assert sentence.startswith("error: bad.json")
    assert expected in sentence
    assert captured.out == ""


@pytest.mark.parametrize("content", ["", "not json", "[1, 2", "NaN", '{"format": NaN}'])
def test_a_model_file_without_valid_json_is_reported_in_one_sentence(
    content: str, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    Path("bad.json").write_text(content)
    assert main(["show", "bad.json"]) == 2
    error = capsys.readouterr().err
    assert error.startswith("error: bad.json")
    assert error.count("\n") == 1


def test_show_prints_the_text_form_of_the_model(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["show", "m.json"]) == 0
    assert capsys.readouterr().out == f"{model_by_hand()}\n"

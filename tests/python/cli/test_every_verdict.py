# SPDX-License-Identifier: Apache-2.0
"""The verdict of every verb is the first printed line, a field of the --json output, and in the exit code."""

import json
from pathlib import Path

import pytest

from models_by_hand import model_by_hand
from palpate.cli.main import main
from palpate.verdict import LEVELS, Verdict, no
from test_cli_identify import spring
from test_every_verb import VERBS


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    spring(tmp_path / "a.csv")
    model_by_hand().save("m.json")
    return tmp_path


@pytest.mark.parametrize("verb", sorted(VERBS))
def test_the_verdict_is_the_first_line_and_sets_the_exit_code(
    verb: str, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    code = main(VERBS[verb].split())
    captured = capsys.readouterr()
    word, _, level = captured.out.split("\n")[0].partition(": ")
    assert word == "verdict", captured.err
    assert level in LEVELS
    assert code == (1 if level == "no" else 0)


@pytest.mark.parametrize("verb", sorted(VERBS))
def test_the_verdict_is_a_field_of_the_json_object_and_sets_the_exit_code(
    verb: str, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    code = main([*VERBS[verb].split(), "--json"])
    captured = capsys.readouterr()
    level = json.loads(captured.out)["verdict"].partition(":")[0]
    assert level in LEVELS
    assert code == (1 if level == "no" else 0)


def test_show_exits_with_code_1_if_the_verdict_of_the_identification_is_no(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    model = model_by_hand()
    model.notes["verdict"] = Verdict((no("the model explains 20% of the force"),)).record()
    model.save("bad.json")
    assert main(["show", "bad.json"]) == 1
    assert capsys.readouterr().out.startswith("verdict: no\n  the model explains 20% of the force\n")
    assert main(["show", "bad.json", "--json"]) == 1
    assert json.loads(capsys.readouterr().out)["verdict"] == "no: the model explains 20% of the force"


def test_show_prints_one_json_object_with_the_fields_of_the_model(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    model = model_by_hand()
    assert main(["plan", "m.json", "--device", "bench-knob", "-o", "planned.json"]) == 0
    capsys.readouterr()
    assert main(["show", "planned.json", "--json"]) == 0
    captured = json.loads(capsys.readouterr().out)
    assert captured["verdict"] == "good"
    assert captured["units"] == {"position": "rad", "force": "N*m"}
    assert captured["domain"] == {"lower": [0.0], "upper": [0.5]}
    assert captured["fit"]["nrmse"] == model.fit.nrmse
    assert captured["fit"]["n_wavelets"] == len(captured["network"]["weight"]) == model.n_wavelets
    assert captured["plan"]["device"] == "bench-knob"
    assert main(["show", "m.json", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["plan"] is None


def test_a_difference_that_a_hand_notices_is_reported(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["show", "m.json", "--beside", "m.json"]) == 0
    assert capsys.readouterr().out.startswith("verdict: good\n")
    content = json.loads(Path("m.json").read_text(encoding="utf-8"))
    content["network"]["linear"] = [2.0 * value for value in content["network"]["linear"]]
    content["slope_bounds"] = None
    Path("other.json").write_text(json.dumps(content), encoding="utf-8")
    assert main(["show", "m.json", "--beside", "other.json", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["verdict"].startswith("usable: a hand notices the difference")


@pytest.mark.parametrize(
    ("arguments", "cure"),
    [
        (["verify", "a.csv", "m.json"], "the model comes first: palpate verify m.json a.csv"),
        (["show", "a.csv", "--beside", "m.json"], "a.csv is a recording: identify it first"),
        (["show", "m.json", "--rows", "0:9"], "--rows is an option for recordings, but m.json is a model"),
        (["simulate", "a.csv"], "a model is a .json file that palpate identify writes"),
    ],
    ids=lambda value: value[0] if isinstance(value, list) else "",
)
def test_a_file_in_the_wrong_role_is_named_with_the_cure(
    arguments: list[str], cure: str, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(arguments) == 2
    error = capsys.readouterr().err
    assert error.strip().endswith(cure)
    assert error.count("\n") == 1
    assert len(error) < 200

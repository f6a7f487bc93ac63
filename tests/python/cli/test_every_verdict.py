# SPDX-License-Identifier: Apache-2.0
"""The verdict of every verb is the first printed line, a field of the --json output, and in the exit code."""

import json
from pathlib import Path

import pytest

from conftest import sampled
from control_program import PROGRAM, needs_program, run
from models_by_hand import model_by_hand
from palpate.cli.main import main
from palpate.verdict import LEVELS, Verdict, no, usable
from test_cli_identify import spring
from test_every_verb import VERBS


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    spring(tmp_path / "a.csv")
    model_by_hand().save("m.json")
    return tmp_path


@pytest.mark.parametrize("verb", sampled(sorted(VERBS), *(verb for verb in VERBS if verb != "demo")))
def test_the_verdict_is_the_first_line_and_sets_the_exit_code(
    verb: str, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    code = main(VERBS[verb].split())
    captured = capsys.readouterr()
    word, _, level = captured.out.split("\n")[0].partition(": ")
    assert word == "verdict", captured.err
    assert level in LEVELS
    assert code == (1 if level == "no" else 0)


@pytest.mark.parametrize("verb", sampled(sorted(VERBS), "identify", "verify", "plan", "render"))
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


USES_OF_A_MODEL = {
    "plan": "plan bad.json --device bench-knob",
    "simulate": "simulate bad.json --structure direct --duration-s 4",
    "render": "render bad.json --structure direct --duration-s 0.3",
    "table": "export bad.json --table -o bad.csv",
    "fmu": "export bad.json --fmu -o bad.fmu",
    "c": "export bad.json --c -o bad.h --uncertified --encoder-step 1e-4 --force-limit 3",
}
"""Verbs that plan, render or export a model."""


def refused_model(path: str) -> None:
    """Writes a model whose verdict is no, with a second finding."""
    model = model_by_hand()
    findings = (usable("two rows are odd"), no("the model explains 20% of the force"))
    model.notes["verdict"] = Verdict(findings).record()
    model.save(path)


@pytest.mark.parametrize("use", sorted(USES_OF_A_MODEL))
def test_a_model_with_the_verdict_no_is_used_only_if_that_is_accepted(
    use: str, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    refused_model("bad.json")
    before = sorted(folder.iterdir())
    assert main(USES_OF_A_MODEL[use].split()) == 2
    refusal = (
        "the verdict of bad.json is no: the model explains 20% of the force. Identify a better model, or"
    )
    assert f"{refusal} give --accept-model to use this one" in capsys.readouterr().err
    assert sorted(folder.iterdir()) == before
    main([*USES_OF_A_MODEL[use].split(), "--accept-model", "--json"])
    verdict = json.loads(capsys.readouterr().out)["verdict"]
    assert "accepted although it is no: the model explains 20% of the force" in verdict
    assert "two rows are odd" in verdict


def test_an_accepted_model_is_accepted_by_all_verbs_that_use_its_plan(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    refused_model("bad.json")
    assert main(["plan", "bad.json", "--device", "bench-knob", "--accept-model", "-o", "planned.json"]) == 0
    capsys.readouterr()
    for words in ("simulate planned.json --duration-s 4", "export planned.json --c -o planned.h"):
        assert main([*words.split(), "--json"]) == 0
        verdict = json.loads(capsys.readouterr().out)["verdict"]
        assert verdict.startswith("usable: ")
        assert "accepted although it is no: the model explains 20% of the force" in verdict


@needs_program
def test_the_program_renders_a_model_with_the_verdict_no_only_if_that_is_accepted(folder: Path) -> None:
    refused_model("bad.json")
    words = [PROGRAM, "bad.json", "--structure", "direct", "--duration-s", "0.3", "--ramp-s", "0"]
    refused = run(*words)
    assert refused.returncode == 2
    assert "the verdict of bad.json is no: the model explains 20% of the force" in refused.stderr
    assert "--accept-model" in refused.stderr
    accepted = json.loads(run(*words, "--accept-model", "--json").stdout)["verdict"]
    assert "accepted although it is no: the model explains 20% of the force" in accepted
    assert "two rows are odd" in accepted


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
    assert json.loads(capsys.readouterr().out)["verdict"].startswith("usable: a hand feels the difference on")


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

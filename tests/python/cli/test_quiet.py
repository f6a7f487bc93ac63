# SPDX-License-Identifier: Apache-2.0
"""--quiet prints only the verdict; colours of the verdict; suggestions for misspelt names."""

import json
from collections.abc import Callable
from pathlib import Path

import pytest

from conftest import sampled
from models_by_hand import model_by_hand
from palpate.cli.main import main
from palpate.cli.main import palpate as group
from test_cli_identify import spring
from test_every_verb import VERBS

Terminal = Callable[..., str]

MISSING_INPUT = {
    "identify": "identify none.csv -o out.json",
    "verify": "verify none.json a.csv",
    "plan": "plan none.json --device bench-knob",
    "show": "show none.json",
}


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    spring(tmp_path / "a.csv")
    model_by_hand().save("m.json")
    return tmp_path


@pytest.mark.parametrize("verb", sampled(VERBS, "identify", "verify", "plan", "render"))
def test_quiet_prints_only_the_verdict_and_keeps_the_exit_code(
    verb: str, here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    code = main([*VERBS[verb].split(), "--quiet"])
    captured = capsys.readouterr()
    level = captured.out.removeprefix("verdict: ").rstrip("\n")
    assert level in ("good", "usable", "no"), captured.out
    assert code == (1 if level == "no" else 0)
    assert captured.err == "" or captured.err.startswith("error: ")


@pytest.mark.parametrize("verb", MISSING_INPUT)
def test_errors_are_printed_also_with_quiet(
    verb: str, here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([*MISSING_INPUT[verb].split(), "-q"]) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.startswith("error: there is no file none")


def test_quiet_ends_with_its_verb(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    main(["show", "m.json", "-q"])
    main(["show", "m.json"])
    assert "position model" in capsys.readouterr().out


def test_quiet_prints_no_line_of_progress_on_a_terminal(here: Path, terminal: Terminal) -> None:
    output = terminal(lambda: main(["simulate", "m.json", "--duration-s", "2", "-q"]))
    assert "simulating" not in output
    assert "\r" not in output


def test_json_with_quiet_prints_one_object_and_no_note(
    here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    main(["verify", "m.json", "a.csv", "--json", "--quiet"])
    captured = capsys.readouterr()
    assert "nrmse" in json.loads(captured.out)
    assert captured.err == ""


def test_every_verb_has_the_option_quiet() -> None:
    for verb in VERBS:
        command = group.get_command(None, verb)  # type: ignore[arg-type]
        assert command is not None
        assert any("--quiet" in (*each.opts, *each.secondary_opts) for each in command.params), verb


GREEN = "\x1b[32m"


@pytest.fixture
def colours(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TERM", "xterm-256color")
    monkeypatch.delenv("NO_COLOR", raising=False)


@pytest.mark.usefixtures("colours")
def test_the_verdict_is_coloured_on_a_terminal(here: Path, terminal: Terminal) -> None:
    output = terminal(lambda: main(["show", "m.json"]))
    first, rest = output.split("\n", 1)
    assert first == f"verdict: {GREEN}\x1b[1mgood\x1b[0m"
    assert "\x1b" not in rest
    for level, colour in (("usable", 33), ("no", 31)):
        notes = {"verdict": [{"level": level, "sentence": "a reason"}]}
        model_by_hand(notes=notes).save("other.json")
        expected = f"verdict: \x1b[{colour}m\x1b[1m{level}\x1b[0m\n  a reason\n"
        assert terminal(lambda: main(["show", "other.json"])).startswith(expected)


@pytest.mark.usefixtures("colours")
@pytest.mark.parametrize(("name", "value"), [("NO_COLOR", "1"), ("TERM", "dumb")])
def test_colours_switch_off(
    name: str, value: str, here: Path, terminal: Terminal, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(name, value)
    assert "\x1b" not in terminal(lambda: main(["show", "m.json"]))


@pytest.mark.usefixtures("colours")
def test_an_empty_no_color_keeps_the_colours(
    here: Path, terminal: Terminal, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("NO_COLOR", "")
    assert GREEN in terminal(lambda: main(["show", "m.json"]))


@pytest.mark.usefixtures("colours")
def test_json_and_files_have_no_colours(
    here: Path, terminal: Terminal, capsys: pytest.CaptureFixture[str]
) -> None:
    assert "\x1b" not in terminal(lambda: main(["show", "m.json", "--json"]))
    main(["show", "m.json"])
    assert "\x1b" not in capsys.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "suggestion"),
    [
        ("idenfity a.csv", "there is no verb 'idenfity' (did you mean 'identify'?)"),
        ("check_device", "there is no verb 'check_device' (did you mean 'check-device'?)"),
        ("xyz", "there is no verb 'xyz'; the verbs are identify, verify"),
        ("fit a.csv", "there is no verb 'fit'; use palpate identify"),
        ("plot a.csv", "there is no verb 'plot'; use palpate show --plot FILE.png"),
        ("m.json", "there is no verb 'm.json'; to print a model, use palpate show m.json"),
        ("identify a.csv", "Missing option '-o' / '--output'; add -o MODEL.json"),
        ("verify m.json a.csv --plto p.png", "'--plot'"),
        ("identify a.csv -o o.json --force forse_N.m", "for --force (did you mean '"),
        ("identify a.csv -o o.json --search patiense=3", "(did you mean 'patience'?)"),
    ],
)
def test_a_misspelt_name_gets_a_suggestion(
    arguments: str, suggestion: str, here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(arguments.split()) == 2
    assert suggestion in capsys.readouterr().err


def test_a_misspelt_column_is_suggested_also_in_the_cure(
    here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rows = "\n".join(f"{k},{2 * k},{3 * k}" for k in range(40))
    Path("two.csv").write_text(f"position_m,force_N,force_left_N\n{rows}\n", encoding="utf-8")
    assert main(["identify", "two.csv", "-o", "o.json", "--force", "force_lefd_N"]) == 2
    message = capsys.readouterr().err
    assert "(did you mean 'force_left_N'?)" in message
    assert "add: --force force_left_N" in message

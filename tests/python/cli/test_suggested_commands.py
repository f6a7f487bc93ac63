# SPDX-License-Identifier: Apache-2.0
"""Commands in messages can be pasted into a shell, also with a hostile file name."""

import ast
import json
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from conftest import ROOT, nodes_of, sampled
from palpate.cli.main import main
from palpate.devices.usb import DeviceError, install_rule

MODEL = ROOT / "tests" / "models" / "good" / "position.json"

HOSTILE = (
    "$(touch RUN)",
    "`touch RUN`",
    "a; touch RUN",
    "a'b",
    'a"b $HOME',
    "-o",
    "a b",
    "*",
    "a\\b",
    "~",
    "a#b",
)
"""File names that a shell would change, or that look like an option"""

INTERPRETER = sys.executable

STORED = (
    "import json, pathlib, sys\n"
    "arguments = [str(pathlib.Path(each)) for each in sys.argv[1:]]\n"
    "pathlib.Path('ARGUMENTS').write_text(json.dumps(arguments))\n"
)
"""Program that stores its arguments; a file name has no leading ./"""


def pasted(text: str, folder: Path) -> list[str]:
    """Runs a command in a shell, in which `palpate` and `sudo` store their arguments; returns these."""
    commands = folder / "commands"
    commands.mkdir(exist_ok=True)
    (folder / "stored.py").write_text(STORED)
    program = shlex.join([INTERPRETER, str(folder / "stored.py")])
    for name in ("palpate", "sudo"):
        (commands / name).write_text(f'#!/bin/sh\nexec {program} "$@"\n')
        (commands / name).chmod(0o755)
    environment = {"PATH": f"{commands}:/usr/bin:/bin", "HOME": "/nonexistent"}
    subprocess.run(["/bin/sh", "-c", text], cwd=folder, env=environment, check=True)
    assert not (folder / "RUN").exists()
    words: list[str] = json.loads((folder / "ARGUMENTS").read_text())
    return words


def suggested(capsys: pytest.CaptureFixture[str], command: list[str], start: str) -> str:
    """Returns the command in the message of a refused run: from `start` to the end of the sentence."""
    assert main(command) == 2
    found = re.search(rf"{start}(?:.*?)(?=\n|, or export| \(see palpate)", capsys.readouterr().err)
    assert found is not None
    return found[0]


@pytest.fixture(params=sampled(HOSTILE, "$(touch RUN)", "a'b", "-o", "a b", "~"))
def name(request: pytest.FixtureRequest, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    monkeypatch.chdir(tmp_path)
    return str(request.param)


@pytest.mark.parametrize("verb", ["verify", "report"])
def test_exchanged_files_are_suggested_in_the_right_order(
    name: str, verb: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    files = [f"./{name}.csv", f"./{name}.json"]
    shutil.copy(MODEL, files[1])
    Path(files[0]).write_text("position_m,force_N\n1,2\n")
    options = ["-o", "page.html"] if verb == "report" else []
    command = suggested(capsys, [verb, *files, *options], f"palpate {verb}")
    assert pasted(command, tmp_path) == [verb, f"{name}.json", f"{name}.csv"]


@pytest.mark.parametrize(("suffix", "verb"), [("json", "show"), ("csv", "identify")])
def test_a_file_in_place_of_a_verb_is_suggested_as_its_argument(
    name: str, suffix: str, verb: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    Path(f"./{name}.{suffix}").write_text("position_m,force_N\n1,2\n")
    command = suggested(capsys, [f"./{name}.{suffix}"], f"palpate {verb}")
    assert pasted(command, tmp_path)[:2] == [verb, f"{name}.{suffix}"]


def test_a_model_without_certificate_is_suggested_to_the_plan(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    shutil.copy(MODEL, f"./{name}.json")
    command = suggested(capsys, ["export", f"./{name}.json", "--c", "-o", "model.h"], "palpate plan")
    words = ["plan", f"{name}.json", "--device", "PROFILE", "-o", f"{name}.json"]
    assert pasted(command, tmp_path) == words


def test_a_column_is_suggested_as_one_word(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    quoted = '"' + name.replace('"', '""') + '"'
    lines = "".join(f"{k},{k * k},{k}\n" for k in range(20))
    Path("press.csv").write_text(f"{quoted},force_N,other\n{lines}")
    options = suggested(capsys, ["show", "press.csv"], "--position")
    assert pasted(f"palpate {options}", tmp_path)[1] == name


def test_the_interpreter_is_suggested_as_one_word(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "executable", f"/opt/{name}/python")
    monkeypatch.setattr("os.access", lambda path, mode: False)
    with pytest.raises(DeviceError) as refused:
        install_rule(print, folder=tmp_path)
    command = str(refused.value).partition("run: ")[2]
    assert pasted(command, tmp_path)[0] == f"/opt/{name}/python"


VERB = re.compile(r"\bpalpate (identify|verify|plan|report|render|simulate|record|show|export|devices)\b")


@pytest.mark.parametrize(
    "file", sorted((ROOT / "python" / "palpate").rglob("*.py")), ids=lambda file: file.stem
)
def test_every_value_in_a_suggested_command_is_one_word_of_a_shell(file: Path) -> None:
    """A value that follows `palpate VERB` in a text is the result of `command_word`."""
    if "palpate " not in file.read_text(encoding="utf-8"):
        return
    for text in nodes_of(file):
        if not isinstance(text, ast.JoinedStr):
            continue
        is_command = False
        for part in text.values:
            if isinstance(part, ast.Constant):
                line = str(part.value).rpartition("\n")[2]  # a command ends with its line
                continues = is_command and "\n" not in str(part.value)
                is_command = continues or VERB.search(line) is not None
            elif is_command and isinstance(part, ast.FormattedValue):
                assert "command_word" in ast.unparse(part.value), f"{file}, line {text.lineno}"

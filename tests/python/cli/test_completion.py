# SPDX-License-Identifier: Apache-2.0
"""Completion of command lines in bash, zsh and fish."""

import os
import shutil
import subprocess
import sys
from functools import cache
from pathlib import Path

import pytest

from conftest import sampled
from palpate.cli.completion import SHELLS, files_with

PROGRAMS = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"

IN_BASH = """
eval "$SCRIPT"
compopt() { echo "compopt $*"; }
COMP_WORDS=("$@")
COMP_CWORD=$(($# - 1))
_palpate_completion palpate
printf '%s\\n' "${COMPREPLY[@]}"
"""
"""Completes a command line with the script, as bash does if the user presses Tab."""


def needs(shell: str) -> None:
    if shutil.which(shell) is None:
        pytest.skip(f"needs {shell}")


def run(command: list[str], folder: Path, **variables: str) -> str:
    environment = {**os.environ, "PATH": PROGRAMS, **variables}
    completed = subprocess.run(
        command, cwd=folder, env=environment, capture_output=True, text=True, check=False
    )
    assert (completed.returncode, completed.stderr) == (0, "")
    return completed.stdout


@cache
def script(shell: str) -> str:
    """Returns the script that palpate prints for a shell."""
    return run(["palpate", "--completion", shell], Path.cwd())


def in_bash(folder: Path, *words: str) -> list[str]:
    needs("bash")
    return run(["bash", "-c", IN_BASH, "bash", *words], folder, SCRIPT=script("bash")).split()


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for name in ("a.csv", "a.parquet", "m.json", "d.toml", "p.png", "notes.txt"):
        (tmp_path / name).touch()
    (tmp_path / "inner").mkdir()
    return tmp_path


CASES = [
    (["i"], ["identify"]),
    (["re"], ["render", "record", "report"]),
    (["--c"], ["--completion"]),
    (["identify", "--hold"], ["--hold-out-every"]),
    (["identify", "a.csv", "--below", ""], ["auto", "free", "linear"]),
    (["identify", ""], ["a.csv", "a.parquet"]),
    (["identify", "a.csv", "-o", ""], ["m.json"]),
    (["identify", "a.csv", "--plot", ""], ["p.png"]),
    (["verify", "m.json", "a.c"], ["a.csv"]),
    (["plan", "m.json", "--device", "bench"], ["bench-knob"]),
    (["plan", "m.json", "--device", "d."], ["d.toml"]),
    (["plan", "--examples", "--dev"], ["--device"]),
    (["render", "m.json", "--device", "m"], ["mit", "moteus"]),
    (["app", ""], ["a.csv", "a.parquet"]),
    (["identify", "in"], ["compopt", "-o", "default"]),
    (["demo", "-o", ""], ["compopt", "-o", "dirnames"]),
]
"""Words, and what the shell receives for the last of them"""


@pytest.mark.parametrize(("words", "expected"), sampled(CASES, *CASES[1::5], CASES[12]), ids=" ".join)
def test_bash_completes_verbs_options_values_and_files_by_type(
    words: list[str], expected: list[str], folder: Path
) -> None:
    assert in_bash(folder, "palpate", *words) == expected


def test_fish_completes_with_descriptions(folder: Path) -> None:
    needs("fish")
    script = 'palpate --completion fish | source; complete -C "$argv[1]"'
    variables = {"HOME": str(folder), "XDG_CONFIG_HOME": str(folder)}
    assert run(["fish", "-c", script, "palpate id"], folder, **variables).split("\n")[0] == (
        "identify\tIdentify a model from recordings."
    )
    assert run(["fish", "-c", script, "palpate verify "], folder, **variables).split() == ["m.json"]


def test_zsh_registers_the_completion_of_palpate(folder: Path) -> None:
    needs("zsh")
    script = (
        "autoload -Uz compinit && compinit -u -D && "
        'eval "$(palpate --completion zsh)" && print $_comps[palpate]'
    )
    assert run(["zsh", "-f", "-c", script], folder) == "_palpate_completion\n"
    request = {"COMP_WORDS": "palpate ver", "COMP_CWORD": "1", "_PALPATE_COMPLETE": "zsh_complete"}
    completions = run(["palpate"], folder, **request).split("\n")
    assert completions[:3] == ["plain", "verify", "Compare a model with a recording."]


def test_an_error_of_a_completion_prints_nothing(folder: Path) -> None:
    for request in ("bash_complete", "zsh_complete", "tcsh_complete", "bash"):
        variables = {"COMP_WORDS": "palpate 'open quote", "COMP_CWORD": "x", "_PALPATE_COMPLETE": request}
        assert run(["palpate"], folder, **variables) == ""


def test_completion_of_verbs_imports_no_verb(folder: Path) -> None:
    request = {"COMP_WORDS": "palpate ", "COMP_CWORD": "", "_PALPATE_COMPLETE": "fish_complete"}
    code = (
        "import sys; sys.argv[0] = 'palpate'; from palpate.cli.main import main; main(); "
        "assert 'numpy' not in sys.modules"
    )
    assert "identify" in run([sys.executable, "-c", code], folder, **request)


def test_a_name_that_needs_quotes_is_completed_by_the_shell(tmp_path: Path) -> None:
    (tmp_path / "with space.csv").touch()
    item = files_with((".csv",), f"{tmp_path}/w")[0]
    assert (item.type, item.value) == ("file", f"{tmp_path}/w")


@pytest.mark.parametrize("shell", SHELLS)
def test_the_script_of_each_shell_is_printed(shell: str) -> None:
    assert "_PALPATE_COMPLETE" in script(shell)

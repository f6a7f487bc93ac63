# SPDX-License-Identifier: Apache-2.0
"""Common behaviour of all verbs: standard streams, verdict, control characters, width of the terminal."""

import subprocess
import sys
from pathlib import Path

import pytest

from models_by_hand import model_by_hand
from palpate import load_model
from palpate.cli.main import palpate as group
from test_cli_identify import spring

VERBS = {
    "identify": "identify a.csv -o out.json",
    "verify": "verify m.json a.csv",
    "plan": "plan m.json --device bench-knob -o out.json",
    "simulate": "simulate m.json --duration-s 0.1 -o rendered.csv",
    "render": "render m.json --duration-s 0.1 --rate-hz 100 --lowest-rate-share 0",
    "record": "record recorded.csv --object m.json --duration-s 0.1 --rate-hz 100",
    "devices": "devices",
    "check-device": "check-device --object m.json --duration-s 2 --rate-hz 100",
    "show": "show m.json",
    "demo": "demo -o demo",
}
"""Short command for each verb."""

UNWRITABLE = {
    "stdout closed": ">&-",
    "all closed": "<&- >&- 2>&-",
    "disk full": ">/dev/full",
    "reader left": "| true",
}


@pytest.fixture
def here(tmp_path: Path) -> Path:
    spring(tmp_path / "a.csv")
    model_by_hand().save(tmp_path / "m.json")
    return tmp_path


def run(command: str, here: Path, redirection: str = "") -> subprocess.CompletedProcess[str]:
    program = f"'{sys.executable}' -m palpate {command}"
    if redirection.startswith("|"):  # the reader has ended before the first word
        program = f"(sleep 0.2; {program}; echo $? > code) {redirection}; sleep 0.2; wait"
        script = f"{program}; while ! test -s code; do sleep 0.05; done; exit $(cat code)"
    else:
        script = f"{program} {redirection}"
    return subprocess.run(
        ["sh", "-c", script], cwd=here, capture_output=True, text=True, check=False, timeout=120
    )


def test_the_table_holds_every_verb() -> None:
    assert sorted(VERBS) == sorted(group.list_commands(None))  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("streams", "options"),
    [*((streams, "") for streams in UNWRITABLE), ("disk full", " --json")],
    ids=[*UNWRITABLE, "disk full, json"],
)
@pytest.mark.parametrize("verb", VERBS)
def test_output_that_cannot_be_written_ends_with_exit_code_1_and_no_traceback(
    verb: str, streams: str, options: str, here: Path
) -> None:
    answer = run(VERBS[verb] + options, here, UNWRITABLE[streams])
    assert answer.returncode == 1, answer.stderr
    for word in ("Traceback", "Exception", "defect"):
        assert word not in answer.stderr
    if streams in ("stdout closed", "disk full"):
        assert answer.stderr.splitlines()[-1].startswith("error: standard output cannot be written: ")
    if (here / "out.json").exists():
        load_model(here / "out.json")
    assert not list(here.glob(".*"))


@pytest.mark.parametrize("redirection", ["2>&-", "2>/dev/full"])
def test_talk_that_cannot_be_written_changes_no_result(redirection: str, here: Path) -> None:
    answer = run(VERBS["identify"], here, redirection)
    assert answer.returncode == 0
    assert answer.stdout.startswith("verdict: good\n")
    load_model(here / "out.json")

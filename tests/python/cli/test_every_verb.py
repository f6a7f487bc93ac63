# SPDX-License-Identifier: Apache-2.0
"""Behaviour that all commands (verbs) share: standard streams, verdict, control characters, line width."""

import subprocess
import sys
from itertools import product
from pathlib import Path

import pytest

from conftest import sampled
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
    "report": "report m.json a.csv -o report.html",
    "export": "export m.json --c --uncertified --encoder-step 1e-4 --force-limit 2 -o knob.h",
    "app": "app --no-browser --idle-s 0.1",
    "demo": "demo -o demo",
}
"""Command lines for the tests, one for each verb; each command ends quickly."""

UNWRITABLE = {
    "disk full": (">/dev/full", ""),
    "stdout closed": (">&-", ""),
    "all closed": ("<&- >&- 2>&-", ""),
    "disk full, json": (">/dev/full", " --json"),
    "reader left": ("| true", ""),
}
"""Redirection and further option, by the reason why standard output cannot be written."""

QUICK = ("plan", "devices", "render", "export", "show")
"""A verb for each reason in `make test`; the code that reports the reason is the same for all verbs."""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    spring(tmp_path / "a.csv")
    model_by_hand().save(tmp_path / "m.json")
    return tmp_path


def run(command: str, folder: Path, redirection: str = "") -> subprocess.CompletedProcess[str]:
    program = f"'{sys.executable}' -m palpate {command}"
    if redirection.startswith("|"):  # the program that reads the pipe ends before the first output
        program = f"(sleep 0.2; {program}; echo $? > code) {redirection}; sleep 0.2; wait"
        script = f"{program}; while ! test -s code; do sleep 0.05; done; exit $(cat code)"
    else:
        script = f"{program} {redirection}"
    return subprocess.run(["sh", "-c", script], cwd=folder, capture_output=True, text=True, check=False)


def test_the_table_contains_every_verb() -> None:
    assert sorted(VERBS) == sorted(group.list_commands(None))  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("verb", "reason"), sampled(product(VERBS, UNWRITABLE), *zip(QUICK, UNWRITABLE, strict=True))
)
def test_unwritable_output_exits_with_code_1_without_traceback(verb: str, reason: str, folder: Path) -> None:
    redirection, option = UNWRITABLE[reason]
    completed = run(VERBS[verb] + option, folder, redirection)
    assert completed.returncode == 1, completed.stderr
    for word in ("Traceback", "Exception", "defect"):
        assert word not in completed.stderr
    if ">" in redirection and "2>" not in redirection:
        assert completed.stderr.splitlines()[-1].startswith("error: standard output cannot be written: ")
    if (folder / "out.json").exists():
        load_model(folder / "out.json")
    assert not list(folder.glob(".*"))


@pytest.mark.parametrize(
    ("verb", "redirection"),
    sampled(product(("identify", "plan"), ("2>&-", "2>/dev/full")), ("plan", "2>/dev/full")),
)
def test_unwritable_messages_change_no_result(verb: str, redirection: str, folder: Path) -> None:
    completed = run(VERBS[verb], folder, redirection)
    assert completed.returncode == 0
    assert completed.stdout.startswith("verdict: good\n")
    load_model(folder / "out.json")

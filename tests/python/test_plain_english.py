# SPDX-License-Identifier: Apache-2.0
"""tools/plain_english.py finds each kind of language fault in a text, and accepts a text without fault."""

import runpy
import subprocess
import sys
from pathlib import Path

import pytest

from conftest import ROOT

TOOL = ROOT / "tools" / "plain_english.py"
CHECKER = runpy.run_path(str(TOOL))


def findings_of(folder: Path, name: str, content: str) -> list[str]:
    """Returns the findings of the language check in a file with this content, as `kind: finding`."""
    file = folder / name
    file.write_text(content, encoding="utf-8")
    texts = CHECKER["READERS"].get(file.suffix, CHECKER["READERS"].get(name))(file)
    return [f"{text.kind}: {kind}" for text in texts for kind, _ in CHECKER["findings"](text)]


LONG = "The program " + "sends zero force and " * 10 + "closes the device"
"""Sentence of 45 words, which is longer than the check of the language allows"""


@pytest.mark.parametrize(
    ("name", "bad", "good", "finding"),
    [
        ("a.py", "# The user is told.", "# The user receives a message.", 'comment: "told"'),
        ("a.py", "# Whether it ends.", "# True if it ends.", 'comment: opening "Whether"'),
        ("a.cpp", "/// Nobody holds it.", "/// No hand holds it.", 'comment: "nobody"'),
        ("a.hpp", "int a;  ///< told mass", "int a;  ///< mass [kg]", 'comment: "told"'),
        ("Makefile", "# Tells the targets.", "# Prints the targets.", 'comment: "tells"'),
        ("a.toml", "\t# Set anew each time.", "\t# Set again each time.", 'comment: "anew"'),
        ("a.py", '"""Tells the error."""', '"""Returns the error."""', 'docstring: "tells"'),
        ("a.py", '"""Where the force is."""', '"""Position of the force."""', 'docstring: opening "Where"'),
        ("a.py", 'print("the force is asked for")', 'print("the force is requested")', 'message: "asked"'),
        ("a.py", 'print(f"this {n} stands in line")', 'print(f"this {n} is in line")', 'message: "stands"'),
        ("a.cpp", 'puts("the force"\n" of its own");', 'puts("a separate"\n" force here");',
         'message: "of its own"'),
        ("a.md", "The rooms are small.\n\nA room is left.", "Each module is small.", 'page: "room is"'),
        ("a.py", "def test_told_errors(): ...", "def test_errors_are_named(): ...", 'test name: "told"'),
        ("a.cpp", "TEST(Force, IsTold) {}", "TEST(Force, IsReported) {}", 'test name: "told"'),
        ("a.cpp", "TEST_F(F, NothingButZero) {}", "TEST_F(F, OnlyZero) {}", 'test name: "nothing but"'),
        ("a.py", "told = 1", "output = 1", 'name: "told"'),
        ("a.py", "def read(asked_force): ...", "def read(requested_force): ...", 'name: "asked"'),
        ("a.py", "class LastStory: ...", "class LastRecord: ...", 'name: "story"'),
        ("a.py", "PRUNE_HOPE = 2", "PRUNE_RATIO = 2", 'name: "hope"'),
        ("a.py", "self.wishes: int = 2", "self.requests: int = 2", 'name: "wishes"'),
        ("a.cpp", "double buzzForce() {}", "double limitCycleForce() {}", 'name: "buzz"'),
        ("a.cpp", "struct Outlets {};", "struct RecordSinks {};", 'name: "outlets"'),
        ("a.cpp", "enum class S { Drained };", "enum class S { EnergyLimited };", 'name: "drained"'),
        ("a.py", f"# {LONG}.", "# It sends zero force. It closes the device.", "comment: long sentence"),
        ("a.py", f'"""{LONG}."""', '"""Sends zero force."""', "docstring: long sentence"),
        ("a.cpp", f'puts("{LONG}");', 'puts("zero force sent, device closed");', "message: long sentence"),
        ("a.md", f"{LONG}.", "It sends zero force.", "page: long sentence"),
    ],
)  # fmt: skip
def test_a_bad_text_is_found_and_a_good_text_is_not(
    name: str, bad: str, good: str, finding: str, tmp_path: Path
) -> None:
    assert findings_of(tmp_path, name, f"{bad}\n") == [finding]
    assert findings_of(tmp_path, name, f"{good}\n") == []


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("a.py", 'print("the account `nobody` has no access")'),
        ("a.py", "print(\"the account 'nobody' has no access\")"),
        ("a.py", 'print("give both models with --beside OTHER and --somebody-elses")'),
        ("a.py", 'SCRIPT = """#!/bin/sh\necho what is told to nobody\n"""'),
        ("a.py", 'SCRIPT = """\nset -e\necho what is told to nobody\n"""'),
        ("a.py", 'ACCOUNTS = "root:x:0:0::/:/bin/sh\\nnobody:x:65534:65534::/:/bin/sh"'),
        ("a.py", '"""Returns the sum.\n\nParameters\n----------\nwhat, told : float\n    A number.\n"""'),
        ("a.py", f'HELP = """{LONG[:90]}\n  --force  {LONG[:90]}\n  --rate  {LONG[:90]}"""'),
        ("a.py", f'"""Options: {", ".join(["rate_hz", "device (simulated)", "record"] * 20)}."""'),
        ("a.py", f'print("{LONG[:120]}; {LONG[:120].lower()}")'),
        ("a.py", "print('room')\nforce['told'] = call(beside=1)"),
        ("a.md", f"```\nwhat was told\n```\n\n| what | {LONG} |\n\n    {LONG}\n"),
    ],
)
def test_code_options_lists_and_quoted_words_are_accepted(name: str, content: str, tmp_path: Path) -> None:
    assert findings_of(tmp_path, name, content) == []


def run(*arguments: str | Path) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, TOOL, *arguments]
    return subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)


def test_exit_code_and_number_of_findings_are_reported(tmp_path: Path) -> None:
    file = tmp_path / "a.py"
    file.write_text("told = 1\n# The user is told.\n# Nobody.\nlimit = told\n", encoding="utf-8")
    completed = run(file)
    assert completed.returncode == 1
    assert completed.stdout.splitlines()[-1] == "3 findings"
    assert f'{file}:1: name: "told" in told is forbidden; write: report' in completed.stdout
    assert '     1 name: "told"' in run("--count", file).stdout
    file.write_text("output = 1\n# The user receives it.\n", encoding="utf-8")
    completed = run(file)
    assert completed.returncode == 0
    assert completed.stdout.splitlines()[-1] == "0 findings"


@pytest.mark.parametrize(("words", "code"), [(20, 0), (21, 1)])
def test_a_mean_of_more_than_20_words_fails(words: int, code: int, tmp_path: Path) -> None:
    file = tmp_path / "a.md"
    file.write_text("Force " * words + ".\n", encoding="utf-8")
    completed = run(file)
    assert f"page: 1 sentences, {words}.0 words on average (at most 20)" in completed.stdout
    assert completed.returncode == code


def test_a_closed_standard_output_exits_without_traceback() -> None:
    command = [sys.executable, TOOL, TOOL.with_name("stubs.py")]
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=ROOT
    ) as process:
        assert process.stdout is not None
        process.stdout.close()
        assert process.stderr is not None
        assert process.stderr.read() == ""
    assert process.returncode == 1

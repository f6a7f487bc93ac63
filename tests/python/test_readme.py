# SPDX-License-Identifier: Apache-2.0
"""What the README shows is what happens."""

import re
import shlex
import subprocess
import sys
import sysconfig
from pathlib import Path

import pytest

from palpate import _core

ROOT = Path(__file__).parents[2]
README = (ROOT / "README.md").read_text(encoding="utf-8")


def blocks(language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```$", README, re.DOTALL | re.MULTILINE)


def shell_commands() -> list[list[str]]:
    lines = [line for block in blocks("sh") for line in block.replace("\\\n", " ").splitlines()]
    return [words for line in lines if (words := shlex.split(line, comments=True))]


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """One empty folder for all of the README, whose commands build on each other."""
    return tmp_path_factory.mktemp("readme")


@pytest.mark.parametrize("snippet", blocks("python"), ids=lambda snippet: snippet.splitlines()[0])
def test_snippet_runs(snippet: str, bench: Path) -> None:
    subprocess.run([sys.executable, "-W", "error", "-c", snippet], cwd=bench, check=True, timeout=300)


def test_palpate_commands_run_in_their_order(bench: Path) -> None:
    commands = [words for words in shell_commands() if words[0] == "palpate"]
    assert commands
    for words in commands:
        executable = Path(sysconfig.get_path("scripts")) / words[0]
        answer = subprocess.run(
            [executable, *words[1:]], cwd=bench, capture_output=True, text=True, check=False, timeout=300
        )
        assert answer.returncode == 0, f"{shlex.join(words)}: {answer.stderr}"


def test_every_other_command_is_one_that_is_known() -> None:
    targets = set(
        re.findall(r"^([a-z][a-z-]*):", (ROOT / "Makefile").read_text(encoding="utf-8"), re.MULTILINE)
    )
    for words in shell_commands():
        if words[0] == "make":
            assert set(words[1:]) <= targets
        else:
            assert words[0] in {"palpate", "pip", "git", "cd", "build/control/palpate-control"}, words


def test_the_two_commands_stand_on_the_first_screen() -> None:
    first_screen = "\n".join(README.splitlines()[:40])
    assert "make demo" in first_screen
    assert "make test" in first_screen


def test_the_table_of_statuses_is_that_of_the_source() -> None:
    rows = re.findall(r"^\| `(\w+)` \| (.*) \|$", README, re.MULTILINE)
    assert rows == list(_core.status_meanings.items())


@pytest.mark.parametrize(
    "name", ["README.md", "ARCHITECTURE.md", "CONTRIBUTING.md", "SECURITY.md", "CHANGELOG.md"]
)
def test_links_lead_to_files_that_exist(name: str) -> None:
    text = (ROOT / name).read_text(encoding="utf-8")
    targets = re.findall(r"\]\((?!https?://|#)([^)#]+)", text)
    assert [target for target in targets if not (ROOT / target).exists()] == []

# SPDX-License-Identifier: Apache-2.0
"""The commands, snippets and tables of the README and of docs/rendering.md are correct."""

import re
import shlex
import subprocess
import sys
import sysconfig
from pathlib import Path

import pytest

from control_program import needs_program
from palpate import _core

ROOT = Path(__file__).parents[2]
README = (ROOT / "README.md").read_text(encoding="utf-8")
RENDERING = (ROOT / "docs" / "rendering.md").read_text(encoding="utf-8")


def blocks(language: str, page: str = README) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```$", page, re.DOTALL | re.MULTILINE)


def shell_commands() -> list[list[str]]:
    lines = [line for block in blocks("sh") for line in block.replace("\\\n", " ").splitlines()]
    return [arguments for line in lines if (arguments := shlex.split(line, comments=True))]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Returns an empty folder for all commands of the README, which use the files of each other."""
    return tmp_path_factory.mktemp("readme")


@pytest.mark.parametrize("snippet", blocks("python"), ids=lambda snippet: snippet.splitlines()[0])
@pytest.mark.docs
def test_snippet_runs(snippet: str, folder: Path) -> None:
    subprocess.run([sys.executable, "-W", "error", "-c", snippet], cwd=folder, check=True)


@needs_program
@pytest.mark.parametrize(
    "left_out",
    [(), pytest.param(("-DPALPATE_COMPILED", "libpalpate_compiled.a"), marks=pytest.mark.full)],
)
@pytest.mark.docs
def test_the_cpp_snippet_prints_the_numbers_of_the_python_snippet(
    folder: Path, left_out: tuple[str, ...]
) -> None:
    (python,), (cpp,) = blocks("python"), blocks("cpp")
    (command,) = re.findall(r"`(g\+\+ [^`]*)`", README)
    (folder / "spring.cpp").write_text(cpp, encoding="utf-8")
    for name in ("cpp", "build"):
        (folder / name).unlink(missing_ok=True)
        (folder / name).symlink_to(ROOT / name)
    words = [word for word in command.split() if not word.endswith(left_out)]
    # The whole core takes twice as long to compile with optimization, which changes no result.
    level = ["-O0"] if left_out else []
    subprocess.run([*words, "-Wall", "-Wextra", "-Werror", *level], cwd=folder, check=True)
    last_lines = [
        subprocess.run(words, cwd=folder, check=True, capture_output=True, text=True).stdout.splitlines()[-1]
        for words in ([sys.executable, "-c", python], ["./spring"])
    ]
    assert last_lines[0] == last_lines[1]


PALPATE = Path(sysconfig.get_path("scripts")) / "palpate"


@pytest.mark.docs
def test_all_commands_except_those_of_the_installation_run_in_their_order(folder: Path) -> None:
    commands = [arguments for arguments in shell_commands() if arguments[0] not in ("make", ".")]
    assert {arguments[0] for arguments in commands} == {"palpate"}
    for arguments in commands:
        completed = subprocess.run(
            [PALPATE, *arguments[1:]],
            cwd=folder,
            capture_output=True,
            text=True,
            check=False,
        )
        assert completed.returncode == 0, f"{shlex.join(arguments)}: {completed.stdout}{completed.stderr}"


@pytest.mark.docs
def test_example_output_equals_the_output_of_the_programs() -> None:
    tool = ROOT / "tools" / "example_output.py"
    completed = subprocess.run([sys.executable, tool, "--check"], capture_output=True, text=True, check=False)
    assert completed.returncode == 0, completed.stderr


def test_every_target_of_make_exists() -> None:
    targets = set(
        re.findall(r"^([a-z][a-z-]*):", (ROOT / "Makefile").read_text(encoding="utf-8"), re.MULTILINE)
    )
    used_targets = {
        target for arguments in shell_commands() if arguments[0] == "make" for target in arguments[1:]
    }
    assert used_targets
    assert used_targets <= targets


def test_the_first_screen_shows_both_commands() -> None:
    first_screen = "\n".join(README.splitlines()[:40])
    assert "make demo" in first_screen
    assert "make test" in first_screen


def test_the_readme_is_short() -> None:
    assert len(README.split()) <= 450
    assert len(re.findall(r"\]\(", README)) <= 10


def test_the_table_of_statuses_equals_the_statuses_of_the_core() -> None:
    rows = re.findall(r"^\| `(\w+)` \| (.*) \|$", RENDERING, re.MULTILINE)
    assert rows == list(_core.status.status_meanings.items())


FOLDERS = ["bench/README.md", "tests/README.md"]


@pytest.mark.parametrize(
    "name", ["README.md", "ARCHITECTURE.md", "CONTRIBUTING.md", "SECURITY.md", "CHANGELOG.md", *FOLDERS]
)
def test_linked_files_exist(name: str) -> None:
    text = (ROOT / name).read_text(encoding="utf-8")
    targets = re.findall(r"\]\((?!https?://|#)([^)#]+)", text)
    assert [target for target in targets if not ((ROOT / name).parent / target).exists()] == []

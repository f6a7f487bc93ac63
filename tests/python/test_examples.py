# SPDX-License-Identifier: Apache-2.0
"""The examples run and give the same results in both languages."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
STORIES = sorted(path.stem for path in (ROOT / "examples").glob("*.py"))


def told_in_python(story: str) -> str:
    command = [sys.executable, "-W", "error", str(ROOT / "examples" / f"{story}.py")]
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout


def told_in_cpp(story: str, folder: Path) -> str:
    compiler = shutil.which("c++")
    assert compiler is not None, "the package cannot have been built without a compiler"
    source, program = ROOT / "examples" / f"{story}.cpp", folder / story
    flags = ["-std=c++20", "-Wall", "-Wextra", "-Werror", "-I", str(ROOT / "cpp" / "include")]
    subprocess.run([compiler, *flags, str(source), "-o", str(program)], check=True)
    # Identification uses the verb.
    verbs = {**os.environ, "PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"}
    return subprocess.run(
        [str(program)], capture_output=True, text=True, check=True, cwd=ROOT, env=verbs
    ).stdout


def test_every_story_is_told_in_both_languages() -> None:
    assert sorted(path.stem for path in (ROOT / "examples").glob("*.cpp")) == STORIES
    assert STORIES


@pytest.mark.parametrize("story", STORIES)
def test_both_languages_print_the_same_numbers(story: str, tmp_path: Path) -> None:
    python = told_in_python(story)
    assert python
    assert told_in_cpp(story, tmp_path) == python

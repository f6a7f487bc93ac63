# SPDX-License-Identifier: Apache-2.0
"""The examples run and give the same results in C++ and Python."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
EXAMPLES = sorted(path.stem for path in (ROOT / "examples").glob("*.py"))


def output_in_python(example: str) -> str:
    command = [sys.executable, "-W", "error", str(ROOT / "examples" / f"{example}.py")]
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout


def output_in_cpp(example: str, folder: Path) -> str:
    compiler = shutil.which("c++")
    assert compiler is not None, "the package cannot have been built without a compiler"
    source, program = ROOT / "examples" / f"{example}.cpp", folder / example
    flags = ["-std=c++20", "-Wall", "-Wextra", "-Werror", "-I", str(ROOT / "cpp" / "include")]
    subprocess.run([compiler, *flags, str(source), "-o", str(program)], check=True)
    # The C++ example runs the command `palpate identify`.
    environment = {**os.environ, "PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"}
    return subprocess.run(
        [str(program)], capture_output=True, text=True, check=True, cwd=ROOT, env=environment
    ).stdout


def test_every_example_exists_in_both_languages() -> None:
    assert sorted(path.stem for path in (ROOT / "examples").glob("*.cpp")) == EXAMPLES
    assert EXAMPLES


@pytest.mark.parametrize("example", EXAMPLES)
def test_both_languages_print_the_same_numbers(example: str, tmp_path: Path) -> None:
    python = output_in_python(example)
    assert python
    assert output_in_cpp(example, tmp_path) == python

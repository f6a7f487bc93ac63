# SPDX-License-Identifier: Apache-2.0
"""Functions with which the tests run commands and build the project of a user."""

from __future__ import annotations

import subprocess
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
PROJECT = Path(__file__).with_name("project")


def run(*command: Any, **options: Any) -> str:
    """Runs a command; returns its standard output."""
    completed = subprocess.run(
        [str(part) for part in command], capture_output=True, text=True, check=False, **options
    )
    assert completed.returncode == 0, f"{command}: {completed.stdout}{completed.stderr}"
    return completed.stdout


def build_consumer(folder: Path, *definitions: str) -> Path:
    """Builds the project of a user, installs it and runs its program; returns the installed folder."""
    run("cmake", "-S", PROJECT, "-B", folder / "build", "-G", "Ninja", *definitions)
    run("cmake", "--build", folder / "build")
    run("cmake", "--install", folder / "build", "--prefix", folder / "installed")
    run(folder / "installed" / "bin" / "consumer")
    return folder / "installed"

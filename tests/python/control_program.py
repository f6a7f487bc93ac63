# SPDX-License-Identifier: Apache-2.0
"""Functions with which the tests run the program palpate-control."""

from __future__ import annotations

import os
import subprocess
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

from conftest import ROOT
from host_clock import host_clock

PROGRAM = Path(os.environ.get("PALPATE_CONTROL", ROOT / "build" / "control" / "palpate-control"))
MODEL = ROOT / "tests" / "models" / "good" / "position.json"

needs_program = pytest.mark.skipif(not PROGRAM.exists(), reason="needs palpate-control, run make control")


def in_virtual_time(environment: Mapping[str, str] = os.environ) -> dict[str, str]:
    """Returns the environment of a program whose clock shows virtual time while its control loop runs."""
    clock = host_clock()
    first = {"LD_PRELOAD": clock.name, "LD_LIBRARY_PATH": str(clock.parent)}
    lists = {name: ":".join(filter(None, [value, environment.get(name)])) for name, value in first.items()}
    return {**environment, **lists}


def run(*command: Any, **options: Any) -> subprocess.CompletedProcess[str]:
    """Runs a program in virtual time, and captures its output."""
    environment = in_virtual_time(options.pop("env", os.environ))
    streams = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, **options}
    words = list(map(str, command))
    return subprocess.run(words, env=environment, text=True, check=False, **streams)


def control(*arguments: Any, **options: Any) -> subprocess.CompletedProcess[str]:
    """Runs palpate-control in virtual time."""
    return run(PROGRAM, *arguments, **options)


def start(*command: Any, **options: Any) -> subprocess.Popen[str]:
    """Starts a program in virtual time."""
    streams = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, **options}
    return subprocess.Popen(list(map(str, command)), env=in_virtual_time(), text=True, **streams)


def every_row(recording: Path) -> pd.DataFrame:
    """Returns all rows of a flight record, also the rows that `read_recording` leaves out."""
    return pd.read_csv(recording, comment="#")


def wait_for_rows(part: Path, process: subprocess.Popen[str], count: int = 1) -> None:
    """Waits until a recording that a program is writing has this number of rows."""
    while process.poll() is None:
        if (
            part.exists()
            and sum(not line.startswith(b"#") for line in part.read_bytes().splitlines()) > count
        ):
            return
        time.sleep(0.005)
    raise AssertionError(process.communicate()[1])

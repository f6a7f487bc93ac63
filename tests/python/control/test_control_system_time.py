# SPDX-License-Identifier: Apache-2.0
"""The time of a system that is set while a program runs changes no time of a recording."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from control_program import MODEL, PROGRAM, every_row, needs_program, run
from file_faults import compiled_library

RENDER = [sys.executable, "-m", "palpate", "render"]


@pytest.fixture(scope="module")
def jumping_clock(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """Returns an environment in which the system time jumps by a day at every reading."""
    library = compiled_library(tmp_path_factory.mktemp("library"))
    return {"LD_PRELOAD": str(library), "FILE_FAULTS_CLOCK_STEP_S": "86400", "PATH": "/usr/bin:/bin"}


def test_the_jumping_clock_jumps(jumping_clock: dict[str, str]) -> None:
    script = "import time; print(max(abs(time.time() - time.time()) for _ in range(9)))"
    command = [sys.executable, "-c", script]
    printed = subprocess.run(command, env=jumping_clock, capture_output=True, text=True, check=True).stdout
    assert float(printed) > 86000.0


@pytest.mark.parametrize(
    "command",
    [
        pytest.param([PROGRAM, MODEL, "--record", "out.csv"], id="palpate-control", marks=needs_program),
        pytest.param([*RENDER, MODEL, "--record", "out.csv"], id="render"),
        pytest.param([*RENDER[:-1], "record", "out.csv", "--object", MODEL], id="record"),
    ],
)
def test_jumps_of_the_system_time_change_no_time(
    tmp_path: Path, command: list[str | Path], jumping_clock: dict[str, str]
) -> None:
    completed = run(*command, "--duration-s", 1, "--json", cwd=tmp_path, env=jumping_clock)
    assert completed.returncode == 0, completed.stderr
    summary = json.loads(completed.stdout)
    assert summary["ended"] == "the duration ended"
    times = every_row(tmp_path / "out.csv")["time_s"].to_numpy()
    assert times == pytest.approx(0.001 * np.arange(1000), abs=0.0011)

# SPDX-License-Identifier: Apache-2.0
"""Functions with which the tests run the program palpate-control."""

from __future__ import annotations

import os
import subprocess
import time
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

from conftest import ROOT

PROGRAM = Path(os.environ.get("PALPATE_CONTROL", ROOT / "build" / "control" / "palpate-control"))
MODEL = ROOT / "tests" / "models" / "good" / "position.json"

needs_program = pytest.mark.skipif(not PROGRAM.exists(), reason="needs palpate-control, run make control")

# palpate-control accepts any loop rate with these options, because the test machine may be busy.
ANY_RATE = ["--lowest-rate-share", "0"]


def control(*arguments: Any, timeout: float = 60.0, **options: Any) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [PROGRAM, *map(str, arguments)],
        capture_output=True,
        text=True,
        check=False,
        timeout=timeout,
        **options,
    )


def start_control(*arguments: Any, **options: Any) -> subprocess.Popen[str]:
    command = [str(PROGRAM), *map(str, arguments)]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **options)


def every_row(recording: Path) -> pd.DataFrame:
    """Returns all rows of a flight record, also the rows that `read_recording` leaves out."""
    return pd.read_csv(recording, comment="#")


def wait_for_rows(part: Path, process: subprocess.Popen[str]) -> float:
    """Waits until a recording that a program is writing has rows; returns the time of the first rows."""
    while process.poll() is None:
        if part.exists() and sum(not line.startswith(b"#") for line in part.read_bytes().splitlines()) > 15:
            return time.monotonic()
        time.sleep(0.005)
    raise AssertionError(process.communicate()[1])

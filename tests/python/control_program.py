# SPDX-License-Identifier: Apache-2.0
"""palpate-control as the tests run it."""

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

# The machine of a test may be busy: only the test of the rate minds.
PATIENT = ["--lowest-rate-share", "0"]


def control(*words: Any, timeout: float = 60.0, **others: Any) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [PROGRAM, *map(str, words)], capture_output=True, text=True, check=False, timeout=timeout, **others
    )


def started(*words: Any) -> subprocess.Popen[str]:
    command = [str(PROGRAM), *map(str, words)]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def every_row(recording: Path) -> pd.DataFrame:
    """Also the rows that a reader of recordings leaves out."""
    return pd.read_csv(recording, comment="#")


def wait_for_rows(part: Path, process: subprocess.Popen[str]) -> float:
    """Wait until the recording has rows; the time at which they were seen."""
    while process.poll() is None:
        if part.exists() and sum(not line.startswith(b"#") for line in part.read_bytes().splitlines()) > 15:
            return time.monotonic()
        time.sleep(0.005)
    raise AssertionError(process.communicate()[1])

# SPDX-License-Identifier: Apache-2.0
"""A live program that is suspended, and a system time that jumps."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from conftest import ROOT
from control_program import ANY_RATE, MODEL, PROGRAM, every_row, needs_program, wait_for_rows
from file_faults import compiled_library
from palpate import read_recording

CERTIFIED = ROOT / "tests" / "models" / "good" / "certificate_massless.json"
RENDER = [sys.executable, "-m", "palpate", "render"]
SUSPENDED_S = 0.8
LONGEST_WAIT_S = 60.0


def run_suspended(command: list[object], recording: Path) -> subprocess.CompletedProcess[str]:
    """Runs a live program; suspends it for a while after its first rows.

    On a loaded computer a run with a certificate may end before it is suspended; it is then repeated.
    """
    words = [*map(str, command), "--duration-s", "3", "--json", "--force"]
    for _ in range(5):
        process = subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        try:
            wait_for_rows(Path(f"{recording}.part"), process)
        except AssertionError:
            continue
        process.send_signal(signal.SIGSTOP)
        time.sleep(SUSPENDED_S)
        process.send_signal(signal.SIGCONT)
        output, messages = process.communicate(timeout=LONGEST_WAIT_S)
        return subprocess.CompletedProcess(words, process.returncode, output, messages)
    raise AssertionError("every run ended before it was suspended")


@pytest.mark.parametrize(
    "program",
    [pytest.param([PROGRAM], id="palpate-control", marks=needs_program), pytest.param(RENDER, id="render")],
)
@pytest.mark.parametrize(
    ("model", "reason"),
    [(CERTIFIED, "the certificate holds for at most"), (MODEL, "the rate was too low")],
    ids=["certified", "uncertified"],
)
def test_a_suspended_rendering_sends_no_further_force(
    tmp_path: Path, program: list[object], model: Path, reason: str
) -> None:
    out = tmp_path / "rendered.csv"
    completed = run_suspended([*program, model, "--record", out], out)
    assert completed.returncode == 1, completed.stderr
    summary = json.loads(completed.stdout)
    assert reason in summary["ended"], summary["ended"]
    assert reason in summary["verdict"]
    rows = every_row(out)
    assert rows["time_s"].diff().max() < SUSPENDED_S / 2, "a tick was rendered after the pause"
    head = out.read_text(encoding="utf-8")[:4096]
    assert reason in head
    assert "zero force sent and confirmed, device closed" in head


def test_a_suspended_recording_by_hand_goes_on_and_counts_the_gap(tmp_path: Path) -> None:
    out = tmp_path / "press.csv"
    completed = run_suspended([sys.executable, "-m", "palpate", "record", out, "--object", MODEL], out)
    summary = json.loads(completed.stdout)
    assert summary["missed_deadlines"] >= 0.9 * SUSPENDED_S * 1000.0
    assert "deadlines of the loop were missed" in summary["verdict"]
    rows = every_row(out)
    assert rows["time_s"].diff().max() > 0.9 * SUSPENDED_S
    assert set(rows.filter(like="applied").iloc[:, 0]) == {0}
    assert "missed" in read_recording(out).metadata["timing"]


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
    began = time.monotonic()
    completed = subprocess.run(
        [*command, *ANY_RATE, "--duration-s", "1", "--json"],
        cwd=tmp_path, env=jumping_clock, capture_output=True, text=True, check=False, timeout=LONGEST_WAIT_S,
    )  # fmt: skip
    assert completed.returncode in (0, 1), completed.stderr
    assert time.monotonic() - began < LONGEST_WAIT_S / 2
    summary = json.loads(completed.stdout)
    assert summary["ended"] == "the duration ended"
    times = every_row(tmp_path / "out.csv")["time_s"].to_numpy()
    assert np.all(np.diff(times) > 0.0)
    assert times[-1] == pytest.approx(1.0, abs=0.1)

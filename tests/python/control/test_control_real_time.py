# SPDX-License-Identifier: Apache-2.0
"""Live programs with the clock of the machine: some are suspended for a while. No test limits a duration."""

from __future__ import annotations

import contextlib
import json
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from conftest import ROOT
from control_program import MODEL, PROGRAM, every_row, needs_program, wait_for_rows
from palpate import read_recording

pytestmark = [pytest.mark.real_time, needs_program]

CERTIFIED = ROOT / "tests" / "models" / "good" / "certificate_massless.json"
RENDER = [sys.executable, "-m", "palpate", "render"]
SUSPENDED_S = 0.8
LONGEST_WAIT_S = 60.0


def run_suspended(command: list[object], recording: Path) -> subprocess.CompletedProcess[str]:
    """Runs a live program; suspends it for a while after its first rows.

    A busy machine can end a run with a certificate earlier, for the same reason.
    """
    words = [*map(str, command), "--duration-s", "3", "--json", "--force"]
    process = subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    with contextlib.suppress(AssertionError):
        wait_for_rows(Path(f"{recording}.part"), process)
    process.send_signal(signal.SIGSTOP)
    time.sleep(SUSPENDED_S)
    process.send_signal(signal.SIGCONT)
    output, messages = process.communicate(timeout=LONGEST_WAIT_S)
    return subprocess.CompletedProcess(words, process.returncode, output, messages)


@pytest.mark.parametrize(
    "program",
    [pytest.param([PROGRAM], id="palpate-control"), pytest.param(RENDER, id="render")],
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


def test_a_signal_ends_a_run_with_zero_force_and_every_row(tmp_path: Path) -> None:
    out = tmp_path / "rendered.csv"
    command = [PROGRAM, MODEL, "--duration-s", "inf", "--record", out, "--json", "--lowest-rate-share", "0"]
    process = subprocess.Popen(
        list(map(str, command)), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    wait_for_rows(Path(f"{out}.part"), process, 500)
    process.send_signal(signal.SIGINT)
    output, messages = process.communicate(timeout=LONGEST_WAIT_S)
    assert process.returncode == 0, messages
    summary = json.loads(output)
    assert summary["zero_force"].startswith("zero force sent and confirmed")
    assert len(every_row(out)) == summary["recorded"] == summary["ticks"]

# SPDX-License-Identifier: Apache-2.0
"""The page starts palpate-control, which stops with zero force when no page is open."""

import time
from pathlib import Path

import pytest

from control_program import MODEL, PROGRAM, needs_program
from palpate.app import live
from palpate.app.live import Live
from palpate.app.session import Session
from palpate.cli.app import CommandLine
from palpate.errors import InputError
from palpate.recording.sample import sample_recording

LONGEST_WAIT_S = 60.0


def test_a_missing_program_is_named_with_its_cure(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(live, "PROGRAM", "palpate-control-that-is-missing")
    with pytest.raises(InputError, match="is not installed, so no device can be started: install palpate"):
        Live().start(["palpate-control", str(MODEL)])


def test_the_name_of_a_device_cannot_be_an_option(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    sample_recording(seed=1, duration_s=3.0).write("knob.csv")
    session = Session(tmp_path, CommandLine())
    session.add_file("knob.csv", Path("knob.csv").read_bytes())
    session.act("identify", {})
    with pytest.raises(InputError, match="there is no plan yet"):
        session.start("simulated")
    session.act("device", {"device": "bench-knob"})
    with pytest.raises(InputError, match="device is '--no-energy-tank': must be the name of a device"):
        session.start("--no-energy-tank")
    assert not session.live.is_running


@needs_program
def test_a_device_stops_with_zero_force_when_no_page_is_open(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PATH", str(PROGRAM.parent), prepend=":")
    monkeypatch.setattr(live, "DESERTED_S", 3.0)
    running, started = Live(), False
    command = ["palpate-control", str(MODEL), "--device", "simulated", "--duration-s", "600"]
    running.start([*command, "--record", str(tmp_path / "felt.csv")])
    deadline = time.monotonic() + LONGEST_WAIT_S
    while running.is_running:
        assert time.monotonic() < deadline
        if not started:
            started = bool(running.latest())  # the last request of the page
        time.sleep(0.05)
    assert started
    assert "zero force sent" in running.ended
    assert (tmp_path / "felt.csv").exists()
    running.stop()

# SPDX-License-Identifier: Apache-2.0
"""Tests of the command palpate render, which runs the control loop of palpate-control from Python."""

import json
import mmap
import os
import signal
import sys
import threading
import time
from pathlib import Path
from typing import Any

import pytest

from control_program import MODEL, every_row, run, start, wait_for_rows
from palpate import InputError, _core, load_model, read_recording
from palpate._core.rendering import Scheme
from palpate._core.simulation import motion_driven
from palpate.cli.main import main
from usb_emulation import emulated, frames, needs_emulation

COMMAND = [sys.executable, "-m", "palpate", "render", str(MODEL)]


def render(scheme: Scheme, **settings: Any) -> dict[str, Any]:
    """Runs `palpate render`, which accepts any loop rate here, because the test machine may be busy."""
    return dict(_core.run.render(load_model(MODEL), scheme, **settings, lowest_rate_share=0.0))


def test_a_live_rendering_writes_a_recording_and_reports_its_timing(tmp_path: Path) -> None:
    out = tmp_path / "rendered.csv"
    summary = render(Scheme(), duration_s=0.3, record=str(out))
    assert len(every_row(out)) == summary["recorded"] == summary["ticks"]
    assert summary["ended"] == "the duration ended"
    assert summary["lost_records"] == 0
    assert summary["limit_cycles"] == 0
    assert summary["lateness"]["p50_us"] <= summary["lateness"]["p999_us"] <= summary["lateness"]["max_us"]


def test_energy_given_during_the_ramp_is_reported_separately() -> None:
    energy = render(Scheme(structure="direct"), duration_s=2.0)["energy"]
    assert 0.0 <= energy["given_in_ramp_J"] <= energy["most_stored_J"]
    assert 0.0 <= energy["given_J"] <= 1.1 * energy["most_stored_J"]
    assert energy["sentence"].startswith("the motor gave ")
    assert "J during the start ramp" in energy["sentence"]


def test_each_recorded_force_equals_the_simulated_force_at_its_position(tmp_path: Path) -> None:
    out = tmp_path / "rendered.csv"
    model = load_model(MODEL)
    render(Scheme(structure="direct"), duration_s=1.0, record=str(out))
    rendered = read_recording(out)
    simulated = motion_driven(model, Scheme(structure="direct"), rendered.position, 1e-3)["force"]
    assert rendered.force == pytest.approx(simulated, abs=1e-15)


def test_other_python_threads_run_during_the_loop() -> None:
    n_counts = 0
    stop = threading.Event()

    def count() -> None:
        nonlocal n_counts
        while not stop.is_set():
            n_counts += 1
            time.sleep(0.001)

    thread = threading.Thread(target=count)
    thread.start()
    render(Scheme(), duration_s=0.4)
    stop.set()
    thread.join()
    assert n_counts > 20


def test_reserved_memory_stays_unused() -> None:
    def resident_bytes() -> int:
        return int(Path("/proc/self/statm").read_text(encoding="utf-8").split()[1]) * mmap.PAGESIZE

    with mmap.mmap(-1, 1 << 28) as reserved:
        before = resident_bytes()
        render(Scheme(), duration_s=0.05)
        assert resident_bytes() - before < len(reserved) / 4


@pytest.mark.parametrize(
    ("settings", "sentence"),
    [
        ({"rate_hz": 5.0}, "rate_hz is 5"),
        ({"duration_s": 0.0}, "duration_s is 0"),
        ({"record": "/no/such/folder/rendered.csv"}, "cannot be written"),
    ],
)
def test_wrong_settings_are_refused(settings: dict[str, object], sentence: str) -> None:
    with pytest.raises(ValueError, match=sentence):
        render(Scheme(), **settings)


def test_an_existing_recording_is_refused_and_replaced_with_force(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "rendered.csv"
    out.write_text("precious", encoding="utf-8")
    with pytest.raises(ValueError, match=r"rendered.csv exists already; .* replace it with --force"):
        render(Scheme(), duration_s=0.3, record=str(out))
    command = [*COMMAND, "--duration-s", "0.8", "--record", str(out)]
    assert main(list(map(str, command[3:]))) == 2
    assert capsys.readouterr().err.startswith(f"error: {out} exists already; choose another name, or ")
    assert out.read_text(encoding="utf-8") == "precious"
    assert run(*command, "--force").returncode == 0
    assert len(every_row(out)) == 800


@pytest.mark.skipif(sys.platform != "linux", reason="needs file names of any bytes")
def test_a_recording_whose_name_is_not_utf_8_is_written(tmp_path: Path) -> None:
    out = tmp_path / os.fsdecode(b"rend\xffered.csv")
    summary = render(Scheme(), duration_s=0.3, record=out)
    assert summary["record"] == str(out)
    assert len(every_row(out)) == summary["recorded"] > 0


def test_an_incomplete_recording_is_renamed_and_reported(tmp_path: Path) -> None:
    (tmp_path / "rendered.csv.part").write_text("precious", encoding="utf-8")
    summary = render(Scheme(), duration_s=0.3, record=str(tmp_path / "rendered.csv"))
    assert (tmp_path / "rendered.csv.1.part").read_text(encoding="utf-8") == "precious"
    assert any("rendered.csv.1.part" in note for note in summary["notes"])


def test_an_exception_of_the_progress_callback_ends_the_run() -> None:
    reports: list[tuple[int, float, float, int]] = []

    def record_report(ticks: int, position: float, force: float, lost: int) -> None:
        reports.append((ticks, position, force, lost))
        if len(reports) == 3:
            raise KeyError("enough")

    with pytest.raises(KeyError, match="enough"):
        render(Scheme(), duration_s=20.0, progress=record_report)
    assert [ticks for ticks, *_ in reports] == sorted(ticks for ticks, *_ in reports)


def test_ctrl_c_during_the_progress_callback_only_ends_the_run() -> None:
    summary = render(Scheme(), duration_s=20.0, progress=lambda *state: os.kill(os.getpid(), signal.SIGINT))
    assert summary["ended"] == "stopped on request"


def test_the_verdict_is_in_the_summary_and_in_the_first_line(tmp_path: Path) -> None:
    short = render(Scheme(), duration_s=0.1, record=str(tmp_path / "a.csv"))
    assert short["verdict"].startswith("no: the recording has no usable row")
    assert next(iter(short)) == "verdict"
    assert short["findings"][0]["level"] == "no"
    out = tmp_path / "b.csv"
    completed = run(*COMMAND, "--duration-s", 0.1, "--record", out)
    assert completed.returncode == 1
    assert completed.stdout.splitlines()[0] == "verdict: no"
    complete = run(*COMMAND, "--structure", "direct", "--duration-s", 1.2)
    assert complete.returncode == 0
    assert complete.stdout.splitlines()[0] == "verdict: good"


@pytest.mark.parametrize("signal_number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_the_verb_with_exit_code_0_and_a_complete_recording(
    tmp_path: Path, signal_number: signal.Signals
) -> None:
    out = tmp_path / "rendered.csv"
    command = [*COMMAND, "--duration-s", "inf", "--record", str(out), "--json"]
    process = start(*command)
    wait_for_rows(Path(f"{out}.part"), process, 500)  # rows of the start ramp are not identified
    process.send_signal(signal_number)
    output, messages = process.communicate()
    assert process.returncode == 0, output + messages
    assert json.loads(output)["recorded"] == len(every_row(out))


def test_the_verb_reports_a_bad_rate_in_one_sentence(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["render", str(MODEL), "--rate-hz", "5"]) == 2
    assert capsys.readouterr().err.splitlines()[-1].startswith("error: rate_hz is 5")


def test_render_accepts_the_simulated_device_by_name(tmp_path: Path) -> None:
    out = tmp_path / "rendered.csv"
    command = [*COMMAND, "--device", "simulated", "--duration-s", "1.2", "--record", str(out), "--json"]
    completed = run(*command)
    assert completed.returncode == 0, completed.stderr
    assert "rendering on simulated, which is simulated: nothing moves" in completed.stderr
    summary = json.loads(completed.stdout)
    assert summary["orderly"]
    assert summary["recorded"] == len(every_row(out))


def test_options_of_the_device_reach_the_loop(monkeypatch: pytest.MonkeyPatch) -> None:
    received: dict[str, Any] = {}

    def refuse(*_: Any, **options: Any) -> None:
        received.update(options)
        raise InputError("refused")

    monkeypatch.setattr("palpate.cli.render.render_live", refuse)
    arguments = ["--device", "usb:EMU-1", "--wait-ms", "20", "--uncertified"]
    assert main(["render", str(MODEL), *arguments]) == 2
    assert (received["device"], received["wait_s"], received["uncertified"]) == ("usb:EMU-1", 0.02, True)


@needs_emulation
def test_a_usb_device_receives_the_force_and_zero_at_the_end(tmp_path: Path) -> None:
    trace = tmp_path / "trace.csv"
    command = [*COMMAND, "--device", "usb", "--uncertified", "--duration-s", "0.6"]
    completed = emulated(*command, "--json", device=["--trace", str(trace)])
    assert completed.returncode == 0, completed.stderr
    assert json.loads(completed.stdout)["ticks"] == 600
    sent_frames = frames(trace)
    assert max(abs(frame.torque) for frame in sent_frames) > 0.01
    assert sent_frames[-1].torque == 0.0
    assert not sent_frames[-1].enabled


@pytest.mark.parametrize(
    ("device", "sentence"),
    [
        ("toaster", "device is 'toaster', must be simulated, usb[:SERIAL], mit:BUS:NUMBER:KIND"),
        ("usb:", "device is 'usb:', must be simulated, usb[:SERIAL], mit:BUS:NUMBER:KIND"),
        ("inverse3:w", "Inverse3"),
    ],
)
def test_an_unknown_device_is_refused_before_anything_is_written(
    device: str, sentence: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "rendered.csv"
    assert main(["render", str(MODEL), "--device", device, "--record", str(out)]) == 2
    last_line = capsys.readouterr().err.splitlines()[-1]
    assert last_line.startswith("error: ")
    assert sentence in last_line
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("device", ["knob.toml", "bench-knob"])
def test_a_profile_as_device_is_refused_with_its_place(
    device: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["render", str(MODEL), "--device", device]) == 2
    assert f"--device {device} is a profile: give it to palpate plan" in capsys.readouterr().err

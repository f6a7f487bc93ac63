# SPDX-License-Identifier: Apache-2.0
"""palpate-control as a program: what it says, how it ends, and what it leaves on the disk."""

from __future__ import annotations

import contextlib
import json
import os
import random
import resource
import shutil
import signal
import socket
import subprocess
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from conftest import ROOT
from palpate import identify, read_recording
from palpate.recording.sample import sample_recording

PROGRAM = Path(os.environ.get("PALPATE_CONTROL", ROOT / "build" / "control" / "palpate-control"))
SCALE = max(1, int(os.environ.get("PALPATE_TEST_SCALE", "1")))
MODEL = ROOT / "tests" / "models" / "good" / "position.json"
KILLS = 2 * SCALE
LONG_RUN_S = 6.0 * SCALE

pytestmark = pytest.mark.skipif(not PROGRAM.exists(), reason="needs palpate-control, run make control")

# The machine of a test may be busy: only the test of the rate minds.
PATIENT = ["--lowest-rate-share", "0"]


def control(*words: Any, timeout: float = 60.0, **others: Any) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [PROGRAM, *map(str, words)], capture_output=True, text=True, check=False, timeout=timeout, **others
    )


def started(*words: Any) -> subprocess.Popen[str]:
    command = [str(PROGRAM), *map(str, words)]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def wait_for_rows(part: Path, process: subprocess.Popen[str]) -> float:
    """Wait until the recording has rows; the time at which they were seen."""
    while process.poll() is None:
        if part.exists() and sum(not line.startswith(b"#") for line in part.read_bytes().splitlines()) > 15:
            return time.monotonic()
        time.sleep(0.005)
    raise AssertionError(process.communicate()[1])


def changed_model(folder: Path, **fields: Any) -> Path:
    path = folder / "changed.json"
    path.write_text(json.dumps({**json.loads(MODEL.read_text(encoding="utf-8")), **fields}), encoding="utf-8")
    return path


def test_help_shows_defaults_units_exit_codes_and_an_example() -> None:
    answer = control("--help")
    assert answer.returncode == 0
    assert answer.stderr == ""
    for word in (
        "--rate-hz",
        "=1000",
        "--duration-s",
        "=10",
        "N*m/rad",
        "Exit code",
        "Example: palpate-control",
    ):
        assert word in answer.stdout


def test_no_arguments_are_answered_with_the_help() -> None:
    answer = control()
    assert answer.returncode == 2
    assert "Usage: palpate-control" in answer.stderr


def test_the_version_is_that_of_the_package() -> None:
    import palpate

    assert control("--version").stdout == f"palpate-control {palpate.__version__}\n"


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["nothing.json"], "nothing.json: there is no such file"),
        ([ROOT], "there is no such file"),
        ([MODEL, "--flavour"], "not expected: --flavour"),
        ([MODEL, "--rate-hz", "5"], "--rate-hz: must be a number from 100 to 1e+04, not 5"),
        ([MODEL, "--rate-hz", "fast"], "--rate-hz: must be a number from 100 to 1e+04, not fast"),
        ([MODEL, "--rate-hz", "nan"], "--rate-hz: must be a number from 100 to 1e+04, not nan"),
        ([MODEL, "--duration-s", "0"], "--duration-s: must be a number above 0, not 0"),
        ([MODEL, "--structure", "soft"], "must be direct, massless, implicit or explicit, not soft"),
        ([MODEL, "--device", "usb"], "this build has no USB device"),
        ([MODEL, "--device", "usb:42"], "this build has no USB device"),
        ([MODEL, "--device", "knob"], "must be simulated or usb[:SERIAL]"),
        ([MODEL, "--record", "/no/such/folder/out.csv"], "cannot be written: No such file or directory"),
        ([MODEL, "--record", "/tmp"], "cannot be written: it is not an ordinary file"),
        ([MODEL, "--record", MODEL], "is the model"),
        ([MODEL, "--coupling-stiffness", "-1"], "coupling_stiffness is -1"),
        ([MODEL, "--structure", "direct", "--compensated"], "no coupling to compensate"),
        ([MODEL, "--force-limit", "9"], "--force-limit is 9, the device makes 5"),
        ([MODEL, "--force-limit", "0"], "force_limit is 0"),
        ([MODEL, "--telemetry-port", "70000"], "--telemetry-port"),
        ([MODEL, "--fault", "flu@1"], "fault is 'flu@1', must be KIND@SECONDS"),
        ([MODEL.parent / "two_inputs.json"], "has 2 inputs"),
        ([MODEL.parents[1] / "bad" / "alpha_zero.json"], "network.alpha[1][0] is 0"),
        ([MODEL.parents[1] / "bad" / "not_json.json"], "this is not JSON"),
    ],
)
def test_what_is_wrong_is_refused_with_one_sentence(words: list[Any], sentence: str) -> None:
    answer = control(*words)
    assert answer.returncode == 2
    assert answer.stdout == ""
    assert answer.stderr.startswith("error: ")
    assert answer.stderr.count("\n") == 1
    assert sentence in answer.stderr


def test_a_motor_current_is_no_force(tmp_path: Path) -> None:
    answer = control(changed_model(tmp_path, units={"position": "rad", "force": "A"}))
    assert answer.returncode == 2
    assert "--torque-constant-Nm-per-A" in answer.stderr


@pytest.mark.parametrize("rate", [100, 1000, 5000])
@pytest.mark.parametrize("structure", ["direct", "massless", "implicit"])
def test_a_run_leaves_a_complete_recording(tmp_path: Path, rate: int, structure: str) -> None:
    out = tmp_path / "felt.csv"
    answer = control(
        MODEL,
        "--rate-hz",
        rate,
        "--duration-s",
        0.5,
        "--record",
        out,
        "--json",
        "--structure",
        structure,
        *PATIENT,
    )
    assert answer.returncode == 0, answer.stderr
    summary = json.loads(answer.stdout)
    recording = read_recording(out)
    assert not (tmp_path / "felt.csv.part").exists()
    assert len(recording) == summary["ticks"] == summary["recorded"]
    assert summary["ticks"] + summary["missed_deadlines"] >= 0.5 * rate
    assert summary["lost_records"] == 0
    assert recording.source.columns["position"] == "position_rad"
    assert recording.source.columns["force"] == "force_Nm"
    assert recording.units == {"position": "rad", "force": "N*m"}
    assert "missed deadlines" in recording.metadata["timing"]
    assert recording.metadata["ended"].startswith("ran its time; zero force sent, device closed")
    assert recording.metadata["simulated"].startswith("yes")


def test_columns_are_chosen_even_without_the_hint_in_the_file(tmp_path: Path) -> None:
    out = tmp_path / "felt.csv"
    assert control(MODEL, "--duration-s", 0.2, "--record", out, *PATIENT).returncode == 0
    bare = tmp_path / "bare.csv"
    lines = [line for line in out.read_text(encoding="utf-8").splitlines() if not line.startswith("#")]
    bare.write_text("\n".join(lines) + "\n", encoding="utf-8")
    assert read_recording(bare).source.columns == read_recording(out).source.columns


def test_other_units_name_other_columns(tmp_path: Path) -> None:
    out = tmp_path / "felt.csv"
    model = changed_model(tmp_path, units={"position": "m", "force": "N"})
    assert control(model, "--duration-s", 0.2, "--record", out, *PATIENT).returncode == 0
    assert read_recording(out).units == {"position": "m", "force": "N"}


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_asked_to_stop_it_ends_in_an_orderly_way(tmp_path: Path, number: signal.Signals) -> None:
    out = tmp_path / "felt.csv"
    process = started(MODEL, "--duration-s", "inf", "--record", out, "--json", *PATIENT)
    wait_for_rows(tmp_path / "felt.csv.part", process)
    process.send_signal(number)
    told, talk = process.communicate(timeout=20)
    assert process.returncode == 0, talk
    assert json.loads(told)["ended"] == "stopped because it was asked to"
    assert len(read_recording(out)) == json.loads(told)["ticks"]


@pytest.mark.parametrize(
    ("fault", "status"),
    [
        ("gone@0.3", "Fault"),
        ("jump@0.3", "Jump"),
        ("nan@0.3x50", "NonFinite"),
        ("late@0.3x50", "Timeout"),
        ("frozen@0.4x500", "Frozen"),
        ("repeated@0.3x50", "Lost"),
    ],
)
def test_a_fault_ends_the_run_with_zero_force_and_its_story(tmp_path: Path, fault: str, status: str) -> None:
    out = tmp_path / "felt.csv"
    answer = control(MODEL, "--duration-s", 3, "--record", out, "--json", "--fault", fault, *PATIENT)
    assert answer.returncode == 1, answer.stderr
    assert f": {status}, " in answer.stderr
    assert "the last 8 ticks" in answer.stderr
    summary = json.loads(answer.stdout)
    assert summary["status"] == status
    rows = out.read_text(encoding="utf-8").splitlines()[12:]
    assert len(rows) == summary["ticks"]
    last = rows[-1].split(",")
    assert last[-1] == status
    assert float(last[2]) == 0.0
    story = (tmp_path / "felt.fault.csv").read_text(encoding="utf-8").splitlines()[12:]
    assert story == rows[-len(story) :]


@pytest.mark.parametrize("fault", ["late@0.2", "lost@0.2", "repeated@0.2", "nan@0.2", "saturated@0.2x100"])
def test_a_passing_fault_is_counted_and_the_run_goes_on(fault: str) -> None:
    answer = control(MODEL, "--duration-s", 0.5, "--json", "--fault", fault, *PATIENT)
    assert answer.returncode == 0, answer.stderr
    assert sum(json.loads(answer.stdout)["ticks_by_status"].values()) == json.loads(answer.stdout)["ticks"]
    assert len(json.loads(answer.stdout)["ticks_by_status"]) == 2


def test_a_rate_too_low_is_said_and_ends_the_run(tmp_path: Path) -> None:
    process = started(MODEL, "--duration-s", 20, "--record", tmp_path / "felt.csv", "--json")
    wait_for_rows(tmp_path / "felt.csv.part", process)
    process.send_signal(signal.SIGSTOP)
    time.sleep(2.0)
    process.send_signal(signal.SIGCONT)
    told, talk = process.communicate(timeout=30)
    assert process.returncode == 1
    assert "the loop did not hold its rate" in talk
    assert json.loads(told)["missed_deadlines"] > 1000


def test_after_kill_the_part_is_complete_to_the_last_tenth_of_a_second(tmp_path: Path) -> None:
    chance = random.Random(5)
    out = tmp_path / "felt.csv"
    part = tmp_path / "felt.csv.part"
    for _ in range(KILLS):
        process = started(MODEL, "--duration-s", "inf", "--record", out, *PATIENT)
        seen = wait_for_rows(part, process)
        time.sleep(chance.uniform(0.0, 1.5))
        ran = time.monotonic() - seen
        process.kill()
        process.communicate()
        recording = read_recording(part)
        assert recording.time is not None
        assert recording.time[-1] >= ran - 0.1
        sequence = recording.columns["sequence"]
        assert np.array_equal(sequence, np.arange(1, len(recording) + 1))
        part.unlink()


def test_a_torn_last_line_is_left_out_and_counted(tmp_path: Path) -> None:
    out = tmp_path / "felt.csv"
    assert control(MODEL, "--duration-s", 0.2, "--record", out, *PATIENT).returncode == 0
    whole = out.read_bytes()
    part = tmp_path / "torn.csv.part"
    part.write_bytes(whole[:-7])
    recording = read_recording(part)
    assert len(recording) == len(read_recording(out)) - 1
    assert any("torn" in note or "cut off" in note or "last line" in note for note in recording.notes)


def test_a_recording_that_was_cut_off_is_never_overwritten(tmp_path: Path) -> None:
    (tmp_path / "felt.csv.part").write_text("precious", encoding="utf-8")
    answer = control(MODEL, "--duration-s", 0.1, "--record", tmp_path / "felt.csv", *PATIENT)
    assert answer.returncode == 0
    assert (tmp_path / "felt.csv.1.part").read_text(encoding="utf-8") == "precious"
    assert "felt.csv.1.part" in answer.stderr


def expect_cut_recording(answer: subprocess.CompletedProcess[str], out: Path, ticks: int) -> None:
    assert answer.returncode == 0, answer.stderr
    summary = json.loads(answer.stdout)
    assert summary["ended"] == "ran its time"
    assert summary["ticks"] + summary["missed_deadlines"] >= ticks
    assert "the recording stopped, the loop goes on" in answer.stderr
    recording = read_recording(out)
    assert 0 < len(recording) == summary["recorded"] < summary["ticks"]
    assert summary["recorded"] + summary["lost_records"] == summary["ticks"]
    assert "incomplete" in recording.metadata["ended"]


def test_a_file_that_may_not_grow_stops_the_recording_and_not_the_loop(tmp_path: Path) -> None:
    def limit() -> None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, 20_000))

    out = tmp_path / "felt.csv"
    answer = control(MODEL, "--duration-s", 1, "--record", out, "--json", *PATIENT, preexec_fn=limit)
    expect_cut_recording(answer, out, 1000)


@pytest.fixture
def full_disk(tmp_path: Path) -> Path:
    """A disk of 64 KiB that is seen by nobody else."""
    if os.geteuid() != 0 or shutil.which("unshare") is None:
        pytest.skip("needs root and unshare, to mount a small disk")
    place = tmp_path / "disk"
    place.mkdir()
    tried = subprocess.run(
        ["unshare", "-m", "mount", "-t", "tmpfs", "-o", "size=64k", "tmpfs", place],
        capture_output=True,
        check=False,
    )
    if tried.returncode != 0:
        pytest.skip("needs root and unshare, to mount a small disk")
    return place


def test_a_full_disk_stops_the_recording_and_not_the_loop(tmp_path: Path, full_disk: Path) -> None:
    script = (
        'mount -t tmpfs -o size=64k tmpfs "$1"; place=$1; shift; '
        '"$@"; code=$?; cp "$place/felt.csv" "$place/../felt.csv"; exit $code'
    )
    command = [PROGRAM, MODEL, "--duration-s", "2", "--record", full_disk / "felt.csv", "--json", *PATIENT]
    answer = subprocess.run(
        ["unshare", "-m", "sh", "-c", script, "sh", full_disk, *command],
        capture_output=True,
        text=True,
        check=False,
        timeout=60,
    )
    expect_cut_recording(answer, tmp_path / "felt.csv", 2000)
    assert "No space left on device" in answer.stderr


def resident_kib(process: subprocess.Popen[str]) -> int:
    status = Path(f"/proc/{process.pid}/status").read_text(encoding="utf-8")
    return int(next(line.split()[1] for line in status.splitlines() if line.startswith("VmRSS")))


def test_a_long_run_loses_nothing_and_its_memory_stays_flat(tmp_path: Path) -> None:
    out = tmp_path / "felt.csv"
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as listener:
        listener.bind(("127.0.0.1", 0))
        listener.setblocking(False)
        words = ["--telemetry-port", listener.getsockname()[1], "--telemetry-hz", 20, "--json", *PATIENT]
        process = started(MODEL, "--duration-s", LONG_RUN_S, "--record", out, *words)
        wait_for_rows(tmp_path / "felt.csv.part", process)
        time.sleep(1.0)
        memory = [resident_kib(process)]
        lines = []
        while process.poll() is None:
            time.sleep(0.25)
            with contextlib.suppress(OSError, StopIteration):  # it may have just ended
                memory.append(resident_kib(process))
            while True:
                try:
                    lines.append(json.loads(listener.recv(4096)))
                except BlockingIOError:
                    break
    told, talk = process.communicate()
    assert process.returncode == 0, talk
    summary = json.loads(told)
    print(f"{summary['ticks']} ticks, {summary['lost_records']} lost, {memory[0]} to {max(memory)} KiB")
    assert summary["lost_records"] == 0
    assert summary["recorded"] == summary["ticks"]
    assert max(memory) - memory[0] <= 256
    assert len(lines) >= 0.8 * 20 * LONG_RUN_S * summary["rate_hz"] / 1000.0
    assert {"time_s", "position_rad", "force_Nm", "status"} <= lines[0].keys()
    times = [line["time_s"] for line in lines]
    assert times == sorted(times)


def test_what_was_rendered_is_identified_as_the_same_model(tmp_path: Path) -> None:
    first = identify(sample_recording(seed=1), inputs=("position",))
    first.save(tmp_path / "first.json")
    out = tmp_path / "felt.csv"
    words = ["--duration-s", 8, "--record", out, "--compensated", "--ramp-s", "0.2", *PATIENT]
    assert control(tmp_path / "first.json", *words).returncode == 0
    felt = read_recording(out, rows=(200, None))  # without the ramp, which is no property of the object
    again = identify(felt, inputs=("position",))
    low, high = (
        np.maximum(felt.position.min(), first.lower[0]),
        np.minimum(felt.position.max(), first.upper[0]),
    )
    assert high - low > 0.4
    x = np.linspace(low, high, 400)
    one, two = first.force(x), again.force(x)
    perceived = 0.07 * np.maximum(np.abs(one), 0.1 * np.abs(one).max())
    assert np.all(np.abs(two - one) <= perceived)

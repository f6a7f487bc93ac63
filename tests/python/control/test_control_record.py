# SPDX-License-Identifier: Apache-2.0
"""Flight records of palpate-control after every kind of ending, and their further use."""

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
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from control_program import MODEL, PATIENT, PROGRAM, control, every_row, needs_program, started, wait_for_rows
from palpate import InputError, load_model, read_recording
from palpate.recording.sample import sample_recording

SCALE = max(1, int(os.environ.get("PALPATE_TEST_SCALE", "1")))
KILLS = 2 * SCALE
LONG_RUN_S = 6.0 * SCALE

pytestmark = needs_program


@pytest.mark.parametrize(
    ("structure", "rate"),
    [("direct", 100), ("direct", 10_000), ("massless", 1000), ("implicit", 1000), ("explicit", 5000)],
)
def test_a_run_leaves_a_complete_recording(tmp_path: Path, structure: str, rate: int) -> None:
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
    assert len(every_row(out)) == summary["ticks"] == summary["recorded"]
    assert summary["ticks"] + summary["missed_deadlines"] >= 0.5 * rate
    assert summary["lost_records"] == 0
    assert recording.source.columns["position"] == "position_rad"
    assert recording.source.columns["force"] == "force_Nm"
    assert recording.units == {"position": "rad", "force": "N*m"}
    assert "missed deadlines" in recording.metadata["timing"]
    assert recording.metadata["ended"].startswith("the duration ended; zero force sent, device closed")
    assert recording.metadata["simulated"].startswith("yes")


def test_columns_are_chosen_even_without_the_hint_in_the_file(tmp_path: Path) -> None:
    out = tmp_path / "felt.csv"
    assert control(MODEL, "--duration-s", 0.3, "--record", out, *PATIENT).returncode == 0
    bare = tmp_path / "bare.csv"
    lines = [line for line in out.read_text(encoding="utf-8").splitlines() if not line.startswith("#")]
    bare.write_text("\n".join(lines) + "\n", encoding="utf-8")
    assert read_recording(bare).source.columns == read_recording(out).source.columns


def test_after_kill_the_part_is_complete_to_the_last_tenth_of_a_second(tmp_path: Path) -> None:
    chance = random.Random(5)
    out = tmp_path / "felt.csv"
    part = tmp_path / "felt.csv.part"
    as_modelled = ["--ramp-s", 0, "--slew-s", 0]  # every row is usable
    for _ in range(KILLS):
        process = started(MODEL, "--duration-s", "inf", "--record", out, *as_modelled, *PATIENT)
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
    assert control(MODEL, "--duration-s", 1.0, "--record", out, *PATIENT).returncode == 0
    whole = out.read_bytes()
    part = tmp_path / "torn.csv.part"
    part.write_bytes(whole[:-7])
    recording = read_recording(part)
    assert len(recording) == len(read_recording(out)) - 1
    assert any("torn" in note or "cut off" in note or "last line" in note for note in recording.notes)


def test_a_recording_that_was_cut_off_is_never_overwritten(tmp_path: Path) -> None:
    (tmp_path / "felt.csv.part").write_text("precious", encoding="utf-8")
    answer = control(MODEL, "--duration-s", 0.8, "--record", tmp_path / "felt.csv", *PATIENT)
    assert answer.returncode == 0
    assert (tmp_path / "felt.csv.1.part").read_text(encoding="utf-8") == "precious"
    assert "felt.csv.1.part" in answer.stderr


def test_an_existing_recording_is_refused_before_anything_runs_and_replaced_with_force(
    tmp_path: Path,
) -> None:
    out = tmp_path / "felt.csv"
    out.write_text("precious", encoding="utf-8")
    words = [MODEL, "--duration-s", 0.8, "--record", out, *PATIENT]
    answer = control(*words)
    assert answer.returncode == 2
    assert answer.stderr.startswith(f"error: {out} exists already; choose another name, or ")
    assert answer.stderr.count("\n") == 1
    assert out.read_text(encoding="utf-8") == "precious"
    assert os.listdir(tmp_path) == ["felt.csv"]
    assert control(*words, "--force").returncode == 0
    assert len(every_row(out)) > 500


def test_the_recording_of_a_failed_run_is_not_replaced_by_the_next_run(tmp_path: Path) -> None:
    out, fault = tmp_path / "felt.csv", tmp_path / "felt.fault.csv"
    words = [MODEL, "--duration-s", 2, "--record", out, "--fault", "gone@0.8", *PATIENT]
    assert control(*words).returncode == 1
    kept = out.read_bytes(), fault.read_bytes()
    assert control(*words).returncode == 2
    assert (out.read_bytes(), fault.read_bytes()) == kept
    out.rename(tmp_path / "first.csv")
    answer = control(*words)
    assert answer.returncode == 1
    assert fault.read_bytes() == kept[1]
    assert f"the last 500 ticks are in {tmp_path / 'felt.fault-2.csv'}" in answer.stderr
    assert len(every_row(tmp_path / "felt.fault-2.csv")) == 500


def stopped(process: subprocess.Popen[str]) -> subprocess.CompletedProcess[str]:
    process.send_signal(signal.SIGINT)
    told, talk = process.communicate(timeout=60)
    return subprocess.CompletedProcess(process.args, process.returncode, told, talk)


@pytest.mark.parametrize("force", [[], ["--force"]], ids=["plain", "force"])
@pytest.mark.parametrize("second", ["palpate-control", "render", "record"])
@pytest.mark.parametrize("first", ["palpate-control", "render"])
def test_the_second_of_two_runs_with_one_recording_is_refused_and_the_first_keeps_its_rows(
    tmp_path: Path, first: str, second: str, force: list[str]
) -> None:
    out = tmp_path / "felt.csv"
    python = [sys.executable, "-m", "palpate"]
    commands = {
        "palpate-control": [PROGRAM, MODEL, "--record", out, *PATIENT],
        "render": [*python, "render", MODEL, "--record", out, *PATIENT],
        "record": [*python, "record", out, "--object", MODEL, "--probe", *PATIENT],
    }
    running = subprocess.Popen(
        list(map(str, [*commands[first], "--duration-s", "inf", "--json"])),
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        wait_for_rows(tmp_path / "felt.csv.part", running)
        refused = subprocess.run(
            list(map(str, [*commands[second], "--duration-s", "0.5", *force])),
            capture_output=True,
            text=True,
            check=False,
            timeout=60,
        )
        assert refused.returncode == 2, refused.stderr
        assert "felt.csv.part is being written by another run" in refused.stderr.splitlines()[-1]
        assert os.listdir(tmp_path) == ["felt.csv.part"]
        time.sleep(0.7)
    finally:
        answer = stopped(running)
    assert answer.returncode == 0, answer.stderr
    summary = json.loads(answer.stdout)
    assert len(every_row(out)) == summary["recorded"] == summary["ticks"]
    assert os.listdir(tmp_path) == ["felt.csv"]


def test_a_file_that_appears_while_the_loop_runs_is_not_replaced(tmp_path: Path) -> None:
    out, part = tmp_path / "felt.csv", tmp_path / "felt.csv.part"
    process = started(MODEL, "--duration-s", "inf", "--record", out, "--json", *PATIENT)
    wait_for_rows(part, process)
    time.sleep(0.7)
    out.write_text("precious", encoding="utf-8")
    answer = stopped(process)
    assert answer.returncode == 0
    assert out.read_text(encoding="utf-8") == "precious"
    summary = json.loads(answer.stdout)
    sentence = f"{out} was created by another program meanwhile and is not replaced; the recording is {part}"
    assert sentence in answer.stderr
    assert sentence in summary["verdict"]
    assert summary["record"] == str(part)
    assert len(every_row(part)) == summary["recorded"]


def test_closed_standard_output_does_not_end_up_in_the_recording(tmp_path: Path) -> None:
    out = tmp_path / "felt.csv"
    for words in ([], ["--json"]):
        command = [PROGRAM, MODEL, "--duration-s", "0.8", "--record", out, "--force", *PATIENT, *words]
        answer = subprocess.run(
            ["sh", "-c", '"$@" >&-', "sh", *map(str, command)],
            stderr=subprocess.PIPE,
            text=True,
            check=False,
            timeout=60,
        )
        assert answer.returncode == 1
        assert "error: standard output could not be written" in answer.stderr.splitlines()[-1]
        text = out.read_text(encoding="utf-8")
        assert "verdict" not in text
        assert text.startswith("# created_by")
        assert text.splitlines()[-1].endswith(",Ok")


@pytest.mark.parametrize("words", [["--json"], [], ["--help"], ["--version"]], ids=" ".join)
def test_a_full_standard_output_ends_with_1_and_a_sentence(words: list[str]) -> None:
    with open("/dev/full", "w", encoding="utf-8") as full:
        answer = subprocess.run(
            list(map(str, [PROGRAM, MODEL, "--duration-s", 0.8, *PATIENT, *words])),
            stdout=full,
            stderr=subprocess.PIPE,
            text=True,
            check=False,
            timeout=60,
        )
    assert answer.returncode == 1
    assert answer.stderr.splitlines()[-1].startswith("error: standard output could not be written")


@pytest.mark.parametrize(
    ("words", "level", "sentence", "code"),
    [
        (["--structure", "direct", "--duration-s", 1.2], "good", "", 0),
        (["--duration-s", 0.1], "usable", "ticks lay within the ramp at the start: run for a longer time", 0),
        (["--duration-s", 0.1, "--record", "felt.csv"], "no", "the recording has no usable row", 0),
        (["--force-limit", 0.2, "--duration-s", 1.2], "usable", "clipped the force to its limit", 0),
        (["--fault", "nan@0.8x30"], "no", "stopped by a guard: NonFinite", 1),
        (["--fault", "lost@0.5x4", "--fault", "lost@0.7x4"], "usable", "samples of the device were lost", 0),
    ],
    ids=["good", "ramp", "nothing recorded", "clipped", "guard", "lost samples"],
)
def test_the_verdict_comes_first(
    tmp_path: Path, words: list[Any], level: str, sentence: str, code: int
) -> None:
    """On a busy machine deadlines are missed, which is also reported."""
    words = [MODEL, *(["--duration-s", 1.2] if "--duration-s" not in words else []), *words, *PATIENT]
    answer = control(*words, cwd=tmp_path)
    assert answer.returncode == code, answer.stderr
    first, *others = answer.stdout.splitlines()
    busy = level == "good" and first == "verdict: usable" and all("deadlines" in o for o in others[:1])
    assert first == f"verdict: {level}" or busy
    assert any(sentence in line for line in others)
    summary = json.loads(control(*words, "--json", "--force", cwd=tmp_path).stdout)
    assert summary["verdict"].startswith(level) or busy or "deadlines" in summary["verdict"]
    assert sentence in summary["verdict"]


def expect_cut_recording(answer: subprocess.CompletedProcess[str], out: Path, ticks: int) -> None:
    assert answer.returncode == 0, answer.stderr
    summary = json.loads(answer.stdout)
    assert summary["ended"] == "the duration ended"
    assert summary["ticks"] + summary["missed_deadlines"] >= ticks
    assert "the recording stopped, the loop continues" in answer.stderr
    assert 0 < len(every_row(out)) == summary["recorded"] < summary["ticks"]
    assert summary["recorded"] + summary["lost_records"] == summary["ticks"]
    assert "incomplete" in read_recording(out).metadata["ended"]


def test_a_file_that_may_not_grow_stops_the_recording_and_not_the_loop(tmp_path: Path) -> None:
    def limit() -> None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (40_000, 40_000))

    out = tmp_path / "felt.csv"
    answer = control(MODEL, "--duration-s", 1, "--record", out, "--json", *PATIENT, preexec_fn=limit)
    expect_cut_recording(answer, out, 1000)


@pytest.fixture
def full_disk(tmp_path: Path) -> Path:
    """Returns a private disk of 64 KiB."""
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


def test_rows_whose_force_was_not_the_model_s_alone_are_left_out_and_counted(tmp_path: Path) -> None:
    """The ramp, clipped rows and rows after a fault do not describe the object."""
    out = tmp_path / "felt.csv"
    words = ["--duration-s", 2, "--structure", "direct", "--force-limit", 1.2, "--fault", "nan@0.5x3"]
    assert control(MODEL, *words, "--record", out, "--json", *PATIENT).returncode == 0
    statuses = every_row(out)["status"].value_counts()
    assert set(statuses.index) == {"Ok", "Ramp", "Limited", "NonFinite"}
    recording = read_recording(out)
    assert len(recording) == statuses["Ok"]
    assert set(recording.columns["status"]) == {"Ok"}
    np.testing.assert_allclose(recording.force, load_model(MODEL).force(recording.position), atol=1e-12)
    counts = ", ".join(f"{statuses[word]} {word}" for word in ("Limited", "NonFinite", "Ramp"))
    assert any(f"({counts})" in note for note in recording.notes)


def test_a_record_of_nothing_but_the_ramp_is_refused_with_the_reason(tmp_path: Path) -> None:
    out = tmp_path / "felt.csv"
    assert control(MODEL, "--duration-s", 0.1, "--record", out, *PATIENT).returncode == 0
    with pytest.raises(InputError, match=r"has 0 usable rows; .* left out \(\d+ Ramp\)$"):
        read_recording(out)


def palpate(*words: Any) -> str:
    """Runs the command line, which must succeed."""
    command = [sys.executable, "-m", "palpate", *map(str, words)]
    answer = subprocess.run(command, capture_output=True, text=True, check=False)
    assert answer.returncode == 0, answer.stderr
    return answer.stdout


def test_what_was_rendered_is_identified_as_the_same_model_with_no_hint(tmp_path: Path) -> None:
    """Runs all steps with the programs: identify, render, record, identify the record, compare."""
    sample, felt = tmp_path / "sample.csv", tmp_path / "felt.csv"
    first, again, picture = (tmp_path / name for name in ("first.json", "again.json", "both.png"))
    sample_recording(seed=1).write(sample)
    palpate("identify", sample, "-o", first)
    assert control(first, "--duration-s", 5, "--record", felt, "--compensated", *PATIENT).returncode == 0
    palpate("identify", felt, "-o", again)
    told = palpate("show", first, "--beside", again, "--plot", picture)
    assert told.startswith("verdict: good\n")
    rows = told.partition("largest difference, in just noticeable ones\n")[2].splitlines()
    shares = [float(row.split()[-1]) for row in rows]
    print(f"largest difference in just noticeable ones: {shares}")
    assert shares
    assert max(shares) < 1.0
    assert picture.read_bytes().startswith(b"\x89PNG")
    one, two = load_model(first), load_model(again)
    assert np.ptp(two.domain) > 0.9 * np.ptp(one.domain)

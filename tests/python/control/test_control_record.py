# SPDX-License-Identifier: Apache-2.0
"""Flight records of palpate-control after each reason to end a run; reading and identifying them."""

from __future__ import annotations

import contextlib
import json
import os
import resource
import shutil
import signal
import socket
import subprocess
import sys
import time
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from conftest import sampled
from control_program import (
    MODEL,
    PROGRAM,
    control,
    every_row,
    needs_program,
    run,
    start,
    wait_for_rows,
)
from palpate import InputError, load_model, read_recording
from palpate.recording.sample import sample_recording

SCALE = max(1, int(os.environ.get("PALPATE_TEST_SCALE", "1")))
LONG_RUN_S = 60 * SCALE

pytestmark = needs_program


@pytest.mark.parametrize(
    ("structure", "rate"),
    [("direct", 100), ("direct", 10_000), ("massless", 1000), ("implicit", 1000), ("explicit", 5000)],
)
def test_a_run_writes_a_complete_recording(tmp_path: Path, structure: str, rate: int) -> None:
    out = tmp_path / "rendered.csv"
    completed = control(
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
    )
    assert completed.returncode == 0, completed.stderr
    summary = json.loads(completed.stdout)
    recording = read_recording(out)
    assert not (tmp_path / "rendered.csv.part").exists()
    assert len(every_row(out)) == summary["ticks"] == summary["recorded"]
    assert summary["ticks"] == 0.5 * rate
    assert summary["missed_deadlines"] == 0
    assert summary["lost_records"] == 0
    assert recording.source.columns["position"] == "position_rad"
    assert recording.source.columns["force"] == "force_Nm"
    assert recording.units == {"position": "rad", "force": "N*m"}
    assert "missed deadlines" in recording.metadata["timing"]
    assert recording.metadata["ended"].startswith("the duration ended; zero force sent and confirmed")
    assert recording.metadata["simulated"].startswith("yes")


def test_the_same_columns_are_chosen_without_the_metadata(tmp_path: Path) -> None:
    out = tmp_path / "rendered.csv"
    assert control(MODEL, "--duration-s", 0.3, "--record", out).returncode == 0
    without_comments = tmp_path / "bare.csv"
    lines = [line for line in out.read_text(encoding="utf-8").splitlines() if not line.startswith("#")]
    without_comments.write_text("\n".join(lines) + "\n", encoding="utf-8")
    assert read_recording(without_comments).source.columns == read_recording(out).source.columns


def test_after_kill_the_part_file_is_complete_except_for_100_ms(tmp_path: Path) -> None:
    part = tmp_path / "rendered.csv.part"
    as_modelled = ["--ramp-s", 0, "--slew-s", 0]  # without start ramp and slew limit every row can be used
    for reports in range(1, 1 + 2 * SCALE):
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as listener:
            listener.bind(("127.0.0.1", 0))
            port = ["--telemetry-port", listener.getsockname()[1]]
            record = ["--duration-s", "inf", "--record", tmp_path / "rendered.csv"]
            process = start(PROGRAM, MODEL, *record, *as_modelled, *port)
            times = [json.loads(listener.recv(4096))["time_s"] for _ in range(8 * reports)]
            process.kill()
            process.communicate()
        recording = read_recording(part)
        assert recording.time is not None
        assert recording.time[-1] >= times[-1] - 0.1
        sequence = recording.columns["sequence"]
        assert np.array_equal(sequence, np.arange(1, len(recording) + 1))
        part.unlink()


def test_an_incomplete_last_line_is_dropped_and_counted(tmp_path: Path) -> None:
    out = tmp_path / "rendered.csv"
    assert control(MODEL, "--duration-s", 1.0, "--record", out).returncode == 0
    content = out.read_bytes()
    part = tmp_path / "torn.csv.part"
    part.write_bytes(content[:-7])
    recording = read_recording(part)
    assert len(recording) == len(read_recording(out)) - 1
    assert any("torn" in note or "cut off" in note or "last line" in note for note in recording.notes)


def test_an_incomplete_recording_is_never_overwritten(tmp_path: Path) -> None:
    (tmp_path / "rendered.csv.part").write_text("precious", encoding="utf-8")
    completed = control(MODEL, "--duration-s", 0.8, "--record", tmp_path / "rendered.csv")
    assert completed.returncode == 0
    assert (tmp_path / "rendered.csv.1.part").read_text(encoding="utf-8") == "precious"
    assert "rendered.csv.1.part" in completed.stderr


def test_an_existing_recording_is_refused_before_the_run_and_replaced_with_force(
    tmp_path: Path,
) -> None:
    out = tmp_path / "rendered.csv"
    out.write_text("precious", encoding="utf-8")
    arguments = [MODEL, "--duration-s", 0.8, "--record", out]
    completed = control(*arguments)
    assert completed.returncode == 2
    assert completed.stderr.startswith(f"error: {out} exists already; choose another name, or ")
    assert completed.stderr.count("\n") == 1
    assert out.read_text(encoding="utf-8") == "precious"
    assert os.listdir(tmp_path) == ["rendered.csv"]
    assert control(*arguments, "--force").returncode == 0
    assert len(every_row(out)) > 500


def test_the_recording_of_a_failed_run_is_not_replaced_by_the_next_run(tmp_path: Path) -> None:
    out, fault = tmp_path / "rendered.csv", tmp_path / "rendered.fault.csv"
    arguments = [MODEL, "--duration-s", 2, "--record", out, "--fault", "gone@0.8"]
    assert control(*arguments).returncode == 1
    first_contents = out.read_bytes(), fault.read_bytes()
    assert control(*arguments).returncode == 2
    assert (out.read_bytes(), fault.read_bytes()) == first_contents
    out.rename(tmp_path / "first.csv")
    completed = control(*arguments)
    assert completed.returncode == 1
    assert fault.read_bytes() == first_contents[1]
    assert f"the last 500 ticks are in {tmp_path / 'rendered.fault-2.csv'}" in completed.stderr
    assert len(every_row(tmp_path / "rendered.fault-2.csv")) == 500


def stop_with_ctrl_c(process: subprocess.Popen[str]) -> subprocess.CompletedProcess[str]:
    process.send_signal(signal.SIGINT)
    output, messages = process.communicate()
    return subprocess.CompletedProcess(process.args, process.returncode, output, messages)


@pytest.mark.parametrize(
    ("first", "second", "force"),
    sampled(
        product(("palpate-control", "render"), ("palpate-control", "render", "record"), ("", "--force")),
        ("palpate-control", "palpate-control", "--force"),
        ("palpate-control", "render", ""),
        ("render", "record", "--force"),
    ),
)
def test_a_second_run_into_the_same_recording_is_refused_and_the_first_keeps_its_rows(
    tmp_path: Path, first: str, second: str, force: str
) -> None:
    out = tmp_path / "rendered.csv"
    python = [sys.executable, "-m", "palpate"]
    commands = {
        "palpate-control": [PROGRAM, MODEL, "--record", out],
        "render": [*python, "render", MODEL, "--record", out],
        "record": [*python, "record", out, "--object", MODEL, "--probe"],
    }
    running = start(*commands[first], "--duration-s", "inf", "--json")
    try:
        wait_for_rows(tmp_path / "rendered.csv.part", running, 500)
        running.send_signal(signal.SIGSTOP)
        refused = run(*commands[second], "--duration-s", 0.5, *force.split())
        assert refused.returncode == 2, refused.stderr
        assert "rendered.csv.part is being written by another run" in refused.stderr.splitlines()[-1]
        assert os.listdir(tmp_path) == ["rendered.csv.part"]
    finally:
        running.send_signal(signal.SIGCONT)
        completed = stop_with_ctrl_c(running)
    assert completed.returncode == 0, completed.stderr
    summary = json.loads(completed.stdout)
    assert len(every_row(out)) == summary["recorded"] == summary["ticks"]
    assert os.listdir(tmp_path) == ["rendered.csv"]


def test_a_file_that_appears_while_the_loop_runs_is_not_replaced(tmp_path: Path) -> None:
    out, part = tmp_path / "rendered.csv", tmp_path / "rendered.csv.part"
    process = start(PROGRAM, MODEL, "--duration-s", "inf", "--record", out, "--json")
    wait_for_rows(part, process, 500)
    out.write_text("precious", encoding="utf-8")
    completed = stop_with_ctrl_c(process)
    assert completed.returncode == 0
    assert out.read_text(encoding="utf-8") == "precious"
    summary = json.loads(completed.stdout)
    sentence = f"{out} was created by another program meanwhile and is not replaced; the recording is {part}"
    assert sentence in completed.stderr
    assert sentence in summary["verdict"]
    assert summary["record"] == str(part)
    assert len(every_row(part)) == summary["recorded"]


def test_messages_for_a_closed_standard_output_are_not_written_to_the_recording(tmp_path: Path) -> None:
    out = tmp_path / "rendered.csv"
    for arguments in ([], ["--json"]):
        command = [PROGRAM, MODEL, "--duration-s", "0.8", "--record", out, "--force", *arguments]
        completed = run("sh", "-c", '"$@" >&-', "sh", *command)
        assert completed.returncode == 1
        assert "error: standard output could not be written" in completed.stderr.splitlines()[-1]
        text = out.read_text(encoding="utf-8")
        assert "verdict" not in text
        assert text.startswith("# created_by")
        assert text.splitlines()[-1].endswith(",Ok")


@pytest.mark.parametrize("arguments", [["--json"], [], ["--help"], ["--version"]], ids=" ".join)
def test_a_full_standard_output_exits_with_code_1_and_one_sentence(arguments: list[str]) -> None:
    with open("/dev/full", "w", encoding="utf-8") as full_device:
        completed = control(MODEL, "--duration-s", 0.8, *arguments, stdout=full_device)
    assert completed.returncode == 1
    assert completed.stderr.splitlines()[-1].startswith("error: standard output could not be written")


@pytest.mark.parametrize(
    ("arguments", "level", "sentence", "code"),
    [
        (["--structure", "direct", "--duration-s", 1.2], "good", "", 0),
        (["--duration-s", 0.1], "usable", "ticks were part of the start ramp", 0),
        (["--duration-s", 0.1, "--record", "rendered.csv"], "no", "the recording has no usable row", 0),
        (["--force-limit", 0.2, "--duration-s", 1.2], "usable", "clipped the force to the force limit", 0),
        (["--fault", "nan@0.8x30"], "no", "stopped by a guard: NonFinite", 1),
        (["--fault", "lost@0.5x4", "--fault", "lost@0.7x4"], "usable", "samples of the device were lost", 0),
    ],
    ids=["good", "ramp", "nothing recorded", "clipped", "guard", "lost samples"],
)
def test_the_verdict_is_the_first_line(
    tmp_path: Path, arguments: list[Any], level: str, sentence: str, code: int
) -> None:
    arguments = [
        MODEL,
        *(["--duration-s", 1.2] if "--duration-s" not in arguments else []),
        *arguments,
    ]
    completed = control(*arguments, cwd=tmp_path)
    assert completed.returncode == code, completed.stderr
    first, *other_lines = completed.stdout.splitlines()
    assert first == f"verdict: {level}"
    assert any(sentence in line for line in other_lines)
    summary = json.loads(control(*arguments, "--json", "--force", cwd=tmp_path).stdout)
    assert summary["verdict"].startswith(level)
    assert sentence in summary["verdict"]


def expect_cut_recording(completed: subprocess.CompletedProcess[str], out: Path, ticks: int) -> None:
    assert completed.returncode == 0, completed.stderr
    summary = json.loads(completed.stdout)
    assert summary["ended"] == "the duration ended"
    assert summary["ticks"] == ticks
    assert "the recording stopped, the loop continues" in completed.stderr
    assert 0 < len(every_row(out)) == summary["recorded"] < summary["ticks"]
    assert summary["recorded"] + summary["lost_records"] == summary["ticks"]
    assert "incomplete" in read_recording(out).metadata["ended"]


def test_a_file_size_limit_stops_the_recording_but_not_the_loop(tmp_path: Path) -> None:
    def limit() -> None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (40_000, 40_000))

    out = tmp_path / "rendered.csv"
    completed = control(MODEL, "--duration-s", 1, "--record", out, "--json", preexec_fn=limit)
    expect_cut_recording(completed, out, 1000)


@pytest.fixture
def full_disk(tmp_path: Path) -> Path:
    """Returns a folder on a file system of 64 KiB that only this test uses."""
    if os.geteuid() != 0 or shutil.which("unshare") is None:
        pytest.skip("needs root and unshare, to mount a small disk")
    folder = tmp_path / "disk"
    folder.mkdir()
    mounted = subprocess.run(
        ["unshare", "-m", "mount", "-t", "tmpfs", "-o", "size=64k", "tmpfs", folder],
        capture_output=True,
        check=False,
    )
    if mounted.returncode != 0:
        pytest.skip("needs root and unshare, to mount a small disk")
    return folder


def test_a_full_disk_stops_the_recording_but_not_the_loop(tmp_path: Path, full_disk: Path) -> None:
    script = (
        'mount -t tmpfs -o size=64k tmpfs "$1"; place=$1; shift; '
        '"$@"; code=$?; cp "$place/rendered.csv" "$place/../rendered.csv"; exit $code'
    )
    command = [
        PROGRAM,
        MODEL,
        "--duration-s",
        "2",
        "--record",
        full_disk / "rendered.csv",
        "--json",
    ]
    completed = run("unshare", "-m", "sh", "-c", script, "sh", full_disk, *command)
    expect_cut_recording(completed, tmp_path / "rendered.csv", 2000)
    assert "No space left on device" in completed.stderr


def resident_kib(process: subprocess.Popen[str]) -> int:
    status = Path(f"/proc/{process.pid}/status").read_text(encoding="utf-8")
    return int(next(line.split()[1] for line in status.splitlines() if line.startswith("VmRSS")))


def test_a_long_run_loses_no_row_and_its_memory_is_constant(tmp_path: Path) -> None:
    out = tmp_path / "rendered.csv"
    process = start(PROGRAM, MODEL, "--duration-s", LONG_RUN_S, "--record", out, "--json")
    wait_for_rows(tmp_path / "rendered.csv.part", process, 1000)
    memory = [resident_kib(process)]
    while process.poll() is None:
        with contextlib.suppress(OSError, StopIteration):  # the process may already have ended
            memory.append(resident_kib(process))
        time.sleep(0.05)
    output, messages = process.communicate()
    assert process.returncode == 0, messages
    summary = json.loads(output)
    print(f"{summary['ticks']} ticks, {summary['lost_records']} lost, {memory[0]} to {max(memory)} KiB")
    assert summary["lost_records"] == 0
    assert summary["recorded"] == summary["ticks"] == 1000 * LONG_RUN_S
    assert max(memory) - memory[0] <= 256


def test_the_telemetry_sends_states_in_their_order() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as listener:
        listener.bind(("127.0.0.1", 0))
        arguments = ["--telemetry-port", listener.getsockname()[1], "--telemetry-hz", 20]
        completed = control(MODEL, "--duration-s", 4, *arguments)
        assert completed.returncode == 0, completed.stderr
        lines = [json.loads(listener.recv(4096)) for _ in range(75)]
    assert {"time_s", "position_rad", "force_Nm", "status"} <= lines[0].keys()
    assert np.diff([line["time_s"] for line in lines]) == pytest.approx(0.05, abs=0.02)


def test_rows_with_a_force_changed_by_a_guard_are_dropped_and_counted(tmp_path: Path) -> None:
    """Rows of the start ramp, rows with a clipped force and rows after a fault do not describe the object."""
    out = tmp_path / "rendered.csv"
    arguments = ["--duration-s", 2, "--structure", "direct", "--force-limit", 1.2, "--fault", "nan@0.5x3"]
    assert control(MODEL, *arguments, "--record", out, "--json").returncode == 0
    statuses = every_row(out)["status"].value_counts()
    assert set(statuses.index) == {"Ok", "Ramp", "Limited", "NonFinite"}
    recording = read_recording(out)
    assert len(recording) == statuses["Ok"]
    assert set(recording.columns["status"]) == {"Ok"}
    np.testing.assert_allclose(recording.force, load_model(MODEL).force(recording.position), atol=1e-12)
    counts = ", ".join(f"{statuses[word]} {word}" for word in ("Limited", "NonFinite", "Ramp"))
    assert any(f"({counts})" in note for note in recording.notes)


def test_a_record_of_the_ramp_alone_is_refused_with_the_reason(tmp_path: Path) -> None:
    out = tmp_path / "rendered.csv"
    assert control(MODEL, "--duration-s", 0.1, "--record", out).returncode == 0
    with pytest.raises(
        InputError,
        match=r"has 0 usable rows; .* left out \d+ rows whose force is not the model's force \(\d+ Ramp\)$",
    ):
        read_recording(out)


def palpate(*arguments: Any) -> str:
    """Runs a palpate command, which must succeed, and returns its standard output."""
    command = [sys.executable, "-m", "palpate", *map(str, arguments)]
    completed = subprocess.run(command, capture_output=True, text=True, check=False)
    assert completed.returncode == 0, completed.stderr
    return completed.stdout


@pytest.mark.full
def test_a_rendered_model_is_identified_as_the_same_model(tmp_path: Path) -> None:
    """Runs all steps with the programs: identify, render, record, identify the record, compare."""
    sample, rendered = tmp_path / "sample.csv", tmp_path / "rendered.csv"
    first, second, figure = (tmp_path / name for name in ("first.json", "again.json", "both.png"))
    sample_recording(seed=1).write(sample)
    palpate("identify", sample, "-o", first)
    assert control(first, "--duration-s", 5, "--record", rendered, "--compensated").returncode == 0
    palpate("identify", rendered, "-o", second)
    output = palpate("show", first, "--beside", second, "--plot", figure)
    assert "a hand feels the difference" not in output
    rows = output.partition("noticed on\n")[2].splitlines()
    shares = [float(row.split()[-2]) for row in rows]
    print(f"largest difference in just noticeable ones: {shares}")
    assert shares
    assert max(shares) < 1.0
    assert figure.read_bytes().startswith(b"\x89PNG")
    one, two = load_model(first), load_model(second)
    assert np.ptp(two.domain) > 0.9 * np.ptp(one.domain)

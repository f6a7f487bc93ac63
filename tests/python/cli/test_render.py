# SPDX-License-Identifier: Apache-2.0
"""palpate render: the loop of palpate-control, run from Python."""

import json
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path
from typing import Any

import pytest

from control_program import MODEL, PATIENT, every_row, wait_for_rows
from palpate import _core, load_model, read_recording
from palpate._core.rendering import Scheme
from palpate._core.simulation import motion_driven

COMMAND = [sys.executable, "-m", "palpate", "render", str(MODEL)]


def render(scheme: Scheme, **words: Any) -> dict[str, Any]:
    """Accepts any rate, because the test machine may be busy."""
    return dict(_core.run.render(load_model(MODEL), scheme, **words, lowest_rate_share=0.0))


def test_a_live_rendering_leaves_a_recording_and_its_timing(tmp_path: Path) -> None:
    out = tmp_path / "felt.csv"
    summary = render(Scheme(), duration_s=0.3, record=str(out))
    assert len(every_row(out)) == summary["recorded"] == summary["ticks"]
    assert summary["ended"] == "the duration ended"
    assert summary["lost_records"] == 0
    assert summary["lateness"]["p50_us"] <= summary["lateness"]["p999_us"] <= summary["lateness"]["max_us"]


def test_the_energy_that_a_ramp_gives_is_told_apart() -> None:
    energy = render(Scheme(structure="direct"), duration_s=2.0)["energy"]
    assert 0.0 <= energy["given_in_ramp_J"] <= energy["most_stored_J"]
    assert 0.0 <= energy["given_J"] <= 1.1 * energy["most_stored_J"]
    assert energy["sentence"].startswith("given ")
    assert "J during the ramp" in energy["sentence"]


def test_each_force_is_what_the_model_says_of_its_position(tmp_path: Path) -> None:
    out = tmp_path / "felt.csv"
    model = load_model(MODEL)
    render(Scheme(structure="direct"), duration_s=1.0, record=str(out))
    live = read_recording(out)
    driven = motion_driven(model, Scheme(structure="direct"), live.position, 1e-3)["force"]
    assert live.force == pytest.approx(driven, abs=1e-15)


def test_python_goes_on_while_the_loop_runs() -> None:
    counted = 0
    over = threading.Event()

    def count() -> None:
        nonlocal counted
        while not over.is_set():
            counted += 1
            time.sleep(0.001)

    thread = threading.Thread(target=count)
    thread.start()
    render(Scheme(), duration_s=0.4)
    over.set()
    thread.join()
    assert counted > 20


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        ({"rate_hz": 5.0}, "rate_hz is 5"),
        ({"duration_s": 0.0}, "duration_s is 0"),
        ({"record": "/no/such/folder/felt.csv"}, "cannot be written"),
    ],
)
def test_what_is_wrong_is_refused(words: dict[str, object], sentence: str) -> None:
    with pytest.raises(ValueError, match=sentence):
        render(Scheme(), **words)


def test_an_existing_recording_is_refused_and_replaced_with_force(tmp_path: Path) -> None:
    out = tmp_path / "felt.csv"
    out.write_text("precious", encoding="utf-8")
    with pytest.raises(ValueError, match=r"felt.csv exists already; .* set force to replace it"):
        render(Scheme(), duration_s=0.3, record=str(out))
    words = [*COMMAND, "--duration-s", "0.8", "--record", str(out), *PATIENT]
    refused = subprocess.run(words, capture_output=True, text=True, check=False)
    assert refused.returncode == 2
    assert refused.stderr.startswith(f"error: {out} exists already; choose another name, or ")
    assert out.read_text(encoding="utf-8") == "precious"
    assert subprocess.run([*words, "--force"], capture_output=True, check=False).returncode == 0
    assert len(every_row(out)) > 500


def test_a_recording_that_was_cut_off_is_set_aside_and_named(tmp_path: Path) -> None:
    (tmp_path / "felt.csv.part").write_text("precious", encoding="utf-8")
    summary = render(Scheme(), duration_s=0.3, record=str(tmp_path / "felt.csv"))
    assert (tmp_path / "felt.csv.1.part").read_text(encoding="utf-8") == "precious"
    assert any("felt.csv.1.part" in note for note in summary["notes"])


def test_progress_is_called_while_it_runs_and_its_exception_ends_the_run() -> None:
    seen: list[tuple[int, float, float, int]] = []

    def show(ticks: int, position: float, force: float, lost: int) -> None:
        seen.append((ticks, position, force, lost))
        if len(seen) == 3:
            raise KeyError("enough")

    with pytest.raises(KeyError, match="enough"):
        render(Scheme(), duration_s=20.0, progress=show)
    assert [ticks for ticks, *_ in seen] == sorted(ticks for ticks, *_ in seen)


def test_the_verdict_is_in_the_summary_and_in_the_first_line(tmp_path: Path) -> None:
    short = render(Scheme(), duration_s=0.1, record=str(tmp_path / "a.csv"))
    assert short["verdict"].startswith("no: the recording has no usable row")
    assert next(iter(short)) == "verdict"
    assert short["findings"][0]["level"] == "no"
    out = tmp_path / "b.csv"
    answer = subprocess.run(
        [*COMMAND, "--duration-s", "0.1", "--record", str(out), *PATIENT],
        capture_output=True,
        text=True,
        check=False,
    )
    assert answer.returncode == 1
    assert answer.stdout.splitlines()[0] == "verdict: no"
    whole = render(Scheme(structure="direct"), duration_s=1.2)
    assert whole["verdict"] == "good" or all("deadlines" in f["sentence"] for f in whole["findings"])


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_the_verb_ends_in_an_orderly_way_when_asked(tmp_path: Path, number: signal.Signals) -> None:
    out = tmp_path / "felt.csv"
    command = [*COMMAND, "--duration-s", "inf", "--record", str(out), "--json", *PATIENT]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    wait_for_rows(Path(f"{out}.part"), process)
    time.sleep(0.8)  # longer than the ramp, whose rows are not used
    process.send_signal(number)
    told, talk = process.communicate(timeout=30)
    assert process.returncode == 0, told + talk
    assert json.loads(told)["recorded"] == len(every_row(out))


def test_a_rate_that_is_not_held_ends_the_run_unless_none_is_too_low(tmp_path: Path) -> None:
    """Stopped for most of a second, it misses the deadlines of a window of half a second."""
    for patient in (False, True):
        out = tmp_path / f"{patient}.csv"
        command = [*COMMAND, "--duration-s", "1.5", "--record", str(out), "--json", *(PATIENT * patient)]
        process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        wait_for_rows(Path(f"{out}.part"), process)
        process.send_signal(signal.SIGSTOP)
        time.sleep(0.9)
        process.send_signal(signal.SIGCONT)
        told, _ = process.communicate(timeout=30)
        assert process.returncode == (0 if patient else 1)
        assert ("the rate was too low" in told) != patient


def test_the_verb_refuses_with_one_sentence() -> None:
    answer = subprocess.run([*COMMAND, "--rate-hz", "5"], capture_output=True, text=True, check=False)
    assert answer.returncode == 2
    assert answer.stderr.splitlines()[-1].startswith("error: rate_hz is 5")


def test_the_simulated_device_is_rendered_on_by_name(tmp_path: Path) -> None:
    out = tmp_path / "felt.csv"
    words = [
        *COMMAND,
        "--device",
        "simulated",
        "--duration-s",
        "1.2",
        "--record",
        str(out),
        "--json",
        *PATIENT,
    ]
    answer = subprocess.run(words, capture_output=True, text=True, check=False)
    assert answer.returncode == 0, answer.stderr
    assert "rendering on simulated, which is simulated: nothing moves" in answer.stderr
    summary = json.loads(answer.stdout)
    assert summary["orderly"]
    assert summary["recorded"] == len(every_row(out))


@pytest.mark.parametrize("device", ["toaster", "usb:", "inverse3:w"])
def test_a_device_that_is_none_is_refused_before_anything_is_written(device: str, tmp_path: Path) -> None:
    out = tmp_path / "felt.csv"
    words = [*COMMAND, "--device", device, "--record", str(out)]
    answer = subprocess.run(words, capture_output=True, text=True, check=False)
    assert answer.returncode == 2
    sentence = answer.stderr.splitlines()[-1]
    assert sentence.startswith("error: ")
    assert device in sentence or "Inverse3" in sentence
    assert list(tmp_path.iterdir()) == []

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

COMMAND = [sys.executable, "-m", "palpate", "render", str(MODEL)]


def render(scheme: _core.Scheme, **words: Any) -> dict[str, Any]:
    """The machine of a test may be busy: no rate is too low."""
    return dict(_core.render(load_model(MODEL), scheme, **words, lowest_rate_share=0.0))


def test_a_live_rendering_leaves_a_recording_and_its_timing(tmp_path: Path) -> None:
    out = tmp_path / "felt.csv"
    summary = render(_core.Scheme(), duration_s=0.3, record=str(out))
    assert len(every_row(out)) == summary["recorded"] == summary["ticks"]
    assert summary["ended"] == "ran its time"
    assert summary["lost_records"] == 0
    assert summary["lateness"]["p50_us"] <= summary["lateness"]["p999_us"] <= summary["lateness"]["max_us"]


def test_each_force_is_what_the_model_says_of_its_position(tmp_path: Path) -> None:
    out = tmp_path / "felt.csv"
    model = load_model(MODEL)
    render(_core.Scheme(structure="direct"), duration_s=1.0, record=str(out))
    live = read_recording(out)
    driven = _core.motion_driven(model, _core.Scheme(structure="direct"), live.position, 1e-3)["force"]
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
    render(_core.Scheme(), duration_s=0.4)
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
        render(_core.Scheme(), **words)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_the_verb_ends_in_an_orderly_way_when_asked(tmp_path: Path, number: signal.Signals) -> None:
    out = tmp_path / "felt.csv"
    command = [*COMMAND, "--duration-s", "inf", "--record", str(out), "--json", *PATIENT]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    while process.poll() is None and not Path(f"{out}.part").exists():
        time.sleep(0.01)
    time.sleep(0.2)
    process.send_signal(number)
    told, talk = process.communicate(timeout=30)
    assert process.returncode == 0, talk
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
        assert ("did not hold its rate" in told) != patient


def test_the_verb_refuses_with_one_sentence() -> None:
    answer = subprocess.run([*COMMAND, "--rate-hz", "5"], capture_output=True, text=True, check=False)
    assert answer.returncode == 2
    assert answer.stderr.splitlines()[-1].startswith("error: rate_hz is 5")

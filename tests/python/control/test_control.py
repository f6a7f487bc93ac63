# SPDX-License-Identifier: Apache-2.0
"""Tests of the program palpate-control: output, refused arguments, exit codes."""

from __future__ import annotations

import json
import os
import signal
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from conftest import ROOT
from control_program import (
    MODEL,
    PROGRAM,
    control,
    every_row,
    needs_program,
    start,
    wait_for_rows,
)
from palpate import InputError, load_model, read_recording
from palpate._core.rendering import structure_names

pytestmark = needs_program


def changed_model(folder: Path, **fields: Any) -> Path:
    path = folder / "changed.json"
    path.write_text(json.dumps({**json.loads(MODEL.read_text(encoding="utf-8")), **fields}), encoding="utf-8")
    return path


def rows_of(recording: Path) -> list[str]:
    """Returns the rows of a recording without its comments and header."""
    lines = recording.read_text(encoding="utf-8").splitlines()
    return [line for line in lines if not line.startswith("#")][1:]


def test_help_shows_defaults_units_exit_codes_and_an_example() -> None:
    completed = control("--help")
    assert completed.returncode == 0
    assert completed.stderr == ""
    for word in (
        "--rate-hz",
        "=1000",
        "--duration-s",
        "=10",
        "N*m/rad",
        "Exit code",
        "Example: palpate-control",
    ):
        assert word in completed.stdout


def test_no_arguments_print_the_help_and_exit_with_code_2() -> None:
    completed = control()
    assert completed.returncode == 2
    assert "Usage: palpate-control" in completed.stderr


def test_the_version_equals_the_version_of_the_package() -> None:
    import palpate

    assert control("--version").stdout == f"palpate-control {palpate.__version__}\n"


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["nothing.json"], "nothing.json: there is no such file"),
        ([ROOT], "there is no such file"),
        ([MODEL, "--flavour"], "not expected: --flavour"),
        ([MODEL, "--rate-hz", "5"], "--rate-hz: must be a number from 100 to 10000, not 5"),
        ([MODEL, "--rate-hz", "fast"], "--rate-hz: must be a number from 100 to 10000, not fast"),
        ([MODEL, "--rate-hz", "nan"], "--rate-hz: must be a number from 100 to 10000, not nan"),
        ([MODEL, "--duration-s", "0"], "--duration-s: must be a number above 0, not 0"),
        (
            [MODEL, "--structure", "soft"],
            f"must be one of {', '.join(structure_names[:-1])} or {structure_names[-1]}, not soft",
        ),
        (
            [MODEL, "--structure", "explicit", "--mass", "1e-4"],
            "explicit, which diverges: the model's steepest",
        ),
        ([MODEL, "--device", "knob"], "must be simulated, usb[:SERIAL], mit:BUS:NUMBER:KIND"),
        ([MODEL, "--record", "/no/such/folder/out.csv"], "cannot be written: No such file or directory"),
        ([MODEL, "--record", "/tmp"], "cannot be written: it is not an ordinary file"),
        ([MODEL, "--record", MODEL], ", the model file: choose another name"),
        ([MODEL, "--coupling-stiffness", "-1"], "--coupling-stiffness: must be a number above 0, not -1"),
        ([MODEL, "--coupling-stiffness", "hard"], "--coupling-stiffness: must be a number above 0, not hard"),
        ([MODEL, "--object-damping", "-1"], "--object-damping: must be a number of 0 or more, not -1"),
        ([MODEL, "--tolerated-samples", "-1"], "must be a number from 0 to 1000000, not -1"),
        ([MODEL, "--cpu", "0.5"], "--cpu: must be a whole number, not 0.5"),
        ([MODEL, "--rate-hz"], "--rate-hz needs a value"),
        (["--rate-hz", "1000"], "MODEL.json is required"),
        ([MODEL, "--structure", "direct", "--compensated"], "direct structure, which has no coupling"),
        ([MODEL, "--force-limit", "9"], "force_limit is 9: must be at most 5"),
        ([MODEL, "--force-limit", "0"], "--force-limit: must be a number above 0, not 0"),
        ([MODEL, "--ramp-s", "1e300"], "ramp_s is 1e+300, must be 0 to 3600"),
        ([MODEL, "--frozen-s", "inf"], "frozen_s is inf, must be 0 to 3600"),
        ([MODEL, "--telemetry-port", "70000"], "--telemetry-port"),
        ([MODEL, "--fault", "flu@1"], "fault is 'flu@1', must be KIND@SECONDS"),
        ([MODEL.parent / "two_inputs.json"], "has 2 inputs"),
    ],
)
def test_wrong_arguments_are_refused_with_one_sentence(arguments: list[Any], sentence: str) -> None:
    completed = control(*arguments)
    assert completed.returncode == 2
    assert completed.stdout == ""
    assert completed.stderr.startswith("error: ")
    assert completed.stderr.count("\n") == 1
    assert sentence in completed.stderr


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [("12.5", "0.0", "network.alpha[1][0] is 0.0: must be > 0"), ("{", "palpate", "this is not JSON")],
)
def test_a_bad_model_is_refused_with_one_sentence(tmp_path: Path, old: str, new: str, sentence: str) -> None:
    path = tmp_path / "bad.json"
    path.write_text(MODEL.read_text(encoding="utf-8").replace(old, new, 1), encoding="utf-8")
    completed = control(path)
    assert completed.returncode == 2
    assert completed.stderr.startswith(f"error: {path}: {sentence}")
    assert completed.stderr.count("\n") == 1


def test_a_model_with_more_wavelets_than_a_tick_can_evaluate_is_refused_as_in_python(tmp_path: Path) -> None:
    content = json.loads(MODEL.read_text(encoding="utf-8"))
    count = 100_000
    network = {name: count * content["network"][name][:1] for name in ("alpha", "beta", "weight")}
    path = changed_model(
        tmp_path,
        network={**content["network"], **network},
        fit={**content["fit"], "n_wavelets": count},
        slope_bounds=None,
    )
    completed = control(path)
    assert completed.returncode == 2
    with pytest.raises(InputError) as refused:
        load_model(path)
    assert completed.stderr == f"error: {refused.value}\n"
    assert "network.alpha has 100000 values: must have at most 1000" in completed.stderr


def test_a_missing_usb_device_or_library_is_named() -> None:
    without = "built without libusb" in control("--help").stdout
    completed = control(MODEL, "--device", "usb:MISSING")
    assert completed.returncode == 2
    assert completed.stderr.startswith("error: device usb:MISSING: ")
    assert completed.stderr.count("\n") == 1
    assert ("built without libusb" in completed.stderr) == without


def test_a_model_in_ampere_is_refused(tmp_path: Path) -> None:
    completed = control(changed_model(tmp_path, units={"position": "rad", "force": "A"}))
    assert completed.returncode == 2
    assert "--torque-constant-Nm-per-A" in completed.stderr


def test_column_names_contain_the_units_of_the_model(tmp_path: Path) -> None:
    out = tmp_path / "rendered.csv"
    model = changed_model(tmp_path, units={"position": "m", "force": "N"})
    assert control(model, "--duration-s", 0.3, "--record", out).returncode == 0
    assert read_recording(out).units == {"position": "m", "force": "N"}


def test_a_model_of_position_and_velocity_renders_its_force(tmp_path: Path) -> None:
    out = tmp_path / "rendered.csv"
    path = MODEL.with_name("certificate_velocity.json")
    completed = control(path, "--duration-s", 1.0, "--record", out, "--json")
    assert completed.returncode == 0, completed.stderr
    rows = every_row(out)
    full = rows[rows["status"] == "Ok"]  # without the start ramp
    assert len(rows) == json.loads(completed.stdout)["ticks"]
    assert len(full) > 100
    expected = load_model(path).predict(full[["position_rad", "velocity_radps"]].to_numpy())
    np.testing.assert_allclose(full["force_Nm"], expected, rtol=0.0, atol=1e-9)


def test_the_recording_does_not_take_the_place_of_a_closed_standard_input(tmp_path: Path) -> None:
    out = tmp_path / "rendered.csv"
    options = ["--duration-s", "inf", "--record", out, "--json"]
    process = start(PROGRAM, MODEL, *options, preexec_fn=lambda: os.close(0))
    wait_for_rows(tmp_path / "rendered.csv.part", process)
    assert os.readlink(f"/proc/{process.pid}/fd/0") == "/dev/null"
    process.send_signal(signal.SIGINT)
    output, messages = process.communicate()
    assert process.returncode == 0, messages
    assert len(every_row(out)) == json.loads(output)["ticks"]


@pytest.mark.parametrize("signal_number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_the_run_with_exit_code_0_and_a_complete_recording(
    tmp_path: Path, signal_number: signal.Signals
) -> None:
    out = tmp_path / "rendered.csv"
    process = start(PROGRAM, MODEL, "--duration-s", "inf", "--record", out, "--json")
    wait_for_rows(tmp_path / "rendered.csv.part", process, 500)  # rows of the start ramp cannot be identified
    process.send_signal(signal_number)
    output, messages = process.communicate()
    assert process.returncode == 0, messages
    assert json.loads(output)["ended"] == "stopped on request"
    assert len(every_row(out)) == json.loads(output)["ticks"]


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
def test_a_fault_ends_the_run_with_zero_force_and_a_fault_record(
    tmp_path: Path, fault: str, status: str
) -> None:
    out = tmp_path / "rendered.csv"
    completed = control(MODEL, "--duration-s", 3, "--record", out, "--json", "--fault", fault)
    assert completed.returncode == 1, completed.stderr
    assert f": {status}, " in completed.stderr
    assert "the last 8 ticks" in completed.stderr
    summary = json.loads(completed.stdout)
    assert summary["status"] == status
    rows = rows_of(out)
    assert len(rows) == summary["ticks"]
    last = rows[-1].split(",")
    assert last[-1] == status
    assert float(last[2]) == 0.0
    fault_rows = rows_of(tmp_path / "rendered.fault.csv")
    assert fault_rows == rows[-len(fault_rows) :]


@pytest.mark.parametrize("fault", ["late@0.2", "lost@0.2", "repeated@0.2", "nan@0.2", "saturated@0.2x100"])
def test_a_short_fault_is_counted_and_the_run_continues(fault: str) -> None:
    completed = control(MODEL, "--duration-s", 0.5, "--json", "--fault", fault)
    assert completed.returncode == 0, completed.stderr
    assert (
        sum(json.loads(completed.stdout)["ticks_by_status"].values()) == json.loads(completed.stdout)["ticks"]
    )
    assert len(json.loads(completed.stdout)["ticks_by_status"]) == 3  # Ok, Ramp, status of the fault

# SPDX-License-Identifier: Apache-2.0
"""A USB device that renders its plan itself, while palpate-control and palpate render watch and record."""

from __future__ import annotations

import json
import os
import shlex
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from conftest import ROOT
from models_by_hand import model_by_hand
from palpate import DeviceProfile, Model, load_model, plan, read_recording
from usb_emulation import emulated, frames, needs_emulation

PROGRAM = Path(os.environ.get("PALPATE_CONTROL", ROOT / "build" / "control" / "palpate-control"))
PORT = ROOT / "cpp" / "firmware" / "mps2"
RATE_HZ = 10_000
STIFFNESS = 2.0
"""Of the planned spring [N*m/rad]"""
UNM_PER_COUNT = 192
"""Stiffness of the emulated device's model: the planned one, rounded"""

PROGRAMS = {"palpate-control": [PROGRAM], "palpate render": [sys.executable, "-m", "palpate", "render"]}

pytestmark = [
    needs_emulation,
    pytest.mark.skipif(not PROGRAM.exists(), reason="needs palpate-control, run make control"),
]


def planned(folder: Path, model: Model | None = None, **profile: Any) -> Path:
    """Plans a model, by default a spring, for the controller of the emulated device."""
    knob = {"id": "EMU-1", "viscous_damping": 0.06, "coulomb_friction": 0.01, "force_step": 1e-6}
    spring = model_by_hand(alpha=[], beta=[], weight=[], linear=[STIFFNESS])
    chosen = plan(model or spring, DeviceProfile(**(knob | profile)), on_device=RATE_HZ, predict="off")
    return chosen.stored().save(folder / "planned.json")


def device_of(path: Path, **changes: str) -> list[str]:
    """Returns the options of an emulated device that contains a plan; `changes` change its fingerprints."""
    certificate = load_model(path).certificate
    assert certificate is not None
    fingerprints = {"fingerprint": certificate["model"], "certificate": certificate["fingerprint"], **changes}
    options = [word for name, digits in fingerprints.items() for word in (f"--model-{name}", digits)]
    return ["--firmware", "c", "--model", str(UNM_PER_COUNT), *options]


def rendered(
    path: Path, *arguments: Any, device: list[str], program: str = "palpate-control"
) -> subprocess.CompletedProcess[str]:
    options = ["--device", "usb", "--duration-s", 0.6]
    return emulated(*PROGRAMS[program], path, *options, *arguments, device=device)


@pytest.mark.parametrize("program", PROGRAMS)
def test_the_device_renders_while_the_host_records(program: str, tmp_path: Path) -> None:
    out, trace = tmp_path / "rendered.csv", tmp_path / "trace.csv"
    path = planned(tmp_path)
    device = [*device_of(path), "--trace", str(trace)]
    completed = rendered(path, "--json", "--record", out, device=device, program=program)
    assert completed.returncode == 0, completed.stderr
    assert "the device renders the model; the host watches and records" in completed.stderr
    summary = json.loads(completed.stdout)
    assert summary["usb"]["watchdog_trips"] == 0
    assert summary["force_range"][1] > 0.05
    recording = read_recording(out)
    assert recording.metadata["certified"] == "yes"
    assert recording.metadata["device_model"] == load_model(path).certificate["model"]
    assert recording.metadata["force"] == "of the motor, from the model that the device renders"
    assert len(recording) > 300  # without the rows of the start ramp, 0.2 s
    force, position = recording.force, recording.position
    spring = UNM_PER_COUNT * 1e-6 * 65536 / (2.0 * np.pi)
    assert np.abs(force - spring * position).max() < 1e-6
    assert frames(trace)[-1].torque == 0.0
    assert not frames(trace)[-1].enabled


@pytest.mark.parametrize(
    ("options", "reason"),
    [
        (
            ["--model", "0"],
            "does not report a model to render: build the header of 'palpate export --c' into",
        ),
        (["--model-fingerprint", "1"], "contains the model 0000000000000001, but the plan is for the model"),
        (["--model-certificate", "1"], "contains this model with the certificate 0000000000000001, but that"),
        (
            ["--loop-hz", "5000"],
            "renders this model at 5000 Hz, but the certificate of the plan is for 10000 Hz",
        ),
        (["--serial", "OTHER"], "is certified for the device EMU-1, not for OTHER"),
    ],
)
def test_a_device_without_exactly_this_plan_is_refused(
    options: list[str], reason: str, tmp_path: Path
) -> None:
    trace = tmp_path / "trace.csv"
    path = planned(tmp_path)
    completed = rendered(path, device=[*device_of(path), *options, "--trace", str(trace)])
    assert completed.returncode == 2
    assert reason in completed.stderr
    assert completed.stderr.count("\n") == 1
    assert all(frame.torque == 0.0 for frame in frames(trace))


@pytest.mark.parametrize(
    ("profile", "reason"),
    [
        ({"encoder_step": 1e-4}, "is exported for an encoder step of 0.0001 rad, the device has 9.58"),
        ({"force_limit": 6.0}, "is certified for a force limit of 6 N*m, the device makes at most 5"),
    ],
)
def test_a_plan_for_another_encoder_or_motor_is_refused(
    profile: dict[str, float], reason: str, tmp_path: Path
) -> None:
    path = planned(tmp_path, **profile)
    completed = rendered(path, device=device_of(path))
    assert completed.returncode == 2
    assert reason in completed.stderr


def test_options_that_change_the_plan_are_refused(tmp_path: Path) -> None:
    path = planned(tmp_path)
    completed = rendered(path, "--force-limit", 1, device=device_of(path))
    assert completed.returncode == 2
    assert "is certified for its plan only" in completed.stderr


@pytest.mark.parametrize("fault", ["emergency-stop", "encoder", "over-temperature", "reset", "unplug"])
def test_a_fault_of_the_device_ends_the_run_with_zero_torque(fault: str, tmp_path: Path) -> None:
    trace = tmp_path / "trace.csv"
    path = planned(tmp_path)
    device = [*device_of(path), "--fault", f"{fault}@200", "--trace", str(trace)]
    completed = rendered(path, device=device)
    assert completed.returncode == 1
    assert "stopped by a fault of the device" in completed.stderr
    sent_frames = frames(trace)
    assert max(abs(frame.torque) for frame in sent_frames if 100 < frame.started < 200) > 1e-3
    last = [frame for frame in sent_frames if frame.started > 200]
    assert all(frame.torque == 0.0 for frame in last)


def test_a_silent_host_ends_the_rendering_of_the_device(tmp_path: Path) -> None:
    """After SIGTERM the host disables the device; after SIGKILL the watchdog sets zero torque."""
    for signal, enabled in (("KILL", True), ("TERM", False)):
        trace, out = tmp_path / f"{signal}-trace.csv", tmp_path / f"{signal}.csv"
        path = planned(tmp_path)
        command = [PROGRAM, path, "--device", "usb", "--duration-s", "inf", "--record", out]
        script = f"""
            {shlex.join(map(str, command))} > /dev/null 2> /dev/null &
            until [ "$(wc -l < '{out}.part' 2> /dev/null)" -gt 300 ] 2> /dev/null; do sleep 0.05; done
            kill -{signal} $!
            wait $! || true
        """
        device = [*device_of(path), "--trace", str(trace)]
        completed = emulated("sh", "-c", script, device=device)
        assert completed.returncode == 0, completed.stderr
        sent_frames = frames(trace)
        assert min(frame.torque for frame in sent_frames) < -1e-3
        assert sent_frames[-1].torque == 0.0
        assert sent_frames[-1].status & 2  # the watchdog
        assert sent_frames[-1].enabled == enabled


@pytest.mark.skipif(
    any(shutil.which(name) is None for name in ("arm-none-eabi-gcc", "make", "qemu-system-arm")),
    reason="needs arm-none-eabi-gcc, make and qemu-system-arm",
)
def test_an_exported_model_is_rendered_by_the_machine_code_of_a_cortex_m4(tmp_path: Path) -> None:
    """Plan, export, firmware, rendering on the device and recording, without a step by hand."""
    path, header, out = planned(tmp_path, model_by_hand()), tmp_path / "knob.h", tmp_path / "rendered.csv"
    export = [sys.executable, "-m", "palpate", "export", path, "--c", "-o", header, "--json"]
    exported = subprocess.run(list(map(str, export)), capture_output=True, text=True, check=True)
    numbers = json.loads(exported.stdout)
    build = [f"OUT={tmp_path}", "MODEL=knob", f"HEADER={header}", "NAME=knob", "CPUS=m4"]
    build += [f"RATE_HZ={RATE_HZ}", f"PROFILE={numbers['profile']:#010x}"]
    subprocess.run(["make", "--silent", "-C", str(PORT), *build], check=True)
    device = ["--firmware", str(tmp_path / "knob-m4.elf")]
    completed = rendered(path, "--record", out, device=device)
    assert completed.returncode == 0, completed.stderr
    recording = read_recording(out)
    model = load_model(path)
    force, position = recording.force, recording.position
    rounded = 0.51e-6  # the torque is a whole number of uN*m
    assert np.ptp(position) > 0.05
    assert np.abs(force - model.force(position)).max() <= numbers["step_error"] + rounded
    # At another rate the firmware refuses to render, because its certificate does not hold.
    refused = rendered(path, device=[*device, "--loop-hz", "5000"])
    assert refused.returncode == 2
    assert (
        "refuses to render its model: the rate or the encoder differs from the certified one"
        in refused.stderr
    )

# SPDX-License-Identifier: Apache-2.0
"""palpate record: recordings of an object on a device, and identification from them."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import palpate
from conftest import ROOT
from control_program import PROGRAM, every_row, needs_program
from palpate import InputError, Model, identify, load_model, read_recording
from palpate.cli.live import LiveLine
from palpate.cli.main import main
from palpate.devices import record
from usb_emulation import emulated, frames, needs_emulation

OBJECT = ROOT / "tests" / "models" / "good" / "position.json"
STIFFNESS = 3.0
SPRING = ["--spring", str(STIFFNESS)]
COUNTS_PER_TURN = 65536


def run_record(out: Path, *arguments: Any, device: Sequence[Any] = ()) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "palpate", "record", out, "--device", "usb", "--duration-s", 1.5]
    return emulated(*command, *arguments, device=device)


def test_a_simulated_device_without_object_names_the_option(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["record", str(tmp_path / "a.csv")]) == 2
    assert capsys.readouterr().err == (
        "error: the simulated device has no object; add --object MODEL.json, a model of one\n"
    )


def stiffness(model: Model) -> float:
    """Returns the mean stiffness of press and release from 10 % to 90 % of the model's domain."""
    lower, upper = model.lower[0], model.upper[0]
    positions = np.array([0.9 * lower + 0.1 * upper, 0.1 * lower + 0.9 * upper])
    lower_force, upper_force = np.mean([model.force(positions, direction=sign) for sign in (1, -1)], axis=0)
    return float(upper_force - lower_force) / float(np.ptp(positions))


@needs_emulation
def test_the_rendering_of_a_device_is_recorded(tmp_path: Path) -> None:
    out = tmp_path / "rendered.csv"
    device = ["--model", "10", "--no-transducer"]
    completed = run_record(out, "--device-renders", "--json", "--duration-s", 0.8, device=device)
    assert completed.returncode == 0, completed.stderr
    assert json.loads(completed.stdout)["device_model"] == "0123456789abcdef"
    recording = read_recording(out)
    assert recording.metadata["device_model"] == "0123456789abcdef"
    assert recording.metadata["force"] == "of the motor, from the model that the device renders"
    after_ramp = slice(50, None)
    spring = 10e-6 * COUNTS_PER_TURN / (2.0 * np.pi)
    error = recording.force[after_ramp] - spring * recording.position[after_ramp]
    assert np.abs(error).max() < 1e-9
    assert recording.force.max() > 0.03


@needs_emulation
def test_a_device_without_a_model_is_not_recorded_as_renderer(tmp_path: Path) -> None:
    completed = run_record(tmp_path / "out.csv", "--device-renders")
    assert completed.returncode == 2
    assert "does not report a model to render" in completed.stderr
    assert not (tmp_path / "out.csv").exists()
    with pytest.raises(InputError, match="device_renders needs a USB device"):
        record(tmp_path / "out.csv", object=load_model(OBJECT), device_renders=True, duration_s=0.1)
    completed = run_record(
        tmp_path / "out.csv",
        *("--device-renders", "--probe", "--upper", 0.4),
        device=["--model", "10"],
    )
    assert completed.returncode == 2
    assert "leave out probe and push" in completed.stderr


@needs_emulation
@needs_program
def test_a_recorded_spring_is_identified_and_rendered_with_the_same_stiffness_and_sign(
    tmp_path: Path,
) -> None:
    names = ("a.csv", "b.csv", "m.json", "t.csv")
    recording_file, rendered_file, model_file, trace = (tmp_path / name for name in names)
    duration = ["--duration-s", 1]
    completed = run_record(recording_file, "--json", *duration, device=[*SPRING, "--trace", str(trace)])
    assert completed.returncode == 0, completed.stderr
    summary = json.loads(completed.stdout)
    assert summary["recorded"] == summary["ticks"] == 1000
    # the motor of the device is never enabled: only the hand moves the handle
    assert not any(frame.enabled for frame in frames(trace))
    recording = read_recording(recording_file)
    assert recording.metadata["force"].endswith("from the device's force transducer")
    model = identify(recording)
    assert stiffness(model) == pytest.approx(STIFFNESS, rel=0.002)
    model.save(model_file)

    command = [PROGRAM, model_file, "--device", "usb", "--structure", "direct", "--uncertified"]
    command = [*command, *duration, "--record", rendered_file]
    completed = emulated(*command, device=["--trace", str(trace)])
    assert completed.returncode == 0, completed.stderr
    # After the start ramp the device receives a torque towards smaller positions, proportional to position.
    sent_frames = frames(trace)
    active = [index for index, frame in enumerate(sent_frames) if frame.torque != 0.0]
    pressed = [frame for frame in sent_frames[active[0] + 300 : active[-1]] if frame.position > 0.1]
    assert len(pressed) > 250
    assert all(-4.0 < frame.torque / frame.position < -2.0 for frame in pressed)
    assert stiffness(identify(read_recording(rendered_file))) == pytest.approx(STIFFNESS, rel=0.02)


@pytest.mark.full
@needs_emulation
def test_a_probe_measures_the_stiffness_of_a_spring_without_a_hand(tmp_path: Path) -> None:
    out, trace = tmp_path / "a.csv", tmp_path / "t.csv"
    probe = ["--probe", "--upper", 0.3, "--force-limit", 1.2, "--speed", 0.3, "--duration-s", 3]
    device_without_hand = [*SPRING, "--no-hand", "--no-transducer", "--trace", str(trace)]
    completed = run_record(out, *probe, device=device_without_hand)
    assert completed.returncode == 0, completed.stderr
    recording = read_recording(out)
    assert "including the device's friction" in recording.metadata["force"]
    assert np.ptp(recording.position) == pytest.approx(0.3, rel=0.1)
    # The motor also compensates the handle's damping: 0.018 N*m at this speed; the force range is 0.72 N*m.
    model = identify(recording)
    assert "velocity" not in model.inputs  # at a single speed, damping cannot be identified
    assert model.damping is None
    assert stiffness(model) == pytest.approx(STIFFNESS, rel=2 * 0.018 / 0.72)
    assert max(abs(frame.torque) for frame in frames(trace)) <= 1.2
    assert frames(trace)[-1].torque == 0.0


@needs_emulation
@pytest.mark.parametrize(
    "arguments",
    [pytest.param([], marks=pytest.mark.full), ["--force-limit", 0.05]],
    ids=["default", "the device's own"],
)
def test_a_probe_may_use_the_whole_force_of_a_weak_device(arguments: list[Any], tmp_path: Path) -> None:
    """A torque limit of 50000 uNm allows the probe 0.05 N*m, although 1e-6 * 50000 is slightly less."""
    trace, out = tmp_path / "trace.csv", tmp_path / "a.csv"
    probe = ["--probe", "--upper", 0.1, "--stiffness", 1, *arguments]
    weak_device = ["--no-hand", "--spring", 0.3, "--max-torque-uNm", 50000, "--trace", trace]
    completed = run_record(out, *probe, "--duration-s", 1.25, device=weak_device)
    assert completed.returncode == 0, completed.stderr
    assert 0.02 < max(abs(frame.torque) for frame in frames(trace)) <= 0.05
    assert len(read_recording(out)) > 1000


EVERY_EXIT_CODE = """
import json, sys
from palpate.cli.main import main
print([main(command) for command in json.loads(sys.argv[1])])
"""
"""Program that runs commands one after the other and prints their exit codes"""


@needs_emulation
@pytest.mark.parametrize(
    ("device", "refusals"),
    [
        (["--no-transducer"], {"EMU-1 has no force transducer": []}),
        (
            [],
            {
                "a probe on a real device needs upper": ["--probe"],
                "force_limit is 6: must be at most 5": ["--probe", "--upper", "0.3", "--force-limit", "6"],
                "object needs device simulated; usb has a real object": ["--object", str(OBJECT)],
            },
        ),
        (["--no-device"], {"no USB device 1209:0001 with this protocol is connected": []}),
    ],
)
def test_an_impossible_recording_is_refused_before_the_device_moves(
    device: list[str], refusals: dict[str, list[str]], tmp_path: Path
) -> None:
    trace = tmp_path / "trace.csv"
    record_usb = ["record", str(tmp_path / "a.csv"), "--device", "usb", "--duration-s", "1.5"]
    commands = json.dumps([[*record_usb, *arguments] for arguments in refusals.values()])
    program = [sys.executable, "-c", EVERY_EXIT_CODE, commands]
    completed = emulated(*program, device=[*device, "--trace", str(trace)])
    assert completed.stdout == f"{[2] * len(refusals)}\n", completed.stderr
    errors = [line for line in completed.stderr.splitlines() if line.startswith("error: ")]
    for reason, error in zip(refusals, errors, strict=True):
        assert reason in error
    assert not list(tmp_path.glob("a.csv*"))
    assert all(frame.torque == 0.0 for frame in frames(trace))


@needs_emulation
def test_rows_recorded_before_an_unplug_are_kept(tmp_path: Path) -> None:
    out, trace = tmp_path / "a.csv", tmp_path / "t.csv"
    unplugged_device = [*SPRING, "--fault", "unplug@500", "--trace", str(trace)]
    completed = run_record(out, "--json", "--duration-s", "inf", device=unplugged_device)
    assert completed.returncode == 1
    assert "a fault of the device" in completed.stderr
    summary = json.loads(completed.stdout)
    rows = every_row(out)
    assert len(rows) == summary["recorded"] == summary["ticks"]
    assert summary["lost_records"] == 0
    assert summary["lost_samples"] == 0
    samples = rows["sequence"].drop_duplicates().to_numpy()
    assert (np.diff(samples) == 1).all()
    last = frames(trace)[-1]
    assert last.unplugged
    # The device did not send the sample of its last frame.
    assert (last.sequence - samples[-1]) % 0x10000 == 1
    assert list(rows["status"])[-1] == "Fault"
    assert len(read_recording(out)) > 100


@pytest.mark.full
def test_verify_confirms_a_recording_of_the_simulated_object(tmp_path: Path) -> None:
    knob = load_model(OBJECT)
    ticks: list[int] = []
    summary = record(
        tmp_path / "a.csv",
        object=knob,
        probe=True,
        duration_s=2.0,
        speed=0.5,
        lowest_rate_share=0.0,
        progress=lambda rows, position, force, lost: ticks.append(rows),
    )
    assert summary["orderly"]
    assert ticks == sorted(ticks)
    assert len(ticks) > 5
    recording = read_recording(tmp_path / "a.csv")
    assert recording.metadata["simulated"].startswith("yes")
    assert recording.metadata["moved_by"].startswith("the device: a sweep from ")
    assert palpate.verify(knob, recording).nrmse < 0.01


def test_an_existing_recording_is_refused_and_replaced_with_force(tmp_path: Path) -> None:
    out = tmp_path / "a.csv"
    out.write_text("precious", encoding="utf-8")
    settings: dict[str, Any] = {
        "object": load_model(OBJECT), "probe": True, "duration_s": 0.5, "lowest_rate_share": 0.0
    }  # fmt: skip
    with pytest.raises(InputError, match=r"a\.csv exists already"):
        record(out, **settings)
    assert main(["record", str(out), "--object", str(OBJECT), "--probe", "--duration-s", "0.5"]) == 2
    assert out.read_text(encoding="utf-8") == "precious"
    assert record(out, **settings, force=True)["recorded"] > 250
    assert len(read_recording(out)) > 100


@needs_emulation
@pytest.mark.full
def test_a_handle_without_motion_gives_the_verdict_no(tmp_path: Path) -> None:
    completed = run_record(tmp_path / "a.csv", "--json", device=["--no-hand"])
    assert completed.returncode == 1
    verdict = json.loads(completed.stdout)["verdict"]
    assert verdict.startswith("no: ")
    assert "so the force over position is unknown: move the handle over the whole object" in verdict


def test_a_recording_without_object_or_force_measurement_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="the simulated device has no object"):
        record(tmp_path / "a.csv")
    with pytest.raises(InputError, match=r"simulated-knob.* has no force transducer, so it cannot"):
        record(tmp_path / "a.csv", object=load_model(OBJECT), transducer=False)
    with pytest.raises(InputError, match=r"device is 'knob', must be simulated, usb\[:SERIAL\], mit:"):
        record(tmp_path / "a.csv", device="knob")
    assert not list(tmp_path.iterdir())


def test_the_live_line_reports_lost_samples(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("sys.stderr.isatty", lambda: True)
    line = LiveLine(1000.0, ("rad", "Nm"))
    line.show(2500, 0.25, -0.5, 3)
    line.end()
    assert "2.5 s  2500 rows, 3 lost  position 0.25 rad" in capsys.readouterr().err

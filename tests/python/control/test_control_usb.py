# SPDX-License-Identifier: Apache-2.0
"""palpate-control on an emulated USB device, through libusb: refused devices and reasons to end a run."""

from __future__ import annotations

import json
import os
import random
import shlex
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest

from conftest import ROOT
from palpate import DeviceProfile, load_model, plan, read_recording
from palpate._core.rendering import Scheme
from palpate.planning import Plan
from usb_emulation import RUNNER, emulated, frames, needs_emulation

PROGRAM = Path(os.environ.get("PALPATE_CONTROL", ROOT / "build" / "control" / "palpate-control"))
SCALE = max(1, int(os.environ.get("PALPATE_TEST_SCALE", "1")))
SPRING = ROOT / "tests" / "models" / "good" / "spring.json"

pytestmark = [
    needs_emulation,
    pytest.mark.skipif(not PROGRAM.exists(), reason="needs palpate-control, run make control"),
]


def control(
    *arguments: Any, device: Sequence[str] = (), model: Path = SPRING
) -> subprocess.CompletedProcess[str]:
    named = [] if "--device" in arguments else ["--device", "usb"]
    return emulated(PROGRAM, model, *named, *arguments, device=device)


def rows(record: Path) -> int:
    return sum(not line.startswith("#") for line in record.read_text(encoding="utf-8").splitlines()) - 1


def wait_for_rows(part: Path) -> None:
    while not part.exists() or rows(part) < 10:
        time.sleep(0.01)


def uncertified(*arguments: Any, device: Sequence[str] = ()) -> subprocess.CompletedProcess[str]:
    return control("--uncertified", *arguments, device=device)


def test_a_model_without_certificate_requires_the_full_option_uncertified() -> None:
    for arguments in ([], ["--uncert"], ["--unc"]):
        completed = control(*arguments)
        assert completed.returncode == 2
        assert "certificate" in completed.stderr or "--unc" in completed.stderr
    assert "set uncertified to render without" in control().stderr


def certified_for(folder: Path, **profile: Any) -> Path:
    chosen = Plan(load_model(SPRING), Scheme(structure="direct"))
    return chosen.certified_for(DeviceProfile(**profile)).stored().save(folder / "certified.json")


def test_a_certificate_of_stability_without_passivity_is_refused(tmp_path: Path) -> None:
    stable = plan(load_model(SPRING), DeviceProfile(id="EMU-1")).stored().save(tmp_path / "stable.json")
    completed = control(model=stable)
    assert completed.returncode == 2
    assert "is not certified: the linearised system is stable" in completed.stderr


def test_a_model_certified_for_this_device_requires_no_option(tmp_path: Path) -> None:
    certified = certified_for(tmp_path, id="EMU-1", delay_s=1.25e-3, coulomb_friction=1e-3)
    completed = control("--duration-s", 0.2, "--json", model=certified)
    assert completed.returncode == 0, completed.stderr
    assert json.loads(completed.stdout)["ticks"] == 200
    refused = control("--structure", "massless", model=certified)
    assert refused.returncode == 2
    assert "is certified for its plan only: do not set structure" in refused.stderr


def planned(folder: Path, **device: Any) -> Path:
    """Plans the spring for the emulated knob."""
    profile = {"id": "EMU-1", "viscous_damping": 50.0, "coulomb_friction": 0.01, "force_step": 1e-6}
    plans = plan(load_model(SPRING), DeviceProfile(**{**profile, "delay_s": 1.25e-3, **device}))
    return plans.stored().save(folder / "planned.json")


def test_a_certified_model_is_rendered_as_planned(tmp_path: Path) -> None:
    record = tmp_path / "rendered.csv"
    completed = control("--duration-s", 0.6, "--record", record, model=planned(tmp_path))
    assert completed.returncode == 0, completed.stderr
    assert "direct, predict 1; emulated knob EMU-1" in completed.stderr
    assert "uncertified" not in completed.stderr
    assert "# certified: yes" in record.read_text(encoding="utf-8")


def test_a_certified_run_has_the_certified_force_limit_and_no_slew_limit(tmp_path: Path) -> None:
    record = tmp_path / "rendered.csv"
    control("--duration-s", 0.1, "--record", record, model=planned(tmp_path, force_limit=3.0))
    assert "# guards: force limit 3, no slew limit, ramp 0.2 s" in record.read_text(encoding="utf-8")
    refused = control("--force-limit", 2, model=planned(tmp_path))
    assert refused.returncode == 2
    assert "do not set structure, its numbers, force_limit" in refused.stderr


@pytest.mark.parametrize(
    ("device", "reason"),
    [
        ({"id": "EMU-2"}, "is certified for the device EMU-2, not for EMU-1"),
        ({"period_s": 2e-3}, "is certified for a period of 2 ms"),
        ({"encoder_step": 1e-5}, "is certified for an encoder step of 1e-05"),
        ({"force_limit": 6.0}, "is certified for a force limit of 6 N*m, the device makes at most 5"),
    ],
)
def test_a_certificate_of_another_device_is_refused(
    device: dict[str, Any], reason: str, tmp_path: Path
) -> None:
    trace = tmp_path / "trace.csv"
    model = planned(tmp_path, **device)
    completed = control(device=["--trace", str(trace)], model=model)
    assert completed.returncode == 2
    assert reason in completed.stderr
    assert all(frame.torque == 0.0 for frame in frames(trace))


def test_a_delay_longer_than_certified_ends_the_run_with_zero_torque(tmp_path: Path) -> None:
    trace = tmp_path / "trace.csv"
    model = planned(tmp_path, delay_s=0.25e-3)
    completed = control("--duration-s", 0.3, device=["--trace", str(trace)], model=model)
    assert completed.returncode == 1
    assert "stopped because the device applied a force" in completed.stderr
    assert "the certificate holds for at most 0.25 ms" in completed.stderr
    assert frames(trace)[-1].torque == 0.0
    assert not frames(trace)[-1].enabled


@pytest.mark.parametrize(
    ("arguments", "device", "reason"),
    [
        ([], ["--no-device"], "no USB device 1209:0001 with this protocol is connected"),
        ([], ["--serial", "A", "--serial", "B"], "2 suitable USB devices are connected (A, B)"),
        (["--device", "usb:OTHER"], [], "no USB device has the serial number OTHER; connected: EMU-1"),
        (["--device", "usb:"], [], "device is 'usb:', must be simulated, usb[:SERIAL], mit:BUS:NUMBER:KIND"),
        ([], ["--wrong-magic"], "is 1209:0001 with another protocol"),
        ([], ["--info-bytes", "31"], "the answer to GET_INFO has 31 bytes, must have 32"),
        ([], ["--info-bytes", "33"], "the answer to GET_INFO has 33 bytes, must have 32"),
        ([], ["--denied"], "sudo palpate devices --install-udev-rule"),
        (["--rate-hz", "500"], [], "sends 1000 packets a second and sets the rate of the loop: must be 1000"),
        (["--force-limit", "6"], [], "force_limit is 6: must be at most 5"),
        (["--fault", "late@1"], [], "faults is set: must be empty for a real device"),
    ],
)
def test_impossible_arguments_are_refused_before_the_device_moves(
    arguments: list[str], device: list[str], reason: str, tmp_path: Path
) -> None:
    trace = tmp_path / "trace.csv"
    completed = uncertified(*arguments, device=[*device, "--trace", str(trace)])
    assert completed.returncode == 2, completed.stderr
    assert reason in completed.stderr
    assert all(frame.torque == 0.0 for frame in frames(trace))


def test_a_model_in_metres_is_refused_by_a_rotary_device(tmp_path: Path) -> None:
    model = json.loads(SPRING.read_text(encoding="utf-8"))
    model["units"] = {"position": "m", "force": "N"}
    linear = tmp_path / "linear.json"
    linear.write_text(json.dumps(model), encoding="utf-8")
    completed = control("--uncertified", model=linear)
    assert completed.returncode == 2
    assert "is in m and N; emulated knob EMU-1" in completed.stderr


def test_a_run_is_recorded_and_ends_with_zero_torque_and_a_disabled_device(tmp_path: Path) -> None:
    record, trace = tmp_path / "rendered.csv", tmp_path / "trace.csv"
    completed = uncertified("--duration-s", 1, "--record", record, "--json", device=["--trace", str(trace)])
    assert completed.returncode == 0, completed.stderr
    summary = json.loads(completed.stdout)
    assert summary["ticks"] == summary["recorded"] == 1000
    assert summary["usb"]["skipped_commands"] == summary["usb"]["lost_commands"] == 0
    assert summary["usb"]["round_trip"]["max_us"] == 2000.0
    assert summary["usb"]["delay_samples"]["max"] == 1.0
    recording = read_recording(record)
    assert recording.force.max() > 0.02
    # The object pushes back: the device receives a torque towards smaller positions.
    sent_frames = frames(trace)
    strongest = min(sent_frames, key=lambda frame: frame.torque)
    assert strongest.torque == pytest.approx(-2.0 * strongest.position, rel=0.2)
    assert sent_frames[-1].torque == 0.0
    assert not sent_frames[-1].enabled
    # The device applies a sent force two rows later: one sample of delay, and one sample in its latch.
    force, applied = recording.force, recording.columns["applied_Nm"]
    assert abs(force[300:-2] - applied[302:]).max() < 2e-6


def test_two_runs_with_the_same_faults_are_equal_to_the_last_byte(tmp_path: Path) -> None:
    faults = ["--fault", "busy@300", "--fault", "stall-in@350", "--fault", "freeze@400x15"]
    results = []
    for name in ("first", "second"):
        (tmp_path / name).mkdir()
        record, trace = tmp_path / name / "rendered.csv", tmp_path / name / "trace.csv"
        completed = uncertified(
            "--duration-s", 0.5, "--record", record, device=[*faults, "--trace", str(trace)]
        )
        assert completed.returncode == 0, completed.stderr
        results.append((record.read_bytes(), trace.read_bytes()))
    assert results[0] == results[1]


@pytest.mark.parametrize("signal_number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_sends_zero_torque_disables_the_device_and_is_reported(
    signal_number: signal.Signals, tmp_path: Path
) -> None:
    trace, part = tmp_path / "trace.csv", tmp_path / "rendered.csv"
    command = [PROGRAM, SPRING, "--device", "usb", "--uncertified", "--ramp-s", 0, "--duration-s", "inf"]
    arguments = [RUNNER, "--lock-step", "--trace", trace, "--", *command, "--record", part]
    process = subprocess.Popen(
        [sys.executable, *map(str, arguments)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    assert process.stderr is not None
    assert "emulated knob" in process.stderr.readline()
    wait_for_rows(Path(f"{part}.part"))
    process.send_signal(signal_number)  # the emulator forwards the signal to palpate-control
    output, _ = process.communicate()
    assert process.returncode == 0
    assert "stopped on request" in output
    assert frames(trace)[-1].torque == 0.0
    assert not frames(trace)[-1].enabled


def test_after_kill_the_watchdog_of_the_device_sets_zero_torque(tmp_path: Path) -> None:
    trace, record = tmp_path / "trace.csv", tmp_path / "rendered.csv"
    arguments = [PROGRAM, SPRING, "--device", "usb", "--uncertified"]
    rendering = shlex.join(map(str, [*arguments, "--duration-s", "inf", "--record", record]))
    script = f"""
        {rendering} 2> /dev/null &
        until [ "$(wc -l < '{record}.part' 2> /dev/null)" -gt 300 ] 2> /dev/null; do sleep 0.05; done
        kill -9 $!
    """
    completed = emulated("sh", "-c", script, device=["--trace", str(trace)])
    assert completed.returncode == 0, completed.stderr
    sent_frames = frames(trace)
    assert min(frame.torque for frame in sent_frames) < -0.01
    assert sent_frames[-1].torque == 0.0
    assert sent_frames[-1].status & 2  # bit 1 of the status: the device's watchdog has acted


# Kind -> number of frames of the fault, True if nothing can follow it, frames until the torque is zero. The
# response to a fault in a packet is immediate and acts one frame later; a lost packet is seen in the next
# frame. Otherwise the watchdog of the device acts when the time of the last command is over.
SAME_FRAME = 1
NEXT_FRAME = 2
WATCHDOG_FRAMES = 10
FAULT_STATUSES = {"Timeout", "Lost", "Fault", "NonFinite", "Jump", "Frozen", "Stale"}
FAULTS: dict[str, tuple[int, bool, int]] = {
    "stall-in": (1, False, NEXT_FRAME),
    "stall-out": (1, False, WATCHDOG_FRAMES),
    "short": (1, False, NEXT_FRAME),
    "magic": (1, False, NEXT_FRAME),
    "version": (1, False, NEXT_FRAME),
    "long": (1, False, NEXT_FRAME),
    "skip": (3, False, SAME_FRAME),
    "repeat": (1, False, SAME_FRAME),
    "freeze": (15, False, WATCHDOG_FRAMES),
    "mute": (15, False, WATCHDOG_FRAMES),
    "deaf": (12, False, WATCHDOG_FRAMES),
    "encoder": (1, True, SAME_FRAME),
    "over-temperature": (1, True, SAME_FRAME),
    "emergency-stop": (1, True, SAME_FRAME),
    "reset": (1, True, SAME_FRAME),
    "jump": (1, True, SAME_FRAME),
    "unplug": (2, True, NEXT_FRAME),
}


def test_faults_in_random_order_end_in_zero_torque_with_a_complete_record(tmp_path: Path) -> None:
    seed = int(os.environ.get("PALPATE_TEST_SEED", "7"))
    generator = random.Random(seed)
    recoverable = [kind for kind, (_, unrecoverable, _) in FAULTS.items() if not unrecoverable]
    unrecoverable = [kind for kind in FAULTS if kind not in recoverable]
    n_faults = 0
    run = 0
    while n_faults < (60 if SCALE == 1 else 100 * SCALE):
        kinds = generator.choices(recoverable, k=29)
        if run % 3:
            kinds.append(generator.choice(unrecoverable))
        next_frame, script = 260, []
        for kind in kinds:
            script.append((kind, next_frame))
            next_frame += generator.randrange(25, 40)
        context = f"seed {seed}, run {run}: {script}"
        faults = [word for kind, frame in script for word in ("--fault", f"{kind}@{frame}x{FAULTS[kind][0]}")]
        record, trace = tmp_path / f"rendered{run}.csv", tmp_path / "trace.csv"
        completed = uncertified(
            "--duration-s", 1.5, "--record", record, "--json", device=[*faults, "--trace", str(trace)]
        )
        is_stopped = kinds[-1] in unrecoverable
        assert completed.returncode == int(is_stopped), f"{context}\n{completed.stderr}"
        summary = json.loads(completed.stdout)
        assert rows(record) == summary["ticks"], context
        assert summary["lost_records"] == 0, context
        for row in record.read_text(encoding="utf-8").splitlines():
            cells = row.split(",")
            if cells[-1] in FAULT_STATUSES:
                assert float(cells[2]) == 0.0, context  # the tick with the fault sends zero force
        sent_frames = frames(trace)
        by_start = {frame.started: index for index, frame in enumerate(sent_frames)}
        for kind, frame in script:
            index = by_start[frame]
            assert sent_frames[index - 1].torque != 0.0, f"{context}: {kind} at {frame}"
            following_frames = sent_frames[index : index + FAULTS[kind][2] + 1]
            assert any(each.torque == 0.0 for each in following_frames) or following_frames[-1].unplugged, (
                f"{context}: {kind} at {frame}"
            )
            n_faults += 1
        assert sent_frames[-1].torque == 0.0 or sent_frames[-1].unplugged, context
        assert not sent_frames[-1].enabled or sent_frames[-1].unplugged, context
        record.unlink()
        run += 1

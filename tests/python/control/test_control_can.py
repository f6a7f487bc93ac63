# SPDX-License-Identifier: Apache-2.0
"""palpate-control on an emulated MIT-mode drive; frames against those of PyPI damiao-motor and moteus."""

import json
import math
import random
import re
import shutil
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

from conftest import ROOT
from control_program import PROGRAM, control, every_row, needs_program, run, start
from emulated_device import emulated
from mit_drive import Drive
from models_by_hand import model_by_hand
from palpate import DeviceProfile
from palpate._core.run import device_help, measured_device_help, transports
from palpate.planning import example_profiles

WORDS = ["--uncertified", "--frozen-s", "0"]


@pytest.fixture
def bus(tmp_path: Path) -> Path:
    return tmp_path / "bus.sock"


@pytest.fixture
def drive(bus: Path) -> Iterator[Drive]:
    with emulated(bus, Drive()) as one:
        yield one


@pytest.fixture
def spring(tmp_path: Path) -> Path:
    return model_by_hand(alpha=[[5.0]], weight=[0.02], linear=[2.0]).save(tmp_path / "spring.json")


@pytest.fixture(scope="module")
def frames(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str, list[str]], list[str]]:
    """Returns a function that gives the frames of commands, one a line, as hexadecimal digits."""
    compiler = shutil.which("g++") or pytest.skip("needs g++")
    program = tmp_path_factory.mktemp("frames") / "can_frames"
    source = ROOT / "tests" / "python" / "control" / "can_frames.cpp"
    include = ROOT / "cpp" / "include"
    subprocess.run([compiler, "-std=c++20", f"-I{include}", str(source), "-o", str(program)], check=True)

    def of(kind: str, lines: list[str]) -> list[str]:
        command = [str(program), kind]
        text = "\n".join(lines)
        return subprocess.run(command, input=text, capture_output=True, text=True, check=True).stdout.split()

    return of


def test_frames_have_the_bytes_of_damiao_motor(frames: Callable[[str, list[str]], list[str]]) -> None:
    damiao = pytest.importorskip("damiao_motor.core.motor", reason="needs damiao-motor")
    chance = random.Random(41)
    lines, expected = [], []
    for _ in range(10_000):
        kind = chance.choice(list(damiao.MOTOR_TYPE_PRESETS))
        motor = damiao.DaMiaoMotor(1, 0x11, None, motor_type=kind)
        p, v, t = (damiao.MOTOR_TYPE_PRESETS[kind][f"{name}_max"] for name in "pvt")
        beyond = 1.2  # values outside of the fields are limited
        position, speed, torque = (chance.uniform(-beyond * top, beyond * top) for top in (p, v, t))
        kp, kd = chance.uniform(-50.0, 600.0), chance.uniform(-0.5, 6.0)
        lines.append(f"{p!r} {v!r} {t!r} {position!r} {speed!r} {kp!r} {kd!r} {torque!r}")
        expected.append(motor.encode_cmd_msg(position, speed, torque, kp, kd).hex())
    assert frames("mit", lines) == expected


def test_frames_have_the_bytes_of_moteus(frames: Callable[[str, list[str]], list[str]]) -> None:
    moteus = pytest.importorskip("moteus", reason="needs moteus")
    ignored = moteus.multiplex.IGNORE
    query = moteus.QueryResolution()
    query.voltage = query.temperature = ignored
    controller = moteus.Controller(id=1, transport=object())
    chance = random.Random(42)
    lines, expected = [], []
    for number in range(10_000):
        given = {
            "position": math.nan if number % 10 == 0 else chance.uniform(-100.0, 100.0),
            "velocity": chance.uniform(-50.0, 50.0),
            "feedforward_torque": chance.uniform(-5.0, 5.0),
            "kp_scale": chance.uniform(0.0, 20.0),
            "kd_scale": chance.uniform(0.0, 1.0),
            "maximum_torque": chance.uniform(0.0, 5.0),
            "watchdog_timeout": chance.uniform(0.001, 1.0),
        }
        lines.append(" ".join(map(repr, given.values())))
        command = controller.make_position(**given, ilimit_scale=0.0, query_override=query)
        expected.append(command.data.hex())
        assert (command.source, command.destination, command.reply_required) == (0, 1, True)
    assert frames("moteus", lines) == expected


@needs_program
def test_a_spring_is_rendered_and_zero_force_confirmed(
    drive: Drive, bus: Path, spring: Path, tmp_path: Path
) -> None:
    record = tmp_path / "felt.csv"
    device = f"mit:{bus}:1:damiao-4310"
    ran = control(
        spring, "--device", device, *WORDS, "--duration-s", 1.5, "--ramp-s", 0.1, "--record", record, "--json"
    )
    assert ran.returncode == 0, ran.stderr
    summary = json.loads(ran.stdout)
    assert summary["can"]["answers"] > 100
    assert summary["can"]["timeouts"] == summary["can"]["repeated"] == 0
    assert "confirmed" in json.dumps(summary)
    assert (drive.enabled, drive.torque) == (False, 0.0)
    rows = every_row(record)
    settled = rows[rows["time_s"] > 0.3]
    applied, position = settled["applied_Nm"].to_numpy(), settled["position_rad"].to_numpy()
    assert position.max() - position.min() > 0.1
    # applied belongs to the command before: the force of the model at about the same position
    assert np.corrcoef(applied, position)[0, 1] > 0.9
    assert 0.1 < drive.largest_torque < 3.0


@needs_program
@pytest.mark.parametrize(
    ("changes", "code", "sentence"),
    [
        (
            {"second": True},
            2,
            "is two drives that answer to the same number: give one of them another",
        ),
        ({"number": 2}, 2, "does not answer: check its number, its power, the wires and the bit rate"),
        pytest.param({"answers": 100}, 1, "timeouts", marks=pytest.mark.full),
    ],
)
def test_a_fault_of_the_bus_ends_in_zero_torque(
    changes: dict[str, int], code: int, sentence: str, bus: Path, spring: Path
) -> None:
    with emulated(bus, Drive(**changes)) as drive:  # type: ignore[arg-type]
        ran = control(spring, "--device", f"mit:{bus}:1:damiao-4310", *WORDS, "--duration-s", 5)
        assert ran.returncode == code, ran.stderr
        assert sentence in ran.stderr + ran.stdout
        drive.disconnected.wait()
        assert drive.torque == 0.0


class SlowDrive(Drive):
    """A drive on a busy machine, which reads and answers its first frame late."""

    def serve(self, connection: socket.socket) -> None:
        time.sleep(0.2)
        super().serve(connection)

    def replies(self, frame: bytes) -> list[bytes]:
        if self.commands < 3:
            time.sleep(0.2)
        return super().replies(frame)


@needs_program
def test_a_busy_machine_does_not_refuse_an_emulated_drive(bus: Path, spring: Path) -> None:
    with emulated(bus, SlowDrive()) as drive:
        ran = control(spring, "--device", f"mit:{bus}:1:damiao-4310", *WORDS, "--duration-s", 0.1)
    assert ran.returncode == 0, ran.stderr
    assert drive.commands > 100


@needs_program
def test_the_watchdog_ends_the_torque_of_a_killed_program(drive: Drive, bus: Path, spring: Path) -> None:
    words = [spring, "--device", f"mit:{bus}:1:damiao-4310", *WORDS, "--duration-s", "inf", "--ramp-s", 0]
    process = start(PROGRAM, *words, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    while drive.largest_torque < 0.05:
        assert process.poll() is None
        time.sleep(0.01)
    process.kill()
    process.wait()
    drive.disconnected.wait()
    last_torque = drive.torque
    assert last_torque != 0.0
    drive.idle_s = 0.99 * drive.watchdog_s
    assert (drive.enabled, drive.torque) == (True, last_torque)
    drive.idle_s = 1.01 * drive.watchdog_s
    assert (drive.enabled, drive.torque) == (True, 0.0)


@needs_program
@pytest.mark.parametrize(
    ("name", "sentence"),
    [
        ("mit", "must be mit:BUS:NUMBER:KIND, such as mit:can0:1:damiao-4310; KIND is one of damiao-4310,"),
        ("mit:can0:1", "must be mit:BUS:NUMBER:KIND"),
        ("mit::1:damiao-4310", "must be mit:BUS:NUMBER:KIND"),
        ("mit:can0:16:damiao-4310", "the number must be from 1 to 15"),
        ("mit:can0:0:cubemars-ak80-9", "the number must be from 1 to 127"),
        ("mit:can0:x:damiao-4310", "the number must be from 1 to 15"),
        ("mit:can0:1:ak80", "the kind must be one of damiao-4310"),
        ("mit:can99:1:damiao-4310", "there is no CAN interface can99: 'ip link' lists the interfaces"),
        (
            "mit:/nowhere/bus:1:damiao-4310",
            "/nowhere/bus: No such file or directory; start the emulated",
        ),
        (
            "mitten",
            "mit:BUS:NUMBER:KIND, moteus:BUS:NUMBER:KP, wheel:NODE:DEGREES:TORQUE[:STIFFNESS] or inverse3",
        ),
        (
            "moteus:can0:1",
            "must be moteus:BUS:NUMBER:KP, such as moteus:can0:1:4; KP is servo.",
        ),
        ("moteus:can0:127:4", "the number must be from 1 to 126"),
        ("moteus:can0:1:0", "KP must be a number > 0 in N*m/rev"),
        ("moteus:can0:1:nan", "KP must be a number > 0 in N*m/rev"),
        ("moteus:can99:1:4", "there is no CAN interface can99"),
    ],
)
def test_a_wrong_name_is_refused_in_one_sentence(name: str, sentence: str, spring: Path) -> None:
    ran = control(spring, "--device", name, "--uncertified")
    assert ran.returncode == 2
    assert sentence in ran.stderr
    assert ran.stderr.count("error:") == 1


def test_a_drive_is_measured_without_being_enabled(drive: Drive, bus: Path) -> None:
    words = ["--device", f"mit:{bus}:1:damiao-4310", "--duration-s", 2, "--rate-hz", 200]
    ran = run(sys.executable, "-m", "palpate", "check-device", *words)
    assert ran.returncode in (0, 1), ran.stderr
    assert "damiao-4310" in ran.stdout
    assert not drive.enabled
    assert drive.largest_torque == 0.0
    assert drive.commands > 50


def test_the_example_profile_has_the_steps_of_the_drive() -> None:
    profile = DeviceProfile.load(example_profiles()["damiao-4310"][0])
    assert profile.encoder_step == pytest.approx(25.0 / 65535)
    assert profile.force_step == pytest.approx(20.0 / 4095)
    assert profile.force_limit == 10.0


@needs_program
def test_the_help_names_every_transport() -> None:
    shown = " ".join(control("--help").stdout.split())
    for name, form, text in transports:
        assert form in shown
        assert text in shown
        assert form in device_help
        assert (form in measured_device_help) == (name != "inverse3")
    assert re.search(r"usb 5, mit 2, moteus 2, wheel 1, inverse3 20", shown)

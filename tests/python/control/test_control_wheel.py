# SPDX-License-Identifier: Apache-2.0
"""palpate-control on an emulated force-feedback wheel; reports against those of the driver of Linux."""

from __future__ import annotations

import json
import math
import os
import random
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from conftest import ROOT, sampled
from control_program import control, every_row, needs_program
from emulated_device import emulated
from hid_wheel import MOST_EFFECTS, TOP, Wheel, open_ff_board
from models_by_hand import model_by_hand
from palpate import DeviceProfile, Model, Plan, identify, load_model, plan, read_recording, verify
from palpate.cli.main import main
from palpate.planning import HeldLine, example_profiles
from pid_driver import Driver

PERIOD_S = 2e-3
DEGREES = 180
TORQUE = Wheel().full_torque
STIFFNESS = Wheel().stiffness
STEP = 0.5 * math.radians(DEGREES) / TOP
SCALE = max(1, int(os.environ.get("PALPATE_TEST_SCALE", "1")))


def name(node: Path, *, springs: bool = True) -> str:
    """Returns the name of the emulated wheel as a device."""
    return f"wheel:{node}:{DEGREES}:{TORQUE:g}" + f":{STIFFNESS:.6f}" * springs


def spring() -> Model:
    """Returns a spring of 3 N*m/rad with a detent, too stiff for a held force on this wheel."""
    return model_by_hand(alpha=[[8.0]], weight=[0.02], linear=[3.0])


def profile(**fields: Any) -> DeviceProfile:
    """Returns the example profile with the numbers of the emulated wheel, and little damping."""
    device = DeviceProfile.load(example_profiles()["hid-wheel"][0])
    assert device.held_line is not None
    loop = {
        "encoder_step": STEP,
        "position_step": STEP,
        "stiffness_step": STIFFNESS / TOP,
        "largest_stiffness": STIFFNESS,
        "largest_center": 0.5 * math.radians(DEGREES),
    }
    own = {
        "viscous_damping": 0.016,
        "coulomb_friction": 0.04,
        "force_limit": TORQUE,
        "force_step": TORQUE / TOP,
        "encoder_step": STEP,
        "held_line": HeldLine(**device.held_line.to_dict() | loop),
    }
    return DeviceProfile(**device.to_dict() | own | fields)


@pytest.fixture
def node(tmp_path: Path) -> Path:
    return tmp_path / "wheel.sock"


@pytest.fixture(scope="module")
def planned(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return plan(spring(), profile()).stored().save(tmp_path_factory.mktemp("plan") / "planned.json")


@pytest.fixture(scope="module")
def reports(tmp_path_factory: pytest.TempPathFactory) -> Callable[..., list[list[str]]]:
    """Returns a function that gives the reports of commands, in a list for each command."""
    compiler = shutil.which("g++") or pytest.skip("needs g++")
    folder = tmp_path_factory.mktemp("reports")
    program = folder / "wheel_reports"
    source = ROOT / "tests" / "python" / "control" / "wheel_reports.cpp"
    include = ROOT / "cpp" / "include"
    subprocess.run([compiler, "-std=c++20", f"-I{include}", str(source), "-o", str(program)], check=True)

    def of(
        descriptor: bytes, commands: list[tuple[float, float, float]], *settings: float
    ) -> list[list[str]]:
        (folder / "descriptor").write_bytes(descriptor)
        command = [str(program), str(folder / "descriptor"), *map(repr, settings)]
        text = "\n".join(" ".join(map(repr, numbers)) for numbers in commands)
        ran = subprocess.run(command, input=text, capture_output=True, text=True, check=True)
        return [part.split() for part in ran.stdout.split("...")]

    return of


@pytest.mark.parametrize("axes", sampled([1, 2], 2))
def test_reports_have_the_bytes_of_the_driver_of_linux(
    axes: int, reports: Callable[..., list[list[str]]]
) -> None:
    descriptor = open_ff_board(axes)
    driver = Driver(descriptor)
    half, torque, stiffness = 1.5, 8.0, 20.0
    chance = random.Random(41)
    commands = []
    for number in range(10_000):
        slope = 0.0 if number % 3 == 0 else chance.uniform(0.5, 1.1 * stiffness)
        force = chance.uniform(-1.1 * torque, 1.1 * torque)
        commands.append((force if slope == 0.0 else 0.1 * force, chance.uniform(-1.4, 1.4), slope))
    got = reports(descriptor, commands, half, torque, stiffness, 0.1)
    opening = [
        driver.control(0x99),
        driver.control(0x9A),
        driver.control(0x97),
        driver.gain(),
        driver.create(0x26),
        driver.set_effect(1, 0x26, 100),
        driver.create(0x40),
        driver.set_effect(2, 0x40, 100),
        driver.constant(1, 0),
        driver.start(1),
        driver.start(2),
    ]
    assert [line[1:] for line in got[0]] == [report.hex() for report in opening]
    assert [line[0] for line in got[0]] == list("OOOOFOFOOOO")
    start = {driver.start(1).hex(), driver.start(2).hex()}
    states = set()
    for (force, position, slope), lines in zip(commands, got[1:-1], strict=True):
        sent = [line[1:] for line in lines if line[1:] not in start]
        level = round(min(max(force / torque, -1.0), 1.0) * TOP)
        code = round(min(slope / stiffness, 1.0) * TOP)
        center = position if code == 0 else position - force / (stiffness * code / TOP)
        if code and abs(center) > half:
            states.add("two reports")
            assert len(sent) == 2
        elif code:
            states.add("spring")
            expected = driver.spring(2, round(center / half * TOP), code, 0xFFFF)
            assert sent[-1] == expected.hex()
        else:
            states.add("constant force")
            assert sent[-1] == driver.constant(1, level).hex()
    assert states == {"spring", "constant force", "two reports"}
    closing = [driver.control(command).hex() for command in (0x99, 0x9A, 0x98)]
    assert [line[1:] for line in got[-1]][-3:] == closing


@needs_program
def test_a_planned_spring_is_rendered_recorded_and_identified_again(
    planned: Path, node: Path, tmp_path: Path
) -> None:
    found = Plan.of(load_model(planned))
    assert found.structure == "tangent"
    assert found.scheme.line is not None
    assert found.scheme.line.rule == "constant"
    assert found.refused[0].startswith("direct: viscous damping")
    record = tmp_path / "rendered.csv"
    with emulated(node, Wheel(period_s=PERIOD_S)) as wheel:
        ran = control(
            planned, "--device", name(node), "--wait-ms", 0.5, "--json", "--duration-s", 4, "--record", record
        )
    assert ran.returncode == 0, ran.stderr
    assert "uncertified" not in ran.stderr
    summary = json.loads(ran.stdout)
    assert summary["wheel"]["reports"] > 1900
    assert summary["wheel"]["two_reports"] == summary["wheel"]["malformed"] == 0
    assert "confirmed" in json.dumps(summary)
    assert not wheel.enabled
    assert not wheel.effects
    rows = every_row(record)
    settled = rows[rows["time_s"] > 0.5]
    error = settled["applied_Nm"] - spring().force(settled["position_rad"].to_numpy())
    assert np.sqrt(np.mean(error**2)) < 0.02
    assert np.ptp(settled["position_rad"]) > 0.1
    # The wheel made the torque that the recording states
    torques = np.array([-torque for _, torque in wheel.trace])[-len(settled) :]
    assert abs(torques.mean() - settled["applied_Nm"].mean()) < 0.02
    recording = read_recording(record, force="applied_Nm")
    again = identify(recording, inputs="position")
    x = np.linspace(settled["position_rad"].min(), settled["position_rad"].max(), 100)
    assert np.abs(again.force(x) - spring().force(x)).max() < 0.02 * np.ptp(spring().force(x))
    assert verify(again, recording).verdict.level != "no"


@pytest.mark.full
@needs_program
def test_a_soak_of_a_certified_line_answers_and_records_every_command(
    planned: Path, node: Path, tmp_path: Path
) -> None:
    seconds = 3 * SCALE
    record = tmp_path / "soak.csv"
    words = ["--wait-ms", 0.5, "--json", "--duration-s", seconds, "--record", record]
    with emulated(node, Wheel(period_s=PERIOD_S)) as wheel:
        ran = control(planned, "--device", name(node), *words)
    assert ran.returncode == 0, ran.stderr
    summary = json.loads(ran.stdout)
    ticks = round(seconds / PERIOD_S)
    assert summary["ticks"] == summary["recorded"] == ticks
    assert wheel.forces >= ticks
    counters = summary["wheel"]
    assert counters["malformed"] == counters["unsent"] == counters["two_reports"] == 0
    rows = pd.read_csv(record, comment="#", usecols=["time_s", "status"])
    statuses = rows["status"].value_counts()
    print(f"{ticks} ticks: {dict(statuses)}")
    assert set(statuses.index) <= {"Ok", "Ramp"}
    assert statuses["Ramp"] <= 0.5 / PERIOD_S
    assert not wheel.enabled
    assert not wheel.effects


@needs_program
@pytest.mark.parametrize(
    ("fault", "sentence"),
    [
        ({"gone_after": 300}, "Fault"),
        ({"paused_after": 300}, "Fault"),
        ({"jolt": (300, 6.0)}, "Jump"),
        ({"jolt": (300, -9.0)}, "Jump"),
    ],
)
def test_a_fault_ends_a_certified_run_in_zero_force(
    fault: dict[str, Any], sentence: str, planned: Path, node: Path
) -> None:
    with emulated(node, Wheel(period_s=PERIOD_S, **fault)) as wheel:
        ran = control(planned, "--device", name(node), "--wait-ms", 0.5, "--duration-s", 4)
        assert ran.returncode == 1
        assert sentence in ran.stderr
        assert wheel.forces < 310
        if "gone_after" in fault:  # the effects end with their duration
            assert any(effect.started is not None for effect in wheel.effects.values())
            wheel.step(0.11)
        assert wheel.torque == 0.0


@needs_program
@pytest.mark.full
def test_a_wheel_that_ignores_reports_ends_its_force_with_the_duration(planned: Path, node: Path) -> None:
    with emulated(node, Wheel(period_s=PERIOD_S, deaf_after=300)) as wheel:
        control(planned, "--device", name(node), "--wait-ms", 0.5, "--duration-s", 4)
        assert wheel.torque != 0.0 or wheel.forces == 300
        wheel.step(0.11)
        assert wheel.torque == 0.0


@needs_program
@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"cut": 900}, "has a wrong report descriptor: byte"),
        ({"cut": 60}, "a collection is open"),
        ({"memory": 0}, "has no memory for a constant force: end the programs"),
        ({"memory": 1}, "has no memory for a spring"),
        ({"spring": False}, "has no spring effect: leave out the stiffness"),
        ({"center": 2.0}, "reports a position at the end of its axis"),
    ],
)
def test_a_wheel_that_cannot_render_is_refused_in_one_sentence(
    changes: dict[str, Any], sentence: str, planned: Path, node: Path
) -> None:
    with emulated(node, Wheel(period_s=PERIOD_S, **changes)) as wheel:
        ran = control(planned, "--device", name(node))
        assert ran.returncode == 2
        assert sentence in ran.stderr
        assert ran.stderr.count("error:") == 1
        assert wheel.torque == 0.0
        assert wheel.largest_torque == 0.0


@needs_program
@pytest.mark.parametrize(
    ("device", "sentence"),
    [
        ("wheel", "must be wheel:NODE:DEGREES:TORQUE[:STIFFNESS]"),
        ("wheel:/dev/hidraw0:900", "such as wheel:/dev/hidraw0:900:8:4"),
        ("wheel::900:8", "must be wheel:NODE"),
        ("wheel:/dev/hidraw0:0:8", "DEGREES must be a number > 0 in degrees"),
        ("wheel:/dev/hidraw0:900:x", "TORQUE must be a number > 0 in N*m"),
        ("wheel:/dev/hidraw0:900:8:-1", "STIFFNESS must be a number > 0 in N*m/rad"),
        ("wheel:/dev/hidraw0:900:8:4:1", "must be wheel:NODE"),
        ("wheel:/nowhere/hidraw0:900:8", "No such file or directory; 'ls /dev/hidraw*' lists the nodes"),
        ("wheel:/dev/null:900:8", "choose the hidraw node of a wheel"),
    ],
)
def test_a_wrong_name_is_refused_in_one_sentence(device: str, sentence: str, tmp_path: Path) -> None:
    model = spring().save(tmp_path / "model.json")
    ran = control(model, "--device", device, "--uncertified")
    assert ran.returncode == 2
    assert sentence in ran.stderr
    assert ran.stderr.count("error:") == 1


@needs_program
@pytest.mark.parametrize(
    ("fields", "device", "sentence"),
    [
        (
            {"largest_center": 2.0},
            None,
            "held_line.largest_center of the profile is 2: must be at most 1.571",
        ),
        (
            {"largest_center": 0.1},
            None,
            "must be within held_line.largest_center, 0.1; set a larger rotation",
        ),
        ({"largest_center": None}, None, "has no held_line.largest_center: a wheel takes springs"),
        (
            {"position_step": STEP / 2},
            None,
            "held_line.position_step of the profile is 2.397e-05: must be at",
        ),
        (
            {"stiffness_step": 1e-6},
            None,
            "held_line.stiffness_step of the profile is 1e-06: must be at least",
        ),
        (
            {"largest_stiffness": 9.0},
            None,
            "held_line.largest_stiffness of the profile is 9: must be at most",
        ),
        ({}, "without", "append it as in wheel:NODE:DEGREES:TORQUE:STIFFNESS"),
    ],
)
def test_a_plan_for_another_wheel_is_refused(
    fields: dict[str, Any], device: str | None, sentence: str, node: Path, tmp_path: Path
) -> None:
    usual = profile()
    assert usual.held_line is not None
    loop = {key: value for key, value in (usual.held_line.to_dict() | fields).items() if value is not None}
    made = plan(spring(), profile(held_line=HeldLine(**loop)))
    assert made.structure == "tangent"
    file = made.stored().save(tmp_path / "planned.json")
    with emulated(node, Wheel(period_s=PERIOD_S)) as wheel:
        ran = control(file, "--device", name(node, springs=device is None))
        assert ran.returncode == 2
        assert sentence in ran.stderr
        assert not wheel.enabled
        assert wheel.largest_torque == 0.0


@needs_program
def test_a_held_force_needs_no_stiffness(node: Path, tmp_path: Path) -> None:
    soft = model_by_hand(weight=[0.0], linear=[0.8])
    record = tmp_path / "held.csv"
    file = soft.save(tmp_path / "soft.json")
    words = ["--uncertified", "--rate-hz", 500, "--wait-ms", 0.5, "--duration-s", 2]
    with emulated(node, Wheel(period_s=PERIOD_S)) as wheel:
        ran = control(file, "--device", name(node, springs=False), *words, "--record", record, "--json")
        assert ran.returncode == 0, ran.stderr
        assert 0.1 < wheel.largest_torque < 0.5
    rows = every_row(record)
    settled = rows[rows["time_s"] > 0.5]
    assert np.abs(settled["applied_Nm"] - 0.8 * settled["position_rad"]).max() < 0.01


def test_a_wheel_is_measured_without_being_enabled(node: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with emulated(node, Wheel()) as wheel:
        code = main(
            [
                "check-device",
                "--device",
                name(node),
                "--rate-hz",
                "200",
                "--duration-s",
                "2",
                "--wait-ms",
                "20",
            ]
        )
        printed = capsys.readouterr()
        assert code in (0, 1), printed.err
        assert "wheel on" in printed.out
        assert "rate" in printed.out
        assert wheel.largest_torque == 0.0
        assert not wheel.effects


def test_the_example_profile_has_the_steps_of_the_reports() -> None:
    device = DeviceProfile.load(example_profiles()["hid-wheel"][0])
    loop = device.held_line
    assert loop is not None
    half = math.radians(90.0)
    assert device.encoder_step == loop.position_step == pytest.approx(half / TOP, rel=1e-4)
    assert device.force_step == pytest.approx(8.0 / TOP, rel=1e-4)
    assert loop.stiffness_step == pytest.approx(20.0 / TOP, rel=1e-4)
    assert loop.largest_center == pytest.approx(half)
    assert MOST_EFFECTS == 40

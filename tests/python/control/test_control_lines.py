# SPDX-License-Identifier: Apache-2.0
"""Certified held lines on emulated CAN drives: plan, rendering, recording, identification, and faults."""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from can_motor import CanMotor
from conftest import sampled
from control_program import control, every_row, needs_program
from emulated_device import emulated
from mit_drive import Drive
from models_by_hand import model_by_hand
from moteus_controller import Moteus
from palpate import DeviceProfile, Model, Plan, identify, load_model, plan, read_recording, verify
from palpate._core.stability import fast_motion_energy
from palpate.planning import HeldLine, example_profiles

pytestmark = needs_program

KINDS: dict[str, tuple[type[CanMotor], str, str]] = {
    "mit": (Drive, "damiao-4310", "mit:{bus}:1:damiao-4310"),
    "moteus": (Moteus, "moteus-r4", "moteus:{bus}:1:4"),
}
"""Adapter -> emulated drive, example profile, name of the device"""

WATCHDOG_S = 0.03
"""Watchdog of the certificates, which is not the default of the adapters"""


def profile(kind: str) -> DeviceProfile:
    """Returns the example profile with this watchdog."""
    device = DeviceProfile.load(example_profiles()[KINDS[kind][1]][0])
    assert device.held_line is not None
    loop = HeldLine(**device.held_line.to_dict() | {"watchdog_s": WATCHDOG_S})
    return DeviceProfile(**device.to_dict() | {"held_line": loop})


def spring() -> Model:
    """Returns a spring of 3 N*m/rad with a detent, too stiff for a held force on both profiles."""
    return model_by_hand(alpha=[[8.0]], weight=[0.02], linear=[3.0])


@pytest.fixture(params=sorted(KINDS))
def kind(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@cache
def plan_on(kind: str) -> Model:
    return plan(spring(), profile(kind)).stored()


@pytest.fixture
def planned(kind: str, tmp_path: Path) -> Path:
    return plan_on(kind).save(tmp_path / "planned.json")


def run_on(kind: str, planned: Path, drive: CanMotor, *options: object) -> Any:
    """Renders a plan on a drive in virtual time, and returns the ended program."""
    bus = planned.with_name("bus.sock")
    device = KINDS[kind][2].format(bus=bus)
    with emulated(bus, drive):
        return control(planned, "--device", device, "--wait-ms", 0.5, "--json", *options)


def made(kind: str, **faults: Any) -> CanMotor:
    return KINDS[kind][0](**faults)


def test_a_planned_line_is_rendered_recorded_and_identified_again(
    kind: str, planned: Path, tmp_path: Path
) -> None:
    found = Plan.of(load_model(planned))
    assert found.structure == "tangent"
    assert found.refused[0].startswith("direct: viscous damping")
    record = tmp_path / "rendered.csv"
    drive = made(kind)
    ran = run_on(kind, planned, drive, "--duration-s", 4, "--record", record)
    assert ran.returncode == 0, ran.stderr
    assert "uncertified" not in ran.stderr
    summary = json.loads(ran.stdout)
    assert summary["can"]["timeouts"] == 0
    assert "confirmed" in json.dumps(summary)
    assert drive.watchdog_s == pytest.approx(WATCHDOG_S)
    assert not drive.enabled
    rows = every_row(record)
    settled = rows[rows["time_s"] > 0.5]
    # The drive holds the line, so its torque belongs to the position at the same time
    error = settled["applied_Nm"] - spring().force(settled["position_rad"].to_numpy())
    assert np.sqrt(np.mean(error**2)) < 5e-3
    assert np.ptp(settled["position_rad"]) > 0.1
    recording = read_recording(record, force="applied_Nm")
    again = identify(recording, inputs="position")
    x = np.linspace(settled["position_rad"].min(), settled["position_rad"].max(), 100)
    assert np.abs(again.force(x) - spring().force(x)).max() < 0.02 * np.ptp(spring().force(x))
    assert verify(again, recording).verdict.level != "no"


def test_a_motion_faster_than_the_certified_one_ends_the_run(kind: str, planned: Path) -> None:
    drive = made(kind, jolt=(600, 6.0))
    ran = run_on(kind, planned, drive, "--duration-s", 4)
    assert ran.returncode == 1
    assert "Jump" in ran.stderr
    assert drive.commands < 700
    assert not drive.enabled
    assert drive.torque == 0.0


@pytest.mark.parametrize("fault", ["lost", "unanswered", "answers"])
def test_a_lost_frame_ends_a_certified_run_and_the_line(kind: str, planned: Path, fault: str) -> None:
    at = 700
    drive = made(kind, **{fault: at if fault == "answers" else {at}})
    ran = run_on(kind, planned, drive, "--duration-s", 4)
    assert ran.returncode == 1
    assert "timeout" in ran.stdout
    # The commands after the lost frame: zero force at the next tick, and those that end the run
    assert drive.commands <= at + 5
    torques = np.array([torque for _, torque in drive.trace])
    assert np.abs(torques[at - 20 : at - 1]).max() > 0.2
    acting = np.flatnonzero(np.abs(torques) > 5e-3)[-1] + 1 - at
    assert acting <= 1000 * WATCHDOG_S
    assert drive.torque == 0.0


@pytest.mark.parametrize("lost", sampled([3, 5], 5))
def test_a_hand_takes_at_most_the_stated_energy_after_lost_commands(
    kind: str, planned: Path, lost: int
) -> None:
    at = 700
    # The hand is pulled away while the last line stays, faster than the certified motion
    drive = made(kind, lost=set(range(at, at + lost)), jolt=(at, -3.0))
    ran = run_on(kind, planned, drive, "--duration-s", 4)
    assert ran.returncode == 1
    until_watchdog = DeviceProfile(**profile(kind).to_dict() | {"period_s": WATCHDOG_S, "jitter_s": 0.0})
    # Nothing reaches the drive after a run that ends while all commands are lost
    for _ in range(round(1000 * WATCHDOG_S) + 1):
        drive.step()
    position, torque = np.array(drive.trace).T
    moved = np.diff(position[at - 2 :])
    assert np.abs(moved).max() > 0.025  # the certified motion of both plans
    taken = np.cumsum(0.5 * (torque[at - 2 : -1] + torque[at - 1 :]) * moved).max()
    assert 0.01 < taken < fast_motion_energy(until_watchdog)
    assert drive.torque == 0.0

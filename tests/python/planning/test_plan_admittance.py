# SPDX-License-Identifier: Apache-2.0
"""Plans and simulations on an admittance display, which measures the force and moves to a position."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import control_program
import palpate
from emulated_device import emulated
from mit_drive import Drive
from models_by_hand import model_by_hand
from palpate import DeviceProfile, InputError, Recording
from palpate.cli.main import main
from palpate.planning import AdmittanceDisplay, Plan, force_error, hand_for, judge

SERVO_HZ = 60.0
HAND = {"hand_stiffness": 2e4, "hand_damping": 20.0, "hand_mass": 0.0, "handle_mass": 0.0}


def pedal(**changes: Any) -> DeviceProfile:
    """Returns a pedal at 4 kHz with a servo of 60 Hz."""
    display = {
        **HAND,
        "servo_bandwidth_hz": SERVO_HZ,
        "servo_damping": 0.8,
        "position_step": 0.0,
        "feed_forward_s": 0.0,
        **changes,
    }
    return DeviceProfile(
        id="pedal",
        position_unit="m",
        period_s=2.5e-4,
        delay_s=2.5e-4,
        force_limit=1e3,
        encoder_step=0.0,
        admittance=AdmittanceDisplay(**display),
    )


def spring(slope: float = 5e3) -> palpate.Model:
    return model_by_hand(
        units={"position": "m", "force": "N"},
        alpha=[[200.0]],
        beta=[[0.02]],
        weight=[1.0],
        linear=[slope],
        upper=[0.05],
    )


@pytest.fixture(scope="module")
def planned() -> Plan:
    return palpate.plan(spring(), pedal())


def test_the_plan_has_the_least_damping_of_the_closed_form(planned: Plan) -> None:
    certificate = planned.certificate
    assert certificate is not None
    assert certificate.certified
    lag = 2.0 * 0.8 / (2.0 * np.pi * SERVO_HZ)
    closed_form = HAND["hand_stiffness"] * (2.5e-4 + lag)
    assert planned.scheme.object_damping == pytest.approx(closed_form, rel=0.01)
    assert not planned.scheme.has_coupling
    assert len(planned.refused) == 2
    rows = planned.summary()
    assert "2e+04" in rows["proved for hands"]
    assert f"{planned.scheme.object_damping:.4g}" in rows["felt in addition"]


def test_the_plan_survives_the_model_file(planned: Plan, tmp_path: Path) -> None:
    planned.stored().save(tmp_path / "pedal.json")
    read = Plan.of(palpate.load_model(tmp_path / "pedal.json"))
    assert read.scheme == planned.scheme
    assert read.certificate is not None
    assert planned.certificate is not None
    assert read.certificate.fingerprint == planned.certificate.fingerprint


def test_a_profile_survives_its_file(tmp_path: Path) -> None:
    device = pedal(rate_limit=0.3)
    assert DeviceProfile.load(device.save(tmp_path / "pedal.toml")) == device


def test_a_refusal_names_the_damping_and_the_hand_that_would_work() -> None:
    refused = palpate.plan(spring(), pedal(), object_damping=30.0, mass=1.0)
    assert refused.verdict.level == "no"
    assert "object damping of at least" in refused.needs
    stiffest = float(refused.needs.split("a hand of at most ")[1].split(" ")[0])
    softer = palpate.plan(spring(), pedal(hand_stiffness=stiffest), object_damping=30.0, mass=1.0)
    assert softer.certificate is not None
    assert softer.certificate.certified
    assert stiffest > 1e3


def test_the_rendered_force_is_that_of_the_object_and_its_damping(planned: Plan) -> None:
    device = pedal()
    rendered = palpate.simulate(planned, device, hand_for(planned, device), 4.0)
    error = force_error(planned, rendered)
    assert judge(planned, rendered, error).level != "no"
    after = rendered.time > 0.5
    velocity = np.gradient(rendered.position, rendered.time)
    beyond = rendered.force - planned.model.force(rendered.position)
    damping = np.linalg.lstsq(velocity[after, None], beyond[after], rcond=None)[0][0]
    # The spring follows the handle by delay and lag, which is felt as damping
    late = 2.5e-4 + 2.0 * 0.8 / (2.0 * np.pi * SERVO_HZ)
    assert damping == pytest.approx(planned.scheme.object_damping + 5e3 * late, rel=0.02)
    rest = np.abs(velocity) < 1e-4
    assert np.abs(beyond[after & rest]).max() < 0.01 * planned.model.force(0.05)


@pytest.mark.full
def test_a_rendering_can_be_identified(planned: Plan) -> None:
    device = pedal()
    rendered = palpate.simulate(planned, device, hand_for(planned, device), 4.0)
    slow = Recording.from_arrays(
        rendered.position[::40], rendered.force[::40], rendered.time[::40], units=rendered.units
    )
    identified = palpate.identify(slow)
    x = np.linspace(0.01, 0.04, 31)
    force = [np.asarray(identified.force(x, direction=side)) for side in (1.0, -1.0)]
    assert np.abs(np.mean(force, axis=0) - spring().force(x)).max() < 0.03 * spring().force(0.05)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"coupling": True}, "no virtual coupling"),
        ({"predict": 2}, "no prediction"),
        ({"mass": 0.0}, "mass is 0"),
    ],
    ids=["coupling", "prediction", "mass"],
)
def test_settings_that_the_display_does_not_have_are_refused(arguments: Any, words: str) -> None:
    with pytest.raises(InputError, match=words):
        palpate.plan(spring(), pedal(), **arguments)


def test_a_servo_damping_without_bandwidth_is_refused() -> None:
    with pytest.raises(InputError, match="servo_damping is given without"):
        pedal(servo_bandwidth_hz=None)


def test_another_hand_needs_another_certificate(planned: Plan) -> None:
    with pytest.raises(InputError, match="another hand or position servo"):
        planned.check_for(pedal(hand_stiffness=3e4))


def test_a_device_that_applies_forces_refuses_the_plan(planned: Plan) -> None:
    with pytest.raises(InputError, match="coupling_stiffness is 0"):
        palpate.simulate(
            Plan(planned.model, planned.scheme), DeviceProfile(), hand_for(planned, DeviceProfile()), 1.0
        )


def test_the_command_line_plans_and_simulates_a_pedal(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    spring().save(tmp_path / "spring.json")
    file = str(tmp_path / "spring.json")
    assert main(["plan", file, "--device", "pedal-2kg", "-o", file]) == 0
    assert "proved for hands" in capsys.readouterr().out
    assert main(["simulate", file, "--duration-s", "2"]) == 0
    assert "force error, below 50 Hz" in capsys.readouterr().out


def test_the_curve_of_a_planned_pedal_states_its_error_and_where_it_falls(
    planned: Plan, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    planned.stored().save(tmp_path / "spring.json")
    curve = tmp_path / "curve.csv"
    assert main(["export", str(tmp_path / "spring.json"), "--knots", "11", "-o", str(curve), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    x, force = np.loadtxt(curve, delimiter=",", skiprows=1, usecols=(1, 2)).T
    assert force == pytest.approx(np.asarray(planned.model.force(x)), rel=1e-8, abs=1e-8)
    fine = np.linspace(x[0], x[-1], 20_001)
    error = np.abs(np.interp(fine, x, force) - planned.model.force(fine)).max()
    assert found["largest_error"] == pytest.approx(error, rel=1e-3)
    assert not found["falls"]
    palpate.plan(clutch(), pedal()).stored().save(tmp_path / "clutch.json")
    assert main(["export", str(tmp_path / "clutch.json"), "--knots", "11", "-o", f"{curve}.2"]) == 0
    assert "looks up its position for a force jumps there" in capsys.readouterr().out


def clutch() -> palpate.Model:
    """Returns a clutch whose force rises to a peak, falls and rises again."""
    x = np.linspace(0.0, 0.06, 600)
    force = 2000.0 * x + 55.0 * np.tanh(x / 0.008) - 20.0 * np.tanh((x - 0.03) / 0.004) - 20.0
    return palpate.identify(Recording.from_arrays(x, force, units={"position": "m", "force": "N"}))


def brake() -> Recording:
    """Returns a recording of a brake pedal with an elastomer: progressive, with a loop of up to 30 N."""
    depth = np.concatenate([np.linspace(0.0, 0.03, 200), np.linspace(0.03, 0.0, 200)] * 3)
    press = np.tile(np.repeat([1.0, -1.0], 200), 3)
    force = 3e3 * depth + 6e6 * depth**3 + press * 15.0 * np.tanh(depth / 0.004)
    return Recording.from_arrays(depth, force, direction=press, units={"position": "m", "force": "N"})


def test_a_brake_pedal_with_elastomer_keeps_its_loop_and_gives_no_energy() -> None:
    model = palpate.identify(brake())
    assert model.hysteretic
    device = pedal()
    plan = palpate.plan(model, device)
    assert plan.certificate is not None
    assert plan.certificate.certified
    rendered = palpate.simulate(plan, device, hand_for(plan, device), 6.0)
    assert force_error(plan, rendered).band < 0.05 * np.ptp(
        model.force(np.linspace(0.0, 0.03, 50), direction=1.0)
    )
    after = rendered.time > 2.0
    lower, upper = 0.012, 0.018
    middle = after & (rendered.position > lower) & (rendered.position < upper)
    velocity = np.gradient(rendered.position, rendered.time)
    beyond = rendered.force - plan.scheme.object_damping * velocity
    loop = beyond[middle & (velocity > 0.0)].mean() - beyond[middle & (velocity < 0.0)].mean()
    assert loop == pytest.approx(30.0, rel=0.15)


def test_a_spring_between_two_stops_stays_there_and_returns() -> None:
    x = np.linspace(-0.03, 0.03, 1201)
    stop = 1e5 * (np.logaddexp(0.0, (np.abs(x) - 0.02) / 5e-4) * 5e-4) * np.sign(x)
    model = palpate.identify(
        Recording.from_arrays(x, 500.0 * x + stop, units={"position": "m", "force": "N"})
    )
    device = pedal()
    plan = palpate.plan(model, device)
    assert plan.certificate is not None
    assert plan.certificate.certified
    rendered = palpate.simulate(plan, device, hand_for(plan, device), 6.0)
    # The foot of 20 N/mm presses into both stops and the object returns between them
    assert rendered.position.max() > 0.02
    assert rendered.position.min() < -0.02
    assert force_error(plan, rendered).band < 0.05 * np.ptp(rendered.force)


@control_program.needs_program
def test_a_rendered_pedal_is_identified_from_its_recording(planned: Plan, tmp_path: Path) -> None:
    planned.stored().save(tmp_path / "pedal.json")
    record = tmp_path / "record.csv"
    done = control_program.control(
        tmp_path / "pedal.json", "--device", "simulated", "--duration-s", "4", "--record", record
    )
    assert done.returncode == 0, done.stderr
    assert "position held, device closed" in done.stdout
    whole = palpate.read_recording(record)
    assert whole.time is not None
    recording = Recording.from_arrays(
        whole.position[::8], whole.force[::8], whole.time[::8], units=whole.units
    )
    model = palpate.identify(recording)
    x = np.linspace(recording.position.min(), recording.position.max(), 50)[5:-5]
    force = planned.model.force(x)
    # The damping of the object, and of its lag, appears as a loop
    sides = [np.asarray(model.force(x, direction=side)) for side in (1.0, -1.0)]
    assert np.abs(np.mean(sides, axis=0) - force).max() < 0.05 * np.ptp(force)


def drive_display(**changes: Any) -> DeviceProfile:
    """Returns the emulated drive in position mode: torque as force sensor, rotor as handle."""
    stiffness, inertia = 300.0, 1e-3
    display = {
        "hand_stiffness": 20.0,
        "hand_damping": 0.2,
        "hand_mass": 0.0,
        "handle_mass": inertia,
        "servo_bandwidth_hz": np.sqrt(stiffness / inertia) / (2.0 * np.pi),
        "servo_damping": 0.8,
        "position_step": 25.0 / 65535.0,
        "feed_forward_s": 0.0,
        "drive_stiffness": stiffness,
        "drive_damping": 2.0 * 0.8 * np.sqrt(stiffness * inertia),
        **changes,
    }
    return DeviceProfile(
        id="damiao-4310",
        delay_s=1e-3,
        encoder_step=25.0 / 65535.0,
        force_step=20.0 / 4095.0,
        force_limit=10.0,
        admittance=AdmittanceDisplay(**display),
    )


def drive_run(plan: Plan, tmp_path: Path, *words: object) -> subprocess.CompletedProcess[str]:
    """Renders a plan on an emulated drive in virtual time, so that a busy machine has no effect."""
    planned = plan.stored().save(tmp_path / "spring.json")
    device = f"mit:{tmp_path / 'bus'}:1:damiao-4310"
    return control_program.control(planned, "--uncertified", "--wait-ms", 0.5, "--device", device, *words)


@control_program.needs_program
def test_a_drive_in_position_mode_renders_the_object_against_its_hand(tmp_path: Path) -> None:
    model = model_by_hand(alpha=[[5.0]], weight=[0.02], linear=[2.0])
    plan = palpate.plan(model, drive_display())
    assert plan.certificate is not None
    assert plan.certificate.certified, plan.verdict
    with emulated(tmp_path / "bus", Drive()) as drive:
        done = drive_run(plan, tmp_path, "--duration-s", "3", "--record", tmp_path / "record.csv")
        assert done.returncode == 0, done.stderr + done.stdout
        # The drive was commanded a position with stiffness and damping, and is disabled at the end
        assert not drive.enabled
    record = palpate.read_recording(tmp_path / "record.csv")
    late = record.time > 0.5
    travel = np.ptp(record.position[late])
    # The hand of 20 N*m/rad moves by 0.4 rad; a spring of 2 N*m/rad leaves nearly all of it
    assert 0.3 < travel < 0.4
    velocity = np.gradient(record.position, record.time)
    columns = np.stack([np.asarray(model.force(record.position)), velocity], axis=1)
    share, damping = np.linalg.lstsq(columns[late], record.force[late], rcond=None)[0]
    assert share == pytest.approx(1.0, abs=0.1)
    assert damping > 0.5 * plan.scheme.object_damping


@control_program.needs_program
@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"drive_stiffness": None}, "has no admittance.drive_stiffness"),
        ({"position_step": 1e-5}, "position_step of the profile is 1e-05: must be at least 0.00038"),
    ],
    ids=["stiffness", "step"],
)
def test_a_drive_refuses_a_display_that_it_is_not(changes: Any, words: str, tmp_path: Path) -> None:
    plan = palpate.plan(model_by_hand(alpha=[[5.0]], weight=[0.02], linear=[2.0]), drive_display(**changes))
    with emulated(tmp_path / "bus", Drive()):
        refused = drive_run(plan, tmp_path)
    assert refused.returncode == 2
    assert words in refused.stderr


@control_program.needs_program
def test_options_that_change_the_plan_of_a_pedal_are_refused(planned: Plan, tmp_path: Path) -> None:
    planned.stored().save(tmp_path / "pedal.json")
    refused = control_program.control(
        tmp_path / "pedal.json", "--device", "simulated", "--structure", "massless"
    )
    assert refused.returncode == 2
    assert "render it with its plan, without options that change it" in refused.stderr
    other = control_program.control(tmp_path / "pedal.json", "--device", "usb")
    assert other.returncode == 2
    assert "applies forces: set device to simulated, mit or moteus" in other.stderr

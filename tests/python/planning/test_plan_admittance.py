# SPDX-License-Identifier: Apache-2.0
"""Plans and simulations on an admittance display, which measures the force and moves to a position."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import control_program
import palpate
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


@control_program.needs_program
def test_the_real_time_program_refuses_a_plan_for_a_display(planned: Plan, tmp_path: Path) -> None:
    planned.stored().save(tmp_path / "pedal.json")
    refused = control_program.control(tmp_path / "pedal.json", "--device", "simulated")
    assert refused.returncode == 2
    assert "planned for the admittance display pedal" in refused.stderr

# SPDX-License-Identifier: Apache-2.0
"""Plans for a device whose controller holds lines."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from models_by_hand import model_by_hand
from palpate import DeviceProfile, Hand, InputError, Plan, load_model, plan, simulate
from palpate._core.stability import stiffest_line_wall
from palpate.planning import HeldLine, HeldSlope, Scheme, example_profiles, force_error

LOOP = HeldLine(period_s=5e-5, delay_s=5e-5, encoder_step=1e-4)


def motor(**fields: Any) -> DeviceProfile:
    """Returns a knob with little damping whose controller holds lines."""
    usual = {
        "id": "motor",
        "viscous_damping": 4e-3,
        "coulomb_friction": 0.01,
        "encoder_step": 1e-4,
        "held_line": LOOP,
    }
    return DeviceProfile(**{**usual, **fields})


def right_side(planned: Plan, id: str) -> float:
    assert planned.certificate is not None
    return next(line.right for line in planned.certificate.inequalities if line.id == id)


@pytest.mark.parametrize(("delay_s", "damping"), [(0.0, 2e-3), (1e-3, 6e-3), (1.4e-3, 6e-3)])
def test_a_line_renders_an_object_that_a_held_force_cannot(delay_s: float, damping: float) -> None:
    planned = plan(model_by_hand(), motor(delay_s=delay_s, viscous_damping=damping))
    assert planned.structure == "tangent", planned.refused
    assert planned.certificate is not None
    assert planned.certificate.certified
    assert planned.force_error.share == 0.0
    assert planned.verdict.level == "good"
    assert planned.refused[0].startswith("direct: ")


def test_without_a_loop_that_holds_lines_the_tangent_is_not_mentioned() -> None:
    planned = plan(model_by_hand(), motor(held_line=None, viscous_damping=2e-3))
    assert planned.structure != "tangent"
    assert not any(reason.startswith("tangent") for reason in planned.refused)


def test_direct_rendering_is_preferred_if_it_is_certified() -> None:
    assert plan(model_by_hand(), motor(viscous_damping=0.06)).structure == "direct"


def test_a_hysteresis_is_rendered_without_delay_only() -> None:
    device = motor(viscous_damping=2e-3, coulomb_friction=0.05)
    model = model_by_hand(
        weight_hysteresis=[0.0], linear_hysteresis=[0.0], bias_hysteresis=0.05, play_radius=0.05
    )
    assert plan(model, device).structure == "tangent"
    late = motor(viscous_damping=2e-3, coulomb_friction=0.05, delay_s=1e-3)
    refused = plan(model, late).refused
    assert any(reason.startswith("tangent: ") and "h / r" in reason for reason in refused)


def test_the_plan_states_slope_and_largest_speed_of_the_line() -> None:
    row = plan(model_by_hand(), motor(viscous_damping=2e-3)).settings()["held line"]
    assert "up to 25 rad/s" in row
    assert "ends the run and gives at most" in row


def test_the_plan_states_the_energy_after_a_lost_command() -> None:
    device = DeviceProfile.load(example_profiles()["moteus-r4"][0])
    row = plan(model_by_hand(alpha=[[8.0]], weight=[0.02]), device).settings()["lost command"]
    # (t_w + t_d) (F_max - f_c)^2 / 4 b of docs/certificate.md
    energy = (0.02 + 1.16e-3) * (1.5 - 0.01) ** 2 / (4.0 * 2e-3)
    assert f"after 20 ms, and a hand takes at most {energy:.3g} J" in row
    without = plan(model_by_hand(), motor(viscous_damping=2e-3)).settings()["lost command"]
    assert without.startswith("without a watchdog")


def test_a_stored_line_is_read_and_checked_again(tmp_path: Path) -> None:
    planned = plan(model_by_hand(), motor(delay_s=1e-3, viscous_damping=6e-3))
    path = planned.stored().save(tmp_path / "m.json")
    again = Plan.of(load_model(path))
    assert again.scheme == planned.scheme
    assert again.scheme.line is not None
    content = json.loads(path.read_text(encoding="utf-8"))
    assert content["certificate"]["device"]["held_line"]["period_s"] == 5e-5
    for field, value in (("lift", 0.123), ("rule", "constant")):
        edited = json.loads(path.read_text(encoding="utf-8"))
        edited["plan"]["line"][field] = value
        (tmp_path / "edited.json").write_text(json.dumps(edited), encoding="utf-8")
        with pytest.raises(InputError, match="certificate"):
            Plan.of(load_model(tmp_path / "edited.json"))


def test_a_line_has_a_smaller_force_error_than_a_held_force() -> None:
    model, device = model_by_hand(linear=[7.0]), motor(viscous_damping=0.06)
    hand = Hand(frequency_hz=2.0, stiffness=200.0)
    errors = {}
    for name, scheme in (
        ("hold", Scheme(structure="direct")),
        ("line", Scheme(structure="tangent", line=HeldSlope(rule="steepest", slope=30.0, motion=3e-3))),
    ):
        planned = Plan(model, scheme)
        errors[name] = force_error(planned, simulate(planned, device, hand, 1.0)).mean
    assert errors["line"] < 0.2 * errors["hold"]


@pytest.mark.parametrize(
    ("loop", "message"),
    [
        ({**LOOP.to_dict(), "period_s": 2e-3}, "held_line.period_s is 0.002, must be at most period_s"),
        ({**LOOP.to_dict(), "delay_s": -1.0}, "held_line.delay_s is -1, must be >= 0"),
        ({**LOOP.to_dict(), "delay_s": 1e-3}, "held_line.delay_s is 0.001, must be 0 to 16 periods"),
    ],
)
def test_an_impossible_loop_is_refused(loop: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        motor(held_line=loop)


def test_a_profile_with_a_loop_is_saved_and_loaded(tmp_path: Path) -> None:
    path = motor().save(tmp_path / "motor.toml")
    assert "[held_line]" in path.read_text(encoding="utf-8")
    assert DeviceProfile.load(path) == motor()


@pytest.mark.full
def test_the_moteus_renders_several_times_stiffer_walls() -> None:
    device = DeviceProfile.load(example_profiles()["moteus-r4"][0])
    assert stiffest_line_wall(device, 0.01, 3e-3) >= 3.0 * 0.9902
    assert stiffest_line_wall(device, 0.05, 3e-3) >= 6.0 * 0.9902


def test_a_tactile_switch_on_a_linear_motor_is_rendered_by_lines() -> None:
    coil = DeviceProfile(
        id="coil",
        position_unit="m",
        viscous_damping=0.05,
        coulomb_friction=0.05,
        encoder_step=1e-6,
        inertia=0.05,
        held_line=HeldLine(period_s=5e-5, delay_s=5e-5, encoder_step=1e-6),
    )
    model = model_by_hand(
        units={"position": "m", "force": "N"},
        alpha=[[2000.0]],
        beta=[[0.002]],
        weight=[-0.2],
        linear=[100.0],
        upper=[0.004],
    )
    assert plan(model, coil).structure == "tangent"

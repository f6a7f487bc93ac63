# SPDX-License-Identifier: Apache-2.0
"""Compensation of the cogging of a motor."""

from __future__ import annotations

import json
import math
import re
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from models_by_hand import model_by_hand
from palpate import DeviceProfile, InputError, Model, Plan, Recording, load_model
from palpate._core.stability import certify
from palpate.cli.main import main
from palpate.planning import compensate, example_profiles, ripple_left

Array = NDArray[np.float64]
TURN = 2.0 * math.pi
ORDER, SIZE, PHASE = 84.0, 0.02, 0.4
"""A cogging of one order, whose steepest slope is ORDER SIZE [N*m/rad]"""
FRICTION = 0.004


def motor(**changes: Any) -> Model:
    arguments: dict[str, Any] = {
        "alpha": [[ORDER]],
        "beta": [[PHASE / ORDER]],
        "weight": [SIZE],
        "linear": [0.0],
        "bias": 0.003,
        "weight_hysteresis": [0.0],
        "linear_hysteresis": [0.0],
        "bias_hysteresis": FRICTION,
        "harmonics": 1,
        "upper": [TURN],
        "period": TURN,
    }
    return model_by_hand(**arguments | changes)


def weak(**changes: Any) -> DeviceProfile:
    """Returns a motor without delay whose damping is half of that which the cogging needs."""
    needed = 1e-3 * ORDER * SIZE / 2.0
    usual = {"viscous_damping": 0.5 * needed, "coulomb_friction": 1.0, "encoder_step": 0.0}
    return DeviceProfile(**usual | changes)


def recorded(seed: int) -> Recording:
    """Returns a recording of the motor in both directions, with noise of 2 % of the cogging."""
    turn = np.linspace(0.0, TURN, 3000)
    angle = np.concatenate([turn, turn[::-1]])
    way = np.repeat([1.0, -1.0], len(turn))
    torque = SIZE * np.cos(ORDER * angle - PHASE) + FRICTION * way + 0.003
    torque += np.random.default_rng(seed).normal(0.0, 0.02 * SIZE, len(angle))
    units = {"position": "rad", "force": "N*m"}
    return Recording.from_arrays(angle, torque, direction=way, units=units)


@cache
def compensated_vesc() -> Plan:
    return compensate(motor(), "vesc")


def test_scale_is_that_of_the_closed_form() -> None:
    # b >= T s M / 2 without delay (docs/certificate.md)
    planned = compensate(motor(), weak())
    assert planned.scale == pytest.approx(0.5, abs=2e-3)
    assert planned.scale <= 0.5
    assert planned.verdict.level == "usable"
    assert "% of the cogging is compensated. The whole needs device damping" in str(planned.verdict)
    assert "needs device damping b >= 0.00084" in planned.needs
    assert planned.certificate is not None
    assert planned.certificate.certified


@pytest.mark.parametrize(
    "changes",
    [
        {"delay_s": 1e-3},
        {"delay_s": 4e-4, "jitter_s": 2e-4},
        {"coulomb_friction": 4e-4, "encoder_step": 1e-3},
    ],
)
def test_a_scale_above_the_largest_is_not_certified(changes: dict[str, float]) -> None:
    device = weak(**changes)
    planned = compensate(motor(), device)
    assert planned.scale is not None
    assert 0.0 < planned.scale < 1.0

    def certified(scale: float) -> bool:
        at_scale = planned.model.with_network(weight=[-scale * SIZE])
        return certify(at_scale, planned.scheme, device).certified

    assert certified(planned.scale)
    assert not certified(planned.scale + 2e-3)


def test_the_force_is_the_negative_cogging_without_friction_and_mean() -> None:
    planned = compensate(motor(), weak(viscous_damping=1.0))
    assert planned.scale == 1.0
    assert planned.verdict.level == "good"
    x = np.linspace(0.0, TURN, 400)
    assert planned.model.force(x) == pytest.approx(-SIZE * np.cos(ORDER * x - PHASE), abs=1e-9)
    assert not planned.model.hysteretic


def test_a_controller_cancels_more_than_the_host() -> None:
    host = compensated_vesc()
    controller = compensate(motor(), "vesc", on_device=15e3)
    assert host.scale is not None
    assert controller.scale is not None
    assert host.scale < 0.5
    assert controller.scale == 1.0
    assert "controller" in controller.summary()["runs on"]


@pytest.mark.full
def test_a_controller_that_holds_lines_cancels_more() -> None:
    moteus = DeviceProfile.load(example_profiles()["moteus-r4"][0])
    lines = compensate(motor(), moteus)
    held = compensate(motor(), DeviceProfile(**moteus.to_dict() | {"held_line": None}))
    assert (lines.structure, held.structure) == ("tangent", "direct")
    assert lines.scale is not None
    assert held.scale is not None
    assert lines.scale > 1.3 * held.scale


def test_without_a_proved_scale_the_verdict_is_no() -> None:
    planned = compensate(motor(), weak(coulomb_friction=0.0, encoder_step=1e-3))
    assert planned.verdict.level == "no"
    assert planned.summary()["compensation"] == "no scale is proved"
    with pytest.raises(InputError, match="verdict no is not stored"):
        planned.stored()


def test_the_ripple_of_a_fresh_recording_is_the_part_that_is_not_cancelled() -> None:
    half = ripple_left(motor(), 0.5, recorded(1))
    assert half.recorded == pytest.approx(SIZE / math.sqrt(2.0), rel=2e-3)
    assert half.left == pytest.approx(0.5 * half.recorded, rel=3e-3)
    assert half.friction == pytest.approx(FRICTION, rel=0.01)
    whole = ripple_left(motor(), 1.0, recorded(2))
    assert whole.left == pytest.approx(0.02 * SIZE, rel=0.05)
    one_way = recorded(3)
    plain = Recording.from_arrays(one_way.position[:3000], one_way.force[:3000], units=one_way.units)
    model = motor(weight_hysteresis=None, linear_hysteresis=None, bias_hysteresis=None)
    assert ripple_left(model, 1.0, plain).left == pytest.approx(0.02 * SIZE, rel=0.05)


@pytest.mark.parametrize(
    ("model", "device", "sentence"),
    [
        (model_by_hand(), "moteus-r4", "the model has no period"),
        (motor(), "touch", "unit"),
        (motor(notes={"compensation": 0.5}), "moteus-r4", "the model is a compensation already"),
    ],
)
def test_an_object_that_is_not_a_cogging_is_refused(model: Model, device: str, sentence: str) -> None:
    with pytest.raises(InputError, match=sentence):
        compensate(model, device)


def test_the_plan_states_scale_ripple_and_friction(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    source = motor().save(tmp_path / "motor.json")
    fresh, output = recorded(4).write(tmp_path / "fresh.csv"), tmp_path / "cancel.json"
    device = weak(viscous_damping=0.41e-3 * ORDER * SIZE / 2.0)
    file = str(device.save(tmp_path / "weak.toml"))
    words = ["plan", str(source), "--device", file, "--compensate", "--fresh", str(fresh)]
    assert main([*words, "-o", str(output)]) == 0
    shown = " ".join(capsys.readouterr().out.split())
    scale = compensate(motor(), device).scale
    assert scale is not None
    assert f"compensation scale {scale:.4g}, proved" in shown
    assert re.search(r"ripple of fresh.csv 0.0142 N\*m RMS, 0.008[34]\d* N\*m with the compensation", shown)
    assert "noise included" in shown
    assert re.search(r"friction 0.00(399|4|401) N\*m, not compensated", shown)
    stored = load_model(output)
    assert Plan.of(stored).scale == scale
    assert main([*words, "--json"]) == 0
    found = json.loads(capsys.readouterr().out)["compensation"]
    assert found["scale"] == scale
    assert found["ripple"]["left_rms"] == pytest.approx((1.0 - scale) * SIZE / math.sqrt(2.0), rel=5e-3)
    # The compensation is rendered as any plan, and a table cannot cancel it
    assert main(["simulate", str(output), "--device", file, "--duration-s", "0.5"]) in (0, 1)
    capsys.readouterr()
    assert main(["export", str(output), "--cogging", "table", "-o", str(tmp_path / "t.csv")]) == 2
    assert f"export the identified model with --scale {scale:g}" in " ".join(capsys.readouterr().err.split())
    table = tmp_path / "table.csv"
    assert main(["export", str(source), "--cogging", "table", "--scale", f"{scale:g}", "-o", str(table)]) == 0
    rows = np.loadtxt(table, delimiter=",", skiprows=1)
    cogging = SIZE * np.cos(ORDER * rows[:, 0] - PHASE) + 0.003
    assert rows[:, 1] == pytest.approx(scale * cogging, abs=1e-9)


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        ("--compensate --coupling", "--coupling is given, but --compensate does not use it"),
        ("--compensate --predict 2", "--predict is given, but --compensate does not use it"),
        ("--fresh fresh.csv", "--fresh is given without --compensate"),
    ],
)
def test_options_that_do_not_fit_are_refused(
    options: str, sentence: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    source = motor().save(tmp_path / "motor.json")
    assert main(["plan", str(source), "--device", "vesc", *options.split()]) == 2
    assert sentence in " ".join(capsys.readouterr().err.split())


def test_an_impossible_scale_of_a_table_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    source = motor().save(tmp_path / "motor.json")
    for scale in ("0", "1.01", "nan"):
        words = ["export", str(source), "--cogging", "table", "--scale", scale, "-o", str(tmp_path / "t")]
        assert main(words) == 2
        assert f"--scale is {scale}: must be above 0 and at most 1" in capsys.readouterr().err

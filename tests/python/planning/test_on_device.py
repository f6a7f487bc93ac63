# SPDX-License-Identifier: Apache-2.0
"""Plans for a model that runs on the motor controller of a device."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from conftest import sampled
from models_by_hand import model_by_hand
from palpate import DeviceProfile, Hand, InputError, Plan, load_model, plan, simulate
from palpate.cli.main import main
from palpate.planning import OnDevice, example_profiles

KNOB = DeviceProfile(id="knob", coulomb_friction=0.01, delay_s=1e-3, jitter_s=2e-4)
TIMED = DeviceProfile(
    **KNOB.to_dict(),
    on_device=OnDevice(delay_periods=0.5, delay_s=2e-5, jitter_s=3e-6, highest_rate_hz=30e3),
)


def right_side(planned: Plan, id: str) -> float:
    assert planned.certificate is not None
    return next(line.right for line in planned.certificate.inequalities if line.id == id)


def test_the_certificate_has_period_delay_and_jitter_of_the_controller() -> None:
    for device, delay_s, jitter_s in ((KNOB, 1.0e-4, OnDevice().jitter_s), (TIMED, 0.7e-4, 3e-6)):
        planned = plan(model_by_hand(), device, on_device=10e3)
        assert planned.certificate is not None
        certified = planned.certificate.device
        assert certified.period_s == pytest.approx(1e-4)
        assert certified.delay_s == pytest.approx(delay_s)
        assert certified.jitter_s == jitter_s
        assert certified.renderer == "device"
        assert certified.on_device is None
        assert planned.summary()["runs on"] == "the motor controller of knob at 10000 Hz"


def test_a_plan_for_the_host_ignores_the_timing_of_the_controller() -> None:
    for device in (KNOB, TIMED):
        planned = plan(model_by_hand(), device)
        assert planned.certificate is not None
        assert planned.certificate.device == KNOB
        assert "runs on" not in planned.summary()


def test_only_the_damping_bound_scales_with_the_rate() -> None:
    exact = DeviceProfile(**KNOB.to_dict(), on_device=OnDevice(jitter_s=0.0))
    slow, fast = (plan(model_by_hand(), exact, on_device=rate, predict="off") for rate in (1e3, 40e3))
    assert right_side(slow, "damping-hold") == pytest.approx(40.0 * right_side(fast, "damping-hold"))
    assert right_side(slow, "friction-steps") == pytest.approx(right_side(fast, "friction-steps"))


def test_the_controller_renders_a_wall_that_the_host_cannot() -> None:
    wall = model_by_hand(linear=[150.0])
    strong = DeviceProfile(**KNOB.to_dict() | {"force_limit": 80.0})
    assert plan(wall, strong).limited is not None
    on_controller = plan(wall, strong, on_device=40e3)
    assert (on_controller.structure, on_controller.limited) == ("direct", None)
    assert str(on_controller.verdict) == "good"


@pytest.mark.parametrize("seed", sampled(range(8), 0, 1, 4))
def test_a_plan_for_the_controller_holds_for_the_exported_program(seed: int, tmp_path: Path) -> None:
    # The friction limits the play radius, so the narrowest certified play radius has no reserve for rounding
    random = np.random.default_rng(seed)
    switch = model_by_hand(
        alpha=[[20.0]], weight=[float(random.uniform(-0.3, 0.3))], linear=[float(random.uniform(1.0, 10.0))],
        weight_hysteresis=[0.0], linear_hysteresis=[0.0], bias_hysteresis=float(random.uniform(0.05, 0.2)),
    )  # fmt: skip
    device = DeviceProfile(**KNOB.to_dict() | {"encoder_step": 4e-4, "coulomb_friction": 0.004})
    chosen = plan(switch, device, on_device=20e3)
    assert chosen.certificate is not None
    assert chosen.certificate.certified
    model = chosen.stored().save(tmp_path / "m.json")
    assert main(["export", str(model), "--c", "-o", str(tmp_path / "m.h")]) == 0


def test_a_stored_plan_is_checked_and_read_again(tmp_path: Path) -> None:
    path = plan(model_by_hand(), TIMED, on_device=20e3).stored().save(tmp_path / "m.json")
    again = Plan.of(load_model(path))
    assert again.certificate is not None
    assert again.certificate.device.renderer == "device"
    content = json.loads(path.read_text(encoding="utf-8"))
    assert "on_device" not in content["certificate"]["device"]
    for changed, sentence in (
        ({"renderer": None}, "certificate.device.renderer is null: must be 'device'"),
        ({"renderer": "host"}, "certificate.device.renderer is \"host\": must be 'device'"),
        ({"on_device": {"delay_s": 0.0}}, "certificate.device.on_device"),
    ):
        wrong = json.loads(json.dumps(content))
        wrong["certificate"]["device"].update(changed)
        (tmp_path / "wrong.json").write_text(json.dumps(wrong), encoding="utf-8")
        with pytest.raises(InputError, match=re.escape(sentence)):
            load_model(tmp_path / "wrong.json")
    del content["certificate"]["device"]["renderer"]
    (tmp_path / "wrong.json").write_text(json.dumps(content), encoding="utf-8")
    with pytest.raises(InputError, match="the certificate was edited"):
        load_model(tmp_path / "wrong.json")


def test_a_plan_is_simulated_at_the_rate_of_the_controller(tmp_path: Path) -> None:
    planned = plan(model_by_hand(), KNOB, on_device=20e3)
    assert planned.certificate is not None
    rendered = simulate(planned, planned.certificate.device, Hand(upper=0.5), 0.05)
    assert rendered.sample_period == pytest.approx(5e-5)
    with pytest.raises(InputError, match="on its motor controller at 20000 Hz, not on the host at 1000 Hz"):
        simulate(planned, KNOB, Hand(upper=0.5), 0.05)
    path = planned.stored().save(tmp_path / "m.json")
    assert main(["simulate", str(path), "--duration-s", "0.5", "--quiet"]) in (0, 1)


def test_the_table_of_a_profile_is_read_as_it_was_written(tmp_path: Path) -> None:
    path = TIMED.save(tmp_path / "knob.toml")
    assert "[on_device]" in path.read_text(encoding="utf-8")
    assert DeviceProfile.load(path) == TIMED
    path.write_text(KNOB.save(path).read_text(encoding="utf-8") + "[on_device]\ndelay_periods = 2.0\n"
                    "delay_s = 0.0\njitter_s = 0.0\n", encoding="utf-8")  # fmt: skip
    assert DeviceProfile.load(path).on_device == OnDevice(delay_periods=2.0, jitter_s=0.0)


@pytest.mark.parametrize(
    ("table", "sentence"),
    [
        ({"delay_s": -1.0}, "on_device.delay_s is -1.0: must be >= 0"),
        ({"jitter_s": "small"}, 'on_device.jitter_s is "small": must be a number'),
        ({"highest_rate_hz": 0.0}, "on_device.highest_rate_hz is 0.0: must be > 0"),
        ({"rate": 1.0}, "on_device.rate is not a key of this format"),
        ({"delay_periods": None}, "on_device.delay_periods is missing"),
    ],
)
def test_a_wrong_value_in_the_table_is_named_with_its_rule(
    tmp_path: Path, table: dict[str, Any], sentence: str
) -> None:
    fields = {
        key: value for key, value in {**TIMED.to_dict()["on_device"], **table}.items() if value is not None
    }
    lines = [f"{key} = {json.dumps(value)}" for key, value in fields.items()]
    path = KNOB.save(tmp_path / "knob.toml")
    path.write_text("\n".join([path.read_text(encoding="utf-8"), "[on_device]", *lines]), encoding="utf-8")
    with pytest.raises(InputError, match=re.escape(sentence)):
        DeviceProfile.load(path)


@pytest.mark.parametrize(
    ("rate", "sentence"),
    [
        (0.0, "on_device is 0, must be a rate in Hz, > 0"),
        (float("nan"), "on_device is nan, must be a rate in Hz, > 0"),
        (31e3, "on_device is 31000, must be at most 30000 Hz, the highest rate of the controller of knob"),
        ("fast", "on_device is 'fast'; it must be a number"),
    ],
)
def test_a_rate_that_the_controller_does_not_reach_is_refused(rate: Any, sentence: str) -> None:
    with pytest.raises(InputError, match=re.escape(sentence)):
        plan(model_by_hand(), TIMED, on_device=rate)


def test_the_command_plans_for_the_controller(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    model, device = model_by_hand().save(tmp_path / "m.json"), TIMED.save(tmp_path / "knob.toml")
    arguments = ["plan", str(model), "--device", str(device), "--on-device"]
    assert main([*arguments, "20000", "-o", str(model)]) == 0
    assert "the motor controller of knob at 20000 Hz" in capsys.readouterr().out
    assert main([*arguments, "20000", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["certificate"]["device"]["renderer"] == "device"
    assert main([*arguments, "40000"]) == 2
    assert "error: on_device is 40000, must be at most 30000 Hz" in capsys.readouterr().err


@pytest.mark.parametrize(
    "name", sampled(["moteus-r4", "odri-solo", "odrive-v3", "smartknob", "vesc"], "moteus-r4", "odri-solo")
)
def test_every_open_controller_renders_a_stiffer_spring_than_the_host(name: str) -> None:
    device = DeviceProfile.load(example_profiles()[name][0])
    assert device.on_device is not None
    rate = min(8e3, device.on_device.highest_rate_hz or 8e3)
    spring = model_by_hand(weight=[0.0], linear=[0.6 * device.viscous_damping / device.period_s])
    without_lines = DeviceProfile(**{**device.to_dict(), "held_line": None})
    host, controller = (
        plan(spring, without_lines, predict="off", energy_account=False),
        plan(spring, device, on_device=rate, predict="off"),
    )
    assert right_side(controller, "damping-hold") < device.viscous_damping
    assert host.limited is not None
    assert controller.limited is None

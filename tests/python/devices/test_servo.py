# SPDX-License-Identifier: Apache-2.0
"""Tests the measured delay and lag of a position servo against known servos."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from palpate import DeviceProfile, InputError
from palpate._core.simulation import display_motion
from palpate.cli.main import main
from palpate.devices import check_device, chirp, identify_servo, judge_servo, measure_servo
from palpate.planning import AdmittanceDisplay, example_profiles

PERIOD_S = 1e-3


def display(
    delay_s: float, bandwidth_hz: float | None, damping: float | None, **changes: float
) -> DeviceProfile:
    return DeviceProfile(
        position_unit="m",
        period_s=PERIOD_S,
        delay_s=delay_s,
        encoder_step=changes.pop("encoder_step", 0.0),
        admittance=AdmittanceDisplay(servo_bandwidth_hz=bandwidth_hz, servo_damping=damping, **changes),
    )


@pytest.mark.parametrize("draw", range(20))
def test_a_servo_is_measured_within_its_stated_error(draw: int) -> None:
    random = np.random.default_rng(draw)
    order = draw % 3
    delay = random.uniform(0.0, 4.0) * PERIOD_S
    bandwidth = random.uniform(8.0, 60.0) if order > 0 else None
    damping = random.uniform(0.4, 1.3) if order > 1 else None
    device = display(delay, bandwidth, damping)
    command = chirp(device, 2e-3, 3.0)
    step = 1e-5
    position = np.asarray(display_motion(device, command)) + 1e-5 * random.normal(size=len(command))
    servo = identify_servo(command, np.round(position / step) * step, PERIOD_S, step)
    assert (servo.bandwidth_hz is None) == (order == 0)
    assert (servo.damping is None) == (order < 2)
    # Three standard errors, of 60 numbers in all: the largest of 60 normal numbers is below 4
    margin = 4.0 / 3.0
    assert servo.delay_s == pytest.approx(delay, abs=margin * servo.delay_error_s)
    assert servo.delay_error_s < (0.1 if order > 0 else 0.51) * PERIOD_S
    if bandwidth is not None:
        assert servo.bandwidth_hz == pytest.approx(bandwidth, abs=margin * servo.bandwidth_error_hz)
        assert servo.bandwidth_error_hz < 0.02 * bandwidth
    if damping is not None:
        assert servo.damping == pytest.approx(damping, abs=margin * servo.damping_error)
        assert servo.damping_error < 0.05


def test_the_chirp_keeps_half_the_rate_limit_and_reaches_the_highest_frequency() -> None:
    command = chirp(display(0.0, None, None, rate_limit=0.1), 2e-3, 4.0)
    assert np.abs(command).max() <= 2e-3
    assert np.abs(np.diff(command)).max() / PERIOD_S <= 0.05 * 1.05
    tail = command[-400:]
    # The frequency rises from 59 to 100 Hz in the last 0.4 s, 78 Hz on average
    assert (np.diff(np.sign(tail)) != 0).sum() == pytest.approx(2 * 0.4 * 78.0, rel=0.03)


def test_a_chirp_that_does_not_move_is_refused() -> None:
    still = np.zeros(500)
    with pytest.raises(InputError, match="must move"):
        identify_servo(still, still, PERIOD_S)
    with pytest.raises(InputError, match="at least 100 samples"):
        identify_servo(still[:10], still[:10], PERIOD_S)


@pytest.mark.parametrize("name", ["pedal-2kg", "stepper-pedal"])
def test_an_example_pedal_has_the_servo_of_its_profile(name: str) -> None:
    file = example_profiles()[name][0]
    check = check_device(profile=DeviceProfile.load(file), duration_s=2.0)
    assert check.suitable, check.verdict


def test_a_profile_with_a_faster_servo_than_the_true_one_is_wrong(tmp_path: Path) -> None:
    true = display(2e-3, 20.0, 0.8, encoder_step=1e-6)
    servo = measure_servo(true, 2.0)
    assert judge_servo(true, servo).suitable
    for wrong in (display(1e-3, 20.0, 0.8), display(2e-3, 30.0, 0.8), display(2e-3, 20.0, None)):
        check = judge_servo(wrong, servo)
        assert not check.suitable
        assert "plan again" in str(check.verdict)


def test_the_command_line_prints_the_servo(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = str(example_profiles()["pedal-2kg"][0])
    assert main(["check-device", "--profile", file, "--duration-s", "2", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["suitable"]
    assert found["servo_bandwidth_hz"] == pytest.approx(60.0, rel=1e-3)
    assert main(["check-device", "--device", "usb", "--profile", file]) == 2
    assert "identify_servo" in capsys.readouterr().err

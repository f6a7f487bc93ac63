# SPDX-License-Identifier: Apache-2.0
"""palpate check-device measures a device, and applies no pushes if the force has the wrong sign."""

from __future__ import annotations

import json
import math
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from conftest import ROOT, sampled
from palpate import DeviceProfile, InputError, load_model, plan
from palpate.cli.main import main
from palpate.devices import Check, check, check_device, judge, push_response
from usb_emulation import emulated, frames, needs_emulation

SPRING = ROOT / "tests" / "models" / "good" / "spring.json"
STEP = 2 * np.pi / 65536
SHARE_OF_FORCE = 0.005


def summary_without_force(**changed: Any) -> dict[str, Any]:
    """Returns a summary of `measure` for a faultless device in a hand against a spring, for `judge`."""
    time = 1e-3 * np.arange(2000)
    moves = np.where(time > 0.5, 0.2 * (1.0 - np.cos(2 * np.pi * (time - 0.5))), 0.0)
    position = STEP * np.round(moves / STEP)
    ticks = {
        "position": position,
        "velocity": np.gradient(moves, time),
        "measured": 3.0 * moves,
        "device_time": time,
        "sequence": np.arange(2000, dtype=np.uint64),
    }
    ticks.update({key: changed.pop(key) for key in list(changed) if key in ticks})
    percentiles = {"p50_us": 1000.0, "p99_us": 1010.0, "p999_us": 1020.0, "max_us": 1030.0}
    profile = DeviceProfile(id="knob", period_s=1e-3, encoder_step=STEP)
    return {
        "device": "knob",
        "kept": ticks,
        "profile": profile,
        "wanted_rate_hz": 1000.0,
        "rate_hz": 1000.0,
        "period": percentiles,
        "ticks": 2000,
        "lost_samples": 0,
        "repeated_samples": 0,
        "orderly": True,
        "ended": "the duration ended",
        "transducer": True,
        "round_trip": percentiles,
        "delay": percentiles,
        **dict.fromkeys(("malformed", "stalls", "bus_errors", "timeouts", "skipped_commands"), 0),
        **changed,
    }


def observed(found: Check, name: str) -> Any:
    return next(one for one in found.observations if one.name == name)


def test_a_faultless_device_has_the_verdict_good_and_all_numbers() -> None:
    found = judge(summary_without_force())
    assert str(found.verdict) == "good"
    assert found.may_push
    assert {one.name for one in found.observations} >= {
        "rate",
        "period",
        "round trip",
        "samples",
        "encoder",
        "delay",
    }
    assert found.numbers["delay_s"] == pytest.approx(1.07e-3)
    assert found.numbers["round_trip_p99_us"] == 1010.0


@pytest.mark.parametrize(
    ("changed", "name", "forbids"),
    [
        ({"rate_hz": 480.0}, "rate", False),
        ({"period": {"p50_us": 1e3, "p99_us": 2e3, "p999_us": 5e3, "max_us": 9e3}}, "period", False),
        ({"device_time": 2.08e-3 * np.arange(2000)}, "device clock", False),
        ({"lost_samples": 30}, "samples", False),
        ({"repeated_samples": 30}, "samples", False),
        ({"stalls": 1}, "USB errors", False),
        ({"orderly": False, "ended": "stopped by a fault"}, "interruption", True),
        ({"measured": -3.0 * summary_without_force()["kept"]["position"]}, "sign of the transducer", True),
        ({"velocity": -summary_without_force()["kept"]["velocity"]}, "velocity", True),
        (
            {
                "position": summary_without_force()["kept"]["position"]
                + STEP * np.random.default_rng(1).normal(0.0, 9.0, 2000)
            },
            "encoder",
            True,
        ),
    ],
)
def test_a_wrong_property_is_named_and_forbids_force_if_it_is_unsafe(
    changed: dict[str, Any], name: str, forbids: bool
) -> None:
    found = judge(summary_without_force(**changed))
    wrong = observed(found, name)
    assert wrong.right is False
    assert str(found.verdict).startswith("no: ")
    assert f"{name}: {wrong.text}" in str(found.verdict)
    assert wrong.advice in str(found.verdict)
    assert found.may_push is not forbids


def test_a_device_whose_check_forbids_force_has_no_profile() -> None:
    found = judge(summary_without_force(velocity=-summary_without_force()["kept"]["velocity"]))
    with pytest.raises(InputError, match="its check found a wrong property that makes force unsafe"):
        found.profile()


def test_without_echoes_of_a_disabled_device_the_delay_is_unknown_until_a_push() -> None:
    summary = summary_without_force()
    del summary["round_trip"], summary["delay"]
    found = judge(summary)
    assert found.suitable
    assert found.numbers["delay_s"] is None
    assert check.with_pushes(found, push_response(push_ticks())).numbers["delay_s"] == 0


@pytest.mark.parametrize("quantity", ["measured", "velocity"])
def test_a_reversed_sign_is_detected_before_any_force(quantity: str, monkeypatch: pytest.MonkeyPatch) -> None:
    calls: list[dict[str, Any]] = []

    def measured(device: str, **settings: Any) -> dict[str, Any]:
        calls.append(settings)
        return summary_without_force(**{quantity: -summary_without_force()["kept"][quantity]})

    monkeypatch.setattr(check, "measure", measured)
    found = check_device(push=True)
    assert not found.suitable
    assert all("push" not in settings for settings in calls)
    text = observed(found, "sign of the force").text
    assert text == "not measured: no force is sent while another property is wrong"


def push_ticks(
    motor_sign: float = 1.0,
    reported_sign: float = 1.0,
    moves: Callable[[np.ndarray], np.ndarray] | None = None,
    friction: float = 0.0,
    smaller_share: float = 0.6,
) -> dict[str, np.ndarray]:
    """Returns ticks of alternating pushes on a free handle: inertia 2e-4 kg m^2, damping 0.06 N m s/rad."""
    sent, position = np.zeros(2000), np.zeros(2000)
    sent[np.arange(2000) % 200 >= 170] = 0.025
    sent *= np.where(np.arange(2000) // 200 % 2, -1.0, 1.0)
    sent *= np.where(np.arange(2000) // 600 % 2, smaller_share, 1.0)
    x = speed = 0.0
    for k, force in enumerate(sent[:-1].tolist(), 1):
        for _ in range(20):
            free = speed + 5e-5 / 2e-4 * (-motor_sign * force - 0.06 * speed)
            speed = math.copysign(max(0.0, abs(free) - 5e-5 / 2e-4 * friction), free)
            x += 5e-5 * speed
        position[k] = x
    time = 1e-3 * np.arange(2000)
    position += moves(time) if moves is not None else 0.0
    return {
        "force": sent,
        "applied": reported_sign * np.concatenate(([0.0], sent[:-1])),
        "position": STEP * np.round(position / STEP),
        "device_time": time,
        "sequence": np.arange(2000, dtype=np.uint64),
    }


def test_pushes_show_sign_delay_and_mechanics() -> None:
    push = push_response(push_ticks(), STEP)
    assert push.displacement > 10 * push.standard_error
    assert push.reported_sign_agrees
    assert push.delay_samples == 0
    assert push.mechanics is not None
    assert push.mechanics.inertia == pytest.approx(2e-4, rel=0.02)
    assert push.mechanics.damping == pytest.approx(0.06, rel=0.02)
    assert push.mechanics.friction_lower_bound == 0.0


@pytest.mark.parametrize("friction", sampled([0.001, 0.003, 0.006, 0.01, 0.012], 0.001, 0.012))
def test_pushes_of_two_sizes_separate_friction_from_damping(friction: float) -> None:
    mechanics = push_response(push_ticks(friction=friction), STEP).mechanics
    assert mechanics is not None
    assert mechanics.friction == pytest.approx(friction, rel=0.05)
    assert 0.85 * friction < mechanics.friction_lower_bound <= friction
    assert mechanics.damping == pytest.approx(0.06, rel=0.02)


def test_friction_above_the_smaller_pushes_is_not_measured_but_can_be_stated() -> None:
    ticks = push_ticks(friction=0.018)
    push = push_response(ticks, STEP)
    assert push.mechanics is None
    found = check.with_pushes(judge(summary_without_force()), push)
    assert "friction: not measured: pushes of two sizes must move the handle" in str(found.verdict)
    assert "--coulomb-friction" in str(found.verdict)
    with pytest.raises(InputError, match="a profile needs inertia, damping and friction"):
        found.profile()
    stated = push_response(ticks, STEP, 0.018)
    assert stated.mechanics is not None
    assert stated.mechanics.damping == pytest.approx(0.06, rel=0.1)
    check_with_friction = check.with_pushes(
        replace(judge(summary_without_force()), coulomb_friction=0.018), stated
    )
    assert check_with_friction.profile().coulomb_friction == 0.018
    assert "coulomb_friction: stated, not measured." in check_with_friction.profile_notes()


def test_a_device_without_friction_is_usable_and_the_verdict_gives_the_reason() -> None:
    found = check.with_pushes(judge(summary_without_force()), push_response(push_ticks(), STEP))
    assert found.verdict.level == "usable"
    assert "friction: not found" in str(found.verdict)
    assert found.profile().coulomb_friction == 0.0


@pytest.mark.parametrize(
    ("ticks", "start"),
    [
        (push_ticks(), "correct: "),
        (push_ticks(motor_sign=-1.0), "reversed: a push moved the handle by -"),
        (push_ticks(motor_sign=-1.0, reported_sign=-1.0), "reversed: a push moved the handle by -"),
        (push_ticks(reported_sign=-1.0), "reversed: the device reports a force of the opposite sign"),
        (push_ticks(motor_sign=0.0), "not clear: "),
        (
            push_ticks(moves=lambda t: 0.3 * np.sin(2 * np.pi * 4.0 * t) * np.sin(2 * np.pi * 1.3 * t)),
            "not clear: ",
        ),
        (push_ticks(moves=lambda t: 0.5 * t), "correct: "),
    ],
    ids=["right", "motor", "firmware", "report", "no motor", "a hand", "drift"],
)
def test_the_motion_of_the_handle_gives_the_sign_of_the_force(
    ticks: dict[str, np.ndarray], start: str
) -> None:
    found = check.with_pushes(judge(summary_without_force()), push_response(ticks))
    assert observed(found, "sign of the force").text.startswith(start)
    assert found.suitable is not start.startswith("reversed")


@pytest.fixture
def faultless(monkeypatch: pytest.MonkeyPatch) -> None:
    """Replaces each measurement of check-device by the result of a device without faults."""
    push = {"kept": push_ticks(friction=0.01), "orderly": True}
    monkeypatch.setattr(
        check, "measure", lambda device, **settings: push if "push" in settings else summary_without_force()
    )


@pytest.mark.usefixtures("faultless")
def test_a_check_without_pushes_reports_the_unknown_sign_of_the_force() -> None:
    found = check_device()
    assert observed(found, "sign of the force").right is None
    assert str(found.verdict) == ("usable: sign of the force: not measured (check a free handle with --push)")


@pytest.mark.full
def test_the_simulated_device_agrees_with_its_profile(tmp_path: Path) -> None:
    profile = DeviceProfile()
    found = check_device(duration_s=4.0, push=True, profile=profile)
    assert observed(found, "sign of the force").right
    assert found.numbers["coulomb_friction"] == pytest.approx(0.002 * profile.force_limit, rel=0.1)
    measured = found.profile()
    assert measured.inertia == pytest.approx(profile.inertia, rel=0.05)
    assert measured.viscous_damping == pytest.approx(profile.viscous_damping, rel=0.3)
    assert measured.delay_s == profile.delay_s
    path = measured.save(tmp_path / "knob.toml")
    assert DeviceProfile.load(path).encoder_step == measured.encoder_step


@pytest.mark.full
def test_the_measured_profile_of_the_simulated_device_gives_a_certified_direct_plan(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "knob.toml"
    words = ["--push", "--duration-s", "5", "--write-profile", str(path), "--json"]
    assert main(["check-device", *words]) in (0, 1)  # a busy machine may miss ticks of the control loop
    result = json.loads(capsys.readouterr().out)
    assert result["written"] == str(path)
    assert result["coulomb_friction"] == pytest.approx(0.01, rel=0.1)
    text = path.read_text(encoding="utf-8")
    assert "# coulomb_friction: measured minus its uncertainty, a lower bound." in text
    assert "# encoder_step, force_step, force_limit: stated by the device, not measured." in text
    measured = DeviceProfile.load(path)
    assert 0.008 < measured.coulomb_friction <= 0.01
    chosen = plan(load_model(SPRING), measured)
    assert chosen.structure == "direct"
    assert chosen.certificate is not None
    assert chosen.certificate.certified


def test_a_negative_friction_is_refused_by_name() -> None:
    with pytest.raises(InputError, match=r"coulomb_friction is -1, must be a finite number >= 0"):
        check_device(duration_s=2.0, push=True, coulomb_friction=-1.0)


@pytest.mark.parametrize(
    ("changed", "wrong"),
    [
        ({"period_s": 0.5e-3}, "longest period "),
        ({"encoder_step": 1e-5}, "expected at most 1e-05"),
        ({"force_limit": 9.0}, "largest force 5, expected at least 9"),
        ({"coulomb_friction": 0.02}, "friction 0.00994, expected at least 0.02"),
    ],
)
@pytest.mark.usefixtures("faultless")
def test_a_profile_better_than_the_device_is_reported_as_wrong(changed: dict[str, float], wrong: str) -> None:
    found = check_device(profile=DeviceProfile(**changed), push=True)
    assert observed(found, "profile").right is False
    assert wrong in observed(found, "profile").text


@pytest.mark.usefixtures("faultless")
def test_an_encoder_finer_than_that_of_the_profile_is_right() -> None:
    found = check_device(profile=DeviceProfile(encoder_step=1e-2, delay_s=2e-3))
    assert observed(found, "profile").right is True


def test_a_model_without_a_certificate_is_refused() -> None:
    with pytest.raises(InputError, match="the model has no certificate; make one with `palpate plan`"):
        check_device(duration_s=2.0, model=load_model(SPRING))
    with pytest.raises(InputError, match=r"duration_s is 1, must be at least 2"):
        check_device(duration_s=1.0)


def run_check(*words: Any, device: list[str], seconds: float = 3.0) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "palpate", "check-device", "--device", "usb", "--duration-s", seconds]
    return emulated(*command, "--json", *words, device=device)


def findings_of_answer(answer: subprocess.CompletedProcess[str]) -> tuple[dict[str, Any], dict[str, Any]]:
    assert answer.returncode in (0, 1), answer.stderr
    result = json.loads(answer.stdout)
    return result, {one["name"]: one for one in result["findings"]}


@needs_emulation
def test_a_usb_device_is_measured_and_its_profile_written(tmp_path: Path) -> None:
    profile, trace = tmp_path / "knob.toml", tmp_path / "trace.csv"
    answer = run_check(
        "--push", "--yes", "--write-profile", profile, device=["--no-hand", "--trace", str(trace)]
    )
    result, findings = findings_of_answer(answer)
    assert findings["sign of the force"]["right"], answer.stdout
    assert result["inertia"] == pytest.approx(2e-4, rel=0.05)
    assert result["viscous_damping"] == pytest.approx(0.06, rel=0.05)
    assert result["delay_p50_us"] == pytest.approx(1000.0, rel=0.02)
    assert 1e-3 < result["delay_s"] < 3e-3  # the largest of 1000 measured delays
    assert result["round_trip_p50_us"] > 0.0
    assert (result["lost_samples"], result["repeated_samples"]) == (0, 0)
    written = DeviceProfile.load(profile)
    assert (written.id, written.force_limit) == ("EMU-1", 5.0)
    assert written.delay_s == result["delay_s"]
    emulated_frames = frames(trace)
    assert max(abs(frame.torque) for frame in emulated_frames) <= 1.001 * SHARE_OF_FORCE * 5.0
    assert emulated_frames[-1].torque == 0.0
    assert not emulated_frames[-1].enabled


@pytest.mark.full
@needs_emulation
def test_the_friction_of_a_usb_device_is_measured(tmp_path: Path) -> None:
    profile = tmp_path / "knob.toml"
    words = ["--push", "--yes", "--write-profile", profile]
    result, _ = findings_of_answer(run_check(*words, device=["--no-hand", "--friction", "0.01"], seconds=5.0))
    assert result["coulomb_friction"] == pytest.approx(0.01, rel=0.1)
    assert result["viscous_damping"] == pytest.approx(0.06, rel=0.05)
    assert 0.008 < DeviceProfile.load(profile).coulomb_friction <= 0.01


@needs_emulation
@pytest.mark.parametrize(
    ("hand", "seconds"),
    [
        pytest.param(["--no-hand"], 2.0, id="free"),
        pytest.param([], 6.0, id="held", marks=pytest.mark.full),
    ],
)
def test_a_reversed_motor_is_detected_by_a_push_of_half_a_percent_of_its_force(
    hand: list[str], seconds: float, tmp_path: Path
) -> None:
    trace = tmp_path / "trace.csv"
    profile = tmp_path / "knob.toml"
    words = ["--push", "--yes", "--write-profile", profile]
    answer = run_check(*words, device=["--reversed", *hand, "--trace", str(trace)], seconds=seconds)
    result, findings = findings_of_answer(answer)
    assert answer.returncode == 1
    assert findings["sign of the force"]["right"] is False
    assert "sign of the force: reversed" in result["verdict"]
    assert "do not enable force" in result["verdict"]
    assert not profile.exists()  # without a profile, nothing is certified for the device
    assert max(abs(frame.torque) for frame in frames(trace)) <= 1.001 * SHARE_OF_FORCE * 5.0


@needs_emulation
@pytest.mark.parametrize(
    "frame",
    [
        pytest.param(1000, id="before the pushes", marks=pytest.mark.full),
        pytest.param(2300, id="during the pushes"),
    ],
)
@pytest.mark.parametrize(
    ("fault", "named"),
    [
        pytest.param(
            "emergency-stop",
            "reports an emergency stop; remove the cause of the fault",
            marks=pytest.mark.full,
        ),
        pytest.param(
            "over-temperature",
            "reports over-temperature; remove the cause of the fault",
            marks=pytest.mark.full,
        ),
        ("unplug", "no USB device 1209:0001 with this protocol is connected"),
    ],
)
def test_a_fault_that_ends_the_measurement_is_named(
    fault: str, named: str, frame: int, tmp_path: Path
) -> None:
    trace, profile = tmp_path / "trace.csv", tmp_path / "knob.toml"
    device = ["--no-hand", "--fault", f"{fault}@{frame}", "--trace", str(trace)]
    answer = run_check("--push", "--yes", "--write-profile", profile, device=device)
    result, findings = findings_of_answer(answer)
    assert answer.returncode == 1
    assert findings["interruption"]["right"] is False
    assert named in findings["interruption"]["text"]
    assert result["verdict"].startswith("no: interruption: ")
    assert named in result["verdict"]
    assert "take the hand off" not in answer.stdout
    assert findings["sign of the force"]["right"] is None
    assert "friction" not in findings
    assert not profile.exists()
    ended = [each for each in frames(trace) if each.started > frame]
    assert all(each.torque == 0.0 for each in ended)


@needs_emulation
@pytest.mark.full
def test_a_device_that_does_not_answer_during_the_pushes_has_advice_on_the_connection() -> None:
    answer = run_check("--push", "--yes", device=["--no-hand", "--fault", "mute@2300x60"])
    result, findings = findings_of_answer(answer)
    assert answer.returncode == 1
    assert "stopped by a fault of the device: Timeout" in findings["interruption"]["text"]
    assert "try another cable" in result["verdict"]


@needs_emulation
def test_a_check_without_pushes_never_enables_the_device(tmp_path: Path) -> None:
    trace = tmp_path / "trace.csv"
    answer = run_check(device=["--spring", "3", "--reversed", "--trace", str(trace)], seconds=2.0)
    _, findings = findings_of_answer(answer)
    assert findings["sign of the transducer"]["right"]
    assert findings["velocity"]["right"]
    assert findings["sign of the force"]["right"] is None
    assert not any(frame.enabled for frame in frames(trace))


@needs_emulation
def test_pushing_without_a_terminal_requires_yes() -> None:
    answer = run_check("--push", device=["--no-hand"])
    assert answer.returncode == 2
    assert "--push moves the handle; without a terminal it needs --yes" in answer.stdout


@pytest.mark.real_time
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupted_check_reports_its_findings(number: signal.Signals) -> None:
    command = [sys.executable, "-m", "palpate", "check-device", "--duration-s", "60", "--json"]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    assert process.stderr is not None
    assert process.stderr.readline().startswith("checking simulated for 60 s")
    time.sleep(1.0)
    process.send_signal(number)
    output, errors = process.communicate()
    assert output, errors
    assert "samples" in {finding["name"] for finding in json.loads(output)["findings"]}

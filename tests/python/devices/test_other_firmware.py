# SPDX-License-Identifier: Apache-2.0
"""Emulated devices with random firmware: a seed draws all behaviour that the USB protocol permits."""

from __future__ import annotations

import json
import os
import shlex
import sys
from pathlib import Path
from typing import Any

import pytest

from conftest import ROOT
from control_program import PROGRAM, needs_program
from palpate import read_recording
from usb_emulation import emulated, frames, needs_emulation

SPRING = ROOT / "tests" / "models" / "good" / "spring.json"
SCALE = max(1, int(os.environ.get("PALPATE_TEST_SCALE", "1")))
PALPATE = [sys.executable, "-m", "palpate"]

pytestmark = [needs_emulation, pytest.mark.parametrize("seed", range(1, 1 + SCALE))]


def firmware_of(seed: int, *words: Any) -> list[str]:
    return ["--seed", str(seed), *map(str, words)]


@needs_program
def test_the_device_is_zeroed_found_by_serial_number_and_rendered_on(seed: int, tmp_path: Path) -> None:
    trace, record, listed = (tmp_path / name for name in ("trace.csv", "rendered.csv", "devices.json"))
    model = json.loads(SPRING.read_text(encoding="utf-8"))
    model["continuation"] = {**model["continuation"], "below": "linear"}  # for any handle position
    both_ways = tmp_path / "spring.json"
    both_ways.write_text(json.dumps(model), encoding="utf-8")
    control = shlex.join(map(str, [PROGRAM, both_ways, "--uncertified"]))
    name = [sys.executable, "-c", 'import json, sys; print(json.load(sys.stdin)["devices"][0]["serial"])']
    script = f"""
        {shlex.join(PALPATE)} devices --zero --json > '{listed}' &&
        serial=$({shlex.join(name)} < '{listed}') &&
        {control} --device "usb:$serial" --json --duration-s 0.5 --record '{record}'
    """
    answer = emulated("sh", "-c", script, device=firmware_of(seed, "--trace", trace))
    assert answer.returncode == 0, answer.stderr
    assert json.loads(listed.read_text(encoding="utf-8"))["devices"][0]["problem"] == ""
    summary = json.loads(answer.stdout)
    assert summary["ticks"] == summary["recorded"] == 500
    assert summary["usb"]["malformed"] == 0
    assert summary["usb"]["late_echoes"] == 0
    assert summary["usb"]["watchdog_trips"] == 0
    emulated_frames = frames(trace)
    assert max(abs(frame.torque) for frame in emulated_frames) > 1e-3  # the spring was rendered with force
    assert emulated_frames[-1].torque == 0.0
    assert not emulated_frames[-1].enabled
    assert abs(read_recording(record).force).max() > 1e-3


def test_the_sign_and_mechanics_of_the_device_are_measured(seed: int) -> None:
    words = [*PALPATE, "check-device", "--device", "usb", "--duration-s", 2, "--json"]
    answer = emulated(*words, "--push", "--yes", device=firmware_of(seed, "--no-hand"))
    assert answer.returncode == 0, answer.stderr
    result = json.loads(answer.stdout)
    findings = {one["name"]: one for one in result["findings"]}
    # A coarse encoder cannot detect the small displacement that the push of check-device causes.
    assert findings["sign of the force"]["right"] or result["encoder_step"] > 1e-3, answer.stdout
    assert 0.0 <= result["delay_s"] < 4e-3
    assert findings["USB errors"]["right"]

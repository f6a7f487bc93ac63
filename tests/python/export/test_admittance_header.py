# SPDX-License-Identifier: Apache-2.0
"""Tests the C header of a model for an admittance display against the core."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

import palpate
from models_by_hand import model_by_hand
from palpate import DeviceProfile
from palpate.cli.main import main
from palpate.planning import AdmittanceDisplay

PROGRAM = """#include <stdio.h>
#include "pedal.h"
int main(void) {
    pedal_object object;
    double force;
    pedal_object_start(&object, 0.001);
    while (scanf("%lf", &force) == 1) {
        printf("%.17g\\n", (double)pedal_object_step(&object, (pedal_real)force));
    }
    return 0;
}
"""

pytestmark = pytest.mark.skipif(shutil.which("gcc") is None, reason="needs gcc")


def clutch() -> palpate.Model:
    """Returns a force with a peak of 120 N and a drop."""
    return model_by_hand(
        units={"position": "m", "force": "N"},
        alpha=[[150.0], [300.0]],
        beta=[[0.02], [0.03]],
        weight=[-60.0, 10.0],
        linear=[3e3],
        upper=[0.06],
    )


def pedal(**changes: float) -> DeviceProfile:
    display = {"hand_stiffness": 2e4, "servo_bandwidth_hz": 60.0, "servo_damping": 0.8, **changes}
    return DeviceProfile(
        id="pedal",
        position_unit="m",
        period_s=2.5e-4,
        delay_s=2.5e-4,
        encoder_step=0.0,
        admittance=AdmittanceDisplay(**display),
    )


def commands(folder: Path, force: np.ndarray, device: DeviceProfile, precision: str) -> np.ndarray:
    """Exports the clutch for a device and returns the commands of the compiled program."""
    plan = palpate.plan(clutch(), device)
    plan.stored().save(folder / "clutch.json")
    arguments = ["export", str(folder / "clutch.json"), "--c", "--precision", precision]
    assert main([*arguments, "-o", str(folder / "pedal.h")]) == 0
    (folder / "main.c").write_text(PROGRAM)
    flags = ["-std=c99", "-O2", "-Wall", "-Wextra", "-Wpedantic", "-Wno-unused-function", "-Werror"]
    subprocess.run(["gcc", *flags, "main.c", "-o", "main"], cwd=folder, check=True)
    lines = "\n".join(map(str, force))
    answer = subprocess.run(["./main"], cwd=folder, input=lines, capture_output=True, text=True, check=True)
    return np.array(answer.stdout.split(), dtype=float)


def pushes() -> np.ndarray:
    """Returns the force of a foot that pushes beyond the peak and lets go, twice."""
    return 90.0 * (1.0 - np.cos(2.0 * np.pi * np.arange(8000) / 4000.0)) + 3.0 * np.sin(np.arange(8000))


@pytest.mark.parametrize(("precision", "error"), [("double", 1e-9), ("single", 2e-6)])
def test_the_program_moves_like_the_core(precision: str, error: float, tmp_path: Path) -> None:
    force = pushes()
    moved = commands(tmp_path, force, pedal(), precision)
    plan = palpate.plan(clutch(), pedal())
    core = palpate._core.simulation.force_driven(plan.rendered, plan.scheme, force, 2.5e-4, 0.001)
    expected = core["environment_position"]
    assert np.ptp(expected) > 0.02
    assert np.abs(moved - expected).max() < error * 0.06 + 1e-3 * error


def test_a_force_that_is_not_a_number_holds_the_command(tmp_path: Path) -> None:
    force = np.array([50.0] * 100 + [np.nan, np.inf, -np.inf] + [50.0])
    moved = commands(tmp_path, force, pedal(), "single")
    assert np.all(moved[100:103] == moved[99])
    assert moved[103] != moved[99]


def test_rate_limit_and_friction_are_those_of_the_display(tmp_path: Path) -> None:
    device = pedal(rate_limit=0.05, position_step=2e-5)
    friction = palpate._core.rendering.virtual_friction(device)
    start = float(clutch().force(0.001))
    moved = commands(tmp_path, np.array([start + 0.95 * friction] * 50 + [1000.0] * 50), device, "double")
    assert np.all(moved[:50] == moved[0])
    assert np.diff(moved[50:]).max() <= 0.05 * 2.5e-4 * (1.0 + 1e-9)
    assert moved[-1] > moved[50]

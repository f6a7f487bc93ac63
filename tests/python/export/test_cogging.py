# SPDX-License-Identifier: Apache-2.0
"""Tables against cogging, replayed with formulas of the controllers that are written here a second time."""

import json
import math
import re
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.linalg import lsqr

from models_by_hand import keyswitch_by_hand, model_by_hand
from palpate import Model
from palpate.cli.main import main
from palpate.export.cogging import CONTROLLERS, table_of
from palpate.export.request import COGGING_TABLES

Array = NDArray[np.float64]

TURN = 2.0 * math.pi
ORDERS = {7: (0.006, 1.0), 12: (0.03, -0.4), 36: (0.004, 2.0), 84: (0.01, 0.5)}
"""Amplitude [N*m] and phase [rad] of the cosines of a motor with 7 pole pairs and 12 slots"""
FRICTION = 0.004
"""Friction of the motor in both directions [N*m]"""


def cogging(angle: Array) -> Array:
    return np.asarray(sum(size * np.cos(n * angle - phase) for n, (size, phase) in ORDERS.items()))


def motor(**changes: Any) -> Model:
    """Returns the cogging of the motor as a model with friction."""
    n = np.array(list(ORDERS), dtype=np.float64)
    size, phase = np.array(list(ORDERS.values())).T
    arguments: dict[str, Any] = {
        "alpha": n[:, None],
        "beta": (phase / n)[:, None],
        "weight": size,
        "linear": [0.0],
        "weight_hysteresis": np.zeros(len(n)),
        "linear_hysteresis": [0.0],
        "bias_hysteresis": FRICTION,
        "harmonics": len(n),
        "upper": [TURN],
        "period": TURN,
    }
    return model_by_hand(**arguments | changes)


def exported(tmp_path: Path, capsys: pytest.CaptureFixture[str], model: Model, *options: object) -> Any:
    """Returns the text of an exported model and the numbers of --json."""
    source, output = model.save(tmp_path / "motor.json"), tmp_path / "table.txt"
    assert main(["export", str(source), *map(str, options), "-o", str(output), "--json"]) == 0
    return output.read_text(encoding="utf-8"), json.loads(capsys.readouterr().out)


@cache
def moteus_table(text: str) -> tuple[list[int], np.float32]:
    """Returns the entries and the scale that the commands for a moteus set."""
    settings = dict(re.findall(r"^conf set motor\.cogging_dq_(\S+) (\S+)$", text, re.MULTILINE))
    table = [int(settings[f"comp.{i}"]) for i in range(1024)]
    assert all(-127 <= entry <= 127 for entry in table)
    return table, np.float32(settings["scale"])


def moteus_current(text: str, turns: float) -> float:
    """Returns the current [A] that a moteus adds at an angle in revolutions, from 0 to 1."""
    table, scale = moteus_table(text)
    left = min(len(table) - 1, int(len(table) * turns))
    right = (left + 1) % len(table)
    fraction = (turns - left / len(table)) * len(table)
    return float((table[right] * scale - table[left] * scale) * fraction + table[left] * scale)


@cache
def odrive_map(text: str) -> list[np.float32]:
    return [np.float32(line) for line in text.splitlines()]


def odrive_torque(text: str, turns: float) -> float:
    """Returns the torque [N*m] that an ODrive adds at a position in revolutions."""
    cogging_map = odrive_map(text)
    assert len(cogging_map) == 3600
    return float(cogging_map[math.trunc(turns / (1.0 / 3600.0) + math.copysign(1e-9, turns)) % 3600])


def openffboard_count(text: str, turns: float) -> int:
    """Returns the torque [counts] that an OpenFFBoard adds at a position in revolutions, from 0 to 1."""
    header, *rows = text.splitlines()
    assert header == "order,amplitude,phase_rad"
    assert len(rows) <= 20
    total = 0.0
    for row in rows:
        order, amplitude, phase = row.split(",")
        assert 0 < int(order) < 1 << 16
        total += float(amplitude) * math.sin(TURN * turns * int(order) + float(phase))
    return int(total)


def test_every_controller_is_a_choice_of_the_command_line() -> None:
    assert tuple(CONTROLLERS) == COGGING_TABLES


def test_moteus_table_is_equal_to_the_best_lines_to_half_a_step(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    constant = 0.05  # N*m/A
    text, numbers = exported(tmp_path, capsys, motor(), "--cogging", "moteus", "--unit-force", constant)
    scale = float(re.search(r"scale (\S+)", text)[1])  # type: ignore[index]
    place = np.arange(20 * 1024) / 20
    left = place.astype(int)
    share = place - left
    lines = csr_array((1.0 - share, (np.arange(len(place)), left)), (len(place), 1024))
    lines += csr_array((share, (np.arange(len(place)), (left + 1) % 1024)), lines.shape)
    best = lsqr(lines, cogging(TURN * place / 1024) / constant, atol=1e-12, btol=1e-12)[0]
    entries = np.array([moteus_current(text, i / 1024) for i in range(1024)])
    assert np.abs(entries - best).max() <= 0.51 * scale
    assert scale == pytest.approx(np.abs(best).max() / 127, rel=1e-3)
    between = np.random.default_rng(1).uniform(0.0, 1.0, 400)
    error = [abs(constant * moteus_current(text, each) - cogging(np.array(TURN * each))) for each in between]
    assert 0.6 * numbers["largest_error"] < max(error) <= 1.001 * numbers["largest_error"]
    assert text.endswith("conf write\n")
    assert numbers["friction"] == pytest.approx(FRICTION)


def test_odrive_entries_are_the_means_while_they_are_held(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text, numbers = exported(tmp_path, capsys, motor(), "--cogging", "odrive")
    within = (np.arange(200) + 0.5) / 200
    exact = cogging(TURN * (np.arange(3600)[:, None] + within) / 3600).mean(axis=1)
    added = np.array([odrive_torque(text, each) for each in np.arange(3600) / 3600])
    assert np.abs(added - exact).max() < 1e-8
    between = np.random.default_rng(2).uniform(0.0, 1.0, 400)
    error = [abs(odrive_torque(text, each) - cogging(np.array(TURN * each))) for each in between]
    assert 0.6 * numbers["largest_error"] < max(error) <= 1.1 * numbers["largest_error"]


def test_odrive_table_reaches_the_least_ripple_of_held_entries(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text, numbers = exported(tmp_path, capsys, motor(), "--cogging", "odrive")
    k, size = np.array([(order, amplitude) for order, (amplitude, _) in ORDERS.items()]).T
    least = math.sqrt(size**2 @ (1.0 - np.sinc(k / 3600) ** 2) / 2.0)
    assert numbers["least_rms_ripple"] == pytest.approx(least, rel=1e-3)
    turns = (np.arange(72_000) + 0.5) / 72_000
    left = cogging(TURN * turns) - np.array([odrive_torque(text, each) for each in turns])
    ripple = math.sqrt(np.mean(left**2))
    assert 0.99 * least < ripple < 1.1 * least
    assert numbers["rms_ripple"] == pytest.approx(ripple, rel=0.02)
    # A table of torques at the angles, as the calibration of the firmware makes it, leaves twice as much
    sampled = cogging(TURN * turns) - cogging(TURN * np.floor(turns * 3600) / 3600)
    assert math.sqrt(np.mean(sampled**2)) > 1.9 * ripple


def test_export_for_an_odrive_states_the_least_ripple(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    source, output = motor().save(tmp_path / "motor.json"), tmp_path / "table.txt"
    assert main(["export", str(source), "--cogging", "odrive", "-o", str(output)]) == 0
    shown = " ".join(capsys.readouterr().out.split())
    assert re.search(r"ripple left 0.00032\d N\*m RMS, 1.4 % of the cogging", shown), shown
    assert "no table of 3600 held entries leaves less than 1.4 %" in shown
    assert "for positions >= 0" in shown


def test_openffboard_harmonics_are_equal_to_the_model_to_one_count(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    count = 1e-5  # N*m
    text, numbers = exported(tmp_path, capsys, motor(), "--cogging", "openffboard", "--unit-force", count)
    orders = [int(row.split(",")[0]) for row in text.splitlines()[1:]]
    assert set(ORDERS) <= set(orders)
    turns = np.random.default_rng(3).uniform(0.0, 1.0, 1000)
    error = [abs(openffboard_count(text, each) - cogging(np.array(TURN * each)) / count) for each in turns]
    assert max(error) < 1.01
    assert numbers["largest_error"] <= 1.01 * count


def test_plain_table_contains_the_model(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text, _ = exported(tmp_path, capsys, motor(), "--cogging", "table")
    rows = np.array([[float(word) for word in line.split(",")] for line in text.splitlines()[1:]])
    assert rows[:, 0] == pytest.approx(np.arange(3600) * TURN / 3600)
    assert rows[:, 1] == pytest.approx(cogging(rows[:, 0]), abs=1e-12)


def test_a_period_of_a_slot_is_repeated_over_the_revolution() -> None:
    size, phase = ORDERS[12]
    slot = motor(
        alpha=[[12.0]],
        beta=[[phase / 12]],
        weight=[size],
        weight_hysteresis=[0.0],
        harmonics=1,
        period=TURN / 12,
        upper=[TURN / 12],
    )
    angle = np.linspace(0.0, TURN, 1000, endpoint=False)
    error = table_of("table", slot).replayed(angle) - size * np.cos(12 * angle - phase)
    assert np.abs(error).max() < 1e-4 * size


def test_encoder_zero_shifts_the_table() -> None:
    angle = np.arange(3600) * TURN / 3600
    added = table_of("table", motor(), encoder_zero=0.3).replayed(angle)
    assert added == pytest.approx(cogging(angle + 0.3), abs=1e-12)


@pytest.mark.parametrize(
    ("model", "options", "sentence"),
    [
        (motor(), "--cogging moteus", "state the force of one A in N*m with --unit-force"),
        (motor(), "--cogging openffboard", "state the force of one count in N*m with --unit-force"),
        (motor(), "--cogging moteus --unit-force 0", "--unit-force is 0: must be a finite number > 0"),
        (motor(), "--cogging moteus --unit-force nan", "--unit-force is nan: must be a finite number > 0"),
        (motor(), "--cogging odrive --encoder-zero nan", "--encoder-zero is nan: must be a finite number"),
        (model_by_hand(), "--cogging odrive", "the model has no period"),
        (
            model_by_hand(period=0.7, upper=[0.7], linear=[0.0]),
            "--cogging odrive",
            "the period is 40.1",
        ),
        (keyswitch_by_hand(), "--cogging table", "the position is in m: cogging needs an angle"),
        (motor(weight=np.zeros(4)), "--cogging odrive", "is zero at every angle"),
        (keyswitch_by_hand(), "--knots 1", "--knots is 1: must be from 2 to 1001"),
        (keyswitch_by_hand(), "--knots 11 --cogging table", "--knots is given, but --cogging does not use"),
        (keyswitch_by_hand(), "--c --knots 11", "--knots is given, but --c does not use it"),
    ],
)
def test_impossible_table_is_refused_in_one_sentence(
    model: Model, options: str, sentence: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    source, output = model.save(tmp_path / "m.json"), tmp_path / "out.txt"
    assert main(["export", str(source), *options.split(), "-o", str(output)]) == 2
    assert sentence in capsys.readouterr().err.splitlines()[-1]
    assert not output.exists()


def test_knots_of_a_pedal_are_points_of_the_press_with_the_largest_error(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    key = keyswitch_by_hand()
    text, numbers = exported(tmp_path, capsys, key, "--knots", 11)
    header, *rows = text.splitlines()
    assert header == "travel_percent,position_m,force_N"
    travel, x, force = np.array([[float(word) for word in row.split(",")] for row in rows]).T
    assert travel.tolist() == [10.0 * k for k in range(11)]
    assert force == pytest.approx(key.force(x, direction=1.0), rel=1e-8)
    fine = np.linspace(0.0, 0.004, 54321)
    left = np.minimum((fine / 0.0004).astype(int), 9)
    line = force[left] + (force[left + 1] - force[left]) * (fine / 0.0004 - left)
    assert numbers["largest_error"] == pytest.approx(
        np.abs(line - key.force(fine, direction=1.0)).max(), rel=1e-4
    )
    assert numbers["largest_loop"] == pytest.approx(0.1)

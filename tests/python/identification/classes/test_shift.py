# SPDX-License-Identifier: Apache-2.0
"""Press and release that are shifted against each other: the error of the model contains the shift."""

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import palpate
from conftest import sampled
from palpate.cli.main import main
from palpate.recording import Recording

TRAVEL, N = 4e-3, 600


def button(x: np.ndarray, s: np.ndarray) -> np.ndarray:
    """Returns the force of a button with a click and friction [N]."""
    u = x / TRAVEL
    click = 0.5 / (1.0 + np.exp(-(u - 0.45) / 0.02))
    return np.asarray((1.0 + 0.08 * s) * (1.0 - np.exp(-u / 0.03)) + 0.6 * u - click)


def recorded(
    shift: float,
    force: Callable[..., np.ndarray] = button,
    seed: int = 0,
    rows: int = 4 * N,
    noise: float = 0.003,
) -> Recording:
    """Returns two presses and releases whose positions are `shift` apart [m], with noise and time."""
    random, time = np.random.default_rng(seed), np.linspace(0.0, 8.0, rows)
    x = TRAVEL * (1.0 - np.abs(1.0 - time % 4.0 / 2.0))
    side = np.where(time % 4.0 < 2.0, 1.0, -1.0)
    f = force(x, side) + random.normal(0.0, noise, len(x))
    return Recording.from_arrays(x + 0.5 * shift * side + random.normal(0.0, 1e-6, len(x)), f, time)


def true_error(model: palpate.Model) -> float:
    """Returns the NRMSE of a model on the exact force of the button."""
    x = np.linspace(0.02, 0.98, 2000) * TRAVEL
    pairs = [(button(x, np.full(2000, s)), model.force(x, direction=s)) for s in (1.0, -1.0)]
    truth, found = (np.concatenate(each) for each in zip(*pairs, strict=True))
    return float(np.sqrt(np.mean((found - truth) ** 2)) / np.std(truth))


@pytest.mark.parametrize("shift", sampled([20e-6, 40e-6], 20e-6))
def test_the_error_contains_the_shift_that_a_hand_feels_and_its_line_and_the_verdict_state_it(
    shift: float, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = recorded(shift).write(tmp_path / "button.csv")
    assert main(["identify", str(path), "-o", str(tmp_path / "button.json")]) == 0
    assert "if press and release are shifted" in " ".join(capsys.readouterr().out.split())
    model = palpate.load_model(tmp_path / "button.json")
    assert model.verdict.level == "usable"
    assert 0.7 < model.notes["shift_nrmse"] / true_error(model) < 1.5
    message = f"{model.notes['identification']} {model.verdict}"
    found = re.search(r"press and release are shifted against each other, by (\S+?):", message)
    assert found
    assert float(found[1]) == pytest.approx(shift, rel=0.5)
    assert "mount the object without backlash, or give --force-late-s" in message
    assert "the loop of friction hides backlash" in str(model.notes["model_selection"])


@pytest.mark.parametrize("seed", sampled(range(6), 0))
def test_strokes_without_a_shift_have_none(seed: int) -> None:
    model = palpate.identify(recorded(0.0, seed=seed))
    assert model.fit.model_class == "hysteresis"
    assert model.notes["shift_nrmse"] == 0.0
    assert model.verdict.level == "good"
    assert "shifted" not in str(model.notes["identification"])


def test_a_single_valued_force_is_the_mean_of_shifted_strokes() -> None:
    def spring(x: np.ndarray, _: np.ndarray) -> np.ndarray:
        return 300.0 * x + 4000.0 * np.maximum(x - 0.6 * TRAVEL, 0.0)

    model, x = palpate.identify(recorded(20e-6, spring, rows=800)), np.linspace(0.02, 0.98, 500) * TRAVEL
    assert model.kind == "position"
    assert model.notes["shift_nrmse"] == 0.0
    assert np.std(model.force(x) - spring(x, x)) < 0.01 * np.std(spring(x, x))


@pytest.mark.parametrize("lag_s", sampled([0.02, 0.03], 0.03))
def test_a_late_force_is_not_taken_as_a_force_of_velocity(lag_s: float) -> None:
    def spring(x: np.ndarray) -> np.ndarray:
        return 300.0 * x + 4000.0 * np.maximum(x - 0.6 * TRAVEL, 0.0)

    time, random = np.linspace(0.0, 6.0, 6000), np.random.default_rng(0)
    x = (
        TRAVEL
        * 0.5
        * (1.0 - np.cos(np.cumsum(2.0 * np.pi * np.where(time < 3.0, 2.0 / 3.0, 4.0 / 3.0)) / 1000.0))
    )
    force = np.interp(time - lag_s, time, spring(x)) + random.normal(0.0, 0.005, len(x))
    model, at = palpate.identify(Recording.from_arrays(x, force, time)), np.linspace(0.02, 0.98, 500) * TRAVEL
    assert model.kind == "position"
    assert np.sqrt(np.mean((model.force(at) - spring(at)) ** 2)) < 0.1 * np.std(spring(at))
    found = re.search(r"by a force that is about (\S+) ms late", str(model.verdict))
    assert found
    assert 1e-3 * float(found[1]) == pytest.approx(lag_s, rel=0.1)


def test_a_lag_that_leaves_most_of_the_error_has_no_number() -> None:
    """The zero of the force moved too, so the lag of 20 ms is not the main cause."""
    time, random = 0.008 * np.arange(1000), np.random.default_rng(0)
    x = 0.5 - 0.5 * np.cos(np.pi * time)
    force = np.interp(time - 0.02, time, x + 2.0 * np.exp(-(((x - 0.5) / 0.08) ** 2))) + 0.5 * (time > 3.0)
    model = palpate.identify(Recording.from_arrays(x, force + random.normal(0.0, 0.01, len(x)), time))
    (reason,) = (each for each in model.verdict.reasons if "shifted against each other" in each)
    assert "by a late force" in reason
    assert "give --force-late-s SECONDS" in reason


@pytest.mark.parametrize("seed", [1, 3])
def test_rows_that_are_far_apart_do_not_look_like_shifted_strokes(seed: int) -> None:
    """A trigger with a stop is moved by hand in 40 steps, without backlash."""
    x = np.round(np.linspace(0.0, 7.6, 40), 2)
    path, side = np.r_[x, x[-2::-1]], np.r_[np.ones(40), -np.ones(39)]
    force = 0.9 + 0.11 * path + 0.12 * side + 22.0 * np.maximum(path - 7.2, 0.0)
    force += np.random.default_rng(seed).normal(0.0, 0.01, len(path))
    model = palpate.identify(path, 9.80665e-3 * np.round(force / 9.80665e-3))
    assert model.notes["shift_nrmse"] == 0.0
    assert "record more rows per stroke" in str(model.verdict)


def test_a_shift_that_leaves_most_of_the_error_is_not_its_cause() -> None:
    """The rows have five times the error that the shift adds, and no hand feels the shift."""
    model = palpate.identify(recorded(10e-6, noise=0.02))
    assert model.verdict.level == "usable"
    assert "shifted against each other" not in str(model.verdict)

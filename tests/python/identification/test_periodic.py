# SPDX-License-Identifier: Apache-2.0
"""A period: one turn becomes the domain, its gap is closed, and longer data are wrapped."""

from pathlib import Path

import numpy as np
import pytest

from palpate import InputError, Recording, identify, load_model, read_recording, verify
from palpate.identification import fit_environment
from palpate.identification.options import IdentifyOptions

TURN = 2.0 * np.pi


def knob(turns: float, n: int = 400, *, end: bool = False, seed: int = 0) -> Recording:
    """Seven detents a turn, sampled from 0.3 rad on; without its end, one step of the turn is missing."""
    x = 0.3 + np.linspace(0.0, turns * TURN, n, endpoint=end)
    force = np.sin(7.0 * x) + 0.3 * np.cos(x) + np.random.default_rng(seed).normal(0.0, 0.01, n)
    return Recording.from_arrays(x, force)


def test_a_turn_that_lacks_one_step_is_closed_and_the_gap_is_reported(tmp_path: Path) -> None:
    model = identify(knob(1.0), period=TURN)
    assert float(model.upper[0] - model.lower[0]) == pytest.approx(TURN, rel=1e-12)
    assert model.fit.nrmse < 0.03
    (note,) = (note for note in model.notes["identification"] if note.startswith("the gap of 0.01571"))
    assert "0.25 % of the period" in note
    assert model.verdict.level == "good"
    again = load_model(model.save(tmp_path / "knob.json"))
    assert again.period == TURN


@pytest.mark.parametrize("turns", [1.0, 2.3])
def test_the_force_is_continuous_over_the_seam(turns: float) -> None:
    model = identify(knob(turns, int(400 * turns)), period=TURN)
    network = {name: getattr(model, name) for name in ("alpha", "beta", "weight", "linear", "bias")}
    lower, upper = float(model.lower[0]), float(model.upper[0])

    def evaluated(x: float) -> float:
        u = (network["alpha"] * (x - network["beta"]))[:, 0]
        wavelets = (u * u - 1.0) * np.exp(-0.5 * u * u)
        return float(network["weight"] @ wavelets + network["linear"][0] * x + network["bias"])

    assert evaluated(upper) == pytest.approx(evaluated(lower), abs=1e-7)
    x = np.linspace(lower - 1.0, upper + 1.0, 3000)
    assert np.abs(model.force(x) - np.sin(7.0 * x) - 0.3 * np.cos(x)).max() < 0.1
    assert verify(model, knob(1.7, 900, seed=5)).nrmse < 0.03


def test_data_longer_than_a_period_are_taken_modulo_the_period() -> None:
    model = identify(knob(2.3, 1200), period=TURN)
    assert any("span 2.298 periods" in note for note in model.notes["identification"])
    assert verify(model, knob(3.0, 1000, seed=1)).extrapolated == 0


def test_hysteresis_of_a_knob_follows_the_motion_and_not_the_wrapped_position() -> None:
    """Two turns forth and back: the play operator must not jump at the seam."""
    time = 1e-3 * np.arange(8000)
    x = TURN * (1.0 - np.cos(2.0 * np.pi * time / 4.0))
    friction = 0.2 * np.sign(np.gradient(x))
    force = np.sin(3.0 * x) + friction + np.random.default_rng(2).normal(0.0, 0.01, len(x))
    model = identify(Recording.from_arrays(x, force, time), period=TURN)
    assert model.kind == "hysteresis"
    assert model.fit.nrmse < 0.06  # a jump at the seam leaves 0.2; friction of a smaller play leaves 0.05


@pytest.mark.parametrize(("missing", "level"), [(0.02, "good"), (0.2, "usable"), (0.7, "no")])
def test_a_part_of_the_period_without_rows_is_a_finding(missing: float, level: str) -> None:
    verdict = identify(knob(1.0 - missing), period=TURN).verdict
    assert verdict.level == level
    assert any("no position lies between" in reason for reason in verdict.reasons) == (level != "good")


def test_a_period_of_several_inputs_is_refused() -> None:
    random = np.random.default_rng(0)
    X = random.uniform(0.0, 1.0, (200, 2))
    with pytest.raises(
        InputError, match="period is for a force over position alone, not over position, load"
    ):
        fit_environment(X, X.sum(axis=1), None, IdentifyOptions(period=1.0), names=("position", "load"))


def test_every_measured_turn_takes_its_period(data: Path) -> None:
    for path in sorted((data / "motor_cogging").glob("map_*.csv")):
        kept, held = read_recording(path, position="angle_rad", force="hold_current_A").split(5)
        model = identify(kept, period=6.283185307179586)
        assert model.period == 6.283185307179586, path.name
        assert verify(model, held).nrmse < 1.3 * verify(identify(kept), held).nrmse, path.name

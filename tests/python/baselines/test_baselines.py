# SPDX-License-Identifier: Apache-2.0
"""Baseline force laws: they fit their own forces, and are compared with a model on the same rows."""

import json
from pathlib import Path

import numpy as np
import pytest

from palpate.baselines import (
    HuntCrossley,
    LinearZones,
    LookupTable,
    PerStroke,
    SmoothingSpline,
    TissueParameters,
    comparable,
    compare,
)
from palpate.cli.main import main
from palpate.recording import Recording

ALL = [HuntCrossley(), LinearZones(), LookupTable(), SmoothingSpline(), TissueParameters()]


def named(estimator: object) -> str:
    return type(estimator).__name__


def moving(n: int = 2000, seed: int = 0) -> np.ndarray:
    """Returns the columns position, velocity and acceleration of a hand motion, (n, 3)."""
    random = np.random.default_rng(seed)
    return np.column_stack(
        [random.uniform(-0.002, 0.01, n), random.normal(0.0, 0.1, n), random.normal(0.0, 2.0, n)]
    )


def press_and_release(seed: int = 0, n: int = 300) -> Recording:
    random = np.random.default_rng(seed)
    half = np.linspace(0.0, 0.004, n // 2)
    x, direction = np.concatenate([half, half[::-1]]), np.repeat([1, -1], n // 2)
    force = 300.0 * x + np.exp(-(((x - 0.002) / 0.0004) ** 2)) * (0.3 + 0.1 * direction)
    return Recording.from_arrays(x, force + random.normal(0.0, 0.005, n), direction=direction)


@pytest.mark.parametrize("estimator", ALL, ids=named)
def test_every_baseline_has_the_estimator_interface(estimator: object) -> None:
    X = moving()
    y = 100.0 * X[:, 0]
    fitted = estimator.fit(X, y)  # type: ignore[attr-defined]
    assert fitted is estimator
    assert fitted.predict(X[:7]).shape == (7,)
    assert fitted.n_parameters_ >= 2
    assert np.std(fitted.predict(X) - y) < 0.05 * np.std(y)


def test_tissue_parameters_are_recovered() -> None:
    X = moving()
    y = 0.02 * X[:, 2] + 1.5 * X[:, 1] + 200.0 * X[:, 0] + 3e6 * X[:, 0] ** 3 + 0.1
    fitted = TissueParameters().fit(X, y)
    assert fitted.predict(X) == pytest.approx(y, abs=1e-9)
    assert fitted.parameters_[-1] / fitted.scale_[2] == pytest.approx(0.02)
    assert fitted.n_parameters_ == 6


@pytest.mark.parametrize("exponent", [1.0, 1.5, 2.5])
def test_hunt_crossley_finds_contact_exponent_and_damping(exponent: float) -> None:
    X = moving()
    y = 800.0 * np.maximum(X[:, 0], 0.0) ** exponent * (1.0 + 1.2 * X[:, 1])
    fitted = HuntCrossley().fit(X, y)
    assert fitted.contact_ == pytest.approx(0.0, abs=2e-5)
    assert fitted.exponent_ == pytest.approx(exponent, rel=1e-2)
    assert fitted.parameters_[2] / fitted.parameters_[1] == pytest.approx(1.2, rel=1e-2)
    assert fitted.n_parameters_ == 5


def test_zones_are_as_many_as_the_force_has_lines() -> None:
    x = np.linspace(0.0, 1.0, 900)
    y = np.select([x < 0.4, x < 0.7], [2.0 * x, 0.8 - 1.0 * (x - 0.4)], 0.5 + 9.0 * (x - 0.7))
    fitted = LinearZones(threshold=0.01).fit(x[:, None], y)
    assert len(fitted.edges_) <= 3
    for kink in (0.4, 0.7):
        assert np.abs(fitted.edges_ - kink).min() < 0.02
    assert fitted.n_parameters_ == 2 * (len(fitted.edges_) + 1) + len(fitted.edges_)
    finer = LinearZones(threshold=0.0001).fit(x[:, None], np.sin(6.0 * x))
    assert len(finer.edges_) > len(LinearZones(threshold=0.1).fit(x[:, None], np.sin(6.0 * x)).edges_)


@pytest.mark.parametrize("estimator", [LookupTable(), SmoothingSpline()], ids=named)
def test_single_valued_curves_follow_a_curve_down_to_its_noise(estimator: LookupTable) -> None:
    random = np.random.default_rng(0)
    x = random.uniform(0.0, 1.0, 3000)
    fitted = estimator.fit(x[:, None], np.sin(9.0 * x) + random.normal(0.0, 0.05, 3000))
    grid = np.linspace(0.05, 0.95, 100)
    assert np.abs(fitted.predict(grid[:, None]) - np.sin(9.0 * grid)).max() < 0.06
    assert fitted.n_parameters_ < 100


def test_a_lookup_table_leaves_out_entries_that_no_row_fixes() -> None:
    x = np.concatenate([np.linspace(0.0, 0.1, 50), np.linspace(0.9, 1.0, 50)])
    fitted = LookupTable(size=40).fit(x[:, None], x)
    assert fitted.n_parameters_ < 40
    assert fitted.predict(np.array([[0.5]])) == pytest.approx([0.5], abs=1e-6)


def test_two_strokes_are_two_estimators() -> None:
    x = np.tile(np.linspace(0.0, 1.0, 100), 2)
    side = np.repeat([1.0, -1.0], 100)
    y = x + 0.5 * side
    fitted = PerStroke(TissueParameters(order=1)).fit(np.column_stack([x, side]), y)
    assert fitted.predict(np.column_stack([x, side])) == pytest.approx(y)
    assert fitted.n_parameters_ == 4


def test_passive_strokes_meet_in_their_mean_where_they_would_cross() -> None:
    x = np.tile(np.linspace(0.0, 1.0, 100), 2)
    side = np.repeat([1.0, -1.0], 100)
    X, y = np.column_stack([x, side]), x + side * (0.5 - x)
    free = PerStroke(TissueParameters(order=1)).fit(X, y)
    passive = PerStroke(TissueParameters(order=1), passive=True).fit(X, y)
    assert passive.n_parameters_ == free.n_parameters_
    assert passive.predict(X) == pytest.approx(x + side * np.maximum(0.5 - x, 0.0))


def test_rows_with_little_motion_are_not_a_stroke() -> None:
    x = np.concatenate([np.linspace(0.0, 0.01, 20), np.linspace(1.0, 0.0, 3000)])
    direction = np.repeat([1, -1], [20, 3000]).astype(np.int8)
    recording = Recording.from_arrays(x, 2.0 * x, direction=direction)
    assert not any("two strokes" in each.name for each in compare([recording], 5))
    assert comparable(recording).tolist() == [False] * 20 + [True] * 3000  # the tool waits in 20 rows


def test_baselines_are_fitted_to_the_kept_rows_and_judged_on_the_others() -> None:
    recording = press_and_release()
    table = {each.name: each for each in compare([recording], 5)}
    assert len(table) == 6
    assert all("two strokes" in name for name in table)
    assert table["smoothing spline, two strokes"].nrmse < 0.03
    broken = recording.force.copy()
    broken[4::5] += 100.0
    again = Recording.from_arrays(recording.position, broken, direction=recording.direction)
    changed = {each.name: each for each in compare([again], 5)}
    assert (
        changed["lookup table, two strokes"].n_parameters == table["lookup table, two strokes"].n_parameters
    )
    assert changed["lookup table, two strokes"].nrmse > 10.0


def test_time_gives_velocity_and_acceleration() -> None:
    t = np.arange(2000) * 1e-3
    x = 0.01 * np.sin(5.0 * t) + 0.004 * np.sin(11.0 * t)
    v = 0.05 * np.cos(5.0 * t) + 0.044 * np.cos(11.0 * t)
    a = -0.25 * np.sin(5.0 * t) - 0.484 * np.sin(11.0 * t)
    noise = np.random.default_rng(0).normal(0.0, 1e-3, len(t))
    recording = Recording.from_arrays(x, 50.0 * x + 2.0 * v + 0.3 * a + noise, time=t)
    table = {each.name: each for each in compare([recording], 5)}
    assert table["tissue parameters"].n_parameters == 6
    assert table["tissue parameters"].nrmse < 0.02
    assert table["lookup table"].nrmse > 0.05


def with_baselines(folder: Path, *options: str) -> int:
    """Identifies a recording with all baselines; returns the exit code."""
    file = press_and_release().write(folder / "press.csv")
    command = ["identify", str(file), "-o", str(folder / "press.json"), "--hold-out-every", "5"]
    return main([*command, "--max-wavelets", "1", "--baselines", *options])


def test_command_prints_baselines_with_the_model(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert with_baselines(tmp_path) == 0
    lines = capsys.readouterr().out.splitlines()
    assert any(line.startswith("wavelet network") for line in lines)
    assert any(line.startswith("smoothing spline, two strokes") for line in lines)


@pytest.mark.full
def test_baselines_are_a_field_of_the_json_object(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert with_baselines(tmp_path, "--json") == 0
    printed = json.loads(capsys.readouterr().out)
    assert {"name", "nrmse", "n_parameters", "seconds", "refused"} == set(printed["baselines"][0])


def test_command_requires_held_out_rows(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = press_and_release().write(tmp_path / "press.csv")
    assert main(["identify", str(file), "-o", str(tmp_path / "press.json"), "--baselines"]) == 2
    assert "--hold-out-every" in capsys.readouterr().err

# SPDX-License-Identifier: Apache-2.0
"""Errors, whiteness and perception by definition or law; comparison of two models."""

from functools import cache
from pathlib import Path

import numpy as np
import pytest

from palpate import InputError, Model, Recording, identify
from palpate.cli.main import main
from palpate.verification import compare
from palpate.verification.metrics import (
    autocorrelation,
    durbin_watson,
    force_floor,
    force_jnd_band,
    lag_one_autocorrelation,
    normalised,
    root_mean_square,
    share_within_force_jnd,
    share_within_stiffness_jnd,
    within_force_jnd,
)


def test_rms_is_the_root_of_the_mean_square() -> None:
    assert root_mean_square(np.array([3.0, -4.0, 0.0, 0.0])) == 2.5


def test_nrmse_divides_by_the_population_standard_deviation() -> None:
    reference = np.array([0.0, 2.0])  # population 1, sample sqrt(2)
    assert normalised(0.25, reference) == 0.25


def test_predicting_the_mean_has_an_nrmse_of_one() -> None:
    reference = np.random.default_rng(1).normal(size=100)
    assert normalised(root_mean_square(reference.mean() - reference), reference) == pytest.approx(
        1.0, rel=1e-14
    )


def test_a_constant_reference_has_no_spread() -> None:
    assert normalised(0.0, np.ones(5)) == 0.0
    assert normalised(0.1, np.ones(5)) == np.inf


def test_white_residuals_are_white() -> None:
    white = np.random.default_rng(2).normal(size=100_000)
    assert lag_one_autocorrelation(white) == pytest.approx(0.0, abs=0.02)
    assert durbin_watson(white) == pytest.approx(2.0, abs=0.04)


def test_the_autocorrelation_repeats_with_the_period_of_the_residuals() -> None:
    repeated = np.resize([1.0, 0.0, -1.0, 0.0], 4000)
    assert autocorrelation(repeated, 4) == pytest.approx([0.0, -1.0, 0.0, 1.0], abs=2e-3)
    assert autocorrelation(np.zeros(10), 3).tolist() == [0.0, 0.0, 0.0]


def test_the_noticeable_band_contains_exactly_the_forces_that_a_hand_does_not_distinguish() -> None:
    random = np.random.default_rng(3)
    recorded = random.uniform(-2.0, 2.0, 10_000)
    modelled = recorded + random.normal(0.0, 0.1, len(recorded))
    low, high = force_jnd_band(modelled, force_floor(recorded))
    inside = (low <= recorded) & (recorded <= high)
    assert inside.tolist() == within_force_jnd(recorded, modelled - recorded).tolist()
    assert 0.1 < inside.mean() < 0.9


def test_slow_residuals_are_not_white() -> None:
    slow = np.sin(np.linspace(0, 20, 100_000))
    assert lag_one_autocorrelation(slow) > 0.99
    assert durbin_watson(slow) < 0.01


def test_alternating_residuals_are_not_white_either() -> None:
    alternating = np.resize([1.0, -1.0], 1000)
    assert lag_one_autocorrelation(alternating) == pytest.approx(-0.999)
    assert durbin_watson(alternating) == pytest.approx(3.996)


def test_no_residual_at_all_counts_as_white() -> None:
    assert lag_one_autocorrelation(np.zeros(5)) == 0.0
    assert durbin_watson(np.zeros(5)) == 2.0


def test_the_force_band_is_seven_per_cent_of_local_force() -> None:
    force = np.array([1.0, -1.0, 0.5, 0.5])
    error = np.array([0.0699, -0.0701, 0.0349, 0.0351])
    assert share_within_force_jnd(force, error) == 0.5


def test_the_force_band_has_a_floor_of_one_per_cent_of_the_largest_force() -> None:
    force = np.array([-10.0, 0.0, 0.0, 0.0])
    assert force_floor(force) == pytest.approx(0.1)
    assert share_within_force_jnd(force, np.array([0.0, 0.099, -0.099, 0.101])) == 0.75


@pytest.mark.parametrize(
    ("factor", "share"), [(0.0, 1.0), (0.229, 1.0), (-0.229, 1.0), (0.231, 0.0), (-0.5, 0.0)]
)
def test_the_stiffness_band_is_23_per_cent(factor: float, share: float) -> None:
    x = np.linspace(0.0, 1.0, 1000)
    assert share_within_stiffness_jnd(x, 3 * x, factor * 3 * x) == share


def test_offset_does_not_change_stiffness() -> None:
    x = np.linspace(0.0, 1.0, 1000)
    assert share_within_stiffness_jnd(x, 3 * x, np.full_like(x, 5.0)) == 1.0


def test_the_stiffness_is_local() -> None:
    x = np.linspace(0.0, 1.0, 2001)
    kink = np.where(x < 0.5, 0.0, 2 * (x - 0.5))
    assert share_within_stiffness_jnd(x, 3 * x, kink) == pytest.approx(0.5, abs=0.05)


def test_a_stiffness_needs_motion_and_rows() -> None:
    assert share_within_stiffness_jnd(np.ones(100), np.ones(100), np.ones(100)) is None
    few = np.linspace(0.0, 1.0, 20)
    assert share_within_stiffness_jnd(few, few, few) is None


@cache
def spring(stiffness: float, reach: float = 1.0, loss: float = 0.0) -> Model:
    x = np.concatenate([np.linspace(0, reach, 100), np.linspace(reach, 0, 100)])
    direction = np.repeat([1, -1], 100)
    force = stiffness * x + loss * direction
    return identify(Recording.from_arrays(x, force, direction=direction if loss else None))


def test_difference_is_measured_in_just_noticeable_differences() -> None:
    (stroke,) = compare(spring(10.0), spring(10.35))
    assert stroke.name == ""
    # The difference is 3.5 % of the force, half the just noticeable difference of 7 % (near zero force: 1 %
    # of the largest force).
    assert stroke.worst == pytest.approx(0.5, rel=1e-6)
    assert stroke.perceptible[0] == pytest.approx(0.1, rel=1e-6)
    (same,) = compare(spring(10.0), spring(10.0))
    assert same.worst == pytest.approx(0.0, abs=1e-9)


def test_strokes_are_compared_separately_if_one_model_has_hysteresis() -> None:
    press, release = compare(spring(10.0), spring(10.0, loss=0.2))
    assert (press.name, release.name) == ("press", "release")
    assert np.max(press.second - press.first) == pytest.approx(0.2, rel=1e-6)
    assert np.max(release.second - release.first) == pytest.approx(-0.2, rel=1e-6)


def test_models_are_compared_on_their_common_domain() -> None:
    (stroke,) = compare(spring(10.0, reach=0.5), spring(10.0))
    assert (stroke.position[0], stroke.position[-1]) == (0.0, 0.5)
    x = np.linspace(2.0, 3.0, 100)
    with pytest.raises(InputError, match="have no common position"):
        compare(spring(10.0), identify(Recording.from_arrays(x, 10.0 * x)))


def test_show_prints_and_draws_two_models(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    one, two, picture = (str(tmp_path / name) for name in ("one.json", "two.json", "both.png"))
    spring(10.0).save(one)
    spring(10.35).save(two)
    assert main(["show", one, "--beside", two, "--plot", picture]) == 0
    assert "0.5" in capsys.readouterr().out
    assert Path(picture).read_bytes().startswith(b"\x89PNG")


def test_show_draws_every_network_that_was_considered(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    one, picture = str(tmp_path / "one.json"), str(tmp_path / "path.png")
    model = spring(10.0)
    model.save(one)
    assert main(["show", one, "--plot", picture]) == 0
    assert capsys.readouterr().out.strip() == str(model).strip()
    assert Path(picture).read_bytes().startswith(b"\x89PNG")

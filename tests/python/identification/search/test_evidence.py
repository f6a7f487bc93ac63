# SPDX-License-Identifier: Apache-2.0
"""Held-out rows decide when to stop adding wavelets and which model class is accepted."""

import re

import numpy as np
import pytest

from palpate import identify
from palpate.identification import IdentifyOptions, fit_environment
from palpate.identification.classes.model_selection import select
from palpate.identification.data.compression import HeldOutRows, held_out_rows
from palpate.identification.data.rows import Rows
from palpate.identification.search.evidence import choice, enough, standard_error
from palpate.recording import sample_recording


def wall(n: int, seed: int, noise: float = 0.02) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    random = np.random.default_rng(seed)
    x = random.uniform(0.0, 0.6, n)
    truth = 2.0 * x + 58.0 * 0.01 * np.logaddexp(0.0, (x - 0.4) / 0.01)
    return x, truth, truth + random.normal(0.0, noise, n)


def test_one_standard_error_rule_takes_smallest_network_within_one_error() -> None:
    values = [500.0, 60.0, 9.0, 4.0, 5.0]
    assert standard_error(50) == 10.0
    assert choice("fresh", values, 50) == 2
    assert choice("bic", values, 50) == 3


def test_perceptual_rule_takes_first_network_below_noticeable_difference() -> None:
    assert choice("perceptual", [500.0, -3.0, -80.0], 50) == 1
    assert choice("perceptual", [500.0, 30.0, 40.0], 50) == 1
    assert enough("perceptual", -3.0)
    assert not enough("perceptual", 3.0)
    assert not enough("fresh", -3.0)


def test_a_difference_is_felt_above_seven_percent_or_one_percent_of_the_largest() -> None:
    rows = HeldOutRows(np.zeros((3, 1)), np.array([0.0, 1.0, 10.0]), None)
    np.testing.assert_allclose(rows.in_jnd(np.array([0.1, 0.1, 0.7])), [1.0, 1.0, 1.0])


@pytest.mark.parametrize("criterion", ["fresh", "perceptual"])
def test_criteria_on_held_out_rows_stop_earlier_and_set_stop_reason(criterion: str) -> None:
    x, _, y = wall(4000, 0)
    network = fit_environment(x[:, None], y, None, IdentifyOptions(criterion=criterion))
    plain = fit_environment(x[:, None], y)
    assert network.stop_reason == criterion
    assert 1 <= len(network.weight) <= len(plain.weight)
    assert np.ptp([point.criterion for point in network.log.path]) > 0.0
    fitted = [point for point in network.log.path if point.model_class == "position"]
    assert fitted[-1].n_wavelets <= max(point.n_wavelets for point in fitted)


def test_held_out_rows_outside_fitted_range_do_not_refuse_a_network() -> None:
    """One group of successive held-out rows is at a wall where no row is fitted."""
    n = 2000
    x = 0.5 - 0.5 * np.cos(20.0 * np.pi * np.arange(n) / n)
    fresh = np.flatnonzero(held_out_rows(n, (0,)))
    stretches = np.split(fresh, np.flatnonzero(np.diff(fresh) > 1) + 1)
    into_wall = stretches[len(stretches) // 2]
    push = np.sin(np.pi * np.arange(len(into_wall)) / len(into_wall)) ** 2
    x[into_wall] += (1.1 - x[into_wall]) * push
    force = 0.1 * np.sin(9.0 * x) + 0.3 * x + 20.0 * np.maximum(x - 1.0, 0.0)
    force += np.random.default_rng(0).normal(0.0, 0.002, n)
    network = fit_environment(x[:, None], force, None, IdentifyOptions(inputs="position"), starts=[0])
    assert network.model_class == "position"
    assert network.errors.nrmse < 0.02


def test_decisions_report_the_criterion_of_each_model_class() -> None:
    straight, curve, *_ = identify(sample_recording(1, duration_s=10.0)).notes["model_selection"]
    reason = r"accepted \(lowers BIC by \d+\)"
    assert re.fullmatch(f"straight line: {reason}", straight)
    assert re.fullmatch(f"curve over position: {reason}", curve)


def test_a_force_without_hysteresis_is_the_same_in_both_strokes() -> None:
    position = np.linspace(0.0, 1.0, 50)
    rows = Rows(("position",), position[:, None], 3.0 * position)
    best = select(rows, IdentifyOptions()).best
    middle, hysteresis = best.parts_at(position[:, None])
    assert middle == pytest.approx(3.0 * position, abs=1e-6)
    assert hysteresis == pytest.approx(np.zeros(50))

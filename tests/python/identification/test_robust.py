# SPDX-License-Identifier: Apache-2.0
"""Huber's loss finds the force as if the wrong readings were not there, and says how many there were."""

import numpy as np
import pytest

import palpate
from imperfect import Array, noise, recorded, strokes, sweep, true_nrmse, wall
from palpate.identification.data.outliers import suspects

N = 4000


def with_outliers(y: Array, share: float) -> Array:
    """The force with that share of rows moved by ten ranges."""
    random, wrong = np.random.default_rng(8), y.copy()
    rows = random.choice(len(y), round(share * len(y)), replace=False)
    wrong[rows] += random.choice([-10.0, 10.0], len(rows)) * np.ptp(y)
    return wrong


@pytest.mark.parametrize("positions", ["strokes", "shuffled"])
@pytest.mark.parametrize("share", [0.01, 0.05])
def test_outliers_of_ten_ranges_cost_nothing(share: float, positions: str) -> None:
    x = strokes(N) if positions == "strokes" else np.random.default_rng(9).permutation(sweep(N))
    y = wall(x) + noise(N)
    clean = palpate.identify(recorded(x, y))
    model = palpate.identify(recorded(x, with_outliers(y, share)), loss="huber")
    assert true_nrmse(model, wall) < max(1.5 * true_nrmse(clean, wall), 0.001)
    assert model.fit.nrmse == pytest.approx(clean.fit.nrmse, rel=0.05)
    assert "left out as wrong readings" in str(model.verdict)


@pytest.mark.parametrize("share", [0.01, 0.05])
def test_outliers_do_not_hide_hysteresis(share: float) -> None:
    x = strokes(N)
    side = np.where(np.gradient(x) > 0.0, 1, -1)
    y = wall(x) + side + noise(N)
    recording = palpate.Recording.from_arrays(x, with_outliers(y, share), direction=side)
    model = palpate.identify(recording, loss="huber")
    assert model.fit.model_class == "hysteresis"
    truth = wall(x) + side
    error = model.force(x, direction=side.astype(float)) - truth
    assert np.sqrt(np.mean(error**2)) < 0.003 * np.std(truth)


def test_click_and_step_are_no_outliers() -> None:
    x = sweep(N)
    click = wall(x) + np.where(np.abs(x - 0.2) < 0.005, 2.0, 0.0) + np.where(x > 0.3, 5.0, 0.0)
    assert not suspects(x[:, None], click + noise(N), None, None).any()


def test_rows_without_outliers_lose_none() -> None:
    x = strokes(N)
    y = wall(x) + noise(N)
    model = palpate.identify(recorded(x, y), loss="huber")
    assert model.verdict.level == "good"
    assert true_nrmse(model, wall) < 0.001

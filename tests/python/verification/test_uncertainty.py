# SPDX-License-Identifier: Apache-2.0
"""Standard errors equal the distance of a model from the truth if noise is the only cause."""

from dataclasses import replace

import numpy as np
import pytest

import palpate
from conftest import ROOT
from palpate.errors import InputError
from palpate.recording import Recording
from palpate.verification import uncertainty

GRID = np.linspace(0.05, 0.95, 60)


def hat(u: np.ndarray) -> np.ndarray:
    return (u * u - 1.0) * np.exp(-0.5 * u * u)


def truth(x: np.ndarray) -> np.ndarray:
    """Returns a force that a network of two wavelets follows exactly."""
    return 3.0 * x + hat(20.0 * (x - 0.3)) - 0.5 * hat(9.0 * (x - 0.7))


def noisy(seed: int, n: int = 1500, sigma: float = 0.02) -> Recording:
    random = np.random.default_rng(seed)
    x = random.uniform(0.0, 1.0, n)
    return Recording.from_arrays(x, truth(x) + random.normal(0.0, sigma, n))


def strokes(seed: int, loss: float = 0.3) -> Recording:
    random = np.random.default_rng(seed)
    x, side = np.tile(np.linspace(0.0, 1.0, 800), 2), np.repeat([1, -1], 800)
    return Recording.from_arrays(x, truth(x) + side * loss + random.normal(0.0, 0.02, len(x)), direction=side)


def test_errors_agree_with_their_standard_errors() -> None:
    """Errors of model force and slope, divided by their standard errors, have a standard deviation of 1."""
    ratios, slopes = [], []
    for seed in range(15):
        recording = noisy(seed)
        model = palpate.identify(recording)
        known = uncertainty(model, recording)
        ratios.append((model.force(GRID) - truth(GRID)) / known.force(GRID))
        step = 1e-6
        slope = (truth(GRID + step) - truth(GRID - step)) / (2.0 * step)
        slopes.append((model.slope(GRID) - slope) / known.slope(GRID))
    for found in (np.array(ratios), np.array(slopes)):
        assert 0.8 < np.sqrt(np.mean(found**2)) < 1.3
        assert np.mean(np.abs(found) < 2.0) > 0.9


@pytest.mark.full
def test_amplitudes_and_phases_of_harmonics_have_errors() -> None:
    def motor(x: np.ndarray) -> np.ndarray:
        return np.cos(3.0 * x) + 0.4 * np.sin(11.0 * x + 1.0)

    ratios = []
    for seed in range(10):
        x = 2.0 * np.pi * np.arange(300) / 300
        noise = np.random.default_rng(seed).normal(0.0, 0.05, len(x))
        recording = Recording.from_arrays(x, motor(x) + noise)
        model = palpate.identify(recording, period=2.0 * np.pi, max_wavelets=2)
        assert model.orders.tolist() == [3.0, 11.0]
        at = 6.0 * GRID
        ratios.append((model.force(at) - motor(at)) / uncertainty(model, recording).force(at))
    assert 0.7 < np.sqrt(np.mean(np.square(ratios))) < 1.3


def test_noise_is_estimated_and_four_times_the_rows_halve_the_error() -> None:
    few, many = noisy(1, 1000), noisy(1, 4000)
    errors = []
    for recording in (few, many):
        known = uncertainty(palpate.identify(recording), recording)
        assert known.sigma == pytest.approx(0.02, rel=0.1)
        errors.append(np.median(known.force(GRID)))
    assert errors[0] / errors[1] == pytest.approx(2.0, rel=0.25)


def test_strokes_of_a_hysteresis_model_have_separate_errors() -> None:
    recording = strokes(0)
    model = palpate.identify(recording)
    assert model.hysteretic
    known = uncertainty(model, recording)
    for side in (1.0, -1.0):
        stroke = np.full(len(GRID), side)
        error = model.force(GRID, direction=stroke) - truth(GRID) - 0.3 * side
        assert np.mean(np.abs(error) < 2.5 * known.force(GRID, stroke)) > 0.8


def test_strokes_that_only_the_order_of_rows_shows_have_the_same_errors() -> None:
    x, side = np.r_[np.linspace(0.0, 1.0, 800), np.linspace(1.0, 0.0, 800)], np.repeat([1, -1], 800)
    noise = np.random.default_rng(0).normal(0.0, 0.02, len(x))
    recording = Recording.from_arrays(x, truth(x) + 0.3 * side + noise, direction=side)
    model, ordered = palpate.identify(recording), replace(recording, direction=None)
    press = np.ones(len(GRID))
    assert uncertainty(model, ordered).force(GRID, press) == pytest.approx(
        uncertainty(model, recording).force(GRID, press), rel=1e-3
    )


def test_correlated_residuals_widen_the_band() -> None:
    random = np.random.default_rng(0)
    x = np.linspace(0.0, 1.0, 2000)
    white = random.normal(0.0, 0.02, len(x))
    walk = np.zeros(len(x))
    for k in range(1, len(x)):
        walk[k] = 0.8 * walk[k - 1] + 0.6 * white[k]
    order = random.permutation(len(x))
    apart = uncertainty(*_identified(x, truth(x) + walk[order]))
    together = uncertainty(*_identified(x, truth(x) + walk))
    assert together.autocorrelation > 0.6 > 0.2 > apart.autocorrelation
    assert np.median(together.force(GRID)) > 2.0 * np.median(apart.force(GRID))


def _identified(x: np.ndarray, y: np.ndarray) -> tuple[palpate.Model, Recording]:
    recording = Recording.from_arrays(x, y)
    return palpate.identify(recording, max_wavelets=2), recording


def test_several_recordings_count_together() -> None:
    parts = [noisy(1), noisy(2)]
    model = palpate.identify(parts)
    both, one = uncertainty(model, parts), uncertainty(model, parts[0])
    assert np.median(one.force(GRID) / both.force(GRID)) == pytest.approx(np.sqrt(2.0), rel=0.15)


def test_outside_the_domain_the_error_is_that_at_its_edge() -> None:
    recording = noisy(3)
    known = uncertainty(palpate.identify(recording), recording)
    far, edge = np.array([2.0, -1.0]), np.array([known.model.upper[0], known.model.lower[0]])
    assert np.array_equal(known.force(far), known.force(edge))


def test_unknown_standard_errors_are_refused() -> None:
    recording = strokes(0)
    surface = palpate.load_model(ROOT / "tests" / "models" / "good" / "two_inputs.json")
    with pytest.raises(InputError, match="need position as the only input"):
        uncertainty(surface, recording)

# SPDX-License-Identifier: Apache-2.0
"""Differences between recordings, and the share of a further recording in the band."""

import numpy as np
import pytest
from numpy.typing import NDArray

from any_input import SCALE
from conftest import sampled
from palpate.identification.data.repeats import Repeats, band_of, deviations, pure_error, row_noise

Array = NDArray[np.float64]

X = np.linspace(0.0, 1.0, 300)

DRAWS = 100 if SCALE == 1 else 300


def draw(random: np.random.Generator, shared: float, by_row: float) -> Array:
    """Returns the residual of one recording: another offset, stiffness and shape, and noise of each row."""
    offset, stiffness, shape = random.normal(size=3)
    smooth = shared * (0.2 * offset + stiffness * X + 0.5 * shape * np.sin(3.0 * X))
    return np.asarray(smooth + by_row * (0.3 + X) * random.normal(size=len(X)))


SHARES = [(0.0, 1.0), (1.0, 0.0), (1.0, 0.3), (0.3, 1.0)]
"""Sizes of the difference between recordings and of the noise of each row"""

BANDS = [(n, *shares) for n in (3, 5, 10) for shares in SHARES]


@pytest.mark.parametrize(("n", "shared", "by_row"), sampled(BANDS, *BANDS[:4], (10, 1.0, 0.3)))
def test_the_band_contains_95_percent_of_a_further_recording(n: int, shared: float, by_row: float) -> None:
    random = np.random.default_rng(n)
    inside = []
    for _ in range(DRAWS):
        *seen, unseen = (draw(random, shared, by_row) for _ in range(n + 1))
        mean = np.polynomial.Polynomial.fit(np.tile(X, n), np.concatenate(seen), 5)(X)
        residual = np.concatenate([each - mean for each in seen])
        repeats = Repeats(np.repeat(np.arange(n), len(X)), (0,) * n)
        band = band_of(np.tile(X, n), None, residual, repeats, (0.0, 1.0), 1.0)
        assert band is not None
        inside.append(np.mean(np.abs(unseen - mean) <= band.half_width(X)))
    assert 0.93 < np.mean(inside) < 0.98


def test_the_band_of_objects_contains_95_percent_of_a_further_object() -> None:
    random = np.random.default_rng(1)
    inside, inside_repeat = [], []
    for _ in range(60 if SCALE == 1 else DRAWS):
        of_object = [draw(random, 3.0, 0.0) for _ in range(7)]
        *seen, unseen = ([each + draw(random, 0.5, 0.1) for _ in range(3)] for each in of_object)
        rows = [row for group in seen for row in group]
        mean = np.mean(rows, axis=0)
        repeats = Repeats(np.repeat(np.arange(18), len(X)), tuple(np.repeat(np.arange(6), 3)))
        residual = np.concatenate([row - mean for row in rows])
        band = band_of(np.tile(X, 18), None, residual, repeats, (0.0, 1.0), 1.0)
        assert band is not None
        inside.append(np.mean(np.abs(unseen[0] - mean) <= band.half_width(X)))
        again = of_object[0] + draw(random, 0.5, 0.1) - np.mean(seen[0], axis=0)
        half = band.repeat_half_width(X)
        assert half is not None
        inside_repeat.append(np.mean(np.abs(again) <= half))
    assert 0.93 < np.mean(inside) < 0.98
    assert 0.93 < np.mean(inside_repeat) < 0.98


def test_an_object_with_one_recording_has_no_band_of_repeats() -> None:
    random = np.random.default_rng(2)
    residual = np.concatenate([draw(random, 1.0, 0.1) for _ in range(3)])
    repeats = Repeats(np.repeat(np.arange(3), len(X)), (0, 1, 2))
    band = band_of(np.tile(X, 3), None, residual, repeats, (0.0, 1.0), 1.0)
    assert band is not None
    assert band.repeat is None
    assert band.object is not None
    assert (band.recordings, band.objects, band.left_out) == (3, 3, "object")


def test_two_offsets_differ_from_their_mean_by_half_their_distance() -> None:
    residual = np.repeat([0.0, 2.0], len(X))
    recording = np.repeat([0, 1], len(X))
    assert pure_error(np.tile(X, 2), None, residual, recording) == pytest.approx(1.0)


def test_press_of_one_recording_is_not_compared_with_release_of_another() -> None:
    side = np.repeat([1.0, -1.0], len(X))
    recording = np.repeat([0, 1], len(X))
    assert pure_error(np.tile(X, 2), side, side, recording) is None


def test_rows_where_no_other_recording_has_rows_have_no_difference() -> None:
    position = np.concatenate([X, 0.5 + X])
    apart = deviations(position, None, np.zeros(600), np.repeat([0, 1], 300), np.zeros(600, dtype=np.intp))
    assert np.isnan(apart[:149]).all()
    assert np.isfinite(apart[150:300]).all()


def test_noise_of_rows_is_separated_from_a_difference_of_the_whole_recording() -> None:
    random = np.random.default_rng(3)
    residual = np.concatenate([5.0 + X, -5.0 - X]) + 0.1 * random.normal(size=600)
    recording = np.repeat([0, 1], 300)
    found = row_noise(np.tile(X, 2), residual, recording, np.ones(600, dtype=bool))
    assert found == pytest.approx(0.01, rel=0.15)

# SPDX-License-Identifier: Apache-2.0
"""Repeated rows, held samples, coarse forces and correlated noise give no false structure."""

from collections.abc import Callable
from functools import cache

import numpy as np
import pytest

import palpate
from conftest import sampled
from imperfect import NOISE, Array, Law, line, noise, recorded, strokes, sweep, true_nrmse, wall
from palpate.identification.data.limits import (
    NO_LIMITS,
    RowLimits,
    correlation,
    distinct_rows,
    force_step,
    independent_share,
    repeated,
)

N = 2000


def rows_five_times(law: Law) -> palpate.Recording:
    x = sweep(N)
    return recorded(np.repeat(x, 5), np.repeat(law(x) + noise(N), 5))


def file_joined_to_itself(law: Law) -> palpate.Recording:
    x = strokes(N)
    return recorded(np.tile(x, 5), np.tile(law(x) + noise(N), 5))


def both_held_for_five(law: Law) -> palpate.Recording:
    x = strokes(N)
    held = np.arange(N) // 5 * 5
    return recorded(x[held], (law(x) + noise(N))[held], 1e-3 * np.arange(N))


def correlated(rho: float) -> Callable[[Law], palpate.Recording]:
    def recording(law: Law) -> palpate.Recording:
        return recorded(sweep(N), law(sweep(N)) + noise(N, correlation=rho))

    return recording


def in_steps(positions: Callable[[int], Array], bits: int) -> Callable[[Law], palpate.Recording]:
    def recording(law: Law) -> palpate.Recording:
        x, step = positions(N), float(np.ptp(law(sweep(N)))) / 2**bits
        return recorded(x, step * np.round(law(x) / step))

    return recording


IMPERFECT: dict[str, Callable[[Law], palpate.Recording]] = {
    "rows five times": rows_five_times,
    "file joined to itself": file_joined_to_itself,
    "position and force held": both_held_for_five,
    "noise of correlation 0.5": correlated(0.5),
    "noise of correlation 0.9": correlated(0.9),
    "8-bit force, one stroke": in_steps(sweep, 8),
    "6-bit force, one stroke": in_steps(sweep, 6),
    "6-bit force, several strokes": in_steps(strokes, 6),
}


@cache
def identified(name: str, law: Law) -> palpate.Model:
    return palpate.identify(IMPERFECT[name](law))


FAST = (
    "rows five times",
    "position and force held",
    "noise of correlation 0.5",
    "6-bit force, several strokes",
)
"""Defects of rows that the quick run tests"""


@pytest.mark.parametrize("name", sampled(IMPERFECT, *FAST, "6-bit force, one stroke"))
def test_straight_line_is_found_in_imperfect_rows(name: str) -> None:
    model = identified(name, line)
    assert model.n_wavelets <= 1
    assert true_nrmse(model, line) < 0.01


@pytest.mark.parametrize("name", sampled(IMPERFECT, *FAST))
def test_wall_is_found_with_few_wavelets(name: str) -> None:
    model = identified(name, wall)
    assert 3 <= model.n_wavelets <= 8
    assert true_nrmse(model, wall) < 0.008


@pytest.mark.parametrize("law", [line, wall])
def test_independent_exact_rows_are_not_limited(law: Law) -> None:
    x, force = sweep(N), law(sweep(N)) + noise(N)
    assert RowLimits(force_error=force_step(force)) == NO_LIMITS
    model = palpate.identify(recorded(x, force))
    assert not any("correlated" in note for note in model.notes["identification"])
    assert not any("once" in note for note in model.notes["rows"])


def test_structure_left_by_a_line_is_not_taken_for_noise() -> None:
    x = sweep(N)
    left = wall(x) - np.polyval(np.polyfit(x, wall(x), 1), x)
    assert left[1:] @ left[:-1] / (left @ left) > 0.9
    click = np.where(np.abs(x - 0.3) < 0.01, 1.0, 0.0) + noise(N)
    assert correlation(click) == 0.0
    assert correlation(noise(N)) == 0.0
    rho = correlation(noise(20_000, correlation=0.9))
    assert rho == pytest.approx(0.9, abs=0.02)
    assert independent_share(rho) == pytest.approx(1.0 / 19.0, rel=0.2)


def test_force_step_is_found_only_where_few_levels_hold_many_rows() -> None:
    x = sweep(N)
    assert force_step(0.1 * np.round(wall(x) / 0.1)) == pytest.approx(0.1)
    assert force_step(wall(x) + noise(N)) == 0.0
    assert force_step(np.arange(float(N))) == 0.0
    assert force_step(np.full(N, 3.0)) == 0.0


def test_repeats_are_rows_that_copy_others() -> None:
    x, y = sweep(200)[:, None], noise(200)
    assert not repeated(x, y, None)[0].any()
    assert np.count_nonzero(repeated(np.repeat(x, 5, axis=0), np.repeat(y, 5), None)[0]) == 800
    assert np.count_nonzero(repeated(np.tile(x, (3, 1)), np.tile(y, 3), None)[0]) == 400
    # rows with equal positions but independent forces are not repeated rows
    assert not repeated(np.repeat(x, 5, axis=0), noise(1000), None)[0].any()


@pytest.mark.parametrize("times", sampled([2, 8], 8))
def test_repeated_rows_change_neither_model_nor_verdict(times: int) -> None:
    x = np.r_[sweep(400), sweep(400)[::-1]]
    y = wall(x) + noise(800)
    time = 1e-3 * np.arange(800.0 * times)
    once = palpate.identify(palpate.Recording.from_arrays(x, y, time[::times]))
    again = palpate.Recording.from_arrays(np.repeat(x, times), np.repeat(y, times), time)
    model = palpate.identify(again)
    assert np.array_equal(model.weight, once.weight)
    assert (model.verdict, again.verdict) == (once.verdict, once.verdict)
    assert model.notes["roles"]["repeated"] == 800 * (times - 1)
    assert f"{800 * (times - 1)} of {800 * times} rows dropped (repeats" in model.notes["rows"][0]


@pytest.mark.full
def test_correlation_is_named_in_the_notes() -> None:
    model = identified("noise of correlation 0.9", wall)
    assert any("The noise is correlated" in note for note in model.notes["identification"])
    assert model.fit.nrmse == pytest.approx(NOISE / np.std(wall(sweep(N))), rel=0.25)


@pytest.mark.parametrize("dimension", [1, 2, 5])
@pytest.mark.parametrize("rows", [1, 2, 400])
def test_distinct_rows_are_those_of_numpy(rows: int, dimension: int) -> None:
    rng = np.random.default_rng(rows + dimension)
    for table in (rng.integers(-3, 3, (rows, dimension)), rng.normal(size=(rows, dimension))):
        expected, inverse, times = np.unique(table, axis=0, return_inverse=True, return_counts=True)
        chosen, group, count = distinct_rows(table)
        assert np.array_equal(table[chosen], expected)
        assert np.array_equal(group, inverse.reshape(-1))
        assert np.array_equal(count, times)

# SPDX-License-Identifier: Apache-2.0
"""Compressed rows represent all rows: the same least squares at a limited cost."""

import numpy as np
import pytest

from palpate.identification.data.compression import (
    SECTIONS,
    Compressed,
    Compressor,
    held_out_rows,
    inside,
)
from palpate.identification.network.basis import Basis
from palpate.identification.network.separable import problem_of


def wall(x: np.ndarray) -> np.ndarray:
    return 2.0 * x + 58.0 * 0.01 * np.logaddexp(0.0, (x - 0.4) / 0.01)


@pytest.mark.parametrize("dimension", [1, 2])
def test_merged_rows_have_the_squared_error_of_all_rows_for_any_function(dimension: int) -> None:
    random = np.random.default_rng(0)
    x = random.integers(0, 12, size=(2000, dimension)) / 11.0
    y = random.normal(size=2000)
    rows = Compressor(x, y, max_positions=1000).rows()
    assert len(rows.force) == 12**dimension
    assert rows.weight.sum() == 2000
    for _ in range(3):
        a, b = random.normal(size=2)

        def f(at: np.ndarray, a: float = a, b: float = b) -> np.ndarray:
            return a * np.sin(5.0 * at.sum(axis=1)) + b

        merged = rows.weight @ (rows.force - f(rows.positions)) ** 2 + rows.within
        assert merged == pytest.approx(np.sum((y - f(x)) ** 2), rel=1e-12)


def test_rows_of_different_sides_are_kept_apart() -> None:
    x = np.repeat(np.linspace(0.0, 1.0, 11), 4)[:, None]
    side = np.tile([1.0, 1.0, -1.0, -1.0], 11)
    rows = Compressor(x, side * 3.0, max_positions=100).rows(side)
    assert rows.side is not None
    assert len(rows.force) == 22
    np.testing.assert_array_equal(rows.force, 3.0 * rows.side)
    assert rows.within == 0.0


def test_variance_within_cells_excludes_the_slope_across_them() -> None:
    random = np.random.default_rng(1)
    x = random.uniform(0.0, 1.0, 50_000)
    noise = random.normal(0.0, 0.02, len(x))
    rows = Compressor(x[:, None], 40.0 * x + noise, max_positions=200).rows()
    freedom = rows.samples - len(rows.force) * 1.25  # fitted: a mean in each cell, a slope in every 4
    assert np.sqrt(rows.within / freedom) == pytest.approx(0.02, rel=0.01)


def test_weights_from_merged_rows_are_those_from_all_rows() -> None:
    random = np.random.default_rng(3)
    x = np.repeat(np.linspace(0.0, 1.0, 60), random.integers(1, 9, 60))[:, None]
    y = wall(0.6 * x[:, 0]) + random.normal(0.0, 0.02, len(x))
    every_row = Compressed(x, y, np.ones(len(x)), None, 0.0, len(x))
    basis = Basis(np.array([[5.0], [20.0]]), np.array([[0.4], [0.7]]))
    merged, every = (
        problem_of(rows, resolved_by=5) for rows in (Compressor(x, y, max_positions=100).rows(), every_row)
    )
    one, other = merged.solve(basis), every.solve(basis)
    np.testing.assert_allclose(one.coefficients, other.coefficients, rtol=1e-9)
    assert merged.total(one.rss) == pytest.approx(every.total(other.rss), rel=1e-12)


def test_a_million_rows_compress_to_a_bounded_number() -> None:
    x = np.random.default_rng(5).uniform(0.0, 0.6, 1_000_000)
    rows = Compressor(x[:, None], wall(x), max_positions=1024).rows()
    assert len(rows.force) == 1024
    assert rows.weight.sum() == 1_000_000


def test_held_out_rows_of_a_motion_are_stretches() -> None:
    scattered, stretches = held_out_rows(10_000, None), held_out_rows(10_000, (0,))
    assert scattered.mean() == pytest.approx(0.2)
    assert stretches.mean() == pytest.approx(0.2)
    assert np.count_nonzero(np.diff(stretches.astype(int))) == 2 * SECTIONS / 5


def test_rows_inside_lie_within_the_range_of_the_others_in_every_input() -> None:
    others = np.array([[0.0, 5.0], [1.0, 6.0]])
    rows = np.array([[0.5, 5.5], [0.0, 6.0], [1.1, 5.5], [0.5, 4.9]])
    np.testing.assert_array_equal(inside(rows, others), [True, True, False, False])
    assert not inside(rows, others[:0]).any()


@pytest.mark.parametrize("n", [6000, 200_000])
def test_the_mean_over_a_cell_does_not_reduce_a_harmonic(n: int) -> None:
    """The mean over a cell of 1/1024 of the period is 11 % below the force at its middle for order 264."""
    x = np.random.default_rng(7).uniform(0.0, 1.0, n)
    force = 0.3 * np.cos(2.0 * np.pi * 264.0 * x - 1.0)
    rows = Compressor(x[:, None], force, max_positions=1024).rows()
    found = problem_of(rows, resolved_by=5).solve(Basis.of_orders(np.array([264.0])))
    assert np.hypot(*found.coefficients[0, 2:]) == pytest.approx(0.3, rel=0.01)

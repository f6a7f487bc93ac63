# SPDX-License-Identifier: Apache-2.0
"""Tests the six problems with known force: their draws, and median and range over the draws."""

import numpy as np
import pytest
from bench.identification.compare_methods import measure
from bench.identification.methods import METHODS
from bench.identification.problems import problem


@pytest.mark.parametrize("name", ["P1", "P2", "P3", "P4", "P5"])
def test_draws_differ_in_positions_and_share_the_test_rows(name: str) -> None:
    first, repeated, other = problem(name, 1), problem(name, 1), problem(name, 2)
    assert np.array_equal(first.X, repeated.X)
    assert np.array_equal(first.y, repeated.y)
    assert first.X.shape == other.X.shape
    assert not np.array_equal(first.X, other.X)
    if name in ("P3", "P4", "P5"):
        assert np.array_equal(first.X_test, other.X_test)


def test_draws_without_noise_keep_the_ends_of_the_grid() -> None:
    for draw in range(3):
        x = problem("P4", draw).X[:, 0]
        assert (x[0], x[-1]) == (-10.0, 10.0)
        assert np.all(np.diff(x) > 0.0)


def test_measured_row_has_median_and_range_over_the_draws() -> None:
    (row,) = measure((problem("P4", draw) for draw in range(3)), METHODS[:1])
    lower, upper = row["nrmse_range"]
    assert lower < row["nrmse"] < upper
    assert row["n_wavelets_range"][0] <= row["n_wavelets"] <= row["n_wavelets_range"][1]
    assert row["n_parameters_range"][0] <= row["n_parameters"] <= row["n_parameters_range"][1]
    assert row["draws"] == 3

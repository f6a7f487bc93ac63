# SPDX-License-Identifier: Apache-2.0
"""Distinct rows: those that NumPy finds, in its order."""

import numpy as np
import pytest

from palpate.identification.data.limits import distinct_rows


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

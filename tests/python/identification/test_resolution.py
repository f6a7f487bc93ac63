# SPDX-License-Identifier: Apache-2.0
"""The distance within which a place has so many positions around it, by brute force."""

import numpy as np
import pytest

from palpate.identification.network.basis import Resolution


@pytest.mark.parametrize("dimension", [1, 2, 3])
@pytest.mark.parametrize("count", [1, 2, 7, 40])
def test_so_many_positions_are_within_reach_and_no_fewer(dimension: int, count: int) -> None:
    random = np.random.default_rng(count)
    positions = random.normal(size=(40, dimension)).round(6)
    places = np.concatenate([random.normal(scale=2.0, size=(200, dimension)), positions[:5]])
    resolution = Resolution(np.repeat(positions, 2, axis=0))
    assert len(resolution) == 40
    distance = np.linalg.norm(places[:, None] - positions, axis=2)
    np.testing.assert_allclose(
        resolution.reach(places, count), np.sort(distance, axis=1)[:, count - 1], atol=1e-12
    )

# SPDX-License-Identifier: Apache-2.0
"""How finely positions resolve a force: how far around a place one has to go to meet so many of them."""

import numpy as np
from scipy.spatial import cKDTree

from .._typing import Float1D, Float2D
from .distinct import distinct_rows


class Resolution:
    """Distances from any place to the distinct ones of some positions (m, d)."""

    def __init__(self, positions: Float2D) -> None:
        distinct = positions[distinct_rows(positions)[0]]
        self._sorted = distinct[:, 0] if distinct.shape[1] == 1 else None
        self._tree = cKDTree(distinct) if self._sorted is None else None
        self._size = len(distinct)

    def __len__(self) -> int:
        return self._size

    def reach(self, places: Float2D, count: int) -> Float1D:
        """(N,) distance from each place (N, d) within which there are count positions, 1 <= count <= len."""
        if self._tree is not None:
            return np.asarray(self._tree.query(places, k=[count])[0])[:, 0]
        # On a line the nearest ones are neighbours: the best of the windows of count positions around it.
        assert self._sorted is not None
        last = self._size - count
        first = np.searchsorted(self._sorted, places[:, 0])[:, None] - np.arange(count + 1)
        first = np.clip(first, 0, last)
        left, right = self._sorted[first], self._sorted[first + count - 1]
        return np.asarray(np.maximum(places - left, right - places).min(axis=1))

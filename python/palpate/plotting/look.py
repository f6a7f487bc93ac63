# SPDX-License-Identifier: Apache-2.0
"""What all figures share: labels with units, and a number of points that a printed column can show."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from .._typing import Float1D

MOST_POINTS = 6000
"""Drawn of a cloud: more cannot be told apart at the width of a column."""

_UNIT_TEXT = {"N*m": "N·m", "count": "counts"}


def label(name: str, unit: str) -> str:
    """ "force [N·m]"; the name alone where the unit is not known."""
    return f"{name} [{_UNIT_TEXT.get(unit, unit)}]" if unit else name


def label_position(axes: Axes, units: Mapping[str, str]) -> None:
    axes.set_xlabel(label("position", units["position"]))


def label_force(axes: Axes, units: Mapping[str, str]) -> None:
    axes.set_ylabel(label("force", units["force"]))


def grid(axes: Axes, axis: Literal["both", "x", "y"] = "both") -> None:
    """Thin lines behind what is drawn."""
    axes.grid(axis=axis, color="0.88", linewidth=0.5)
    axes.set_axisbelow(True)


def thinned(*arrays: Float1D, most: int = MOST_POINTS) -> list[Float1D]:
    """Every k-th sample of each array, so that at most `most` are drawn."""
    step = max(1, -(-len(arrays[0]) // most))
    return [array[::step] for array in arrays]


def strokes(direction: NDArray[np.int8] | None, n: int) -> list[tuple[str, NDArray[np.bool_]]]:
    """The strokes that are told apart: press and release where a recording has both, else all rows at once.

    Pauses belong to no stroke and are left out beside strokes.
    """
    if direction is not None and (direction > 0).any() and (direction < 0).any():
        return [("press", direction > 0), ("release", direction < 0)]
    return [("", np.ones(n, dtype=np.bool_))]

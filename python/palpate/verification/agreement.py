# SPDX-License-Identifier: Apache-2.0
"""Would a hand tell two models apart?"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .._typing import Float1D
from ..errors import InputError
from ..model import Model
from ..verdict import FORCE_JND
from .metrics import force_floor

_POSITIONS = 2001
"""Positions at which two models are compared."""


@dataclass(frozen=True)
class Stroke:
    """Two models along one stroke, at the positions that both were identified on."""

    name: str
    """press or release; empty where neither model tells them apart"""
    position: Float1D
    """(n,) [m or rad]"""
    first: Float1D
    """(n,) force of the first model [N or N*m]"""
    second: Float1D
    """(n,) force of the second model"""
    perceptible: Float1D
    """(n,) the force difference that is just noticeable"""

    @property
    def worst(self) -> float:
        """Largest difference as a share of what is just noticeable: below 1 nobody feels it."""
        return float(np.max(np.abs(self.second - self.first) / self.perceptible))


def compare(first: Model, second: Model) -> tuple[Stroke, ...]:
    """Compare the forces of two models over the positions that both were identified on.

    Just noticeable is 7 % of the first model's local force, or 1 % of its largest force where that is more.

    Parameters
    ----------
    first, second : Model
        Models of one position, in the same units.

    Returns
    -------
    tuple of Stroke
        Press and release where one of the models tells them apart, else one.

    Raises
    ------
    InputError
        A model has several inputs, the units differ, or there is no position that both know.
    """
    for model in (first, second):
        if model.dimension > 1:
            raise InputError(
                f"a model over {' and '.join(model.inputs)} has several inputs: two models are laid beside "
                "each other along one position"
            )
    if dict(first.units) != dict(second.units):
        raise InputError(f"the models have different units, {first.units} and {second.units}")
    lower = max(float(first.lower[0]), float(second.lower[0]))
    upper = min(float(first.upper[0]), float(second.upper[0]))
    if lower >= upper:
        raise InputError(
            f"the models share no position: one ends at {upper:.6g}, the other begins at {lower:.6g}"
        )
    position = np.linspace(lower, upper, _POSITIONS)
    directions = {"press": 1, "release": -1} if first.hysteretic or second.hysteretic else {"": 1}
    strokes = []
    for name, direction in directions.items():
        one, two = (model.force(position, direction=direction) for model in (first, second))
        perceptible = np.maximum(FORCE_JND * np.abs(one), force_floor(one))
        strokes.append(Stroke(name, position, one, two, perceptible))
    return tuple(strokes)

# SPDX-License-Identifier: Apache-2.0
"""Error metrics of series and models: RMS errors, residual structure, and the share below the JND."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .._typing import Float1D
from ..errors import InputError
from ..model import Model
from ..verdict import FORCE_FLOOR, FORCE_JND

STIFFNESS_JND = 0.23
"""Just noticeable difference of stiffness, as a share of the stiffness (Jones and Hunter 1990: about 23
%)."""

STIFFNESS_CELLS = 20
"""Number of equal cells over the range of positions in which a local stiffness is computed."""

_LEAST_CELL_ROWS = 5
"""Least number of rows of a cell from which a local stiffness is computed."""


def root_mean_square(values: Float1D) -> float:
    """Returns the RMS of the values in their unit."""
    return float(np.sqrt(np.mean(np.square(values))))


def normalised(rmse: float, reference: Float1D) -> float:
    """Returns the NRMSE: `rmse` over the population standard deviation of the reference.

    For a constant reference the result is 0 without error, else infinity.
    """
    spread = float(np.std(reference))
    if spread == 0:
        return 0.0 if rmse == 0 else np.inf
    return rmse / spread


def autocorrelation(residual: Float1D, lags: int) -> Float1D:
    """Returns sum e_k e_{k+j} / sum e_k^2 for the lags j = 1 to `lags`: (lags,), 0 for white residuals."""
    power = float(residual @ residual)
    if power == 0:
        return np.zeros(lags)
    return np.array([float(residual[:-lag] @ residual[lag:]) / power for lag in range(1, lags + 1)])


def lag_one_autocorrelation(residual: Float1D) -> float:
    """Returns sum e_k e_{k+1} / sum e_k^2: 0 for white residuals, near 1 if adjacent errors are similar."""
    return float(autocorrelation(residual, 1)[0])


def durbin_watson(residual: Float1D) -> float:
    """Returns sum (e_k - e_{k-1})^2 / sum e_k^2 (Durbin and Watson 1950).

    It is 2 for white residuals, and tends to 0 if adjacent errors are similar.
    """
    power = float(residual @ residual)
    return 2.0 if power == 0 else float(np.sum(np.diff(residual) ** 2)) / power


def force_floor(force: Float1D) -> float:
    """Returns the smallest just noticeable difference of a recorded force, 1 % of its largest |force|, in
    its unit."""
    return FORCE_FLOOR * float(np.abs(force).max())


def within_force_jnd(reference: Float1D, error: Float1D) -> NDArray[np.bool_]:
    """Returns True for samples with an error of at most 7 % of the local force, or at most the
    smallest just noticeable difference."""
    allowed = np.maximum(FORCE_JND * np.abs(reference), force_floor(reference))
    return np.asarray(np.abs(error) <= allowed)


def share_within_force_jnd(reference: Float1D, error: Float1D) -> float:
    """Returns the share of the samples of `within_force_jnd`."""
    return float(np.mean(within_force_jnd(reference, error)))


def force_jnd_band(force: Float1D, floor: float) -> tuple[Float1D, Float1D]:
    """Returns the lowest and the highest recorded force that a hand does not distinguish from a force.

    A recorded force F is in the band of the force f if |f - F| is at most 7 % of |F|, or at most `floor`, the
    smallest just noticeable difference.
    """
    ends = force / (1.0 + FORCE_JND), force / (1.0 - FORCE_JND), force - floor, force + floor
    return np.min(ends, axis=0), np.max(ends, axis=0)


def share_within_stiffness_jnd(position: Float1D, reference: Float1D, error: Float1D) -> float | None:
    """Returns the share of position cells whose stiffness is within 23 % of the reference.

    The stiffness of a cell is its least-squares slope of force over position. A difference that changes the
    force by less than the force floor across a cell counts as within. None if no cell has enough rows.

    Parameters
    ----------
    position : (n,) array
        Positions of the rows of one stroke, in any order.
    reference, error : (n,) array
        Reference force, and the compared force minus it.
    """
    width = np.ptp(position) / STIFFNESS_CELLS
    if width == 0:
        return None
    cell = np.minimum(((position - position.min()) / width).astype(int), STIFFNESS_CELLS - 1)
    floor = force_floor(reference) / width

    def cell_sums(values: Float1D) -> Float1D:
        sums: Float1D = np.bincount(cell, weights=values, minlength=STIFFNESS_CELLS).astype(np.float64)
        return sums

    rows = cell_sums(np.ones_like(position))
    centre = cell_sums(position) / np.maximum(rows, 1)
    offset = position - centre[cell]
    spread = cell_sums(offset**2)
    usable = (rows >= _LEAST_CELL_ROWS) & (spread > 0)
    if not usable.any():
        return None
    stiffness = cell_sums(offset * reference)[usable] / spread[usable]
    difference = cell_sums(offset * error)[usable] / spread[usable]
    return float(np.mean(np.abs(difference) <= np.maximum(STIFFNESS_JND * np.abs(stiffness), floor)))


_COMPARED_POSITIONS = 2001
"""Number of positions at which two models are compared."""


@dataclass(frozen=True)
class Stroke:
    """Forces of two models along one stroke, at positions in the domains of both models."""

    name: str
    """Name of the stroke, press or release; empty if neither model distinguishes press and release"""
    position: Float1D
    """(n,) positions at which the forces of both models are computed [m or rad]"""
    first: Float1D
    """(n,) force of the first model [N or N*m]"""
    second: Float1D
    """(n,) force of the second model [N or N*m]"""
    perceptible: Float1D
    """(n,) just noticeable difference of the force [N or N*m]"""

    @property
    def worst(self) -> float:
        """Largest force difference divided by the just noticeable difference [-]; below 1 a hand cannot feel
        the difference."""
        return float(np.max(self._noticed))

    @property
    def worst_position(self) -> float:
        """Position of this difference [m or rad]"""
        return float(self.position[np.argmax(self._noticed)])

    @property
    def worst_difference(self) -> float:
        """This difference, second minus first force [N or N*m]"""
        return float((self.second - self.first)[np.argmax(self._noticed)])

    @property
    def noticed_share(self) -> float:
        """Share of the travel on which a hand feels the difference [-]"""
        return float(np.mean(self._noticed > 1.0))

    @property
    def _noticed(self) -> Float1D:
        return np.abs(self.second - self.first) / self.perceptible


def compare(first: Model, second: Model) -> tuple[Stroke, ...]:
    """Compares the forces of two models over the common part of their domains.

    The JND is 7 % of the local force of the first model, but at least 1 % of its largest force.

    Parameters
    ----------
    first, second : Model
        Models of one position, in the same units.

    Returns
    -------
    tuple of Stroke
        Press and release if one of the models distinguishes these strokes, else one stroke.

    Raises
    ------
    InputError
        A model has several inputs, the units differ, or the domains do not overlap.
    """
    for model in (first, second):
        if model.dimension > 1:
            raise InputError(
                f"the inputs of a model are {' and '.join(model.inputs)}: must be position only for a "
                "comparison"
            )
    if dict(first.units) != dict(second.units):
        raise InputError(f"the units of the models are {first.units} and {second.units}: must be equal")
    lower = max(float(first.lower[0]), float(second.lower[0]))
    upper = min(float(first.upper[0]), float(second.upper[0]))
    if lower >= upper:
        raise InputError(
            f"the domains of the models have no common position: one ends at {upper:.6g}, the other begins "
            f"at {lower:.6g}"
        )
    position = np.linspace(lower, upper, _COMPARED_POSITIONS)
    directions = {"press": 1, "release": -1} if first.hysteretic or second.hysteretic else {"": 1}
    strokes = []
    for name, direction in directions.items():
        one, two = (model.force(position, direction=direction) for model in (first, second))
        perceptible = np.maximum(FORCE_JND * np.abs(one), force_floor(one))
        strokes.append(Stroke(name, position, one, two, perceptible))
    return tuple(strokes)

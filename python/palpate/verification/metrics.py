# SPDX-License-Identifier: Apache-2.0
"""Error metrics of series and models: RMS errors, residual structure, and the share below the JND."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .._typing import Float1D, Int8Vector
from ..errors import InputError
from ..model import Model
from ..recording.units import Unit
from ..verdict import FORCE_FLOOR, FORCE_JND, Finding, force_jnd, usable

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
    return np.asarray(np.abs(error) <= force_jnd(reference, force_floor(reference)))


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


NOTICED_SHARE = 0.05
"""Share of the travel above which a difference that a hand feels is a finding [-]. A model and a further
recording of its object differ by as much on at most 1 % of the travel (domes, silicones)."""

_COMPARED_POSITIONS = 2001
"""Number of positions at which two models are compared."""


@dataclass(frozen=True)
class Stroke:
    """Two forces along one stroke: those of two models, or the mean ones of a recording and a model."""

    name: str
    """Name of the stroke: press or release; empty if these are not distinguished"""
    position: Float1D
    """(n,) positions of the forces [m or rad]"""
    first: Float1D
    """(n,) force of the first model or the recording [N or N*m]"""
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

    def noticed(self, position: Unit, force: Unit) -> str:
        """Returns where a hand feels how much of the difference, in these units."""
        stroke = f" of the {self.name}" if self.name else ""
        where = f"on {self.noticed_share:.0%} of the travel{stroke}" if self.worst > 1.0 else "nowhere"
        return (
            f"{where}: up to {self.worst:.3g} just noticeable differences, "
            f"{force.text(self.worst_difference)} at {position.text(self.worst_position)}"
        )


def most_noticed(strokes: Sequence[Stroke]) -> Stroke:
    """Returns the stroke on most of whose travel a hand feels the difference."""
    return max(strokes, key=lambda each: (each.noticed_share, each.worst))


def noticed_findings(strokes: Sequence[Stroke], position: Unit, force: Unit) -> tuple[Finding, ...]:
    """Returns a finding if a hand feels the difference on more than `NOTICED_SHARE` of the travel."""
    stroke = most_noticed(strokes)
    if stroke.noticed_share <= NOTICED_SHARE:
        return ()
    return (usable(f"a hand feels the difference {stroke.noticed(position, force)}"),)


def mean_forces(
    position: Float1D, side: Float1D | Int8Vector | None, reference: Float1D, force: Float1D
) -> tuple[Stroke, ...]:
    """Returns recorded and modelled force of each stroke as means over `STIFFNESS_CELLS` cells of the
    positions, which have less noise than the rows.

    Parameters
    ----------
    position, reference, force : (n,) array
        Position, recorded and modelled force of the rows.
    side : (n,) array, optional
        Positive in the press, negative in the release, 0 in neither: such rows are left out if others have a
        direction.
    """
    signs = np.zeros(len(position), dtype=np.int8) if side is None else np.sign(side).astype(np.int8)
    names = {0: "", 1: "press", -1: "release"}
    width = float(np.ptp(position)) or 1.0
    scaled = STIFFNESS_CELLS * (position - position.min()) / width
    cell = np.minimum(scaled.astype(int), STIFFNESS_CELLS - 1)
    strokes = []
    for sign in np.unique(signs[signs != 0] if signs.any() else signs).tolist():
        of_stroke = signs == sign
        rows = np.bincount(cell[of_stroke])
        sums = [np.bincount(cell[of_stroke], each[of_stroke]) for each in (position, reference, force)]
        at, recorded, modelled = (each[rows > 0] / rows[rows > 0] for each in sums)
        perceptible = force_jnd(recorded, force_floor(reference))
        strokes.append(Stroke(names[sign], at, recorded, modelled, perceptible))
    return tuple(strokes)


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
        strokes.append(Stroke(name, position, one, two, force_jnd(one, force_floor(one))))
    return tuple(strokes)

# SPDX-License-Identifier: Apache-2.0
"""How far one series is from another, whether the rest is noise, and which share of it a hand notices."""

from __future__ import annotations

import numpy as np

from .._typing import Float1D
from ..verdict import FORCE_FLOOR, FORCE_JND

STIFFNESS_JND = 0.23
"""Share of a stiffness by which another must differ (Jones and Hunter 1990: about 23 %)."""

STIFFNESS_CELLS = 20
"""Cells of equal width, over the range of positions, in which a local stiffness is taken."""

_CELL_ROWS = 5
"""Rows that a cell needs for its stiffness."""


def root_mean_square(values: Float1D) -> float:
    """RMS of the values, in their unit."""
    return float(np.sqrt(np.mean(np.square(values))))


def normalised(rmse: float, reference: Float1D) -> float:
    """NRMSE: `rmse` over the population standard deviation of the reference.

    A reference that does not vary has no spread to compare with: the result is then 0 for no error, else
    infinity.
    """
    spread = float(np.std(reference))
    if spread == 0:
        return 0.0 if rmse == 0 else np.inf
    return rmse / spread


def lag_one_autocorrelation(residual: Float1D) -> float:
    """sum e_k e_{k+1} / sum e_k^2: 0 for white residuals, towards 1 where neighbours err alike."""
    power = float(residual @ residual)
    return 0.0 if power == 0 else float(residual[:-1] @ residual[1:]) / power


def durbin_watson(residual: Float1D) -> float:
    """sum (e_k - e_{k-1})^2 / sum e_k^2 (Durbin and Watson 1950): 2 for white residuals, towards 0 where
    neighbours err alike."""
    power = float(residual @ residual)
    return 2.0 if power == 0 else float(np.sum(np.diff(residual) ** 2)) / power


def force_floor(force: Float1D) -> float:
    """The absolute floor for a recording of this force, in the force's unit."""
    return FORCE_FLOOR * float(np.abs(force).max())


def share_within_force_jnd(reference: Float1D, error: Float1D) -> float:
    """Share of samples whose error stays below 7 % of the local reference force, or below the floor."""
    allowed = np.maximum(FORCE_JND * np.abs(reference), force_floor(reference))
    return float(np.mean(np.abs(error) <= allowed))


def share_within_stiffness_jnd(position: Float1D, reference: Float1D, error: Float1D) -> float | None:
    """Share of cells along the position whose stiffness is within 23 % of the reference's.

    A cell's stiffness is the least-squares slope of force over position in it. A difference that changes the
    force by less than the force floor across a cell counts as within. None where no cell holds enough rows.

    Parameters
    ----------
    position : (n,) array
        Rows of one stroke, in any order.
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
    usable = (rows >= _CELL_ROWS) & (spread > 0)
    if not usable.any():
        return None
    stiffness = cell_sums(offset * reference)[usable] / spread[usable]
    difference = cell_sums(offset * error)[usable] / spread[usable]
    return float(np.mean(np.abs(difference) <= np.maximum(STIFFNESS_JND * np.abs(stiffness), floor)))

# SPDX-License-Identifier: Apache-2.0
"""Parts of a recording whose forces differ at the same positions."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..._typing import Float1D, Float2D
from ...verdict import Finding, usable
from .cells import LEAST_COMPARED_ROWS, Checked

if TYPE_CHECKING:
    from ..recording import Recording


def changed_force(
    checked: Checked, *, blocks: int, explained_share: float, distance_share: float, place_cells: float
) -> list[Finding]:
    """Returns a finding if the force at equal positions differs between two parts of a recording.

    Parameters
    ----------
    blocks : int
        Number of equal blocks of rows; a change is searched only at their edges.
    explained_share : float
        Least share of the scatter that the two parts explain [-]: the scatter is the sum of squared
        differences of the force from its mean at the same position.
    distance_share : float
        Least RMS difference of the parts over the standard deviation of the force [-].
    place_cells : float
        Largest distance of the mean positions of the parts in a position cell that is compared [cells].
    """
    recording, cells = checked.recording, checked.cells
    if cells is None or checked.of_motion:
        return []
    total, spread = float(np.sum(cells.residual**2)), float(np.std(recording.force))
    if not total > 0.0 or not spread > 0.0:
        return []
    width = 2 * cells.cells
    code = cells.row * blocks // len(recording) * width + cells.cell

    def sums(values: Float1D | None) -> Float2D:
        table = np.bincount(code, values, blocks * width).reshape(blocks, width)
        return table.cumsum(axis=0, dtype=np.float64)

    count, force, place = sums(None), sums(cells.residual), sums(cells.place)
    before, after = count[:-1], count[-1] - count[:-1]
    one, other = np.maximum(before, 1.0), np.maximum(after, 1.0)
    force_difference = force[:-1] / one - (force[-1] - force[:-1]) / other
    place_difference = place[:-1] / one - (place[-1] - place[:-1]) / other
    compared = (
        (before >= LEAST_COMPARED_ROWS)
        & (after >= LEAST_COMPARED_ROWS)
        & (np.abs(place_difference) <= place_cells)
    )
    explained = np.where(compared, before * after / (one + other) * force_difference**2, 0.0).sum(axis=1)
    best = int(np.argmax(explained))
    shared = compared[best]
    if not shared.any():
        return []
    rows = (before[best] + after[best])[shared]
    distance = float(np.sqrt(np.average(force_difference[best][shared] ** 2, weights=rows)))
    if explained[best] < explained_share * total or distance < distance_share * spread:
        return []
    split = (best + 1) * len(recording) // blocks
    moving = np.split(cells.row, [np.searchsorted(cells.row, split)])
    parts = " before it, ".join(_motion(recording, rows) for rows in moving)
    return [
        usable(
            f"near row {split} the force at the same position and stroke changes by "
            f"{recording.file_unit('force').text(distance)}, {distance / spread:.0%} of its spread. The tool "
            f"reaches {parts} after it: if these are equal, the object or its zero changed, else the force "
            "may depend on speed or depth. Identify each part separately with "
            f"--rows 0:{split} and --rows {split}:{len(recording)}"
        )
    ]


def _motion(recording: Recording, rows: NDArray[np.intp]) -> str:
    """Returns the largest position of some rows and, with time, their median speed, as text."""
    unit = recording.file_unit("position")
    deepest = unit.text(float(recording.position[rows].max()))
    if recording.time is None:
        return deepest
    speed = np.abs(np.gradient(recording.position, recording.time))[rows]
    return f"{deepest} at {unit.text(float(np.median(speed)))}/s"

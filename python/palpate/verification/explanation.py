# SPDX-License-Identifier: Apache-2.0
"""Likely causes of a large error: a unit, a sign or an offset between a model and a recording."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from .._typing import Float1D
from ..model import Model
from ..recording import Recording
from ..recording.units import UNITS, Unit
from .metrics import normalised, root_mean_square
from .prediction import Prediction

REPORTED_NRMSE_RATIO = 0.5
"""Largest ratio of the NRMSE with a changed recording to the NRMSE of the unchanged recording, at which the
change is reported [-]."""

EQUIVALENT_NRMSE_RATIO = 1.2
"""Largest ratio of the NRMSE of a simpler explanation to the least NRMSE of all explanations, at which the
simpler one is preferred [-]."""

FACTOR_TOLERANCE = 0.02
"""Largest relative difference of a fitted factor from the factor between two units, at which a wrong unit is
reported [-]."""

OFFSETS_PER_GRID = 41
"""Number of position offsets on one grid that are tried as the cause of a large error."""

OFFSET_GRIDS = 3
"""Number of grids of position offsets, each finer than the previous one."""

MOST_ROWS = 2000
"""Largest number of rows on which possible causes of an error are compared: enough to distinguish them."""


@dataclass(frozen=True)
class Explanation:
    """Change of a recording after which the model may fit the recording."""

    nrmse: float
    sentence: str
    order: int
    """Rank of the explanation; the simplest explanation has the lowest rank"""


def explanation(model: Model, recording: Recording, prediction: Prediction) -> Explanation | None:
    """Returns the simplest change of the recording that more than halves the error, or None.

    The changes are: the sign of the force, press and release exchanged, the sign of the position, an offset
    of the force, another unit of force or position, an offset of the position, and a factor of the force.
    None for a model with memory.
    """
    if model.memory is not None:  # a changed position also changes the forces at later times
        return None
    index = np.flatnonzero(prediction.rows)
    few = slice(None, None, max(1, -(-len(index) // MOST_ROWS)))
    force, modelled = recording.force[index][few], prediction.force[few]
    if float(np.std(force)) == 0.0:
        return None
    nrmse = _share(modelled - force, force)
    unit = recording.file_unit("force") if recording.units["force"] else Unit.of_si(model.units["force"])
    tried = [*_of_force(force, modelled, unit)]
    if model.dimension == 1 and model.mass is None and model.damping is None:
        side = None if prediction.side is None else prediction.side[few]
        tried += _of_position(model, prediction.position[few], side, force, recording)
    found = [each for each in tried if each.nrmse < REPORTED_NRMSE_RATIO * nrmse]
    least = min((each.nrmse for each in found), default=0.0)
    return min(
        (each for each in found if each.nrmse <= EQUIVALENT_NRMSE_RATIO * least),
        key=lambda each: each.order,
        default=None,
    )


def _share(error: Float1D, force: Float1D) -> float:
    return normalised(root_mean_square(error), force)


def _of_force(force: Float1D, modelled: Float1D, unit: Unit) -> Iterator[Explanation]:
    """Yields changes of the recorded force: opposite sign, an offset, a factor."""
    yield Explanation(
        _share(modelled + force, force),
        "the model fits with the opposite sign of the recorded force: give --negate force",
        order=0,
    )
    offset = float(np.mean(force - modelled))
    yield Explanation(
        _share(modelled - (force - offset), force),
        f"the model fits if {unit.text(offset)} is subtracted from the recorded force: the sensor may "
        "have an offset. Give --zero START:STOP, the rows without contact",
        order=2,
    )
    factor = float(modelled @ force) / float(force @ force)
    if factor == 0.0 or float(np.std(modelled)) == 0.0:
        return
    known = _unit_of(factor, unit.si)
    cause = f"{known}. Give its unit with --units" if known else "the gain may differ"
    yield Explanation(
        _share(modelled - factor * force, modelled),
        f"the model fits if the recorded force is multiplied by {factor:.4g}: {cause}",
        order=3 if known else 6,
    )


def _of_position(
    model: Model, position: Float1D, side: Float1D | None, force: Float1D, recording: Recording
) -> Iterator[Explanation]:
    """Yields changes of the recorded direction (press and release exchanged) and position (opposite sign,
    unit, offset)."""

    def left(at: Float1D, s: Float1D | None) -> float:
        modelled = model.force(at) if s is None else model.force(at, direction=s)
        error = _share(modelled - force, force)
        return error if np.isfinite(error) else np.inf

    unit = recording.units["position"] or model.units["position"]
    if side is not None:
        yield Explanation(
            left(position, -side),
            "the model fits with press and release exchanged: check the words of the direction column",
            order=0,
        )
    yield Explanation(
        left(-position, None if side is None else -side),
        "the model fits with the opposite sign of the recorded position: give --negate position",
        order=1,
    )
    for symbol, other in UNITS.items():
        if other.si == unit and other.factor != 1.0:
            for factor, cause in (
                (other.factor, f"it may be in {symbol}"),
                (1.0 / other.factor, f"it may be in {unit}, not in {symbol}"),
            ):
                yield Explanation(
                    left(factor * position, side),
                    f"the model fits if the recorded position is multiplied by {factor:.4g}: {cause}. Give "
                    "its unit with --units",
                    order=4,
                )
    # Search the position offset on a grid over the travel, then on finer grids around the best offset.
    best, step = 0.0, 2.0 * float(model.upper[0] - model.lower[0]) / (OFFSETS_PER_GRID - 1)
    for _ in range(OFFSET_GRIDS):
        grid = best + step * (np.arange(OFFSETS_PER_GRID) - OFFSETS_PER_GRID // 2)
        best = float(min(grid, key=lambda shift: left(position + shift, side)))
        step *= 4.0 / (OFFSETS_PER_GRID - 1)
    yield Explanation(
        left(position + best, side),
        f"the model fits if {recording.file_unit('position').text(abs(best))} is "
        f"{'added to' if best > 0.0 else 'subtracted from'} the recorded position: the zero of the "
        "position may have moved. Correct the positions in the file",
        order=5,
    )


def _unit_of(factor: float, unit: str) -> str | None:
    """Returns the mistaken unit that a factor corrects, in words, or None."""
    for symbol, other in UNITS.items():
        if other.si == unit and other.factor != 1.0:
            if abs(factor / other.factor - 1.0) < FACTOR_TOLERANCE:
                return f"it may be in {symbol}"
            if abs(factor * other.factor - 1.0) < FACTOR_TOLERANCE:
                return f"it may be in {unit}, not in {symbol}"
    return None

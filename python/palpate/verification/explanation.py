# SPDX-License-Identifier: Apache-2.0
"""Likely causes of an error: a unit, a sign, an offset or a delay between a model and a recording."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .._typing import Float1D
from ..identification.classes.findings import USABLE_NRMSE
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
"""Number of position offsets, or of delays, on one grid that are tried as the cause of an error."""

OFFSET_GRIDS = 3
"""Number of grids, each finer than the previous one."""

MOST_ROWS = 2000
"""Largest number of rows on which possible causes of an error are compared: enough to distinguish them."""


@dataclass(frozen=True)
class Explanation:
    """Change of a recording after which the model fits the recording."""

    nrmse: float
    sentence: str
    order: int
    """Rank of the explanation; the simplest explanation has the lowest rank"""


def explanation(model: Model, recording: Recording, prediction: Prediction) -> Explanation | None:
    """Returns the simplest change of the recording with which the model fits it, or None.

    The model fits if the change more than halves the error and the verdict accepts the rest. Changes of the
    force are another sign, unit, offset, factor or delay. Changes of the position are another sign, also with
    that of the force, another unit, an offset, and press and release exchanged. A model with memory has none.
    """
    if model.memory is not None:  # a changed position also changes the forces at later times
        return None
    index = np.flatnonzero(prediction.rows)
    few = slice(None, None, max(1, -(-len(index) // MOST_ROWS)))
    index = index[few]
    force, modelled = recording.force[index], prediction.force[few]
    if float(np.std(force)) == 0.0:
        return None
    nrmse = _share(modelled - force, force)
    unit = recording.file_unit("force") if recording.units["force"] else Unit.of_si(model.units["force"])
    tried = [*_of_force(force, modelled, unit)]
    if model.dimension == 1 and model.mass is None and model.damping is None:
        side = None if prediction.side is None else prediction.side[few]
        tried += _of_position(model, prediction.position[few], side, index, recording)
    largest = min(USABLE_NRMSE, REPORTED_NRMSE_RATIO * nrmse)
    found = [each for each in tried if each.nrmse < largest]
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
        order=3 if known else 7,
    )


def _of_position(
    model: Model, position: Float1D, side: Float1D | None, index: NDArray[np.intp], recording: Recording
) -> Iterator[Explanation]:
    """Yields changes of the recorded direction (press and release exchanged), position (opposite sign, unit,
    offset) and time of the force, for the rows `index`."""
    force = recording.force[index]

    def left(at: Float1D, s: Float1D | None = side, of: Float1D = force) -> float:
        modelled = model.force(at) if s is None else model.force(at, direction=s)
        error = _share(modelled - of, of)
        return error if np.isfinite(error) else np.inf

    unit = recording.units["position"] or model.units["position"]
    turned = None if side is None else -side
    if side is not None:
        yield Explanation(
            left(position, turned),
            "the model fits with press and release exchanged: check the words of the direction column",
            order=0,
        )
    yield Explanation(
        left(-position, turned),
        "the model fits with the opposite sign of the recorded position: give --negate position",
        order=1,
    )
    yield Explanation(
        left(-position, turned, -force),
        "the model fits with the opposite signs of the recorded position and force: give --negate position "
        "--negate force",
        order=1,
    )
    for symbol, other in UNITS.items():
        if other.si == unit and other.factor != 1.0:
            for factor, cause in (
                (other.factor, f"it may be in {symbol}"),
                (1.0 / other.factor, f"it may be in {unit}, not in {symbol}"),
            ):
                yield Explanation(
                    left(factor * position),
                    f"the model fits if the recorded position is multiplied by {factor:.4g}: {cause}. Give "
                    "its unit with --units",
                    order=4,
                )
    travel = float(model.upper[0] - model.lower[0])
    offset, error = _least(lambda offset: left(position + offset), 2.0 * travel / (OFFSETS_PER_GRID - 1))
    yield Explanation(
        error,
        f"the model fits if {recording.file_unit('position').text(abs(offset))} is "
        f"{'added to' if offset > 0.0 else 'subtracted from'} the recorded position: the zero of the "
        "position may have moved. Correct the positions in the file",
        order=5,
    )
    if recording.time is not None:
        time, moved = recording.time, recording.position

        def late(delay: float) -> float:
            earlier = np.interp(time[index] - delay, time, moved) - moved[index]
            return left(position + earlier) if delay >= 0.0 else np.inf

        delay, error = _least(late, float(np.median(np.diff(time))))
        yield Explanation(
            error,
            f"the model fits if the recorded force is {delay:.3g} s late: give --force-late-s {delay:.3g}",
            order=6,
        )


def _least(error: Callable[[float], float], step: float) -> tuple[float, float]:
    """Returns the change with the least error, and this error: from a grid about zero with this step, then
    from finer grids about the best change."""
    best = 0.0
    for _ in range(OFFSET_GRIDS):
        grid = best + step * (np.arange(OFFSETS_PER_GRID) - OFFSETS_PER_GRID // 2)
        best = float(min(grid, key=error))
        step *= 4.0 / (OFFSETS_PER_GRID - 1)
    return best, error(best)


def _unit_of(factor: float, unit: str) -> str | None:
    """Returns the mistaken unit that a factor corrects, in words, or None."""
    for symbol, other in UNITS.items():
        if other.si == unit and other.factor != 1.0:
            if abs(factor / other.factor - 1.0) < FACTOR_TOLERANCE:
                return f"it may be in {symbol}"
            if abs(factor * other.factor - 1.0) < FACTOR_TOLERANCE:
                return f"it may be in {unit}, not in {symbol}"
    return None

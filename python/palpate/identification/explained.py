# SPDX-License-Identifier: Apache-2.0
"""Share of the force that position can explain at all, estimated from rows at neighbouring positions.

Rows at the same position and direction that differ in force differ for a reason that no force over position
holds: time (relaxation, drift), velocity, another input, or noise. The estimate is that of Gasser, Sroka and
Jennen-Steinmetz (1986): each force less the line between its two neighbours in position.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .._typing import Float1D
from ..verdict import Finding, no, usable
from .judgement import UNFIT_NRMSE, USABLE_NRMSE

MOST_OF_THE_ERROR = 0.5
"""Part of a model's mean square error that position cannot explain, from which wavelets stay wide [-]"""

WORTH_A_FINDING = 0.25
"""The same part, from which a finding says so [-]"""

CAUSE = 0.4
"""Part of the residual's variance that a cause must explain to be named [-]"""

BLOCKS = 40
"""Stretches of the recording whose mean residuals show a dependence on time."""

PARTS = 8
"""Parts of the travel, in each of which the residual may depend differently on the direction of motion."""

MOST_ROWS = 50_000
"""Rows, evenly spread, that are enough to estimate a share."""


def unexplained_variance(position: Float1D, force: Float1D, side: Float1D | None = None) -> float:
    """Variance of the force (n,) between neighbours in position (n,), of one stroke where side is given.

    Rows are in recorded order. A row between its own predecessor and successor counts as explained.
    """
    shuffled = np.random.default_rng(0).permutation(len(position))  # equal positions: neighbours at any time
    position, force = position[shuffled], force[shuffled]
    keys = (position,) if side is None else (position, side[shuffled])
    order = np.lexsort(keys)
    x, y = position[order], force[order]
    whole = x[2:] - x[:-2]
    right = np.divide(x[1:-1] - x[:-2], whole, out=np.full(len(whole), 0.5), where=whole > 0.0)
    inner = np.ones(len(whole), dtype=bool)
    if side is not None:
        strokes = side[shuffled][order]
        inner = (strokes[2:] == strokes[1:-1]) & (strokes[1:-1] == strokes[:-2])
    right = np.clip(right, 0.0, 1.0)[inner]
    between = (1.0 - right) * y[:-2][inner] + right * y[2:][inner]
    apart = y[1:-1][inner] - between
    # rows of one sweep, neighbours in the recording as well, differ by the structure of the force itself
    steps = np.abs(np.diff(shuffled[order]))
    swept = ((steps[1:] == 1) & (steps[:-1] == 1))[inner]
    variance = np.where(swept, 0.0, apart**2 / (1.0 + right**2 + (1.0 - right) ** 2))
    return float(np.mean(variance)) if len(apart) else 0.0


def unexplained_share(position: Float1D, force: Float1D, side: Float1D | None) -> float:
    """Share of the force's variance that position, and the sign of side, cannot explain [-]."""
    rows, spread = _thinned(force), float(np.var(force))
    side = None if side is None else np.sign(side[rows])
    return unexplained_variance(position[rows], force[rows], side) / spread if spread > 0.0 else 0.0


def enough(nrmse: float) -> float:
    """Share that cannot be explained from which it is most of a model's error."""
    return MOST_OF_THE_ERROR * nrmse**2


def _thinned(values: Float1D) -> slice:
    """Rows, evenly spread, that are enough."""
    return slice(None, None, max(1, len(values) // MOST_ROWS))


def likely_cause(position: Float1D, residual: Float1D) -> tuple[str, str]:
    """Likely cause of a residual (n,) at positions (n,) in recorded order, and the cure."""
    part = np.argsort(np.argsort(position, kind="stable"), kind="stable") * PARTS // len(position)
    ahead = np.sign(np.gradient(position))
    by_direction = _explained(residual, 3 * part + ahead.astype(np.intp) + 1) - _explained(residual, part)
    in_time = _explained(residual, np.arange(len(residual)) * BLOCKS // len(residual))
    if max(by_direction, in_time) < CAUSE:
        return (
            "another input (a second position, a place on the object, velocity), or noise of the force",
            "record the other inputs as columns and name them with --inputs, or identify each place alone",
        )
    if by_direction >= in_time:
        return (
            "press and release differ",
            "record a direction or a time column, so that hysteresis can be identified",
        )
    return (
        "time: the force changes at a constant position (relaxation, creep or drift)",
        "record continuous strokes without pauses, or cut the pauses off",
    )


def _explained(values: Float1D, group: NDArray[np.intp]) -> float:
    """Share of the variance of values (n,) between groups (n,), less what chance gives."""
    _, index, count = np.unique(group, return_inverse=True, return_counts=True)
    mean = np.bincount(index, values) / count
    total = float(np.sum((values - values.mean()) ** 2))
    if total == 0.0:
        return 0.0
    between = float(count @ (mean - values.mean()) ** 2) / total
    return between - (len(count) - 1) / len(values)


def explained_findings(
    position: Float1D, force: Float1D, residual: Float1D, side: Float1D | None, nrmse: float
) -> list[Finding]:
    """A finding if most of a model's error is force that position cannot explain.

    Parameters
    ----------
    position, force, residual : (n,)
        Rows in recorded order, and what the model leaves of their force.
    side : (n,) or None
        Direction, where the model has hysteresis.
    nrmse : float
        Of the model.
    """
    rows = _thinned(force)
    spread = float(np.var(force))
    if nrmse <= USABLE_NRMSE or spread == 0.0:
        return []
    least = unexplained_share(position, force, side)
    if least < WORTH_A_FINDING * nrmse**2:
        return []
    judge = no if nrmse > UNFIT_NRMSE else usable
    share = max(0.0, 1.0 - least)
    what = "position explains" if side is None else "position and direction explain"
    cause, cure = likely_cause(position[rows], residual[rows])
    apart = float(np.sqrt(2.0 * least * spread))
    return [
        judge(
            f"{what} at most {share:.0%} of the force: rows at neighbouring positions differ by "
            f"{apart:.3g} RMS, so that no model of these inputs has an NRMSE below {np.sqrt(least):.2g}. "
            f"Likely cause: {cause}. Cure: {cure}"
        )
    ]

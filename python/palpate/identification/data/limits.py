# SPDX-License-Identifier: Apache-2.0
"""Limits of the information in rows: repeated rows, force steps and correlated noise.

A criterion that counts rows takes each of them as independent and exact. Held samples, a coarse converter and
correlated noise break this: then structure is fitted that is not there.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..._typing import Float1D, Float2D
from ...recording.motion import SIGNIFICANT_STANDARD_ERRORS
from ..options import IdentifyOptions

LEAST_GAIN = 0.25
"""Least share of the squared error that damping, mass, velocity as an input, or a memory must explain [-]:
these forces are harder to render and to certify. A longer period must explain it too: a straight line over
the travel, taken modulo at most half of it, explains no more."""

LEAST_LEVELS = 3
"""A force step is computed only for at least this number of distinct force values."""

ROWS_PER_LEVEL = 2.0
"""Least number of rows for each distinct force value [-]: equal differences of force values are then not a
coincidence."""

GRID_TOLERANCE = 0.02
"""Largest deviation of a force difference from a multiple of the force step [steps]."""

STEP_ERROR = 1.0 / 3.0
"""RMS error divided by the step of the recorded force, below which the step hides the error [-]; uniform
rounding errors have 1/sqrt(12)"""

LEAST_NOISE_EVENNESS = 0.8
"""Least ratio of the median to the RMS of residuals, 1 for normal noise, at which they are noise [-].
Residuals of an unfitted force are large at a few positions and small at others."""

LEAST_INDEPENDENT_SHARE = 0.02
"""Least share of the rows that count as independent if the noise of successive rows is correlated [-]. With a
smaller share the residual is not noise but memory or drift."""

MOST_COMPARED_ROWS = 20_000
"""Largest number of rows from which two models are compared or a correlation is computed: a share of their
squared error is then known to 1 %."""


def evenly_spread(rows: NDArray[np.intp]) -> NDArray[np.intp]:
    """Returns the given rows, or about `MOST_COMPARED_ROWS` of them, evenly spread."""
    return rows[:: max(1, -(-len(rows) // MOST_COMPARED_ROWS))]


@dataclass(frozen=True)
class RowLimits:
    """Limits of the information in the rows of a recording; by default rows are independent and exact."""

    independent: float = 1.0
    """Share of the rows that are independent (0, 1]"""
    force_error: float = 0.0
    """RMS error that the force step hides [force]; a criterion does not count smaller errors"""
    position_gap: float = 0.0
    """Gap between neighbouring positions that bounds the harmonics of a periodic force [share of the
    period]"""


NO_LIMITS = RowLimits()
"""Limits of the rows of a recording that are independent and exact."""

LEAST_EQUAL_REPEATS = 0.99
"""Least share of rows with the same number of copies, in a file that was joined from copies of one recording
[-]. Where two copies meet, the stroke of a row can change."""


def distinct_rows(table: NDArray[np.generic]) -> tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.intp]]:
    """Finds the distinct rows of a table (n, d), in sorted order.

    Returns the index of one row for each of them (k,), the number of the one that equals each row (n,), and
    the number of rows that equal each of them (k,).
    It sorts the columns, which is ten times faster than np.unique(table, axis=0).
    """
    order = np.lexsort(table.T[::-1])
    ordered = table[order]
    first = np.ones(len(table), dtype=bool)
    np.any(ordered[1:] != ordered[:-1], axis=1, out=first[1:])
    group = np.empty(len(table), dtype=np.intp)
    group[order] = np.cumsum(first) - 1
    start = np.flatnonzero(first)
    return order[start], group, np.diff(start, append=len(table))


def repeated(positions: Float2D, force: Float1D, side: Float1D | None) -> tuple[NDArray[np.bool_], str]:
    """Returns the rows (n,) that copy others, so that they are used once, and a note; no rows if few are
    copies: a file joined from copies of one recording has the same number of copies of each row."""
    columns = [*positions.T, force] if side is None else [*positions.T, force, side]
    again = np.zeros(len(force), dtype=bool)
    if 2 * len(np.unique(force)) <= len(force):  # sorting all columns takes longer
        chosen, _, count = distinct_rows(np.column_stack(columns))
        usual = int(np.median(count))
        if usual > 1 and np.mean(count == usual) > LEAST_EQUAL_REPEATS:
            again[:] = True
            again[chosen] = False
            return again, f"Each row occurs {usual} times in the data and is counted once."
    return again, ""


def force_step(force: Float1D) -> float:
    """Returns the step of a force whose values differ by multiples of one step; 0 if there is no such
    step."""
    levels = np.unique(force)
    if len(levels) < LEAST_LEVELS or len(levels) * ROWS_PER_LEVEL > len(force):
        return 0.0
    reach = float(levels[-1] - levels[0])
    steps = np.diff(levels)
    steps = steps[steps > 1e-9 * reach]
    least = float(steps.min())
    step = reach / max(round(reach / least), 1)
    away = np.abs(steps / step - np.rint(steps / step))
    return step if float(away.max()) <= GRID_TOLERANCE else 0.0


def standard_deviation(residual: Float1D) -> float:
    """Returns the standard deviation of normal residuals (n,), from the median of their absolute values."""
    return 1.4826 * float(np.median(np.abs(residual)))


def evenness(residual: Float1D) -> float:
    """Returns the ratio of :func:`standard_deviation` to the RMS of residuals (n,): 1 for normal noise, small
    if few positions cause the error, 0 without an error."""
    power = float(residual @ residual)
    return standard_deviation(residual) / float(np.sqrt(power / len(residual))) if power > 0.0 else 0.0


def neighbour_correlation(residual: Float1D) -> float:
    """Returns the correlation of neighbouring residuals (n,) in recorded order; 0 without residuals."""
    power = float(residual @ residual)
    return float(residual[1:] @ residual[:-1]) / power if power > 0.0 else 0.0


def correlation(residual: Float1D) -> float:
    """Returns the correlation of neighbouring residuals (n,) in recorded order; 0 if the correlation can be
    random, or can come from a force that the model does not fit."""
    if len(residual) < 2:
        return 0.0
    found = neighbour_correlation(residual)
    significant = found * float(np.sqrt(len(residual))) > SIGNIFICANT_STANDARD_ERRORS
    return found if significant and evenness(residual) >= LEAST_NOISE_EVENNESS else 0.0


def independent_share(rho: float) -> float:
    """Returns the share of independent samples of noise with correlation rho of neighbours: (1 - rho) / (1 +
    rho)."""
    return (1.0 - rho) / (1.0 + rho)


def innovation_deviance(residual: Float1D, n_parameters: int, least: float) -> float:
    """Returns the BIC of a model with residuals (n,), from the errors of predicting each residual by the
    previous one; a mean squared prediction error below `least` is replaced by `least`."""
    n, new = len(residual), residual[1:] - neighbour_correlation(residual) * residual[:-1]
    return n * float(np.log(max(float(new @ new) / n, least))) + n_parameters * float(np.log(n))


LARGE_OFFSET_RATIO = 1e3
"""Ratio of the mean force to the range of the force above which the mean is subtracted before the fit [-]."""

FIT_STEP = 2.0**-30
"""Step of the positions in the unit box and of the scaled forces of a fit: far below the step of a sensor,
far above a rounding error."""


def stepped(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Returns scaled positions or forces, rounded to whole steps of a fit.

    Recordings that differ by rounding errors, as those in other units or with other digits do, then have the
    same scaled values and get the same model. The search for wavelets would amplify the rounding errors.
    """
    return np.asarray(np.rint(values / FIT_STEP) * FIT_STEP)


@dataclass(frozen=True)
class ForceScale:
    """Scale of the force for the fit: the fit uses (force - offset) * factor, in whole steps."""

    offset: float = 0.0
    factor: float = 1.0

    @classmethod
    def of(cls, force: Float1D, options: IdentifyOptions) -> ForceScale:
        """Returns the scale of a force (n,): its range is 1 in the fit, or a constant force.

        A large mean would cost digits and is subtracted. The criterion "perceptual" compares errors with the
        local force, so that no offset is subtracted for it.
        """
        reach = float(np.ptp(force))
        mean = float(np.mean(force)) if reach > 0.0 and options.criterion != "perceptual" else 0.0
        offset = mean if abs(mean) > LARGE_OFFSET_RATIO * reach else 0.0
        return cls(offset, 1.0 / (reach or float(np.abs(force).max()) or 1.0))

    def scaled(self, force: Float1D) -> Float1D:
        """Returns the scaled force (n,) for the fit."""
        return stepped((force - self.offset) * self.factor)

    def scaled_options(self, options: IdentifyOptions) -> IdentifyOptions:
        """Returns the options with their forces and slopes in the scale of the fit."""
        factor = self.factor
        slopes, fixed, coupling = options.slope_bounds, options.fixed_force, options.coupling_stiffness
        return replace(
            options,
            slope_bounds=None if slopes is None else (slopes[0] * factor, slopes[1] * factor),
            fixed_force=None if fixed is None else (fixed[0], (fixed[1] - self.offset) * factor),
            coupling_stiffness=None if coupling is None else coupling * factor,
        )

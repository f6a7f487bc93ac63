# SPDX-License-Identifier: Apache-2.0
"""Error of the final network on the rows themselves, not on the cells that it was fitted to."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .._core.model import ForceModel
from .._typing import Float1D, Float2D
from ..verdict import Finding, no, usable
from .identified import IdentifiedNetwork
from .judgement import UNFIT_NRMSE, USABLE_NRMSE

DISAGREEMENT = 1.5
"""Ratio of the error on rows to the error on cells above which the cells were too wide [-]"""

WORTH_A_FINDING = 0.02
"""NRMSE on rows below which that ratio is not reported [-]"""

SAMPLED = 10_000
"""Rows, evenly spread, that show the spread of the force."""

EXTREME_SHARE = 0.01
"""Share of the rows, those with the most extreme forces, that must not decide the NRMSE alone [-]"""

LEAST_ROWS = 100
"""Rows below which one percent of them is no row."""

HIDDEN = 1.2
"""Ratio of the NRMSE without these rows to the reported NRMSE above which a finding says so [-]"""


BETWEEN_ROWS = 4001
"""Positions over the domain, beside the extrema of each wavelet, where the force between rows is computed."""

USABLE_BEYOND = 0.25
"""Share of the range of the recorded forces by which the model may exceed them without a finding [-].
Models of measured switches, domes and springs exceed it by less than 0.1."""

UNFIT_BEYOND = 1.0
"""The same, from which the model is unfit [-]."""


@dataclass(frozen=True)
class RowError:
    """Residuals of every row, with the samples that each stands for."""

    residual: Float1D
    """(n,) [force]"""
    force: Float1D
    """(n,)"""
    weight: Float1D
    """(n,) samples, 0 for a row that does not count"""
    within: float = 0.0
    """Sum of squares inside rows that stand for several samples [force^2]"""

    @property
    def rmse(self) -> float:
        """Root mean square error over the samples [force]."""
        total = float(self.weight.sum())
        return float(np.sqrt((self.weight @ self.residual**2 + self.within) / total)) if total else 0.0

    @property
    def nrmse(self) -> float:
        """rmse over the standard deviation of the force; 0 for a constant force."""
        spread = self.spread
        return self.rmse / spread if spread > 0.0 else 0.0

    @property
    def spread(self) -> float:
        """Standard deviation of the force over the samples [force]."""
        if not self.weight.any():
            return 0.0
        if np.all(self.weight == 1.0):
            return float(np.std(self.force))
        mean = np.average(self.force, weights=self.weight)
        return float(np.sqrt(np.average((self.force - mean) ** 2, weights=self.weight)))

    def findings(self) -> list[Finding]:
        """A finding if few rows of extreme force hide a large error of all others."""
        rows = np.flatnonzero(self.weight > 0.0)
        if len(rows) < LEAST_ROWS or self.spread == 0.0 or self._plainly_small(rows):
            return []
        far = np.abs(self.force[rows] - np.median(self.force[rows]))
        count = len(rows) - int(EXTREME_SHARE * len(rows))
        kept = rows[np.sort(np.argpartition(far, count - 1)[:count])]
        inner = RowError(self.residual[kept], self.force[kept], self.weight[kept])
        if inner.nrmse <= max(USABLE_NRMSE, HIDDEN * self.nrmse):
            return []
        judge = no if inner.nrmse > UNFIT_NRMSE else usable
        return [
            judge(
                f"the NRMSE is {self.nrmse:.3g} over all rows, but {inner.nrmse:.3g} without the "
                f"{EXTREME_SHARE:.0%} of most extreme force (|force| up to {np.abs(self.force).max():.3g}, "
                f"the others span {np.ptp(self.force[kept]):.3g}): few large forces hide the error of the "
                "others. If they are wrong readings, remove these rows or give --loss huber"
            )
        ]

    def _plainly_small(self, rows: NDArray[np.intp]) -> bool:
        """True if the error is small for the spread of all but the most extreme forces, of some rows (k,)."""
        some = self.force[rows[:: max(1, len(rows) // SAMPLED)]]
        low, high = np.quantile(some, (EXTREME_SHARE, 1.0 - EXTREME_SHARE))
        inner = some[(some >= low) & (some <= high)]
        return bool(self.rmse < 0.5 * USABLE_NRMSE * float(np.std(inner)))


def beyond_rows(network: IdentifiedNetwork, force: Float1D, *, repeats: bool) -> list[Finding]:
    """A finding if a model of one input leaves the range of the recorded forces between the rows.

    A stroke begins with a play of 2 r, in which no motion slides; a force that repeats has no such ends.
    """
    reach = float(np.ptp(force))
    if len(network.lower) > 1 or not reach > 0.0:
        return []
    lower, upper = float(network.lower[0]), float(network.upper[0])
    sides = np.array([0.0, -1.0, 1.0, -np.sqrt(3.0), np.sqrt(3.0)])
    extrema = (network.beta[:, :1] + sides / network.alpha[:, :1]).ravel()
    at = np.concatenate([np.linspace(lower, upper, BETWEEN_ROWS), np.clip(extrema, lower, upper)])
    directions = ("", "") if network.weight_hysteresis is None else (" while pressing", " while releasing")
    found = []
    play = 0.0 if repeats else min(2.0 * (network.play_radius or 0.0), upper - lower)
    ends = (lower + play, upper), (lower, upper - play)
    for sign, stroke, (first, last) in zip((1.0, -1.0), directions, ends, strict=True):
        x = at[(at >= first) & (at <= last)]
        side = None if network.weight_hysteresis is None else np.full(len(x), sign)
        values = modelled(network, x[:, None], side)
        excess = np.maximum(force.min() - values, values - force.max()) / reach
        worst = int(np.argmax(excess))
        found.append((float(excess[worst]), float(x[worst]), float(values[worst]), stroke))
    share, place, value, stroke = max(found)
    if share <= USABLE_BEYOND:
        return []
    judge = no if share > UNFIT_BEYOND else usable
    return [
        judge(
            f"between the rows the model's force reaches {value:.4g} at position {place:.4g}{stroke}, but "
            f"the recorded forces lie between {force.min():.4g} and {force.max():.4g}. Likely cause: few "
            "rows of that stroke near this position. Cure: record more strokes there, or give fewer "
            "--max-wavelets"
        )
    ]


def modelled(network: IdentifiedNetwork, positions: Float2D, side: Float1D | None) -> Float1D:
    """Force of the network at rows (n, d)."""
    two, model = network.weight_hysteresis is not None, ForceModel(**network.parameters())
    inside = np.clip(positions, network.lower, network.upper)
    if len(network.lower) > 1:
        return np.asarray(model.predict(inside))
    if not two or side is None:
        return np.asarray(model.force(inside[:, 0]))
    return np.asarray(model.force(inside[:, 0], direction=np.clip(side, -1.0, 1.0)))


def disagreement(on_rows: RowError, on_cells: float, travel: float, cells: int) -> list[Finding]:
    """A finding if the error on rows is far above the error on the cells that were fitted."""
    if on_rows.nrmse <= WORTH_A_FINDING or on_rows.rmse <= DISAGREEMENT * on_cells:
        return []
    return [
        no(
            f"the error is {on_rows.rmse:.3g} on the rows but {on_cells:.3g} on the cells that were fitted: "
            f"the cells, 1/{cells} of the travel of {travel:.3g}, are wider than the force's structure. "
            "Remove rows that stretch the travel, or raise max_positions"
        )
    ]

# SPDX-License-Identifier: Apache-2.0
"""Findings on an identified model: its error on the rows, its size, and what the inputs cannot explain."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..._typing import Float1D
from ...recording import Recording
from ...recording.quality import findings_of
from ...verdict import Finding, Verdict, no, usable
from ..network.fitted import FittedNetwork
from ..search.evidence import Candidate
from .climb import BoxRows

USABLE_NRMSE = 0.1
"""NRMSE above which a model is usable with a reservation: a tenth of the force's spread [-]."""

UNFIT_NRMSE = 0.5
"""NRMSE above which a model is unfit: it leaves a quarter of the force's variance unexplained [-]."""

ROWS_A_PARAMETER = 7
"""Rows for each parameter below which the error between the rows may exceed that of the fit by a fifth."""

ROWS_A_PARAMETER_OF_FEW = 10
"""The same among fewer than FEW_ROWS rows, which may miss a bend of the force."""

FEW_ROWS = 500

CERTAINLY_ENOUGH = 1000
"""Rows for each parameter from which repetitions are not counted."""


def error_findings(nrmse: float, rows: str) -> list[Finding]:
    """Findings on the error alone; `rows` says on which rows it was computed."""
    if nrmse <= USABLE_NRMSE:
        return []
    judge = no if nrmse > UNFIT_NRMSE else usable
    explained = max(0.0, 1.0 - nrmse * nrmse)
    return [judge(f"the NRMSE on {rows} is {nrmse:.3g}: the model explains {explained:.0%} of the force")]


def size_findings(network: FittedNetwork, recordings: Sequence[Recording]) -> list[Finding]:
    """Findings on too few rows for the number of parameters.

    Rows that repeat another one do not count, and correlated noise makes each row count for less.
    """
    rows = sum(map(len, recordings))
    if not recordings or rows >= CERTAINLY_ENOUGH * network.n_parameters:
        return []
    pairs = np.concatenate([part.position + 1j * part.force for part in recordings])
    distinct = len(np.unique(pairs))
    each = ROWS_A_PARAMETER_OF_FEW if distinct < FEW_ROWS else ROWS_A_PARAMETER
    needed = each * network.n_parameters
    if min(distinct, network.independent_rows) >= needed:
        return []
    counted = min(distinct, round(network.independent_rows))
    subject = f"{rows} rows"
    if counted < rows:
        subject = f"{counted} independent of {rows} rows (the others repeat them, or follow correlated noise)"
    return [
        usable(
            f"{subject} determine {network.n_parameters} parameters, {needed} would be needed to trust the "
            "NRMSE: the error between the rows may be larger; record more rows, or verify the model on "
            "another recording"
        )
    ]


def verdict_of(
    network: FittedNetwork, recordings: Sequence[Recording], side: Float1D | None = None
) -> Verdict:
    """The verdict on a network that was identified from recordings, with the direction (n,) of all rows."""
    findings = [*findings_of(recordings, side), *network.findings]
    findings += size_findings(network, recordings)
    findings += error_findings(network.nrmse, "the rows of the identification")
    return Verdict(tuple(dict.fromkeys(findings)))


MOST_OF_THE_ERROR = 0.5
"""Part of a model's mean square error that position cannot explain, from which wavelets stay wide [-]"""

REPORTED_SHARE = 0.25
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


def most_of_error(nrmse: float) -> float:
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
    if least < REPORTED_SHARE * nrmse**2:
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


DISAGREEMENT = 1.5
"""Ratio of the error on rows to the error on cells above which the cells were too wide [-]"""

REPORTED_NRMSE = 0.02
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


def beyond_rows(network: FittedNetwork, force: Float1D, *, repeats: bool) -> list[Finding]:
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
        values = network.force(x[:, None], side)
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


def disagreement(on_rows: RowError, on_cells: float, travel: float, cells: int) -> list[Finding]:
    """A finding if the error on rows is far above the error on the cells that were fitted."""
    if on_rows.nrmse <= REPORTED_NRMSE or on_rows.rmse <= DISAGREEMENT * on_cells:
        return []
    return [
        no(
            f"the error is {on_rows.rmse:.3g} on the rows but {on_cells:.3g} on the cells that were fitted: "
            f"the cells, 1/{cells} of the travel of {travel:.3g}, are wider than the force's structure. "
            "Remove rows that stretch the travel, or raise max_positions"
        )
    ]


def judged_on_rows(
    network: FittedNetwork,
    found: Candidate,
    data: BoxRows,
    cells: int,
    moving: tuple[Float1D, Float1D] | None,
    *,
    periodic: bool,
) -> FittedNetwork:
    """The network with the error that its evaluator leaves on the rows, and the findings on this error.

    moving: force of mass and damping (n,), and 1 in the rows where it is known, else 0.
    """
    residual = data.force - network.force(data.positions, found.side)
    counted = np.ones(len(residual)) if data.counted is None else data.counted
    fitted = np.ones(len(residual)) if data.weight is None else data.weight
    if moving is not None:
        residual, counted, fitted = residual - moving[0], counted * moving[1], fitted * moving[1]
    if found.strokes is not None:
        counted, fitted = counted * found.strokes.known, fitted * found.strokes.known
    findings = []
    if data.robust is not None:
        counted = np.where(data.robust.outliers, 0.0, counted)
        findings += data.robust.findings(residual)
    error = RowError(residual, data.force, counted, data.within)
    on_fitted = RowError(residual, data.force, fitted, data.within)
    findings += [*error.findings(), *disagreement(on_fitted, found.rmse, float(data.reach[0]), cells)]
    findings += beyond_rows(network, data.force[counted > 0.0], repeats=periodic)
    if data.counted is None and len(data.names) == 1:
        rows = np.flatnonzero(counted)
        side = None if found.side is None else found.side[rows]
        position = data.positions[rows, 0]
        findings += explained_findings(position, data.force[rows], residual[rows], side, error.nrmse)
    return replace(
        network,
        rmse=error.rmse,
        nrmse=error.nrmse,
        independent_rows=found.problem.independent,
        findings=(*network.findings, *findings),
    )

# SPDX-License-Identifier: Apache-2.0
"""Model selection: every model class in turn, from constant to hysteresis, on the rows of one recording.

A class is judged on the same samples by the same criterion as the one below it, with its constraints imposed.
It is accepted only if the criterion falls by `evidence` (of :class:`SearchOptions`) or more and if the error
falls on held-out rows too. What a class gains, or would have gained, stands in the notes.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ..._typing import Float1D, Float2D
from ...errors import InputError
from ...verdict import usable
from ..data.compression import Compressed, Compressor
from ..data.held_out import EVERY, held_out_rows
from ..data.limits import NO_LIMITS, RowLimits
from ..data.outliers import Robust
from ..network.basis import Basis
from ..network.constraints import Bound, crossing, domain_bounds, impose, moved_to_bounds
from ..network.separable import SeparableProblem, Solution
from ..options import IdentifyOptions
from ..search.criteria import criterion_of
from ..search.evidence import Candidate, Judge, Report, Samples
from ..search.growth import Grown, Growth

WORTH_REGROWING = 1.01
"""Ratio of the RMS errors with and without constraints from which wavelets are grown to suit them."""


@dataclass(frozen=True)
class BoxRows:
    """Rows of a recording, in the unit box of their positions."""

    names: tuple[str, ...]
    """(d,) of the inputs"""
    positions: Float2D
    """(n, d) in the unit of the recording, modulo the period where there is one"""
    lower: Float1D
    reach: Float1D
    """(d,) corner and sides of the box [position]"""
    box: Float2D
    """(n, d) positions in the unit box"""
    path: Float1D
    """(n,) first input in the unit box as it was moved through, not taken modulo a period"""
    force: Float1D
    side: Float1D | None = None
    """(n,) +1, -1: the stroke of each row"""
    starts: Sequence[int] | None = None
    """Rows at which a motion starts, from which the play operator gives a hysteresis input (d = 1)"""
    weight: Float1D | None = None
    """(n,) samples that each row stands for in the fit; None: 1"""
    counted: Float1D | None = None
    """(n,) samples that each row stands for in the reported error; None: 1"""
    within: float = 0.0
    """Sum of squares inside rows that stand for several samples [force^2]"""
    robust: Robust | None = None
    """Outliers, where the loss is Huber's"""
    limits: RowLimits = NO_LIMITS
    """What limits the information in the rows"""

    @property
    def reported(self) -> NDArray[np.bool_]:
        """(n,) rows that count in the error."""
        rows = np.ones(len(self.force), dtype=bool) if self.counted is None else self.counted > 0.0
        return rows if self.robust is None else rows & ~self.robust.outliers

    def held_out(self) -> NDArray[np.bool_]:
        """(n,) rows that are held out to judge on."""
        held_out = held_out_rows(len(self.force), self.starts)
        if self.weight is not None:
            counted = np.flatnonzero(self.weight > 0.0)
            held_out &= self.weight > 0.0
            if 2 * EVERY * np.count_nonzero(held_out) < len(counted):
                # rows that repeat others can stand at every place that is held out
                held_out[:] = False
                held_out[counted] = held_out_rows(len(counted), self.starts)
        return held_out


class Climb:
    """One model selection over one recording: what its model classes share.

    Parameters
    ----------
    rows : BoxRows
    options : IdentifyOptions
    cells : int
        Distinct positions that are kept apart.
    before : Climb, optional
        A climb over nearly the same rows: growth begins with the wavelets that it ended with.
    on_held_out : bool
        False: the criterion alone decides, not the held-out rows.
    """

    def __init__(
        self,
        rows: BoxRows,
        options: IdentifyOptions,
        cells: int,
        before: Climb | None = None,
        *,
        on_held_out: bool = True,
    ) -> None:
        self.data, self.options = rows, options
        self.report: Report = Report(list(before.report.path) if before else [])
        self.begun: dict[str, Basis] = dict(before.begun) if before else {}
        """Wavelets of each model class that growth begins with"""
        compressor = Compressor(
            rows.box,
            rows.force,
            weight=rows.weight,
            max_positions=cells,
            within=rows.within,
            limits=rows.limits,
        )
        self.samples = Samples(rows.box, rows.force, rows.held_out(), compressor, options)
        self.judge = Judge(self.samples, options, self.report, on_held_out=on_held_out)
        single = rows.side is None and (rows.starts is None or rows.box.shape[1] > 1)
        self.growth = Growth(options, single=single)
        self.spread = float(np.std(rows.force)) or 1.0
        self._fixed_force = self._fixed_in_box()
        given = len(rows.force) if rows.weight is None else int(np.count_nonzero(rows.weight))
        if (used := compressor.rows_used) < given:
            self.report.notes.append(f"{used} of {given} rows, evenly spread, stand for all of them")

    def best(self, classes: Sequence[ModelClass]) -> Candidate:
        """The highest candidate that the judge accepts."""
        best: Candidate | None = None
        for model_class in classes:
            best = model_class.better(best)
        assert best is not None
        self._report_limit(best)
        return best

    @cached_property
    def rows(self) -> Compressed:
        """Compressed rows without a hysteresis input."""
        return self.samples.rows()

    def grown(
        self, problem: SeparableProblem, start: Basis, model_class: str, most: int | None = None
    ) -> Grown:
        """A network grown from the wavelets of start, its path reported."""
        grown = self.growth.grow(problem, start, model_class, most=most)
        self.report.path.extend(grown.path)
        return grown

    def recorded(self, candidate: Candidate) -> Candidate:
        """The candidate, with its point on the path."""
        self.report.path.append(candidate.point(self.options.criterion))
        return candidate

    def constrained(self, candidate: Candidate) -> Candidate:
        """The candidate with its constraints, their price in the notes.

        If they cost more than a little, the network is grown further on forces that keep them; the result is
        taken if the criterion prefers it once the constraints are imposed on the true forces again.
        """
        options, problem = self.options, candidate.problem
        bounds = self.bounds(problem)
        if problem.dimension > 1 or not bounds:
            return candidate
        kept = impose(problem, candidate.solution, bounds)
        if kept is candidate.solution:
            return candidate
        if problem.rmse(kept) > WORTH_REGROWING * candidate.rmse and any(bound.seam for bound in bounds):
            # Equal slopes at both ends of a period may cost more than the corner that they avoid.
            bounds = [bound for bound in bounds if not (bound.seam and bound.of_slope)]
            kept = impose(problem, candidate.solution, bounds)
        worse = problem.rmse(kept) > WORTH_REGROWING * candidate.rmse
        if options.search.refine and worse and len(kept.basis) and not all(bound.seam for bound in bounds):
            moved = moved_to_bounds(problem, candidate.rows, candidate.solution, bounds)
            compatible = self.samples.problem(moved, candidate.strokes)
            regrown = self.grown(compatible, candidate.solution.basis, candidate.model_class)
            trial = impose(problem, problem.solve(regrown.solution.basis), bounds)
            if self._judged_on(regrown.problem, trial) < self._judged_on(regrown.problem, kept):
                kept = trial
        names = " and ".join(dict.fromkeys(bound.name for bound in bounds))
        price = f"RMS error {problem.rmse(kept):.4g} with, {candidate.rmse:.4g} without"
        crossed = ""
        if options.hysteresis_nonnegative:
            lower, reach = float(self.data.lower[0]), float(self.data.reach[0])
            crossed = crossing(problem, candidate.solution, lower, reach)
        self.report.notes.append(
            f"{candidate.model_class}: {names} imposed over the domain, {price}{crossed}"
        )
        more = problem.n_parameters(len(kept.basis)) - problem.n_parameters(candidate.n_wavelets)
        return replace(candidate, solution=kept, n_parameters=candidate.n_parameters + more)

    def bounds(self, problem: SeparableProblem) -> list[Bound]:
        """The bounds that the options ask for."""
        slopes, reach = self.options.slope_limits, float(self.data.reach[0])
        return domain_bounds(
            problem,
            hysteresis=self.options.hysteresis_nonnegative,
            slopes=None if slopes is None else (slopes[0] * reach, slopes[1] * reach),
            fixed=self._fixed_force,
            periodic=self.options.period is not None,
        )

    def _judged_on(self, problem: SeparableProblem, solution: Solution) -> float:
        """Criterion of a solution on the rows of another problem of the same form."""
        moved = problem.with_coefficients(solution, solution.coefficients)
        return criterion_of(problem, moved, self.options.criterion)

    def _fixed_in_box(self) -> tuple[float, float] | None:
        """The fixed force, its position in the unit box."""
        if self.options.fixed_force is None:
            return None
        (place, fixed), lower, reach = self.options.fixed_force, self.data.lower[0], self.data.reach[0]
        if not lower <= place <= lower + reach:
            raise InputError(
                f"fixed_force is at {place:g}, outside the positions from {lower:g} to {lower + reach:g}"
            )
        return float((place - lower) / reach), fixed

    def _report_limit(self, best: Candidate) -> None:
        """Reports that growth ended at max_wavelets while neighbouring residuals are still correlated."""
        limit = self.options.max_wavelets
        if best.stop_reason != "max_wavelets" or not best.problem.structured(best.solution):
            return
        period = "" if self.options.period or best.problem.dimension > 1 else ", or --period if it repeats"
        self.report.findings.append(
            usable(
                f"growth ended at the limit of {limit} wavelets and the error is still structured "
                f"(NRMSE {best.rmse / self.spread:.3g}); give --max-wavelets {4 * limit}{period}"
            )
        )


class ModelClass(ABC):
    """A kind of force law that may be accepted."""

    name: str

    def __init__(self, climb: Climb) -> None:
        self._climb = climb

    @abstractmethod
    def fit(self, below: Candidate | None) -> Candidate:
        """The candidate of this class, fitted to the rows."""

    def better(self, below: Candidate | None) -> Candidate:
        """The candidate of this class if it is accepted, else the one below."""
        above = self.fit(below)
        return above if below is None else self._climb.judge.better(below, above)

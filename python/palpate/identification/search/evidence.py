# SPDX-License-Identifier: Apache-2.0
"""Candidate models, the rows that they are fitted to, and the judge that compares them."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from ..._core.model import wavelet_columns, wavelet_curvature_columns
from ..._typing import Float1D, Float2D
from ...verdict import Finding
from ..data.compression import Compressed, Compressor, around_seam, binning_error
from ..data.held_out import TRIM, HeldOutRows, gain, inside
from ..data.strokes import HysteresisInput
from ..network.fitted import PathPoint
from ..network.separable import SeparableProblem, Solution, problem_of
from ..options import IdentifyOptions
from .criteria import ON_HELD_OUT_ROWS, criterion_of, enough, standard_error

BINNING_SHARE = 0.05
"""Error that cells of positions may add, as a share of the RMS error; above it the cells are halved."""

ROBUST_GAIN = 0.5
"""Fall of the squared error, as a share, that a trimmed mean must show to outweigh a mean that shows none."""

LEAST_HELD_OUT = 20
"""Held-out rows below which they are too few to refuse a model class."""

ALL = slice(None)
"""Every row."""


@dataclass(frozen=True)
class Candidate:
    """A candidate model: one solution of a problem over compressed rows."""

    model_class: str
    rows: Compressed
    problem: SeparableProblem
    solution: Solution
    n_parameters: int
    stop_reason: str
    strokes: HysteresisInput | None = None
    """The hysteresis input, where the model class has one"""

    @property
    def side(self) -> Float1D | None:
        """(n,) hysteresis input of every row of the recording."""
        return None if self.strokes is None else self.strokes.side

    @property
    def play_radius(self) -> float | None:
        """[box]"""
        return None if self.strokes is None else self.strokes.play_radius

    @property
    def n_wavelets(self) -> int:
        return len(self.solution.basis)

    @property
    def rmse(self) -> float:
        return self.problem.rmse(self.solution)

    @property
    def at_lower(self) -> float:
        """g at the lower corner of the domain [force]."""
        table, d = self.problem.readout @ self.solution.coefficients, self.problem.dimension
        basis = self.solution.basis
        corner = wavelet_columns(np.zeros((1, d)), basis.alpha, basis.beta)[0]
        return float(table[0, 0] + table[0, 1 + d :] @ corner)

    def criterion(self, name: str) -> float:
        """Value of a criterion: the smaller the better."""
        return criterion_of(self.problem, self.solution, name, self.n_parameters)

    def point(self, name: str) -> PathPoint:
        """The candidate on the path, by this criterion."""
        return PathPoint(self.model_class, self.n_wavelets, self.rmse, self.criterion(name))

    def held_out_errors(self, fitted: SeparableProblem, rows: HeldOutRows) -> Float1D:
        """Errors (k,) on held-out rows with the linear unknowns of a problem of the other rows."""
        if self.model_class == "constant":
            (block,) = fitted.blocks
            root = block.channels[:, 0]
            return np.asarray(rows.force - block.target @ root / (root @ root))
        fitted = replace(fitted, prior=self.problem.prior)
        return fitted.errors(fitted.solve(self.solution.basis), rows)

    def cells_too_wide(self) -> bool:
        """True if gathering positions in cells may have moved the fit by more than it should."""
        if not self.rows.spread.any():
            return False
        basis, weights = self.solution.basis, self.solution.coefficients[:, 1 + self.problem.dimension :]
        bends = wavelet_curvature_columns(self.rows.positions, basis.alpha, basis.beta)
        curvature = np.column_stack([np.abs(bend @ weights.T).max(axis=1) for bend in bends])
        return binning_error(self.rows, curvature) > BINNING_SHARE * self.problem.resolved_rmse(self.solution)

    def force_at(self, positions: Float2D, rows: slice = ALL) -> Float1D:
        """Force at every row (n,), or at some, of positions (n, d) in the unit box."""
        return self._force(positions[rows], None if self.side is None else self.side[rows])

    def parts_at(self, positions: Float2D) -> tuple[Float1D, Float1D]:
        """g and h (k,) of a model with hysteresis at positions (k, d) in the unit box."""
        middle = self._force(positions, np.zeros(len(positions)))
        return middle, self._force(positions, np.ones(len(positions))) - middle

    def _force(self, positions: Float2D, side: Float1D | None) -> Float1D:
        return -self.problem.errors(self.solution, HeldOutRows(positions, np.zeros(len(positions)), side))


@dataclass
class Report:
    """What is known of a model selection beside its result."""

    path: list[PathPoint] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    findings: list[Finding] = field(default_factory=list)
    sign_findings: list[Finding] = field(default_factory=list)
    """Those on the signs of position and force"""


class Samples:
    """The rows of one recording in the unit box: compressed for fits, and held out to judge on.

    Parameters
    ----------
    box : (n, d)
        Positions in the unit box.
    force : (n,)
    held_out : (n,)
        Rows that are held out.
    compressor : Compressor
        Of the same rows.
    options : IdentifyOptions
    """

    def __init__(
        self,
        box: Float2D,
        force: Float1D,
        held_out: NDArray[np.bool_],
        compressor: Compressor,
        options: IdentifyOptions,
    ) -> None:
        self.box, self.force = box, force
        self._held_out, self._compressor = held_out, compressor
        self._resolved_by, self._periodic = options.search.resolved_by, options.period is not None
        self._for_criterion = options.criterion in ON_HELD_OUT_ROWS

    def rows(self, strokes: HysteresisInput | None = None) -> Compressed:
        """Compressed rows: all of them, or those that are not held out for the criterion.

        Rows whose hysteresis input is unknown are dropped and the others reweighted, so that all model
        classes are judged on as many.
        """
        only = ~self._held_out if self._for_criterion else None
        if strokes is None:
            rows = self._compressor.rows(only=only)
        else:
            known = strokes.known if only is None else only & strokes.known
            rows = self._compressor.rows(strokes.side, known)
            if not strokes.known.all():
                rows = rows.standing_for(self._compressor.samples(only))
        return around_seam(rows) if self._periodic else rows

    def problem(self, rows: Compressed, strokes: HysteresisInput | None = None) -> SeparableProblem:
        """Least squares over compressed rows."""
        held_out = self.held_out_rows(strokes) if self._for_criterion else None
        return problem_of(rows, resolved_by=self._resolved_by, held_out=held_out)

    def held_out_rows(
        self, strokes: HysteresisInput | None, known: NDArray[np.bool_] | None = None
    ) -> HeldOutRows:
        """Rows that are held out, of those whose hysteresis input is known."""
        known = strokes.known if strokes is not None else known
        rows = self._held_out if known is None else self._held_out & known
        return HeldOutRows.of(self.box, self.force, None if strokes is None else strokes.side, rows)

    def on_known_rows(self, below: Candidate, above: Candidate) -> Candidate:
        """The candidate below on the rows whose hysteresis input is known for the one above.

        The luck of the noise in the other rows is as much as a model class has to gain.
        """
        strokes = above.strokes
        if strokes is None or strokes.known.all() or self._for_criterion:
            return below
        rows = self._compressor.rows(below.side, strokes.known).standing_for(above.rows.samples)
        problem = self.problem(rows)
        solved = problem.solve(below.solution.basis)
        solution = problem.with_coefficients(solved, below.solution.coefficients)
        return replace(below, problem=problem, solution=solution)

    def held_out_gain(self, below: Candidate, above: Candidate) -> tuple[float, float]:
        """Fall of the squared error on held-out rows as a share, and its standard error.

        Only rows inside the range of the fitted rows count: outside it a network is not defined by data. If
        the mean over all groups shows no gain, but the trimmed mean a large one, the trimmed mean counts: a
        few groups then hold rows that no fitted row is near.
        """
        known = None if above.strokes is None else above.strokes.known
        fitted = ~self._held_out if known is None else ~self._held_out & known
        errors = []
        for one in (below, above):
            compressed = self._compressor.rows(one.side, fitted)
            problem = problem_of(compressed, resolved_by=self._resolved_by)
            rows = self.held_out_rows(one.strokes, known)
            errors.append(one.held_out_errors(problem, rows)[inside(rows.positions, self.box[fitted])])
        if len(errors[0]) < LEAST_HELD_OUT:
            return gain(*errors) if len(errors[0]) else (0.0, 0.0)
        share, error = gain(*errors)
        if share > error:
            return share, error
        trimmed = gain(*errors, trim=TRIM)
        return trimmed if trimmed[0] > max(trimmed[1], ROBUST_GAIN) else (share, error)


@dataclass(frozen=True)
class Judgement:
    """The comparison of two candidates."""

    earned: bool
    """The upper one is accepted"""
    why: str
    """What it gains, in words"""
    criterion_falls: bool
    """The criterion falls by enough: if it is not accepted, held-out rows refuse it"""


class Judge:
    """Decides which of two candidates is accepted, by the criterion and then on held-out rows.

    Parameters
    ----------
    samples : Samples
    options : IdentifyOptions
    report : Report
        Receives a note on each decision.
    on_held_out : bool
        False: the criterion alone decides.
    """

    def __init__(
        self, samples: Samples, options: IdentifyOptions, report: Report, *, on_held_out: bool = True
    ) -> None:
        self.criterion, self.evidence = options.criterion, options.search.evidence
        self._samples, self._report, self.on_held_out = samples, report, on_held_out

    def better(self, below: Candidate, above: Candidate) -> Candidate:
        """The upper candidate if it is accepted, else the lower one; adds a note on what it gains."""
        return above if self.noted(below, above).earned else below

    def noted(self, below: Candidate, above: Candidate, *, errors: float = 1.0) -> Judgement:
        """The comparison of two candidates, with a note."""
        judged = self.compared(below, above, errors=errors)
        decision = "accepted" if judged.earned else "refused"
        self._report.notes.append(f"{above.model_class} {decision}: {judged.why}")
        return judged

    def earned(self, below: Candidate, above: Candidate) -> bool:
        """True if the upper candidate is accepted."""
        return self.compared(below, above).earned

    def fall(self, below: Candidate, above: Candidate) -> float:
        """Fall of the criterion from one candidate to another, on the rows that both know."""
        below = self._samples.on_known_rows(below, above)
        return below.criterion(self.criterion) - above.criterion(self.criterion)

    def compared(self, below: Candidate, above: Candidate, *, errors: float = 1.0) -> Judgement:
        """Compares the upper candidate with the lower one.

        On held-out rows the squared error must fall by more than that many of its standard errors.
        """
        name, evidence = self.criterion, self.evidence
        if not self.on_held_out:
            falls = self.fall(below, above)
            return Judgement(falls >= evidence, f"{name} changes by {-falls:.4g}", False)
        if enough(name, below.criterion(name)):
            return Judgement(False, f"{below.model_class} is already closer than a hand can feel", False)
        falls = self.fall(below, above)
        changes = f"{name} {'falls' if falls > 0 else 'rises'} by {abs(falls):.4g}"
        rows = self._samples.held_out_rows(above.strokes)
        if name in ON_HELD_OUT_ROWS:
            evidence = max(evidence, standard_error(len(rows.force)))
        if falls < evidence:
            return Judgement(False, f"{changes}, it has to fall by {evidence:.4g} or more", False)
        share, error = self._samples.held_out_gain(below, above)
        way = "falls" if share > 0.0 else "rises"
        by = f"{_percent(abs(share), 4)} +- {_percent(error, 2)} %"
        measured = f"the squared error on held-out rows {way} by {by}"
        if share <= errors * error and len(rows.force) >= LEAST_HELD_OUT:
            return Judgement(False, f"{changes}, but {measured}", True)
        return Judgement(True, f"{changes}, {measured}", True)


def _percent(share: float, digits: int) -> str:
    return f"{100 * share:.{digits}g}" if share < 1.0 else f"{100 * share:.0f}"

# SPDX-License-Identifier: Apache-2.0
"""Candidate models, the criteria that they are compared by, and the judge that accepts them.

The criteria weigh the error against the number of fitted numbers. All are written as a deviance, n ln(RSS/n)
plus a penalty for the p fitted parameters, so that their differences compare: BIC (Schwarz 1978), AICc
(Hurvich & Tsai 1989), GCV (Craven & Wahba 1979, as n ln of the score), FPE (Akaike 1970, as n ln of the
score). The smallest value wins.

Two rules judge on held-out rows instead, and need no penalty. "fresh" takes the smallest network
whose error there is within one standard error of the least (Breiman et al. 1984); "perceptual" the smallest
whose error there is not felt: RMS of the error over 7 % of the local force, or 1 % of the largest, below 1.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ..._core.model import wavelet_columns, wavelet_curvature_columns
from ..._typing import Float1D, Float2D
from ...errors import InputError
from ...verdict import Finding
from ..data.compression import (
    TRIMMED_SHARE,
    Compressed,
    Compressor,
    HeldOutRows,
    around_seam,
    binning_error,
    gain,
    inside,
)
from ..data.rows import Rows
from ..data.strokes import HysteresisInput
from ..decision import Decision, decided, in_words, signed, squared_error_change
from ..network.fitted import FittedNetwork, PathPoint
from ..network.separable import TINY, SeparableProblem, Solution, problem_of
from ..options import IdentifyOptions

MOST_BINNING_SHARE = 0.05
"""Largest error from gathering positions in cells, as a share of the RMS error [-]. Above it the cells are
halved."""

LEAST_TRIMMED_GAIN = 0.5
"""Least fall of the trimmed squared error, as a share, that replaces a mean without a fall [-]. Half of the
error cannot come from the few trimmed groups."""

LEAST_HELD_OUT = 20
"""Least number of held-out rows that can refuse a model class. Fewer are too uncertain."""

ALL_ROWS = slice(None)
"""Every row."""

CRITERIA: dict[str, Callable[[float, int], float]] = {
    "bic": lambda n, p: p * math.log(n),
    "aicc": lambda n, p: 2.0 * p + 2.0 * p * (p + 1) / (n - p - 1) if p < n - 1 else math.inf,
    "gcv": lambda n, p: -2.0 * n * math.log1p(-p / n) if p < n else math.inf,
    "fpe": lambda n, p: n * math.log((n + p) / (n - p)) if p < n else math.inf,
    "fresh": lambda n, p: 0.0,
    "perceptual": lambda n, p: 0.0,
}
"""Name of the criterion to its penalty of p parameters on n samples."""

CRITERION_NAMES = {
    "bic": "BIC",
    "aicc": "AICc",
    "gcv": "GCV",
    "fpe": "FPE",
    "fresh": "deviance on held-out rows",
    "perceptual": "deviance in just noticeable differences",
}
"""Name of the criterion to its name in messages."""

ON_HELD_OUT_ROWS = ("fresh", "perceptual")
"""The criteria whose error is that on held-out rows."""


def deviance(criterion: str, rss: float, n: float, p: int) -> float:
    """Value of a criterion: n ln(rss/n) + penalty(n, p); rss in force squared, over all n samples.

    For "perceptual" rss is in just noticeable differences squared, so that 0 is the limit of perception.
    """
    return n * math.log(rss / n) + CRITERIA[criterion](n, p)


def standard_error(n: float) -> float:
    """Standard error of n ln(MSE) over n samples of normal noise: n sqrt(2/n)."""
    return math.sqrt(2.0 * n)


def enough(criterion: str, value: float) -> bool:
    """True if no larger network is needed."""
    return criterion == "perceptual" and value <= 0.0


def choice(criterion: str, values: Sequence[float], n: float) -> int:
    """Index of the network to take, from the values of networks of rising size."""
    least = min(values)
    limit = {"fresh": least + standard_error(n), "perceptual": max(0.0, least)}.get(criterion, least)
    return next(index for index, value in enumerate(values) if value <= limit)


def criterion_of(
    problem: SeparableProblem, solution: Solution, name: str, n_parameters: int | None = None
) -> float:
    """Value of a criterion for a solution: the smaller the better.

    Without n_parameters those of the problem and the basis are counted.

    Raises
    ------
    InputError
        The criterion judges on held-out rows, and the problem has none.
    """
    if name in ON_HELD_OUT_ROWS:
        rows = problem.held_out
        if rows is None:
            raise InputError(f"criterion is {name!r}: needs held-out rows, and there are none")
        return held_out_deviance(name, rows, problem.errors(solution, rows))
    p = problem.n_parameters(len(solution.basis)) if n_parameters is None else n_parameters
    share = problem.limits.independent
    return deviance(name, share * problem.total(solution.rss), problem.independent, p)


def held_out_deviance(criterion: str, rows: HeldOutRows, errors: Float1D) -> float:
    """Criterion of a network that leaves these errors on held-out rows."""
    counted = rows.in_jnd(errors) if criterion == "perceptual" else errors
    smallest = (1e-12 * float(np.ptp(rows.force))) ** 2 * len(counted)
    return deviance(criterion, max(float(counted @ counted), smallest, TINY), len(counted), 0)


Reporter = Callable[[str, int], None]
"""Receives the model class that is tried and the number of wavelets."""

_reporter: ContextVar[Reporter | None] = ContextVar("reporter", default=None)


@contextmanager
def reporting_to(reporter: Reporter) -> Iterator[None]:
    """Report every network that is tried in this context."""
    token = _reporter.set(reporter)
    try:
        yield
    finally:
        _reporter.reset(token)


def report(model_class: str, n_wavelets: int) -> None:
    """Report a network that is tried now."""
    if (reporter := _reporter.get()) is not None:
        reporter(model_class, n_wavelets)


@dataclass(frozen=True)
class Moving:
    """Mass and damping, and their force."""

    damping: float | None
    mass: float | None
    force: Float1D
    """(n,) m L a + B L v at every row"""
    known: Float1D
    """(n,) 1 in the rows that have a velocity and an acceleration, else 0"""


@dataclass(frozen=True)
class RowError:
    """Residuals of every row, with the samples that each represents."""

    residual: Float1D
    """(n,) [force]"""
    force: Float1D
    """(n,)"""
    weight: Float1D
    """(n,) samples, 0 for a row that does not count"""
    within: float = 0.0
    """Sum of squares inside rows that represent several samples [force^2]"""

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


@dataclass(frozen=True)
class Candidate:
    """A candidate model: one solution of a problem over compressed rows."""

    model_class: str
    data: Rows
    """The rows that its error is reported on"""
    rows: Compressed
    problem: SeparableProblem
    solution: Solution
    n_parameters: int
    stop_reason: str
    strokes: HysteresisInput | None = None
    """The hysteresis input, where the model class has one"""
    moving: Moving | None = None
    """Mass and damping, where the model class has them"""

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
        return binning_error(self.rows, curvature) > MOST_BINNING_SHARE * self.problem.resolved_rmse(
            self.solution
        )

    def force_at(self, rows: slice = ALL_ROWS) -> Float1D:
        """Force over position at every row (n,), or at some."""
        return self._force(self.data.box[rows], None if self.side is None else self.side[rows])

    def parts_at(self, positions: Float2D) -> tuple[Float1D, Float1D]:
        """g and h (k,) of a model with hysteresis at positions (k, d) in the unit box."""
        middle = self._force(positions, np.zeros(len(positions)))
        return middle, self._force(positions, np.ones(len(positions))) - middle

    def _force(self, positions: Float2D, side: Float1D | None) -> Float1D:
        return -self.problem.errors(self.solution, HeldOutRows(positions, np.zeros(len(positions)), side))

    @cached_property
    def network(self) -> FittedNetwork:
        """The candidate in the units of the data."""
        lower, reach, moving = self.data.lower, self.data.reach, self.moving
        return FittedNetwork.of(
            self.solution,
            self.problem.readout,
            lower,
            reach,
            inputs=self.data.names,
            play_radius=None if self.play_radius is None else self.play_radius * float(reach[0]),
            mass=moving and moving.mass,
            damping=moving and moving.damping,
            model_class=self.model_class,
            stop_reason=self.stop_reason,
            n_parameters=self.n_parameters,
            independent_rows=self.problem.independent,
        )

    @cached_property
    def residual(self) -> Float1D:
        """Force of every row (n,) less that of the network's evaluator, of mass and of damping."""
        residual = self.data.force - self.network.force(self.data.domain, self.side)
        return residual if self.moving is None else residual - self.moving.force

    @cached_property
    def error(self) -> RowError:
        """Error on the rows that count."""
        error, robust = self.error_on(self.data.counted), self.data.robust
        return (
            error if robust is None else replace(error, weight=np.where(robust.outliers, 0.0, error.weight))
        )

    def error_on(self, samples: Float1D | None) -> RowError:
        """Error on rows that represent so many samples (n,), or 1; rows without a motion do not count."""
        weight = np.ones(len(self.residual)) if samples is None else samples
        if self.moving is not None:
            weight = weight * self.moving.known
        if self.strokes is not None:
            weight = weight * self.strokes.known
        return RowError(self.residual, self.data.force, weight, self.data.within)


@dataclass
class Report:
    """Path, notes and findings of a model selection."""

    path: list[PathPoint] = field(default_factory=list)
    decisions: list[Decision] = field(default_factory=list)
    """Decisions on the model classes, in order"""
    notes: list[str] = field(default_factory=list)
    """Sentences on constraints with their cost, and on unused rows"""
    findings: list[Finding] = field(default_factory=list)
    sign_findings: list[Finding] = field(default_factory=list)
    """Those on the signs of position and force"""

    def replaces(self, other: Report, note: str) -> None:
        """Begins with the path of a selection that this one replaces, and with the reason."""
        self.path[:0] = other.path
        self.notes.insert(0, note)

    def add(self, other: Report, note: str) -> None:
        """Adds the path, decisions and notes of a later selection and takes its findings."""
        self.path += other.path
        self.decisions += other.decisions
        self.notes += [note, *other.notes]
        self.findings, self.sign_findings = other.findings, other.sign_findings


class Samples:
    """The rows of one recording: compressed for fits, and held out to judge on.

    Parameters
    ----------
    data : Rows
    options : IdentifyOptions
    cells : int
        Distinct positions that are kept apart.
    """

    def __init__(self, data: Rows, options: IdentifyOptions, cells: int) -> None:
        self.data, self._held_out = data, data.held_out()
        self._compressor = Compressor(
            data.box,
            data.force,
            weight=data.weight,
            max_positions=cells,
            within=data.within,
            limits=data.limits,
        )
        self.used = self._compressor.rows_used
        """Rows that represent all"""
        self._resolved_by = options.search.resolved_by
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
                rows = rows.reweighted_to(self._compressor.samples(only))
        return rows if self.data.period is None else around_seam(rows)

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
        return HeldOutRows.of(self.data.box, self.data.force, None if strokes is None else strokes.side, rows)

    def on_known_rows(self, below: Candidate, above: Candidate) -> Candidate:
        """The candidate below on the rows whose hysteresis input is known for the one above.

        The random error of the other rows is as large as the gain that a model class must show.
        """
        strokes = above.strokes
        if strokes is None or strokes.known.all() or self._for_criterion:
            return below
        rows = self._compressor.rows(below.side, strokes.known).reweighted_to(above.rows.samples)
        problem = self.problem(rows)
        solved = problem.solve(below.solution.basis)
        solution = problem.with_coefficients(solved, below.solution.coefficients)
        return replace(below, problem=problem, solution=solution)

    def held_out_gain(self, below: Candidate, above: Candidate) -> tuple[float, float]:
        """Fall of the squared error on held-out rows as a share, and its standard error.

        Only rows inside the range of the fitted rows count: outside it a network is not defined by data. If
        the mean over all groups shows no gain, but the trimmed mean a large one, the trimmed mean counts: a
        few groups then hold rows far from all fitted rows.
        """
        known = None if above.strokes is None else above.strokes.known
        fitted = ~self._held_out if known is None else ~self._held_out & known
        errors = []
        for one in (below, above):
            compressed = self._compressor.rows(one.side, fitted)
            problem = problem_of(compressed, resolved_by=self._resolved_by)
            rows = self.held_out_rows(one.strokes, known)
            errors.append(one.held_out_errors(problem, rows)[inside(rows.positions, self.data.box[fitted])])
        if len(errors[0]) < LEAST_HELD_OUT:
            return gain(*errors) if len(errors[0]) else (0.0, 0.0)
        share, error = gain(*errors)
        if share > error:
            return share, error
        trimmed = gain(*errors, trim=TRIMMED_SHARE)
        return trimmed if trimmed[0] > max(trimmed[1], LEAST_TRIMMED_GAIN) else (share, error)


@dataclass(frozen=True)
class Judgement:
    """The comparison of two candidates."""

    accepted: bool
    """The upper one is accepted"""
    reason: str
    """Its gain, in words"""
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
        """The upper candidate if it is accepted, else the lower one; adds a note on its gain."""
        return above if self.noted(below, above).accepted else below

    def noted(self, below: Candidate, above: Candidate, *, errors: float = 1.0) -> Judgement:
        """The comparison of two candidates, with a note."""
        judged = self.compared(below, above, errors=errors)
        self._report.decisions.append(decided(above.model_class, judged.accepted, judged.reason))
        return judged

    def accepts(self, below: Candidate, above: Candidate) -> bool:
        """True if the upper candidate is accepted."""
        return self.compared(below, above).accepted

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
            return Judgement(falls >= evidence, f"{CRITERION_NAMES[name]} {signed(-falls)}", False)
        if enough(name, below.criterion(name)):
            reason = f"the error of the {in_words(below.model_class)} is below the just noticeable difference"
            return Judgement(False, reason, False)
        falls = self.fall(below, above)
        change = f"{CRITERION_NAMES[name]} {signed(-falls)}"
        rows = self._samples.held_out_rows(above.strokes)
        if name in ON_HELD_OUT_ROWS:
            evidence = max(evidence, standard_error(len(rows.force)))
        if falls < evidence:
            return Judgement(False, f"{change}, must fall by at least {evidence:.4g}", False)
        share, error = self._samples.held_out_gain(below, above)
        measured = squared_error_change(share, error, "held-out rows")
        if share <= errors * error and len(rows.force) >= LEAST_HELD_OUT:
            bound = f"must fall by more than {100.0 * errors * error:.2g} %"
            return Judgement(False, f"{measured}, {bound}; {change}", True)
        return Judgement(True, f"{measured}, {change}", True)

# SPDX-License-Identifier: Apache-2.0
"""Candidate models, the criteria that compare them, and the judge that accepts or refuses a candidate.

The criteria weigh the error against the number of fitted numbers. All are written as a deviance: n ln(RSS/n)
plus a penalty for the p fitted parameters, where RSS is the residual sum of squares of n samples. So the
differences of two criteria have the same scale: BIC (Schwarz 1978), AICc (Hurvich & Tsai 1989), GCV (Craven &
Wahba 1979, as n ln of the score), FPE (Akaike 1970, as n ln of the score). The smallest value wins.

Two rules use the error on held-out rows instead, and need no penalty. "fresh" takes the smallest network
whose error on held-out rows is within one standard error of the least error (Breiman et al. 1984).
"perceptual" takes the smallest network whose error on held-out rows a hand cannot feel: the RMS of error/JND
is at most 1, where the JND is 7 % of the local force, at least 1 % of the largest force. Without such a
network it takes the one with the least error.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ..._typing import Float1D, Float2D
from ...errors import InputError
from ..data.compression import Compressed, Compressor, HeldOutRows, around_seam
from ..data.limits import evenly_spread
from ..data.rows import Rows
from ..data.strokes import HysteresisInput
from ..log import Decision, Log, decided, in_words, lowered
from ..network.fitted import FittedNetwork, parameters_of
from ..network.separable import TINY, SeparableProblem, Solution, problem_of
from ..options import IdentifyOptions

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
"""Maps the name of a criterion to its penalty for p parameters on n samples."""

CRITERION_NAMES = {
    "bic": "BIC",
    "aicc": "AICc",
    "gcv": "GCV",
    "fpe": "FPE",
    "fresh": "deviance on held-out rows",
    "perceptual": "deviance in just noticeable differences",
}
"""Maps each criterion, as a value of the option --criterion, to its name in messages."""

ON_HELD_OUT_ROWS = ("fresh", "perceptual")
"""Criteria that use the error on held-out rows."""


def on_fitted_rows(criterion: str) -> str:
    """Returns the criterion for comparisons on the rows of the fit: BIC in place of one on held-out rows."""
    return "bic" if criterion in ON_HELD_OUT_ROWS else criterion


def deviance(criterion: str, rss: float, n: float, p: int) -> float:
    """Returns the value of a criterion, n ln(rss/n) + penalty(n, p), from the residual sum of squares rss
    [force^2] of n samples and the number of parameters p.

    For "perceptual" rss is in just noticeable differences squared: at the value 0 the RMS error is one just
    noticeable difference.
    """
    return n * math.log(rss / n) + CRITERIA[criterion](n, p)


def standard_error(n: float) -> float:
    """Returns the standard error of n ln(mean squared error) for n samples of normal noise: n sqrt(2/n)."""
    return math.sqrt(2.0 * n)


def enough(criterion: str, value: float) -> bool:
    """True if the criterion is "perceptual" and the error is at most the just noticeable difference."""
    return criterion == "perceptual" and value <= 0.0


def choice(criterion: str, values: Sequence[float], n: float) -> int:
    """Returns the index of the network that the criterion prefers, from the criterion values of networks in
    order of size."""
    least = min(values)
    limit = {"fresh": least + standard_error(n), "perceptual": max(0.0, least)}.get(criterion, least)
    return next(index for index, value in enumerate(values) if value <= limit)


def criterion_of(
    problem: SeparableProblem, solution: Solution, name: str, n_parameters: int | None = None
) -> float:
    """Returns the value of a criterion for a solution; a smaller value is better.

    By default n_parameters is the number of fitted values of the problem with the wavelets of the solution.
    """
    if name in ON_HELD_OUT_ROWS:
        rows = problem.held_out
        if rows is None:
            raise InputError(f"criterion is {name!r}: needs held-out rows, and no rows are held out")
        errors = rows.force - problem.force(solution, rows.positions, rows.side)
        return held_out_deviance(name, rows, errors)
    p = problem.n_parameters(solution.basis) if n_parameters is None else n_parameters
    share = problem.limits.independent
    return deviance(name, share * problem.total(solution.rss), problem.independent, p)


def held_out_deviance(criterion: str, rows: HeldOutRows, errors: Float1D) -> float:
    """Returns the criterion of a network from its force errors on held-out rows."""
    counted = rows.in_jnd(errors) if criterion == "perceptual" else errors
    smallest = (1e-12 * float(np.ptp(rows.force))) ** 2 * len(counted)
    return deviance(criterion, max(float(counted @ counted), smallest, TINY), len(counted), 0)


Reporter = Callable[[str, int], None]
"""Function that is called with the model class and the present number of wavelets of a growing network, to
show progress."""

_reporter: ContextVar[Reporter | None] = ContextVar("reporter", default=None)


@contextmanager
def reporting_to(reporter: Reporter) -> Iterator[None]:
    """Calls `reporter` before each added wavelet of a growing network inside the with statement."""
    token = _reporter.set(reporter)
    try:
        yield
    finally:
        _reporter.reset(token)


def report(model_class: str, n_wavelets: int) -> None:
    """Reports the model class and the present number of wavelets of a growing network, to show progress."""
    if (reporter := _reporter.get()) is not None:
        reporter(model_class, n_wavelets)


@dataclass(frozen=True)
class Moving:
    """Fitted mass and damping of the object, and the sum of their forces at each row."""

    damping: float | None
    mass: float | None
    force: Float1D
    """(n,) force m L a + B L v of mass m and damping B at every row, with acceleration a, velocity v and
    low-pass filter L [force]"""
    known: Float1D
    """(n,) 1 in the rows with the velocity or acceleration that the fitted terms need, else 0"""


@dataclass(frozen=True)
class RowError:
    """Residual of every row, and the number of samples that each row represents."""

    residual: Float1D
    """(n,) [force]"""
    force: Float1D
    """(n,)"""
    weight: Float1D
    """(n,) number of samples of each row; 0 for a row that is left out of the error"""
    within: float = 0.0
    """Sum of squared differences of the samples from the mean force of their row [force^2]; 0 if each row is
    one sample"""

    @property
    def rmse(self) -> float:
        """RMS error of all samples [force]."""
        total = float(self.weight.sum())
        return float(np.sqrt((self.weight @ self.residual**2 + self.within) / total)) if total else 0.0

    @property
    def nrmse(self) -> float:
        """RMS error divided by `spread` [-]; 0 for a constant force."""
        spread = self.spread
        return self.rmse / spread if spread > 0.0 else 0.0

    @property
    def spread(self) -> float:
        """Standard deviation of the forces of the rows, weighted by their samples [force]."""
        if not self.weight.any():
            return 0.0
        if np.all(self.weight == 1.0):
            return float(np.std(self.force))
        mean = np.average(self.force, weights=self.weight)
        return float(np.sqrt(np.average((self.force - mean) ** 2, weights=self.weight)))


@dataclass(frozen=True)
class Candidate:
    """Candidate model: a solution of the least squares over the compressed rows of a recording."""

    model_class: str
    data: Rows
    """All rows of the recording, on which the error of the candidate is reported"""
    problem: SeparableProblem
    solution: Solution
    n_parameters: int
    stop_reason: str
    strokes: HysteresisInput | None = None
    """Direction state of each row; None for a model class without hysteresis"""
    moving: Moving | None = None
    """Mass and damping; None for a model class without them"""

    @property
    def side(self) -> Float1D | None:
        """(n,) direction state s of every row of the recording; None without hysteresis."""
        return None if self.strokes is None else self.strokes.side

    @property
    def share(self) -> Float1D:
        """(n,) weight of every row in the fit, from 0 to 1, besides the samples that it represents."""
        return np.ones(len(self.data.force)) if self.strokes is None else self.strokes.share

    @property
    def fit_weight(self) -> Float1D:
        """(n,) weight of every row in the fit: its share times the samples that it represents."""
        return self.share if self.data.weight is None else self.share * self.data.weight

    @property
    def static_force(self) -> Float1D:
        """(n,) recorded force of every row without the forces of mass and damping."""
        return self.data.force if self.moving is None else self.data.force - self.moving.force

    @property
    def play_radius(self) -> float | None:
        """[box]"""
        return None if self.strokes is None else self.strokes.play_radius

    @property
    def n_wavelets(self) -> int:
        return self.solution.basis.size

    @property
    def rmse(self) -> float:
        return self.problem.rmse(self.solution)

    def criterion(self, name: str) -> float:
        """Returns the value of a criterion for this candidate; a smaller value is better."""
        return criterion_of(self.problem, self.solution, name, self.n_parameters)

    def on_rows(self, name: str, weight: Float1D) -> float:
        """Returns the value of a criterion from the residuals of all rows, each of which represents `weight`
        (n,) samples.

        The rows of a fit are compressed in another way for each model class, and their sums of squares differ
        by the slopes inside the cells. The residuals of the rows do not.
        """
        problem, rows = self.problem, float(weight.sum())
        squares = float(weight @ self.residual**2) + self.data.within
        total = problem.total(squares * problem.samples / rows - problem.within)
        n = problem.independent * rows / problem.samples
        return deviance(name, total * n / problem.samples, n, self.n_parameters)

    def force_at(self, rows: slice | NDArray[np.intp] = ALL_ROWS) -> Float1D:
        """Returns the force (n,) of the candidate without the forces of mass and damping, at all rows or at
        some rows."""
        return self._force(self.data.box[rows], None if self.side is None else self.side[rows])

    def parts_at(self, positions: Float2D) -> tuple[Float1D, Float1D]:
        """Returns the mean force g (k,) of both strokes and the hysteresis h (k,) at positions (k, d) in the
        unit box; h is 0 without hysteresis."""
        if self.strokes is None:
            return self._force(positions, None), np.zeros(len(positions))
        middle = self._force(positions, np.zeros(len(positions)))
        return middle, self._force(positions, np.ones(len(positions))) - middle

    def _force(self, positions: Float2D, side: Float1D | None) -> Float1D:
        return self.problem.force(self.solution, positions, side)

    @cached_property
    def network(self) -> FittedNetwork:
        """The network of the candidate, in the units of the recording."""
        lower, reach, moving = self.data.lower, self.data.reach, self.moving
        return FittedNetwork(
            **parameters_of(self.solution, self.problem.readout, lower, reach),
            inputs=self.data.names,
            rows=self.data,
            period=self.data.period,
            play_radius=None if self.play_radius is None else self.play_radius * float(reach[0]),
            mass=None if moving is None else moving.mass,
            damping=None if moving is None else moving.damping,
            model_class=self.model_class,
            stop_reason=self.stop_reason,
            n_parameters=self.n_parameters,
            independent_rows=self.problem.independent,
        )

    @cached_property
    def residual(self) -> Float1D:
        """Recorded force of every row (n,) minus the force of the network, of the mass and of the damping."""
        return self.static_force - self.network.force(self.data.domain, self.side)

    @cached_property
    def error(self) -> RowError:
        """Error on the rows that are reported; they have the weights `data.counted`."""
        counted = 1.0 if self.data.counted is None else self.data.counted
        return replace(self.settled, weight=np.where(self.settled.weight > 0.0, counted, 0.0))

    @cached_property
    def settled(self) -> RowError:
        """Error on the rows that are reported, with their weights in the fit."""
        error = self.error_on(self.data.counted)
        return replace(error, weight=np.where(self.data.reported, error.weight, 0.0))

    def error_on(self, samples: Float1D | None) -> RowError:
        """Returns the error if each row represents the given number of samples (n,), or 1 sample each, with
        the weights of the fit. Rows without velocity, acceleration or direction state are left out if the
        model needs them."""
        weight = self.share if samples is None else samples * self.share
        if self.moving is not None:
            weight = weight * self.moving.known
        return RowError(self.residual, self.data.force, weight, self.data.within)


class Samples:
    """Rows of one recording: compressed rows for the fit, and held-out rows for the comparison of models."""

    def __init__(self, data: Rows, options: IdentifyOptions) -> None:
        self.data, self._held_out = data, data.held_out()
        self._compressor = Compressor(
            data.box,
            data.force,
            weight=data.weight,
            max_positions=options.search.cells(len(data.names)),
            within=data.within,
            limits=data.limits,
        )
        self.used = len(self._compressor.kept)
        """Number of recorded rows that are used to represent the recording"""
        self._resolved_by = options.search.resolved_by
        self._for_criterion = options.criterion in ON_HELD_OUT_ROWS

    def rows(self, strokes: HysteresisInput | None = None) -> Compressed:
        """Returns the compressed rows, without the held-out rows if the criterion needs held-out rows.

        Rows with unknown direction state are dropped and the remaining rows reweighted to the same total, so
        that all model classes are compared on the same number of samples.
        """
        only = ~self._held_out if self._for_criterion else np.ones(len(self.data.force), dtype=bool)
        if strokes is None:
            rows = self._compressor.rows(share=only)
        else:
            rows = self._compressor.rows(strokes.side, only * strokes.share)
            rows = rows.reweighted_to(self._compressor.samples(only))
        return rows if self.data.period is None else around_seam(rows)

    def problem(
        self, strokes: HysteresisInput | None = None, rows: Compressed | None = None
    ) -> SeparableProblem:
        """Returns the least-squares problem of compressed rows with direction states; by default of all."""
        rows = self.rows(strokes) if rows is None else rows
        held_out = None
        if self._for_criterion:
            side, known = (None, True) if strokes is None else (strokes.side, strokes.known)
            held_out = HeldOutRows.of(self.data.box, self.data.force, side, self._held_out & known)
        return problem_of(rows, resolved_by=self._resolved_by, held_out=held_out)


def local_noise_ratio(below: Candidate, above: Candidate) -> float:
    """Returns the mean squared residual where two candidates differ divided by that of all rows, at least 1.

    The rows are weighted by the squared difference of the two forces. A criterion with one noise level for
    all rows overestimates the evidence for structure by this ratio.
    """
    data = above.data
    rows = evenly_spread(np.flatnonzero(data.fitted))
    force = above.force_at(rows)
    weight = (force - below.force_at(rows)) ** 2
    if data.weight is not None:
        weight = weight * data.weight[rows]
    squares = (data.force[rows] - force) ** 2
    used = weight > 0.0
    if not used.any() or not (mean := float(squares[used].mean())) > 0.0:
        return 1.0
    return max(1.0, float(np.average(squares, weights=weight)) / mean)


class Judge:
    """Decides which of two candidates is accepted, by the criterion."""

    def __init__(self, options: IdentifyOptions, log: Log) -> None:
        self.criterion, self.evidence, self._log = options.criterion, options.search.evidence, log

    def better(self, below: Candidate, above: Candidate) -> Candidate:
        """Returns the more complex candidate if it is accepted, else the simpler candidate; adds the decision
        to the log."""
        decision = self.compared(below, above)
        self._log.decisions.append(decision)
        return above if decision.accepted else below

    def accepts(self, below: Candidate, above: Candidate) -> bool:
        """True if the more complex candidate `above` is accepted."""
        return self.compared(below, above).accepted

    def fall(self, below: Candidate, above: Candidate) -> float:
        """Returns the decrease of the criterion from the simpler candidate `below` to the more complex
        candidate `above`, on the rows that both candidates can use.

        If the noise is larger where two single-valued candidates over one position differ, the decrease of
        the error counts less. The residuals of a hysteresis are not noise, because its reversals are not
        fitted exactly, and those over several inputs contain what the rows between the wavelets show.
        """
        if self.criterion in ON_HELD_OUT_ROWS:
            return below.criterion(self.criterion) - above.criterion(self.criterion)
        weight = above.error_on(above.data.weight).weight
        falls = below.on_rows(self.criterion, weight) - above.on_rows(self.criterion, weight)
        if above.strokes is not None or above.problem.dimension > 1:
            return falls
        penalty, n = CRITERIA[self.criterion], above.problem.independent
        cost = penalty(n, above.n_parameters) - penalty(n, below.n_parameters)
        return (falls + cost) / local_noise_ratio(below, above) - cost

    def compared(self, below: Candidate, above: Candidate) -> Decision:
        """Returns the decision on the more complex candidate `above`."""
        name, evidence = self.criterion, self.evidence
        if enough(name, below.criterion(name)):
            reason = f"the error of the {in_words(below.model_class)} is below the just noticeable difference"
            return decided(above.model_class, False, reason)
        falls = self.fall(below, above)
        change = lowered(CRITERION_NAMES[name], falls)
        if (held_out := above.problem.held_out) is not None:
            evidence = max(evidence, standard_error(len(held_out.force)))
        if falls < evidence:
            change += f", must lower it by at least {evidence:.4g}"
        return decided(above.model_class, falls >= evidence, change)

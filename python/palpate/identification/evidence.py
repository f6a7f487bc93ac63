# SPDX-License-Identifier: Apache-2.0
"""What the rungs of a ladder are made of and judged on: the rows of one recording in the unit box."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from .._typing import Float1D, Float2D
from .compression import Compressed, Compressor
from .frame import resolved_frame
from .fresh import TRIM, FreshRows, gain, inside
from .growth import Grown, grow
from .hysteresis_input import HysteresisInput
from .options import IdentifyOptions
from .periodic import around_seam
from .rung import Rung
from .selection import Library
from .separable import Basis, SeparableProblem, problem_of
from .stopping import ON_FRESH_ROWS, enough, standard_error

ROBUST_GAIN = 0.5
"""Fall of the squared error, as a share, that a trimmed mean must show to outweigh a mean that shows none."""

LEAST_FRESH = 20
"""Fresh rows below which they are too few to refuse a rung."""


@dataclass(frozen=True)
class Judgement:
    """The comparison of two model classes."""

    earned: bool
    """The upper one earns its place"""
    why: str
    """What it gains, in words"""
    criterion_falls: bool
    """The criterion falls by enough: if it earns nothing, held-back rows refuse it"""


class Evidence:
    """Compressed rows, and the rows of the recording that are kept back to judge on.

    Parameters
    ----------
    box : (n, d)
        Positions in the unit box.
    force : (n,)
    fresh : (n,)
        Rows that are kept back.
    compressor : Compressor
        Of the same rows.
    options : IdentifyOptions
    single : bool
        Whether the force is known to be one: two strokes that a motion samples at different places look like
        one that wants ever more wavelets.
    """

    def __init__(
        self,
        box: Float2D,
        force: Float1D,
        fresh: NDArray[np.bool_],
        compressor: Compressor,
        options: IdentifyOptions,
        *,
        single: bool,
    ) -> None:
        self.box, self.force, self._single = box, force, single
        self._fresh, self._compressor, self._options = fresh, compressor, options
        self._judges_on_fresh = options.criterion in ON_FRESH_ROWS

    def rows(self, strokes: HysteresisInput | None = None) -> Compressed:
        """Compressed rows: all of them, or those that are not kept back for the criterion.

        Rows whose hysteresis input is unknown are stood for by the others, so that all rungs are judged on
        as many.
        """
        only = ~self._fresh if self._judges_on_fresh else None
        if strokes is None:
            rows = self._compressor.rows(only=only)
        else:
            known = strokes.known if only is None else only & strokes.known
            rows = self._compressor.rows(strokes.side, known)
            if not strokes.known.all():
                rows = rows.standing_for(self._compressor.samples(only))
        return rows if self._options.period is None else around_seam(rows)

    def problem(self, rows: Compressed, strokes: HysteresisInput | None = None) -> SeparableProblem:
        """Least squares over compressed rows."""
        fresh = self.fresh_rows(strokes) if self._judges_on_fresh else None
        return problem_of(rows, resolved_by=self._options.resolved_by, fresh=fresh)

    def fresh_rows(
        self, strokes: HysteresisInput | None, known: NDArray[np.bool_] | None = None
    ) -> FreshRows:
        """Rows that are kept back, of those whose hysteresis input is known."""
        known = strokes.known if strokes is not None else known
        rows = self._fresh if known is None else self._fresh & known
        return FreshRows.of(self.box, self.force, None if strokes is None else strokes.side, rows)

    def judged(self, below: Rung, above: Rung, *, errors: float = 1.0) -> Judgement:
        """Compare the upper rung with the lower one, by the criterion and then on held-back rows.

        On these the squared error must fall by more than that many of its standard errors.
        """
        options, name = self._options, self._options.criterion
        if enough(name, below.criterion(options)):
            return Judgement(False, f"{below.name} is already closer than a hand can tell", False)
        falls = self.fall(below, above)
        changes = f"{name} {'falls' if falls > 0 else 'rises'} by {abs(falls):.4g}"
        fresh = self.fresh_rows(above.strokes)
        evidence = options.rung_evidence
        if name in ON_FRESH_ROWS:
            evidence = max(evidence, standard_error(len(fresh.force)))
        if falls < evidence:
            return Judgement(False, f"{changes}, it has to fall by {evidence:.4g} or more", False)
        share, error = self._fresh_gain(below, above)
        way = "falls" if share > 0.0 else "rises"
        by = f"{_percent(abs(share), 4)} +- {_percent(error, 2)} %"
        measured = f"the squared error on fresh rows {way} by {by}"
        if share <= errors * error and len(fresh.force) >= LEAST_FRESH:
            return Judgement(False, f"{changes}, but {measured}", True)
        return Judgement(True, f"{changes}, {measured}", True)

    def earned(self, below: Rung, above: Rung) -> bool:
        """True if the upper rung earns its place."""
        return self.judged(below, above).earned

    def fall(self, below: Rung, above: Rung) -> float:
        """Fall of the criterion from one rung to another, on the rows whose hysteresis input is known.

        What noise left in the other rows, by luck, is as much as a rung has to gain.
        """
        options, strokes = self._options, above.strokes
        if strokes is not None and not strokes.known.all() and not self._judges_on_fresh:
            rows = self._compressor.rows(below.side, strokes.known).standing_for(above.rows.samples)
            problem = self.problem(rows)
            solution = problem.with_coefficients(
                problem.solve(below.solution.basis), below.solution.coefficients
            )
            below = replace(below, problem=problem, solution=solution)
        return below.criterion(options) - above.criterion(options)

    def _fresh_gain(self, below: Rung, above: Rung) -> tuple[float, float]:
        """Fall of the squared error on held-back rows as a share, and its standard error.

        Only rows inside the range of the fitted rows count: outside it a network is not defined by data. If
        the mean over all groups shows no gain, but the trimmed mean a large one, the trimmed mean counts: a
        few groups then hold rows that no fitted row is near.
        """
        known = None if above.strokes is None else above.strokes.known
        fitted = ~self._fresh if known is None else ~self._fresh & known
        errors = []
        for rung in (below, above):
            problem = problem_of(
                self._compressor.rows(rung.side, fitted), resolved_by=self._options.resolved_by
            )
            fresh = self.fresh_rows(rung.strokes, known)
            errors.append(rung.fresh_errors(problem, fresh)[inside(fresh.positions, self.box[fitted])])
        if len(errors[0]) < LEAST_FRESH:
            return gain(*errors) if len(errors[0]) else (0.0, 0.0)
        share, error = gain(*errors)
        if share > error:
            return share, error
        trimmed = gain(*errors, trim=TRIM)
        return trimmed if trimmed[0] > max(trimmed[1], ROBUST_GAIN) else (share, error)

    def grown(
        self,
        rows: Compressed,
        strokes: HysteresisInput | None,
        name: str,
        start: Basis,
        options: IdentifyOptions,
    ) -> tuple[SeparableProblem, Grown]:
        """A network grown from the wavelets of start, and the problem that it solves."""
        problem = self.problem(rows, strokes)
        library = Library(problem, resolved_frame(problem, options))
        return problem, grow(problem, library, start, name, options, single=self._single)


def _percent(share: float, digits: int) -> str:
    return f"{100 * share:.{digits}g}" if share < 1.0 else f"{100 * share:.0f}"

# SPDX-License-Identifier: Apache-2.0
"""Model classes of a single-valued force: constant, linear, and a wavelet network over the inputs."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..network.basis import Basis
from ..search.evidence import Candidate
from .climb import Climb, ModelClass

SMALLER_ERRORS = 3.0
"""Standard errors by which a smaller network must improve on held-out rows: each further try may succeed by
chance."""

HELD_OUT = "held-out rows"
"""Reason for which growth stopped, if held-out rows refused a larger network."""


class Constant(ModelClass):
    """The mean force."""

    name = "constant"

    def fit(self, below: Candidate | None) -> Candidate:
        straight = straight_line(self._climb)
        rows, problem = straight.rows, straight.problem
        coefficients = np.zeros_like(straight.solution.coefficients)
        coefficients[0, 0] = float(np.average(rows.force, weights=rows.weight))
        level = problem.with_coefficients(straight.solution, coefficients)
        reason = "data" if problem.n_parameters(0) >= problem.samples else straight.stop_reason
        return self._climb.recorded(
            replace(straight, model_class=self.name, solution=level, n_parameters=1, stop_reason=reason)
        )


class Linear(ModelClass):
    """A straight line over every input."""

    name = "linear"

    def fit(self, below: Candidate | None) -> Candidate:
        return self._climb.recorded(self._climb.constrained(straight_line(self._climb)))

    def better(self, below: Candidate | None) -> Candidate:
        """As for every class, but not where the rows are too few for a line."""
        if below is not None and below.problem.n_parameters(0) >= below.problem.samples:
            return below
        return super().better(below)


class Network(ModelClass):
    """A wavelet network over the inputs, named by what they are."""

    def __init__(self, climb: Climb, name: str) -> None:
        super().__init__(climb)
        self.name = name

    def fit(self, below: Candidate | None) -> Candidate:
        return self._of_size(self._climb.options.max_wavelets)

    def better(self, below: Candidate | None) -> Candidate:
        """The network that is accepted, or the candidate below.

        If held-out rows refuse a network that the criterion prefers, networks of half its size are tried.
        """
        assert below is not None
        size, errors = self._climb.options.max_wavelets, 1.0
        if below.problem.n_parameters(1) >= below.problem.samples:
            return below
        while size > 0:
            above = self._of_size(size)
            judged = self._climb.judge.noted(below, above, errors=errors)
            if judged.earned:
                return above
            size = above.n_wavelets // 2 if judged.criterion_falls else 0
            errors = SMALLER_ERRORS
        return below

    def _of_size(self, size: int) -> Candidate:
        """A network of at most that many wavelets, with its constraints."""
        climb = self._climb
        whole = size == climb.options.max_wavelets
        problem = climb.samples.problem(climb.rows)
        start = Basis.empty(problem.dimension)
        if whole:
            start = climb.begun.get(self.name, start)
        grown = climb.grown(problem, start, self.name, size)
        if whole:
            climb.begun[self.name] = grown.solution.basis
        n_parameters = grown.problem.n_parameters(len(grown.solution.basis))
        reason = grown.stop_reason if whole else HELD_OUT
        return climb.constrained(
            Candidate(self.name, climb.rows, grown.problem, grown.solution, n_parameters, reason)
        )


def straight_line(climb: Climb) -> Candidate:
    """The straight line without its constraints."""
    rows, problem = climb.rows, climb.samples.problem(climb.rows)
    solution = problem.solve(Basis.empty(problem.dimension))
    criterion = climb.options.criterion
    return Candidate("linear", rows, problem, solution, problem.n_parameters(0), criterion)

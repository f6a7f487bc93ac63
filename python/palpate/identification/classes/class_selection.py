# SPDX-License-Identifier: Apache-2.0
"""Model selection over the rows of one recording: tries model classes in order, the simplest first.

A model class is compared with the next simpler accepted class on the same samples by the same criterion, with
constraints imposed. It is accepted only if the criterion decreases by at least `evidence` (of
:class:`SearchOptions`). The notes hold the decrease for every class, accepted or not.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cached_property
from typing import Any, TypeVar

import numpy as np

from ...errors import InputError
from ..data.rows import Rows
from ..data.strokes import HysteresisInput
from ..log import Log, PathPoint, in_words
from ..network.basis import Basis
from ..network.constraints import (
    Bound,
    crossing,
    domain_bounds,
    impose,
    moved_to_bounds,
    violated_positions,
)
from ..network.separable import SeparableProblem, Solution
from ..options import IdentifyOptions
from ..search.evidence import Candidate, Judge, Samples, criterion_of
from ..search.growth import Growth
from .dynamics import Dynamics

Value = TypeVar("Value")

REGROWTH_ERROR_RATIO = 1.01
"""Ratio of the RMS error with constraints to the RMS error without constraints, above which a network is
grown again on forces that keep the constraints [-]."""

FORCE_MARGIN = 0.1
"""Part of the range of the recorded forces by which a model may exceed them between the rows [-]."""

VELOCITY_INPUTS = ("position", "velocity")
"""Inputs of a network of the model class velocity."""

NETWORK_CLASSES = {("position",): "position", VELOCITY_INPUTS: "velocity"}
"""Maps the inputs of a network to the name of its model class; "network" for all other inputs."""


class ClassSelection:
    """One model selection over the rows of one recording, which tries the model classes in their order, the
    simplest first; and the best candidate so far."""

    def __init__(self, data: Rows, options: IdentifyOptions, classes: Sequence[ModelClass]) -> None:
        self.data, self.options, self.classes = data, options, classes
        self.log = Log()
        self.samples = Samples(data, options)
        self.judge = Judge(options, self.log)
        single = data.side is None and (data.starts is None or len(data.names) > 1)
        self.growth = Growth(options, single=single)
        self._once: dict[Callable[..., Any], tuple[Candidate, Any]] = {}
        self._fixed_force = self._fixed_in_box()
        self.spread = float(np.std(data.force[data.reported])) or 1.0
        given = len(data.force) if data.weight is None else int(np.count_nonzero(data.weight))
        if self.samples.used < given:
            self.log.rows.append(f"{self.samples.used} of {given} rows are used, evenly spread.")
        self.best = constant(self)
        """Candidate of the most complex model class that has been accepted"""
        self.try_classes(classes)

    def try_classes(self, classes: Sequence[ModelClass]) -> None:
        """Tries model classes in order; each is compared with the best candidate of the classes before it."""
        for model_class in classes:
            self.best = model_class(self, self.best)

    def once(self, compute: Callable[[ClassSelection], Value]) -> Value:
        """Returns the value of a function of this selection, computed once for each best candidate."""
        if compute not in self._once or self._once[compute][0] is not self.best:
            self._once[compute] = self.best, compute(self)
        value: Value = self._once[compute][1]
        return value

    def repeated(self, data: Rows) -> ClassSelection:
        """Repeats this model selection on changed rows."""
        return ClassSelection(data, self.options, self.classes)

    @cached_property
    def problem(self) -> SeparableProblem:
        """Least-squares problem of the rows without direction state."""
        return self.samples.problem()

    def candidate(
        self,
        model_class: str,
        problem: SeparableProblem,
        solution: Solution,
        stop_reason: str,
        *,
        strokes: HysteresisInput | None = None,
    ) -> Candidate:
        """Returns the candidate model for a solution; by default one without direction state."""
        n_parameters = problem.n_parameters(solution.basis)
        if strokes is not None and strokes.play_radius is not None:
            n_parameters += 1
        return Candidate(model_class, self.data, problem, solution, n_parameters, stop_reason, strokes)

    @cached_property
    def motion(self) -> Dynamics | None:
        """Recorded motion, to which mass and damping are fitted; None if there is no time, the option inputs
        is not "auto", or the force has inputs besides position."""
        data = self.data
        decides = data.parts and len(data.names) == 1 and self.options.inputs == "auto"
        return Dynamics(data, self.options) if decides else None

    def grown(
        self,
        problem: SeparableProblem,
        start: Basis,
        model_class: str,
        *,
        most: int | None = None,
        strokes: HysteresisInput | None = None,
    ) -> Candidate:
        """Returns the candidate of a network that grows from the wavelets of `start`, and reports the tested
        networks."""
        grown = self.growth.grow(problem, start, model_class, most=most)
        self.log.path.extend(grown.path)
        return self.candidate(model_class, grown.problem, grown.solution, grown.stop_reason, strokes=strokes)

    def recorded(self, candidate: Candidate) -> Candidate:
        """Adds a candidate to the list of tested networks and returns it."""
        value = candidate.criterion(self.options.criterion)
        self.log.path.append(PathPoint(candidate.model_class, candidate.n_wavelets, candidate.rmse, value))
        return candidate

    def constrained(self, candidate: Candidate) -> Candidate:
        """Returns the candidate with constraints imposed; adds the change of its error to the notes.

        If the constraints raise the RMS error by more than 1 %, the network is grown further on forces that
        keep the constraints. The new network is taken if the criterion prefers it.
        """
        problem = candidate.problem
        bounds = self.bounds(problem)
        if problem.dimension > 1 or not bounds:
            return candidate
        kept = impose(problem, candidate.solution, bounds)
        if kept is candidate.solution:
            return candidate
        worse = problem.rmse(kept) > REGROWTH_ERROR_RATIO * candidate.rmse
        if worse and len(kept.basis) and not all(bound.seam for bound in bounds):
            rows = self.samples.rows(candidate.strokes)
            moved = moved_to_bounds(problem, rows, candidate.solution, bounds)
            compatible = self.samples.problem(candidate.strokes, moved)
            regrown = self.grown(compatible, candidate.solution.basis, candidate.model_class)
            trial = impose(problem, problem.solve(regrown.solution.basis), bounds)
            if self._judged_on(regrown.problem, trial) < self._judged_on(regrown.problem, kept):
                kept = trial
        self.log.notes.append(self._cost_of(bounds, candidate, problem.rmse(kept)))
        more = problem.n_parameters(kept.basis) - problem.n_parameters(candidate.solution.basis)
        return replace(candidate, solution=kept, n_parameters=candidate.n_parameters + more)

    def _cost_of(self, bounds: Sequence[Bound], free: Candidate, rmse: float) -> str:
        """Returns a note on imposed constraints: the change of the RMS error by them, and the largest release
        force minus press force without them."""
        broken = (
            bound.name for bound in bounds if len(violated_positions(free.problem, free.solution, bound))
        )
        names, unit = " and ".join(dict.fromkeys(broken)), self.data.force_unit
        note = (
            f"{in_words(free.model_class)}: {names} imposed over the whole domain, which changes the RMS "
            f"error from {unit.interval(free.rmse, rmse)}."
        )
        nonnegative = self.options.hysteresis_nonnegative and free.strokes is not None
        if not nonnegative or not (above := self.above_press(free)):
            return note
        return f"{note} Without this constraint {above}; a passive object cannot do that."

    def above_press(self, free: Candidate) -> str:
        """Returns how far release is above press in a candidate without constraints, and where; an empty text
        if the difference is small."""
        found = crossing(free.problem, free.solution)
        if found is None:
            return ""
        (height, *ends), lower, reach = found, float(self.data.lower[0]), float(self.data.reach[0])
        places = self.data.position_unit.interval(*(lower + reach * end for end in ends))
        return f"release is up to {self.data.force_unit.text(height)} above press at {places}"

    def bounds(self, problem: SeparableProblem) -> list[Bound]:
        """Returns the constraints that the options require."""
        slopes, reach = self.options.slope_limits, float(self.data.reach[0])
        return domain_bounds(
            problem,
            hysteresis=self.options.hysteresis_nonnegative,
            slopes=None if slopes is None else (slopes[0] * reach, slopes[1] * reach),
            fixed=self._fixed_force,
            periodic=self.options.period is not None,
            forces=self._force_range if slopes is None and self._fixed_force is None else None,
        )

    @cached_property
    def _force_range(self) -> tuple[float, float]:
        """Least and largest force of the model in its domain: those of the rows, and a little more, because
        the force can have an extreme value between two rows."""
        force = self.data.force[self.data.reported]
        more = FORCE_MARGIN * float(np.ptp(force))
        return float(force.min()) - more, float(force.max()) + more

    def _judged_on(self, problem: SeparableProblem, solution: Solution) -> float:
        """Returns the criterion of a solution on the rows of another least-squares problem, without a new
        fit."""
        moved = problem.with_coefficients(solution, solution.coefficients)
        return criterion_of(problem, moved, self.options.criterion)

    def _fixed_in_box(self) -> tuple[float, float] | None:
        """Returns the fixed force of the options and its position in the unit box; None without a fixed
        force."""
        if self.options.fixed_force is None:
            return None
        (place, fixed), lower, reach = self.options.fixed_force, self.data.lower[0], self.data.reach[0]
        if not lower <= place <= lower + reach:
            raise InputError(
                f"fixed_force is at position {place:g}: must be within the recorded positions, {lower:g} to "
                f"{lower + reach:g}"
            )
        return float((place - lower) / reach), fixed


ModelClass = Callable[[ClassSelection, Candidate], Candidate]
"""Fits a candidate of a kind of force law and returns it if it is accepted. Otherwise, or if the rows or
options do not allow it, returns the given candidate, the best one of the simpler model classes."""


def linear(selection: ClassSelection, below: Candidate) -> Candidate:
    """Fits the model class linear, a straight line over every input, if there are enough rows."""
    if below.problem.n_parameters(Basis.empty(below.problem.dimension)) >= below.problem.samples:
        return below
    line = selection.recorded(selection.constrained(straight_line(selection)))
    return selection.judge.better(below, line)


def network(selection: ClassSelection, below: Candidate) -> Candidate:
    """Fits a wavelet network over the inputs; they decide the name of its model class: position, velocity,
    network."""
    problem, start = selection.problem, Basis.empty(selection.problem.dimension)
    if selection.options.max_wavelets == 0 or problem.n_parameters(start, more=1) >= problem.samples:
        return below
    name = NETWORK_CLASSES.get(selection.data.names, "network")
    found = selection.grown(problem, start, name)
    return selection.judge.better(below, selection.constrained(found))


def constant(selection: ClassSelection) -> Candidate:
    """Returns the candidate of model class constant, the mean force, with which every model selection
    starts."""
    straight = straight_line(selection)
    rows, problem = selection.samples.rows(), straight.problem
    coefficients = np.zeros_like(straight.solution.coefficients)
    coefficients[0, 0] = float(np.average(rows.force, weights=rows.weight))
    level = problem.with_coefficients(straight.solution, coefficients)
    reason = (
        "data" if problem.n_parameters(straight.solution.basis) >= problem.samples else straight.stop_reason
    )
    return selection.recorded(
        replace(straight, model_class="constant", solution=level, n_parameters=1, stop_reason=reason)
    )


def straight_line(selection: ClassSelection) -> Candidate:
    """Returns the candidate of model class linear, a straight line, without constraints."""
    problem = selection.problem
    solution = problem.solve(Basis.empty(problem.dimension))
    return selection.candidate("linear", problem, solution, selection.options.criterion)

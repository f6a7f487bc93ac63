# SPDX-License-Identifier: Apache-2.0
"""Model class hysteresis: f = g + s h, with mean force g, hysteresis h, and direction state s from strokes or
a play operator."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cached_property

import numpy as np
import scipy
from numpy.typing import NDArray

from ..._typing import Float1D
from ...errors import InputError
from ...verdict import usable
from ..data.limits import evenly_spread
from ..data.strokes import (
    HysteresisInput,
    turns_before,
    weights_of_shared_errors,
)
from ..log import Decision, causes_of_crossing
from ..network.basis import Basis
from ..options import IdentifyOptions
from ..search.evidence import Candidate, Samples, on_fitted_rows
from .class_selection import ClassSelection, straight_line
from .findings import USABLE_NRMSE

REPORTED_ERROR_RATIO = 2.0
"""Ratio of the RMS error with the constraint hysteresis h >= 0 to the RMS error without this constraint,
above which a finding names a cure [-]."""

FIRST_MAX_WAVELETS = 4
"""Largest number of wavelets that a network with hysteresis has before the play radius is searched for the
second time."""

MOST_RADIUS_SEARCHES = 6
"""Largest number of searches of the play radius."""

RADIUS_TOLERANCE = 1e-3
"""Relative error of the play radius at which the search of the play radius ends [-]."""

RADIUS_SEARCH_RATIO = 2.0
"""A search tries play radii between the best radius so far divided by this ratio and that radius times this
ratio [-]."""

REVERSAL = 0.12
"""Distance from a turn up to which no row is fitted by the wavelets that show the play radius [travel]: the
friction of the largest radius reverses in it. With twice this distance, few rows are left."""

REWEIGHTINGS = 5
"""Number of fits of given wavelets, each with the weights that follow from the fit before."""


def hysteresis(selection: ClassSelection, below: Candidate) -> Candidate:
    """Fits the model class hysteresis, if the options allow it and the rows have directions or the starts of
    motions; refuses options that name it and rows that have neither."""
    inputs, data = selection.options.inputs, selection.data
    if data.side is not None or (data.starts is not None and len(data.names) == 1):
        allowed = inputs == "auto" or "hysteresis" in inputs
        return Hysteresis(selection).better(below) if allowed else below
    if "hysteresis" in inputs:
        raise InputError(
            "inputs names hysteresis: the recording needs time, or both directions in a direction "
            "column; name that column, or remove hysteresis from inputs"
        )
    return below


class Hysteresis:
    """Network with hysteresis, f = g + s h; it is grown if hysteresis lowers the criterion or the options
    name it."""

    name = "hysteresis"

    def __init__(self, selection: ClassSelection) -> None:
        self._selection, self._named = selection, selection.options.inputs != "auto"

    def better(self, below: Candidate) -> Candidate:
        selection, data = self._selection, self._selection.data
        if data.side is not None:
            known = np.ones(len(data.side), dtype=bool)
            return self._chosen(below, self._free(below, HysteresisInput(data.side, known)))
        play, basis, best = PlaySearch(selection.samples, selection.options), below.solution.basis, None
        if data.order is not None and {-1.0, 1.0} <= set(data.order.tolist()):
            # The direction can also change at once at a turn. Wavelets of strokes without their reversals
            # show the radius; those of all rows would fit the reversals.
            order = self._weighted(HysteresisInput(data.order, data.order != 0.0), basis)
            best, settled = self._free(below, order), play.settled(order)
            if settled.both_ways:
                basis = self._free(below, settled).solution.basis
        for strokes in play.best_of_options(basis):
            found = self._free(below, strokes, play, first=basis)
            best = found if best is None or self._fits_better(found, best) else best
        if best is not None:
            return self._chosen(below, best)
        untested = "the motions of the recording between gaps of time are too short, or never turn back"
        if self._named:
            raise InputError(f"inputs names hysteresis: {untested}")
        selection.log.decisions.append(Decision("hysteresis", "not tested", untested))
        return below

    def _fits_better(self, one: Candidate, other: Candidate) -> bool:
        """True if the criterion of the first of two candidates is smaller on the rows that both can use, with
        their weights in the first one. A play radius must lower it as much as a model class, compared with
        the order of rows."""
        weight = one.error_on(one.data.weight).weight * (other.share > 0.0)
        evidence = self._selection.options.search.evidence
        name = on_fitted_rows(self._selection.judge.criterion)

        def value(candidate: Candidate) -> float:
            assert candidate.strokes is not None
            return candidate.on_rows(name, weight) + evidence * (candidate.strokes.play_radius is not None)

        return value(one) < value(other)

    def _free(
        self,
        below: Candidate,
        strokes: HysteresisInput,
        play: PlaySearch | None = None,
        first: Basis | None = None,
    ) -> Candidate:
        """Returns a network with hysteresis, without constraints, for given direction states, or for those of
        the best play radius if `play` searches it.

        A hysteresis h >= 0 has a mean, which a fit with the wavelets `first`, by default those of the simpler
        candidate, already shows.
        If the criterion does not decrease with these wavelets, and the options do not name hysteresis, no
        network with hysteresis is grown.
        """
        selection, judge = self._selection, self._selection.judge
        first = below.solution.basis if first is None else first
        strokes = self._weighted(strokes, first)
        problem = selection.samples.problem(strokes)
        start = problem.solve(first)
        free = selection.candidate(self.name, problem, start, judge.criterion, strokes=strokes)
        if self._named or judge.fall(below, free) > 0.0:
            return self._grown(below, free, play)
        return free

    def _chosen(self, below: Candidate, free: Candidate) -> Candidate:
        """Returns the better one of the simpler candidate and a network with hysteresis, on which the
        constraints are imposed."""
        judge, named = self._selection.judge, self._named
        if not named and not judge.accepts(below, free):
            return judge.better(below, free)
        kept = self._selection.constrained(free)
        if named:
            self._report_sign(kept, kept, free)
            return kept
        single = self._single_valued(kept) if kept is not free and below.n_wavelets else below
        best = judge.better(single, kept)
        if best is single and best.n_wavelets < below.n_wavelets:
            self._selection.log.notes.append(
                f"{best.n_wavelets} of {below.n_wavelets} wavelets over position are kept. The removed "
                "wavelets modelled the difference between press and release."
            )
        self._report_sign(best, kept, free)
        return best

    def _grown(self, below: Candidate, found: Candidate, play: PlaySearch | None) -> Candidate:
        """Returns a network with hysteresis; its play radius is searched if hysteresis is accepted or the
        options name it.

        Wavelets grown at a wrong play radius, or without hysteresis, model the error of the radius. A radius
        found with too few wavelets compensates for the missing wavelets. So growth starts again without
        wavelets, and the radius is searched again each time the allowed number of wavelets doubles.
        """
        assert found.strokes is not None
        selection, samples = self._selection, self._selection.samples
        strokes, most = found.strokes, selection.options.max_wavelets
        basis, searched, complete = found.solution.basis, False, False
        for _ in range(MOST_RADIUS_SEARCHES):
            before = strokes
            if play and (self._named or selection.judge.accepts(below, found)):
                strokes = self._weighted(play.with_best_radius(strokes, basis), basis)
                basis, searched = (basis if searched else Basis.empty(1)), True
            if complete and strokes is before:
                break
            limit = min(most, max(FIRST_MAX_WAVELETS, 2 * len(basis))) if play else most
            problem, passed = samples.problem(strokes), len(selection.log.path)
            found = selection.grown(problem, basis, self.name, most=limit, strokes=strokes)
            basis, path = found.solution.basis, selection.log.path[passed:]
            complete = limit == most or max(point.n_wavelets for point in path) < limit
        return found

    def _weighted(self, strokes: HysteresisInput, basis: Basis) -> HysteresisInput:
        """Returns direction states with weights of the rows behind turns, from fits of given wavelets, each
        with the weights before."""
        data, samples = self._selection.data, self._selection.samples
        if data.order is None or strokes.weight is not None:
            return strokes
        order, share = data.order * data.fitted, self._selection.options.search.contact_share
        for _ in range(REWEIGHTINGS):
            problem = samples.problem(strokes)
            found = self._selection.candidate(self.name, problem, problem.solve(basis), "", strokes=strokes)
            residual = data.force - found.force_at()
            weight = weights_of_shared_errors(data.path[:, 0], order, residual, data.force, share)
            strokes = replace(strokes, weight=weight)
        return strokes

    def _single_valued(self, hysteresis: Candidate) -> Candidate:
        """Returns a single-valued force with the wavelets of a network with hysteresis; superfluous wavelets
        are removed.

        This force is the simpler candidate if the constraints change the network with hysteresis. A network
        grown without hysteresis is not used: press and release, sampled at different positions by a periodic
        motion, would look like one rapidly changing force.
        """
        selection = self._selection
        problem = selection.problem
        start = problem.solve(hysteresis.solution.basis)
        problem = problem.with_prior(start.rss)
        problem, solution = selection.growth.prune(problem, problem.solve(start.basis))
        line = selection.recorded(selection.constrained(straight_line(selection)))
        if len(solution.basis) == 0:
            return line
        found = selection.candidate("position", problem, solution, hysteresis.stop_reason)
        found = selection.recorded(selection.constrained(found))
        return found if selection.judge.accepts(line, found) else line

    def _report_sign(self, best: Candidate, kept: Candidate, free: Candidate) -> None:
        """Reports causes and cures if the constraint h >= 0 raises the error much."""
        spread = self._selection.spread
        if kept.rmse <= REPORTED_ERROR_RATIO * free.rmse or best.rmse <= USABLE_NRMSE * spread:
            return
        where = self._selection.above_press(free) or "on a part of the loop"
        cost = f"NRMSE {kept.rmse / spread:.3g} with press >= release, {free.rmse / spread:.3g} without"
        causes = causes_of_crossing(bool(self._selection.data.parts))
        sentence = (
            f"hysteresis gains energy: {where} ({cost}); if a sign is reversed, give --negate force or "
            f"--negate position; {causes}"
        )
        self._selection.log.findings[:] = [usable(sentence)]


class PlaySearch:
    """Searches the play radius that fits the motions of a recording over one position best."""

    def __init__(self, samples: Samples, options: IdentifyOptions) -> None:
        data = samples.data
        moving = np.maximum.accumulate(np.where(data.fitted, np.arange(len(data.force)), 0))
        # A tool that waits does not move the play: noise of its position would.
        self._samples, self._path, self._starts = samples, data.path[moving, 0], list(data.starts or ())
        self._radii, self._evidence = sorted(options.search.play_radius), options.search.evidence

    def settled(self, order: HysteresisInput) -> HysteresisInput:
        """Returns the directions of the rows behind reversals."""
        moving, stroke, turns = turns_before(order.side * self._samples.data.fitted)
        settled = np.zeros(len(self._path), dtype=bool)
        settled[moving] = np.abs(self._path[moving] - self._path[turns][stroke]) > REVERSAL
        return replace(order, known=settled)

    def best_of_options(self, basis: Basis) -> list[HysteresisInput]:
        """Returns the direction states for each play radius of the options at which the error on given
        wavelets is smaller than at its neighbours, and than that of the order of rows.

        The error can fall further beyond the smallest and the largest of three or more radii. Where the order
        of rows is known, the smallest is not returned, and the largest only if the tool turns at different
        places: else wavelets there fit as much. Returns none if the motions between gaps of time are too
        short for every play radius, or never reverse: with one stroke only the sum g + h is determined.
        """
        if not self._usable:
            return []
        known, order, least = self._thinned(self._usable[-1]), self._samples.data.order, math.inf
        first = last = math.inf
        if order is not None:
            known &= order != 0.0
            least = self._residual_squares(HysteresisInput(order, known), basis, known)
            if len(self._usable) > 2:
                first, last = 0.0, math.inf if self._turns_apart(order) else 0.0
        errors = [first, *(self._residual_squares(each, basis, known) for each in self._usable), last]
        return [
            strokes
            for strokes, before, error, after in zip(
                self._usable, errors, errors[1:], errors[2:], strict=False
            )
            if error <= min(before, after) and error < least
        ]

    def with_best_radius(self, strokes: HysteresisInput, basis: Basis) -> HysteresisInput:
        """Returns the direction states for the best play radius near the given one, on given wavelets.

        Keeps the given radius unless another radius lowers the criterion by as much as a model class must.
        Call only for accepted or named hysteresis: a free play radius also fits other differences between
        press and release, such as damping.
        """
        radius = strokes.play_radius or 0.0
        least, most = (each.play_radius or 0.0 for each in (self._usable[0], self._usable[-1]))
        lower, upper = max(radius / RADIUS_SEARCH_RATIO, least), min(radius * RADIUS_SEARCH_RATIO, most)
        if lower >= upper:
            return strokes
        known = self._thinned(self._of(upper))
        found = scipy.optimize.minimize_scalar(
            lambda log_radius: self._residual_squares(self._of(math.exp(log_radius)), basis, known),
            bounds=(math.log(lower), math.log(upper)),
            method="bounded",
            options={"xatol": RADIUS_TOLERANCE},
        )
        falls = math.log(self._residual_squares(strokes, basis, known) / found.fun) * np.count_nonzero(known)
        return self._of(math.exp(found.x)) if falls > self._evidence else strokes

    def _turns_apart(self, order: Float1D) -> bool:
        """True if the tool, whose rows have the directions `order` (n,), turns at places that are further
        apart than the way in which friction reverses."""
        at = self._path[turns_before(order)[2][1:]]
        return any(np.ptp(ends) > REVERSAL for ends in (at[::2], at[1::2]) if len(ends))

    def _of(self, radius: float) -> HysteresisInput:
        return HysteresisInput.of_play(np.split(self._path, self._starts[1:]), radius)

    @cached_property
    def _usable(self) -> list[HysteresisInput]:
        """Direction states of the rows for each tried play radius, the smallest radius first; without radii
        at which rows of one stroke only have a known direction state."""
        return [one for one in map(self._of, self._radii) if one.both_ways]

    def _residual_squares(self, strokes: HysteresisInput, basis: Basis, known: NDArray[np.bool_]) -> float:
        """Returns the residual sum of squares of the best weights on given wavelets, over the rows `known`.

        All play radii are compared on the same rows, so that the random error of further rows has no
        influence.
        """
        strokes = replace(strokes, known=known, weight=None)
        problem = self._samples.problem(strokes)
        return problem.total(problem.solve(basis).rss)

    def _thinned(self, strokes: HysteresisInput) -> NDArray[np.bool_]:
        """Selects evenly spread rows (n,) of the fitted rows with known direction state."""
        thin = np.zeros(len(strokes.known), dtype=bool)
        thin[evenly_spread(np.flatnonzero(self._samples.data.fitted))] = True
        return np.asarray(thin & strokes.known)

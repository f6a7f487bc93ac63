# SPDX-License-Identifier: Apache-2.0
"""Model class hysteresis: f = g + s h, with s from strokes or from the play operator."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from ...errors import InputError
from ...verdict import usable
from ..data.strokes import HysteresisInput
from ..decision import Decision
from ..network.basis import Basis
from ..network.constraints import crosses_where_steep, impose
from ..options import IdentifyOptions
from ..search.evidence import Candidate, Samples
from .climb import Climb, ModelClass, straight_line
from .findings import USABLE_NRMSE

GAINS_ENERGY = 2.0
"""Ratio of the RMS errors with and without h >= 0 above which a cure is named."""

FIRST_SIZE = 4
"""Wavelets with hysteresis until the play radius is sought again."""

RADIUS_ROUNDS = 6
"""Times that it is sought at most."""

LEAST_KNOWN = 0.5
"""Share of the rows whose hysteresis input must be known, for a play radius to be considered."""

NEAR = 1e-3
"""Share of itself to which a play radius is found."""

WITHIN = 2.0
"""Ratio to the radius that helped most so far within which a better one is sought."""

MOST_ROWS = 100_000
"""Rows that are enough to distinguish two radii; more are thinned out evenly."""


class Hysteresis(ModelClass):
    """g + s h on top of the wavelets of the candidate below, if it is accepted or named as an input."""

    name = "hysteresis"

    def __init__(self, climb: Climb) -> None:
        super().__init__(climb)
        data, options = climb.data, climb.options
        self._named = options.inputs != "auto"
        self._play: PlaySearch | None = None
        if data.side is None and data.starts is not None and len(data.names) == 1:
            self._play = PlaySearch(climb.samples, options)

    @classmethod
    def possible(cls, climb: Climb) -> bool:
        """True if the options allow hysteresis and the rows show directions.

        Raises
        ------
        InputError
            The inputs name hysteresis, and the rows show no directions.
        """
        inputs, data = climb.options.inputs, climb.data
        told = data.side is not None or (data.starts is not None and len(data.names) == 1)
        if not told and "hysteresis" in inputs:
            raise InputError(
                "inputs names hysteresis: the recording needs time, or both directions in a direction "
                "column; name that column, or remove hysteresis from inputs"
            )
        return told and (inputs == "auto" or "hysteresis" in inputs)

    def better(self, below: Candidate) -> Candidate:
        if self._play is None:
            assert self._climb.data.side is not None
            return self._of(below, HysteresisInput.of_strokes(self._climb.data.side))
        strokes = self._play.best_tried(below.solution.basis)
        if strokes is not None:
            return self._play.with_first_states(self._of(below, strokes))
        untested = "the motions between gaps of time are too short, or never turn back"
        if self._named:
            raise InputError(f"inputs names hysteresis: {untested}")
        self._climb.report.decisions.append(Decision("hysteresis", "not tested", untested))
        return below

    def _of(self, below: Candidate, strokes: HysteresisInput) -> Candidate:
        """The better of the candidate below and hysteresis with this input.

        h >= 0 has a mean, which the wavelets of g, the slope and the bias show at once: if the criterion does
        not fall at all with these, growing a network would be in vain.
        """
        climb, judge, named, samples = self._climb, self._climb.judge, self._named, self._climb.samples
        rows = samples.rows(strokes)
        problem = samples.problem(rows, strokes)
        first = problem.solve(below.solution.basis)
        free = climb.candidate(self.name, problem, first, judge.criterion, rows=rows, strokes=strokes)
        if named or judge.fall(below, free) > 0.0:
            free = self._grown(below, free)
        if not named and not judge.earned(below, free):
            return judge.better(below, free)
        kept = self._climb.constrained(free)
        if named:
            self._report_sign(kept, kept, free)
            return kept
        single = self._single_valued(kept) if kept is not free and below.n_wavelets else below
        best = judge.better(single, kept)
        if best is single and best.n_wavelets < below.n_wavelets:
            self._climb.report.notes.append(
                f"{best.n_wavelets} of {below.n_wavelets} wavelets over position are kept. The removed ones "
                "modelled the difference between press and release."
            )
        self._report_sign(best, kept, free)
        return best

    def _grown(self, below: Candidate, found: Candidate) -> Candidate:
        """A network with hysteresis; the play radius is found once hysteresis is certain.

        Wavelets grown at a wrong radius, or for a single force, model the error of the radius. A radius found
        on few wavelets compensates for missing ones. So growth begins again from an empty basis, and the
        radius is sought again whenever the network may be twice as large.
        """
        assert found.strokes is not None
        climb, play, most = self._climb, self._play, self._climb.options.max_wavelets
        strokes = found.strokes
        basis = climb.begun.get(self.name, found.solution.basis)
        begun, complete = self.name in climb.begun, False
        for _ in range(RADIUS_ROUNDS):
            before = strokes
            if play and (self._named or climb.judge.earned(below, found)):
                strokes = play.nearer(strokes, basis)
                basis, begun = (basis if begun else Basis.empty(1)), True
            if complete and strokes is before:
                break
            rows = climb.samples.rows(strokes)
            limit = min(most, max(FIRST_SIZE, 2 * len(basis))) if play else most
            grown = climb.grown(climb.samples.problem(rows, strokes), basis, self.name, limit)
            basis = climb.begun[self.name] = grown.solution.basis
            reason = grown.stop_reason
            found = climb.candidate(
                self.name, grown.problem, grown.solution, reason, rows=rows, strokes=strokes
            )
            complete = limit == most or max(point.n_wavelets for point in grown.path) < limit
        return found

    def _single_valued(self, hysteresis: Candidate) -> Candidate:
        """A force of position alone on the wavelets of hysteresis, those it does not need removed.

        Where hysteresis is there but not with h >= 0, this is the remaining part. A network grown on position
        alone will not do: strokes that a periodic motion samples at different places look like one rapidly
        changing force.
        """
        climb = self._climb
        problem = climb.samples.problem(climb.rows)
        start = problem.solve(hysteresis.solution.basis)
        problem = problem.with_prior(start.rss)
        problem, solution = climb.growth.prune(problem, problem.solve(start.basis))
        line = climb.recorded(climb.constrained(straight_line(climb)))
        if len(solution.basis) == 0:
            return line
        found = climb.candidate("position", problem, solution, hysteresis.stop_reason)
        found = climb.recorded(climb.constrained(found))
        return found if climb.judge.earned(line, found) else line

    def _report_sign(self, best: Candidate, kept: Candidate, free: Candidate) -> None:
        """Names the cure if h >= 0 costs much: the other sign, or h of either sign."""
        if kept.rmse <= GAINS_ENERGY * free.rmse:
            return
        spread, report = self._climb.spread, self._climb.report
        cost = f"NRMSE {kept.rmse / spread:.3g} with press >= release, {free.rmse / spread:.3g} without"
        turned = self._turned_rmse(free)
        if turned < math.sqrt(kept.rmse * free.rmse):
            cure = (
                f"with the opposite sign of the force the NRMSE is {turned / spread:.3g}. Press and release "
                "may be exchanged: give --negate force or --negate position"
            )
        elif crosses_where_steep(free.problem, free.solution):
            cure = (
                "release lies above press where the force is steep. The force may be recorded late: try "
                "--force-late-s"
            )
        else:
            cure = (
                f"the opposite sign of the force does not help (NRMSE {turned / spread:.3g}). The object may "
                "release stored energy, as a latch does: give --no-hysteresis-nonnegative"
            )
        sentence = f"hysteresis gains energy on a part of the loop ({cost}); {cure}"
        if best.rmse > USABLE_NRMSE * spread:
            report.sign_findings.append(usable(sentence))
            report.findings.append(usable(sentence))
        else:
            report.notes.append(sentence)

    def _turned_rmse(self, free: Candidate) -> float:
        """RMS error of hysteresis with h <= 0, as with the sign of the force turned."""
        if free.problem.dimension > 1:
            return math.inf
        turned = replace(free.problem, readout=free.problem.readout * np.array([[1.0], [-1.0]]))
        return turned.rmse(impose(turned, free.solution, self._climb.bounds(turned)))


class PlaySearch:
    """Looks for the play operator that a recording's motions went through.

    Parameters
    ----------
    samples : Samples
        Of one position; every start of a motion is known.
    options : IdentifyOptions
    """

    def __init__(self, samples: Samples, options: IdentifyOptions) -> None:
        data = samples.data
        self._samples, self._path, self._starts = samples, data.path[:, 0], list(data.starts or ())
        self._radii, self._evidence = sorted(options.search.play_radius), options.search.evidence

    def best_tried(self, basis: Basis) -> HysteresisInput | None:
        """The hysteresis input of that radius of the options which helps most on given wavelets.

        None where the motions between gaps of time are too short for any of them, or never turn back: g + h
        alone is one force of position, and h could be anything.
        """
        if not self._judged:
            return None
        known = _thinned(self._judged[-1].known)
        return min(self._judged, key=lambda strokes: self._left_by(strokes, basis, known))

    def nearer(self, strokes: HysteresisInput, basis: Basis) -> HysteresisInput:
        """The hysteresis input of the radius around the one tried that helps most on given wavelets.

        The same one, if no other is better by as much as a model class has to be. Hysteresis must be certain:
        a radius that may be anything also fits other differences between press and release, such as damping.
        """
        radius = strokes.play_radius or 0.0
        least, most = (each.play_radius or 0.0 for each in (self._judged[0], self._judged[-1]))
        lower, upper = max(radius / WITHIN, least), min(radius * WITHIN, most)
        if lower >= upper:
            return strokes
        known = _thinned(self._of(upper).known)
        found = minimize_scalar(
            lambda log_radius: self._left_by(self._of(math.exp(log_radius)), basis, known),
            bounds=(math.log(lower), math.log(upper)),
            method="bounded",
            options={"xatol": NEAR},
        )
        falls = math.log(self._left_by(strokes, basis, known) / found.fun) * np.count_nonzero(known)
        return self._of(math.exp(found.x)) if falls > self._evidence else strokes

    def with_first_states(self, found: Candidate) -> Candidate:
        """The candidate with each motion's play begun where its first force says."""
        if found.play_radius is None:
            return found
        g, h = found.parts_at(self._samples.data.box[self._starts])
        force = self._samples.data.force[self._starts]
        first = np.clip((force - g) / np.where(h == 0.0, np.inf, h), -1.0, 1.0)
        return replace(found, strokes=self._of(found.play_radius, first.tolist()))

    def _of(self, radius: float, first: Sequence[float] | None = None) -> HysteresisInput:
        motions = np.split(self._path, self._starts[1:])
        return HysteresisInput.of_play(motions, radius, first)

    @cached_property
    def _judged(self) -> list[HysteresisInput]:
        """The plays of the radii tried for which enough rows are known, both ways, the smallest first."""
        tried = [self._of(radius) for radius in self._radii]
        return [one for one in tried if one.known.mean() >= LEAST_KNOWN and one.both_ways]

    def _left_by(self, strokes: HysteresisInput, basis: Basis, known: NDArray[np.bool_]) -> float:
        """Sum of squares that the best weights on given wavelets leave in these rows, for all radii the same.

        The random error of rows that only one radius knows must not decide between radii.
        """
        strokes = replace(strokes, known=known)
        problem = self._samples.problem(self._samples.rows(strokes), strokes)
        return problem.total(problem.solve(basis).rss)


def _thinned(rows: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """At most MOST_ROWS of these rows (n,), evenly spread."""
    thin = np.zeros_like(rows)
    thin[:: max(1, -(-len(rows) // MOST_ROWS))] = True
    return np.asarray(rows & thin)

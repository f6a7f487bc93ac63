# SPDX-License-Identifier: Apache-2.0
"""The play radius of a recording, and where its play began."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from .._typing import Float1D
from .evidence import Evidence
from .hysteresis_input import HysteresisInput
from .options import IdentifyOptions
from .rung import Rung
from .separable import Basis

LEAST_KNOWN = 0.5
"""Share of the rows whose hysteresis input must be known, for a play radius to be considered."""

NEAR = 1e-3
"""Share of itself to which a play radius is found."""

WITHIN = 2.0
"""Ratio to the radius that helped most so far within which a better one is sought."""

MOST_ROWS = 100_000
"""Rows that are enough to tell one radius from another; more are thinned out evenly."""


class PlaySearch:
    """Looks for the play operator that a recording's motions went through.

    Parameters
    ----------
    evidence : Evidence
        Of one position.
    path : (n,)
        Positions as they were moved through, not taken modulo a period.
    starts : sequence of int
        Rows at which a motion starts.
    options : IdentifyOptions
    """

    def __init__(
        self, evidence: Evidence, path: Float1D, starts: Sequence[int], options: IdentifyOptions
    ) -> None:
        self._evidence, self._path, self._starts, self._options = evidence, path, list(starts), options

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

        The same one, if no other is better by as much as a rung has to be. For hysteresis that is known to
        be there: a radius that may be anything also passes for what else differs between press and release,
        such as damping.
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
        return self._of(math.exp(found.x)) if falls > self._options.rung_evidence else strokes

    def with_first_states(self, rung: Rung) -> Rung:
        """The rung with each motion's play begun where its first force says."""
        if rung.play_radius is None:
            return rung
        g, h = rung.parts_at(self._evidence.box[self._starts])
        force = self._evidence.force[self._starts]
        first = np.clip((force - g) / np.where(h == 0.0, np.inf, h), -1.0, 1.0)
        return replace(rung, strokes=self._of(rung.play_radius, first.tolist()))

    def _of(self, radius: float, first: Sequence[float] | None = None) -> HysteresisInput:
        motions = np.split(self._path, self._starts[1:])
        return HysteresisInput.of_play(motions, radius, first)

    @cached_property
    def _judged(self) -> list[HysteresisInput]:
        """The plays of the radii tried for which enough rows are known, both ways, the smallest first."""
        tried = [self._of(radius) for radius in sorted(self._options.play_radius)]
        return [one for one in tried if one.known.mean() >= LEAST_KNOWN and one.both_ways]

    def _left_by(self, strokes: HysteresisInput, basis: Basis, known: NDArray[np.bool_]) -> float:
        """Sum of squares that the best weights on given wavelets leave in these rows, for all radii the same.

        What noise left in some row and not in another, by luck, is no reason to prefer a radius.
        """
        strokes = replace(strokes, known=known)
        problem = self._evidence.problem(self._evidence.rows(strokes), strokes)
        return problem.total(problem.solve(basis).rss)


def _thinned(rows: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Of these rows (n,) no more than MOST_ROWS, evenly spread."""
    thin = np.zeros_like(rows)
    thin[:: max(1, -(-len(rows) // MOST_ROWS))] = True
    return np.asarray(rows & thin)

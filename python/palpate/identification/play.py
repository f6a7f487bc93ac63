# SPDX-License-Identifier: Apache-2.0
"""The play radius of a recording, and where its play began."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from .evidence import Evidence
from .hysteresis_input import HysteresisInput
from .options import IdentifyOptions
from .rung import Rung
from .separable import Basis

LEAST_KNOWN = 0.5
"""Share of the rows whose hysteresis input must be known, for a play radius to be considered."""


class PlaySearch:
    """Looks for the play operator that a recording's motions went through.

    Parameters
    ----------
    evidence : Evidence
        Of one position.
    starts : sequence of int
        Rows at which a motion starts.
    options : IdentifyOptions
    """

    def __init__(self, evidence: Evidence, starts: Sequence[int], options: IdentifyOptions) -> None:
        self._evidence, self._starts, self._options = evidence, list(starts), options

    def best_tried(self, basis: Basis) -> HysteresisInput | None:
        """The hysteresis input of that radius of the options which helps most on given wavelets.

        None where the motions between gaps of time are too short for any of them, or never turn back: g + h
        alone is one force of position, and h could be anything.
        """
        tried = [self._of(radius) for radius in self._options.play_radius]
        judged = [one for one in tried if one.known.mean() >= LEAST_KNOWN and one.both_ways]
        return min(judged, key=lambda strokes: self._left_by(strokes, basis), default=None)

    def with_first_states(self, rung: Rung) -> Rung:
        """The rung with each motion's play begun where its first force says."""
        if rung.play_radius is None:
            return rung
        g, h = rung.parts_at(self._evidence.box[self._starts])
        force = self._evidence.force[self._starts]
        first = np.clip((force - g) / np.where(h == 0.0, np.inf, h), -1.0, 1.0)
        return replace(rung, strokes=self._of(rung.play_radius, first.tolist()))

    def _of(self, radius: float, first: Sequence[float] | None = None) -> HysteresisInput:
        motions = np.split(self._evidence.box[:, 0], self._starts[1:])
        return HysteresisInput.of_play(motions, radius, first)

    def _left_by(self, strokes: HysteresisInput, basis: Basis) -> float:
        """Sum of squares that the best weights on given wavelets leave."""
        problem = self._evidence.problem(self._evidence.rows(strokes), strokes)
        return problem.total(problem.solve(basis).rss)

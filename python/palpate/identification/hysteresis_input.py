# SPDX-License-Identifier: Apache-2.0
"""The input that tells press from release: s in f = g + s h, by strokes or by the play operator."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .. import _core
from .._typing import Float1D


@dataclass(frozen=True)
class HysteresisInput:
    """s of every row of a recording."""

    side: Float1D
    """(n,) in [-1, 1]"""
    known: NDArray[np.bool_]
    """(n,) rows whose s does not depend on what happened before the recording"""
    play_radius: float | None = None
    """[box]"""

    @property
    def both_ways(self) -> bool:
        """Whether the known rows hold strokes into the object and out of it."""
        side = self.side[self.known]
        return bool((side > 0.0).any() and (side < 0.0).any())

    @classmethod
    def of_strokes(cls, side: Float1D) -> "HysteresisInput":
        """+1, -1: the stroke of each row (n,)."""
        return cls(side, np.ones(len(side), dtype=bool))

    @classmethod
    def of_play(
        cls, motions: Sequence[Float1D], radius: float, first: Sequence[float] | None = None
    ) -> "HysteresisInput":
        """The play operator along motions that each begin with a history of their own: at s = 0, or first.

        Once a motion has covered the slot's width 2 r its history is forgotten: whatever the state was, it
        has been pushed by one edge of the slot past where the other edge could have held it. Where no motion
        is that long, none of the rows is known better than another, and all count.
        """
        side, known = [], []
        for motion, s in zip(motions, first if first is not None else [0.0] * len(motions), strict=True):
            play = _core.model.play(motion, radius, start=motion[0] - s * radius)
            side.append(np.clip((motion - play) / radius, -1.0, 1.0))
            covered = np.maximum.accumulate(motion) - np.minimum.accumulate(motion)
            known.append(covered >= 2.0 * radius)
        all_known = np.concatenate(known)
        return cls(np.concatenate(side), all_known if all_known.any() else ~all_known, radius)

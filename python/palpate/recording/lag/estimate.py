# SPDX-License-Identifier: Apache-2.0
"""Lag of the force of recordings, with a 95 % confidence interval.

Strokes at different speeds determine it best; at one speed only the turns count. The residuals are correlated
in time, for example those of a force that an instrument averages. The interval uses this correlation.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from ..motion import LEAST_SPEED_SPREAD, spread_of_speeds
from .force_lag import LONGEST_LAG_S, LONGEST_LEAD_S, ForceLag, unknown
from .motions import Motion, motions_of
from .strokes import Strokes
from .turns import lag_of_turns

if TYPE_CHECKING:
    from ..recording import Recording

LARGEST_ERROR_S = 0.01
"""Largest half width of the confidence interval of a lag that counts as known [s]."""

MOST_MOTION_ROWS = 100_000
"""Largest number of rows of motions that are used; later motions are left out."""


def lag_of(recordings: Sequence[Recording]) -> ForceLag:
    """Returns the lag of the force in recordings of one object on one test machine.

    The lag of a recording that is already corrected is the remaining lag.
    """
    if any(recording.time is None for recording in recordings):
        return unknown("the recording has no time")
    if any(recording.input_names for recording in recordings):
        return unknown("the force depends on further inputs")
    parts: list[Motion] = []
    for recording in recordings:
        parts += motions_of(recording, MOST_MOTION_ROWS - sum(len(part.time) for part in parts))
    if not parts:
        return unknown("the motion between gaps of time is too short")
    position, force = (
        np.concatenate([getattr(part, name) for part in parts]) for name in ("position", "force_known")
    )
    if not (np.ptp(position) > 0.0 and np.ptp(force) > 0.0):
        return unknown("position or force is constant")
    one_speed = spread_of_speeds(np.concatenate([part.velocity for part in parts])) < LEAST_SPEED_SPREAD
    return _checked(lag_of_turns(parts) if one_speed else Strokes.of(parts))


def _checked(found: ForceLag) -> ForceLag:
    """Returns a lag as unknown if its interval is too wide or leaves the range of the search."""
    lower, upper = max(found.lower_s, -LONGEST_LEAD_S), min(found.upper_s, LONGEST_LAG_S)
    if not found.known or (
        (lower, upper) == (found.lower_s, found.upper_s) and upper - lower <= 2.0 * LARGEST_ERROR_S
    ):
        return found
    allowed = f"any lag from {1e3 * lower:.3g} to {1e3 * upper:.3g} ms fits the {found.source}"
    return replace(found, lower_s=lower, upper_s=upper, reason=allowed)

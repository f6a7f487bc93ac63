# SPDX-License-Identifier: Apache-2.0
"""Angle of an encoder that starts again after each revolution."""

from __future__ import annotations

import math

import numpy as np

from .._typing import Float1D

MAX_STEP_RATIO = 2.0
"""Largest ratio of a step to the largest other step that can be chance [-]."""


@np.errstate(over="ignore", invalid="ignore")  # huge values, refused later, may overflow
def continued_angle(
    name: str, angle: Float1D, force: Float1D, revolution: float = 2.0 * math.pi
) -> tuple[Float1D, list[str]]:
    """Returns an angle (n,) that continues where the given one jumps by a revolution, and a note on jumps.

    The first row keeps its angle. The given angle is returned if a jump is not certain to be that of an
    encoder. Without the revolution, the steps of angle and force (n,) there must be as small as those between
    the other rows. The force of a torsion spring that is turned again from the start jumps as well.
    """
    known = np.flatnonzero(np.isfinite(angle) & np.isfinite(force))
    step = np.diff(angle[known])
    revolutions = np.rint(step / revolution)
    jumps = revolutions != 0.0
    left = np.abs(step - revolution * revolutions)
    # Both directions are equally near at half of a revolution: a step must be shorter by more than chance.
    if not jumps.any() or not MAX_STEP_RATIO * left.max() <= 0.5 * revolution:
        return angle, []
    for change in (left, np.abs(np.diff(force[known]))):
        if change[jumps].max() > MAX_STEP_RATIO * change[~jumps].max(initial=0.0):
            return angle, []
    continued = angle.copy()
    continued[known[1:]] -= revolution * np.cumsum(revolutions)
    return continued, [
        f"{name} jumps by a revolution in {np.count_nonzero(jumps)} rows, but motion and force continue: "
        "revolutions are added, and the first row keeps its angle"
    ]

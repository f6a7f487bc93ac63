# SPDX-License-Identifier: Apache-2.0
"""Ranges of position and force that no object has in the stated units."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ...verdict import Finding, usable
from .cells import Checked

Bounds = tuple[float, float]


def implausible_range(
    checked: Checked,
    *,
    travels: Mapping[str, Bounds],
    forces: Mapping[str, Bounds],
    microscope_travel: float,
    microscope_forces: Bounds,
) -> list[Finding]:
    """Returns findings on an implausible travel or force range. Unstated units are not checked.

    Parameters
    ----------
    travels, forces
        Least and largest plausible range by unit: from a microscope tip to an arm or 50 revolutions.
    microscope_travel : float
        Travel below which the recording is taken to be from a force microscope [m].
    microscope_forces : (float, float)
        Least and largest plausible range of its force [N].
    """
    recording = checked.recording
    position, force = recording.file_unit("position"), recording.file_unit("force")
    microscope = position.si == "m" and force.si == "N" and checked.travel < microscope_travel
    of_force = microscope_forces if microscope else forces.get(force.si)
    if force.si == "N" and position.si != "m":
        of_force = None
    found = []
    for role, value, unit, bounds in (
        ("travel", checked.travel, position, travels.get(position.si)),
        ("range of the force", float(np.ptp(recording.force)), force, of_force),
    ):
        if bounds is None or value == 0.0 or bounds[0] <= value <= bounds[1]:
            continue
        side, bound = ("below", bounds[0]) if value < bounds[0] else ("above", bounds[1])
        over = "" if role == "travel" else f" over a travel of {position.text(checked.travel)}"
        found.append(
            usable(
                f"the {role} is {unit.text(value)}{over}, {side} {unit.text(bound)}: the unit of "
                "position or force is probably wrong; name the right one with --units"
            )
        )
    return found

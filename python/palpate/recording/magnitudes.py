# SPDX-License-Identifier: Apache-2.0
"""Travels and forces that no haptic object has: most likely a wrong unit."""

from __future__ import annotations

import numpy as np

from ..verdict import Finding, usable
from .cells import Travel, amount
from .recording import Recording

TRAVEL = {"m": (1e-7, 0.5), "rad": (1e-3, 100.0 * np.pi)}
"""Least and largest plausible travel, by unit: from a microscope's tip to an arm, and up to 50 turns."""

FORCE = {"N*m": (1e-6, 1e3), "A": (1e-5, 1e3)}
"""Least and largest plausible range of the force, by unit; that of N depends on the travel."""

SMALL_TRAVEL = 1e-4
"""Travel below which a recording is one of a microscope [m]."""

SMALL_FORCE, LARGE_FORCE = (1e-10, 0.1), (1e-3, 1e4)
"""Plausible range of the force below that travel, and from it on [N]."""


def magnitude_findings(recording: Recording, travel: Travel) -> list[Finding]:
    """Findings on an implausible travel or range of force. Nothing is known of units that are not stated."""
    position, force = recording.units["position"], recording.units["force"]
    inner = recording.force[travel.inside]
    force_bounds = FORCE.get(force)
    if position == "m" and force == "N":
        force_bounds = SMALL_FORCE if travel.length < SMALL_TRAVEL else LARGE_FORCE
    found = []
    for role, value, unit, bounds in (
        ("travel", travel.length, position, TRAVEL.get(position)),
        ("range of the force", float(np.ptp(inner)), force, force_bounds),
    ):
        if bounds is None or value == 0.0 or bounds[0] <= value <= bounds[1]:
            continue
        side, bound = ("below", bounds[0]) if value < bounds[0] else ("above", bounds[1])
        over = "" if role == "travel" else f" over a travel of {amount(travel.length, position)}"
        found.append(
            usable(
                f"the {role} is {amount(value, unit)}{over}, {side} {amount(bound, unit)}: the unit of "
                "position or force is probably wrong; name the right one with --units"
            )
        )
    return found

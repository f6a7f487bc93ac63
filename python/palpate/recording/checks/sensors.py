# SPDX-License-Identifier: Apache-2.0
"""Sensors that are clipped."""

from __future__ import annotations

import numpy as np

from ...verdict import Finding, usable
from .cells import Checked


def clipped_force(
    checked: Checked, *, positions: int, ratio: float, near_share: float, contact_share: float
) -> list[Finding]:
    """Returns findings on a largest or least force that occurs in many rows.

    Parameters
    ----------
    positions : int
        Least number of positions of the rows with this force: a tool at rest has one.
    ratio : float
        Least ratio of the rows with this force to those with any near force [-].
    near_share : float
        Share of the range of the force within which values are near [-].
    contact_share : float
        A force below this share of the largest |force| is that without contact [-], if it occurs at the
        smallest position.
    """
    x, f = checked.recording.position, checked.recording.force
    if not np.ptp(f) > 0.0:
        return []
    position, force = (checked.recording.file_unit(role) for role in ("position", "force"))
    found = []
    for value, name in ((float(f.max()), "largest"), (float(f.min()), "least")):
        at = np.flatnonzero(f == value)
        if abs(value) < contact_share * float(np.abs(f).max()) and x[at].min() == x.min():
            continue
        near = f[(np.abs(f - value) <= near_share * float(np.ptp(f))) & (f != value)]
        most_near = np.unique(near, return_counts=True)[1].max(initial=1)
        if len(at) >= ratio * most_near and len(np.unique(x[at])) >= positions:
            found.append(
                usable(
                    f"the {name} force, {force.text(value)}, occurs in {len(at)} "
                    f"rows ({len(at) / len(f):.2g} of all) while the position changes from "
                    f"{position.interval(x[at].min(), x[at].max())}: the force "
                    "sensor or its converter is probably clipped there; record with a larger force range or "
                    "press less far"
                )
            )
    return found

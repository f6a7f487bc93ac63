# SPDX-License-Identifier: Apache-2.0
"""Positions without rows."""

from __future__ import annotations

import numpy as np

from ...verdict import FORCE_FLOOR, Finding, usable
from ..motion import directions_of
from .cells import Checked


def position_gaps(
    checked: Checked, *, gap_share: float, gap_ratio: float, stroke_share: float, named: int
) -> list[Finding]:
    """Returns findings on intervals of position without rows, of the recording and of each stroke.

    Parameters
    ----------
    gap_share, gap_ratio : float
        Least width of an interval, over the travel and over the 90th percentile of the distances of adjacent
        positions [-].
    stroke_share : float
        The same over the travel for one of the strokes, and the longest motion that is not a stroke [-].
    named : int
        Largest number of intervals whose limits are stated.
    """
    recording, travel = checked.recording, checked.travel
    if not travel > 0.0 or recording.input_names:
        return []
    way, unit = directions_of(recording), recording.file_unit("position")
    force = np.abs(recording.force)
    # Between rows before the first noticeable force the tool is in air: there the force is known.
    contact = recording.position[force >= FORCE_FLOOR * force.max()].min()
    strokes = {"recording": recording.position}
    if way is not None:
        strokes |= {
            "press stroke": recording.position[way > 0],
            "release stroke": recording.position[way < 0],
        }
    found: list[Finding] = []
    reported: set[tuple[float, float]] = set()
    for name, positions in strokes.items():
        if len(np.unique(positions)) < 10 or np.ptp(positions) <= stroke_share * travel:
            continue
        at = np.unique(np.r_[checked.lower, positions, checked.upper])
        distances = np.diff(at)
        share = gap_share if name == "recording" else stroke_share
        bound = max(share * travel, gap_ratio * float(np.percentile(distances, 90.0)))
        gaps = [(float(at[k]), float(at[k + 1])) for k in np.flatnonzero(distances > bound)]
        gaps = [gap for gap in gaps if gap[1] >= contact and gap not in reported]
        reported.update(gaps)
        if not gaps:
            continue
        longest = sorted(gaps, key=lambda gap: gap[0] - gap[1])[:named]
        intervals = " and ".join(unit.interval(*gap) for gap in sorted(longest))
        more = f" ({len(gaps) - len(longest)} shorter gaps are not listed)" if len(gaps) > named else ""
        share = sum(stop - start for start, stop in gaps) / travel
        found.append(
            usable(
                f"the {name} has no rows from {intervals}{more}, {share:.0%} of the travel: the model is "
                "interpolated or extrapolated there; record these positions too, or remove single rows "
                "beyond a gap"
            )
        )
    return found

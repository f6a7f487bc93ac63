# SPDX-License-Identifier: Apache-2.0
"""Sensors that are clipped, or slower than the recorder."""

from __future__ import annotations

import numpy as np

from ..._typing import Float1D
from ...verdict import Finding, usable
from ..motion import TURN_STEPS
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
        A force below this share of the largest |force| is that without contact [-].
    """
    x, f = checked.recording.position, checked.recording.force
    if not np.ptp(f) > 0.0:
        return []
    position, force = (checked.recording.file_unit(role) for role in ("position", "force"))
    found = []
    for value, name in ((float(f.max()), "largest"), (float(f.min()), "least")):
        at = np.flatnonzero(f == value)
        if abs(value) < contact_share * float(np.abs(f).max()):
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


def repeated_samples(checked: Checked, *, regular_share: float, change_ratio: float) -> list[Finding]:
    """Returns findings if position or force changes only once in several rows: a repeated, slower sensor.

    If both columns repeat, rows repeat, which are used once.

    Parameters
    ----------
    regular_share : float
        Least share of the rows in runs of equal values whose length is a multiple of the commonest one [-].
    change_ratio : float
        Least ratio of the number of changes of the other column to that of the repeated column [-].
    """
    recording = checked.recording
    x, f, period = recording.position, recording.force, recording.sample_period
    rows = {
        "position": _held_for(x, regular_share),
        "force": _held_for(f, regular_share),
    }
    moved = np.abs(np.diff(x))[np.diff(x) != 0.0]
    if len(moved) and np.median(moved) <= TURN_STEPS * moved.min():
        rows["position"] = 1  # steps of a coarse sensor, not repeated values
    changes = {name: np.count_nonzero(np.diff(values)) for name, values in (("position", x), ("force", f))}
    found = []
    for name, other in (("force", "position"), ("position", "force")):
        count = rows[name]
        if count < 2 or count == rows[other] or changes[other] < change_ratio * changes[name]:
            continue
        lag, late = (count - 1) / 2.0, ""
        if name == "force" and period is not None:
            late = f", or give --force-late-s {lag * period:.3g}"
        found.append(
            usable(
                f"the {name} changes only once in {count} rows while the other column changes in between: a "
                f"slower sensor was probably repeated, and is late by {lag:g} rows on average; keep one row "
                f"of each {count}, the first with a new value{late}"
            )
        )
    return found


def _held_for(values: Float1D, regular_share: float) -> int:
    """Returns the number of rows for which a column usually keeps one value; 1 if it is irregular."""
    lengths = np.diff(np.flatnonzero(np.diff(values)) + 1)
    if len(lengths) < 4:
        return 1
    rows = np.bincount(lengths) * np.arange(lengths.max() + 1)
    common = int(np.argmax(rows))
    return common if rows[::common].sum() >= regular_share * rows.sum() else 1

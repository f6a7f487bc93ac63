# SPDX-License-Identifier: Apache-2.0
"""Force or position that a slower sensor repeats for several rows while the other one goes on."""

from __future__ import annotations

import numpy as np

from .._typing import Float1D
from ..verdict import Finding, usable
from .recording import Recording

REGULAR = 0.8
"""Share of the rows that stand in runs of one length, or of its multiples."""

SLOWER = 1.5
"""Changes of the other column over those of the held one."""

WORTH_TELLING = 0.005
"""Change of the force from run to run, as a share of its spread, from which a lag is reported."""

LONGEST = 1000
"""Rows of a run from which it is no held sample but a pause."""


def hold_findings(recording: Recording) -> list[Finding]:
    """Findings on columns that change only once in several rows.

    Both columns together matter only with time, which then belongs to other rows than they do.
    """
    x, f = recording.position, recording.force
    rows = {"position": _held_for(x), "force": _held_for(f)}
    if rows["position"] == rows["force"]:
        return (
            [] if recording.time is None else _held(recording, "position and force change", rows["force"], "")
        )
    found = []
    for name, held, other in (("force", f, x), ("position", x, f)):
        if np.count_nonzero(np.diff(other)) >= SLOWER * np.count_nonzero(np.diff(held)):
            found += _held(
                recording, f"the {name} changes", rows[name], " while the other column changes in between"
            )
    return found


def _held(recording: Recording, what: str, rows: int, other: str) -> list[Finding]:
    f, lag = recording.force, (rows - 1) / 2.0
    if rows < 2 or not np.std(f[rows:] - f[:-rows]) > WORTH_TELLING * np.std(f):
        return []
    late = ""
    if what == "the force changes" and (period := recording.sample_period) is not None:
        late = f", or give --force-late-s {lag * period:.3g}"
    return [
        usable(
            f"{what} only once in {rows} rows{other}: a slower sensor was probably repeated, and "
            f"is late by {lag:g} rows on average; keep one row of each {rows}, the first with a new "
            f"value{late}"
        )
    ]


def _held_for(values: Float1D) -> int:
    """Rows for which a column is held; 1 where the runs of equal values have no common length."""
    edges = np.flatnonzero(np.diff(values)) + 1
    lengths = np.diff(edges)
    lengths = lengths[lengths < LONGEST]
    if len(lengths) < 4:
        return 1
    rows = np.bincount(lengths) * np.arange(lengths.max() + 1)
    common = int(np.argmax(rows))
    return common if rows[::common].sum() >= REGULAR * rows.sum() else 1

# SPDX-License-Identifier: Apache-2.0
"""What a flight record states beside position and force: play radius and position of the virtual object."""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np

from .._typing import Float1D
from ..recording import Recording

_STRUCTURE = "structure"
"""Line of metadata with the structure that was rendered."""

_OBJECT_POSITION = "environment_position"
"""Stem of the column with the position of the virtual object."""


@dataclass(frozen=True)
class FlightRecord:
    """Statements of a flight record; None where the recording is none."""

    play_radius: float | None = None
    """[position]"""
    object_position: Float1D | None = None
    """(n,) position at which the force was computed: behind a coupling, or predicted"""
    predicted: bool = False
    """True if it is a predicted position of the handle"""


def flight_of(recording: Recording) -> FlightRecord:
    """Read what the metadata and the columns of a flight record state."""
    structure = recording.metadata.get(_STRUCTURE, "")
    found = re.search(r"\br = ([0-9.eE+-]+)", structure)
    radius = float(found.group(1)) if found else None
    predicted = ", predict " in structure
    directly = structure.startswith("direct") and not predicted
    if not structure or directly or "compensated" in structure:
        return FlightRecord(radius)
    for name, cells in recording.columns.items():
        if name.startswith(_OBJECT_POSITION) and cells.dtype.kind == "f" and np.isfinite(cells).all():
            return FlightRecord(radius, np.asarray(cells, dtype=np.float64), predicted)
    return FlightRecord(radius)

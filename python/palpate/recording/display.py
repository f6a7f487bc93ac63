# SPDX-License-Identifier: Apache-2.0
"""A recording as columns of a table, and as HTML for notebooks."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..errors import shortened
from ..html_table import Curve, html_table
from .files import Layout, free_name
from .table import Cells
from .units import COLUMN_SUFFIX

if TYPE_CHECKING:
    from .recording import Recording

LONGEST_METADATA = 120
"""Largest length of a value of the metadata in the HTML of a recording; longer values are cut [characters]"""


def columns_of(recording: Recording) -> tuple[Layout, dict[str, Cells]]:
    """Returns the columns of a recording by name, with their roles. The names end in the SI unit."""
    used_names = {*recording.columns, *recording.input_names}
    suffixes = {"time": "_s", "direction": ""}
    for role in ("position", "force"):
        unit = recording.units[role]
        suffixes[role] = f"_{COLUMN_SUFFIX[unit]}" if unit else ""
    roles = {
        role: free_name(role, suffixes[role], used_names)
        for role in ("time", "position", "force", "direction")
        if getattr(recording, role) is not None
    }
    cells: dict[str, Cells] = {name: getattr(recording, role) for role, name in roles.items()}
    cells |= {name: recording.inputs[:, index] for index, name in enumerate(recording.input_names)}
    cells |= recording.columns
    return Layout(roles, recording.input_names), cells


def html_of(recording: Recording) -> str:
    """Returns verdict, ranges, source and a sketch of a recording as HTML."""
    rows = {"rows": str(len(recording))}
    if recording.time is not None and recording.sample_period is not None:
        duration = float(recording.time[-1] - recording.time[0])
        rows["time"] = f"{duration:.4g} s, {1.0 / recording.sample_period:.4g} Hz"
    for role in ("position", "force"):
        values = getattr(recording, role)
        rows[role] = recording.file_unit(role).interval(float(values.min()), float(values.max()))
    if recording.direction is not None:
        press, release = (int(np.count_nonzero(recording.direction == side)) for side in (1, -1))
        rows["direction"] = f"{press} rows of press, {release} of release"
    if recording.input_names:
        rows["inputs"] = ", ".join(recording.input_names)
    rows["source"] = ", ".join(recording.source.files) or "arrays"
    for name, value in recording.metadata.items():
        rows.setdefault(shortened(name), shortened(value, LONGEST_METADATA))
    curves = [Curve(recording.position, recording.force, "dots")] if len(recording) else []
    return html_table("Recording", recording.verdict, rows, curves)

# SPDX-License-Identifier: Apache-2.0
"""Files that hold two objects, and rows that were appended twice."""

from __future__ import annotations

import numpy as np

from .._typing import Float1D, Float2D
from ..verdict import Finding, usable
from .cells import ROWS_TO_COMPARE, CellRows, amount
from .recording import Recording

BLOCKS = 32
"""Blocks of rows between which a file is split."""

EXPLAINED = 0.4
"""Share of the scatter about the mean curves that the split into two parts explains."""

APART = 0.02
"""Distance of the two parts, as a share of the force's spread."""

PATTERN = 16
"""Rows by which a repetition of the beginning is found."""

LEAST_COPY = 0.1
"""Share of the rows that a copy holds."""

MOST_COPIES = 4
"""Places that begin like the file and are compared to the end."""

SAME_PLACE = 0.1
"""Distance of the mean positions of two parts in a cell, in cells, up to which they are compared."""


def merged_findings(recording: Recording, cells: CellRows | None) -> list[Finding]:
    """Findings on a force that has two branches, one before and one after a row, and on repeated rows."""
    if recording.input_names:
        return []
    if (again := _appended_to_itself(recording)) is not None:
        return [
            usable(
                f"the rows from {again} on repeat those from 0 on exactly: the file was probably appended to "
                f"itself; give --rows 0:{again}"
            )
        ]
    return [] if cells is None else _two_parts(recording, cells)


def _two_parts(recording: Recording, cells: CellRows) -> list[Finding]:
    """Compares the parts before and after each block edge, cell by cell."""
    total = float(np.sum(cells.residual**2))
    spread = float(np.std(recording.force))
    if not total > 0.0 or not spread > 0.0:
        return []
    width = 2 * cells.cells
    block = cells.row * BLOCKS // len(recording)
    code = block * width + cells.cell

    def sums(values: Float1D | None) -> Float2D:
        table = np.bincount(code, values, BLOCKS * width).reshape(BLOCKS, width)
        return table.cumsum(axis=0, dtype=np.float64)

    count, force, place = sums(None), sums(cells.residual), sums(cells.place)
    before, after = count[:-1], count[-1] - count[:-1]
    one, other = np.maximum(before, 1.0), np.maximum(after, 1.0)
    apart = force[:-1] / one - (force[-1] - force[:-1]) / other
    moved = place[:-1] / one - (place[-1] - place[:-1]) / other
    both = (before >= ROWS_TO_COMPARE) & (after >= ROWS_TO_COMPARE) & (np.abs(moved) <= SAME_PLACE)
    between = np.where(both, before * after / (one + other) * apart**2, 0.0)
    explained = between.sum(axis=1) / total
    best = int(np.argmax(explained))
    shared = both[best]
    if not shared.any():
        return []
    rows = (before[best] + after[best])[shared]
    distance = float(np.sqrt(np.average(apart[best][shared] ** 2, weights=rows)))
    if explained[best] < EXPLAINED or distance < APART * spread:
        return []
    split = (best + 1) * len(recording) // BLOCKS
    return [
        usable(
            f"before and after about row {split} the force at the same position and stroke differs by "
            f"{amount(distance, recording.units['force'])}, {distance / spread:.0%} of its spread: the file "
            "probably holds two objects or two zeros, or the object changed (drift, settling); identify "
            f"each part by itself with --rows 0:{split} and --rows {split}:{len(recording)}"
        )
    ]


def _appended_to_itself(recording: Recording) -> int | None:
    """First row of a copy of the beginning that goes on to the end of the file."""
    x, f = recording.position, recording.force
    n = len(x)
    least = int(LEAST_COPY * n)
    if least < PATTERN:
        return None
    starts = np.arange(n // 3, n - least + 1)
    for k in (*range(PATTERN), *np.linspace(PATTERN, least - 1, PATTERN).astype(int).tolist()):
        starts = starts[(x[starts + k] == x[k]) & (f[starts + k] == f[k])]
    for start in starts[:MOST_COPIES].tolist():
        copied = slice(0, n - start)
        same = np.array_equal(x[start:], x[copied]) and np.array_equal(f[start:], f[copied])
        if same and len(np.unique(f[copied])) > PATTERN:
            return int(start)
    return None

# SPDX-License-Identifier: Apache-2.0
"""Sections of long recordings: the consecutive rows to which a model is fitted.

The time and memory of a fit grow with its rows. MOST_ROWS rows are hundreds in each position cell, so that
more rows no longer change the model.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ...recording import Recording
from ...recording.conversion import Motion
from ...recording.rows import of_each
from .compression import SECTIONS

MOST_ROWS = 500_000
"""Largest number of rows that are all fitted; of longer recordings about this number is used."""

BLOCKS = 10
"""Number of blocks of rows in a section. A block is added for each interval without rows in the sections."""

INTERVALS = 100
"""Number of intervals of each input that contain fitted rows, in both directions, if they contain any row."""


def in_sections(
    recordings: Sequence[Recording], most_rows: int = MOST_ROWS
) -> tuple[list[Recording], tuple[str, ...]]:
    """Returns the parts of recordings to fit, and a note; the recordings themselves if they are short.

    Sections are spread evenly over each recording. Blocks of rows are added until the sections contain the
    inputs and directions of all rows.
    """
    total = sum(map(len, recordings))
    if total <= most_rows:
        return list(recordings), ()
    block_rows = max(1, most_rows // (SECTIONS * BLOCKS))
    blocks = [_evenly_spread(len(each), total, most_rows, block_rows) for each in recordings]
    _add_missing_values(recordings, blocks, block_rows)
    kept = [
        np.repeat(chosen, block_rows)[: len(each)] for each, chosen in zip(recordings, blocks, strict=True)
    ]
    used = sum(int(np.count_nonzero(rows)) for rows in kept)
    note = f"{used} of {total} rows are used for the fit, in sections spread over all rows."
    return [_of_rows(each, rows) for each, rows in zip(recordings, kept, strict=True)], (note,)


def _evenly_spread(rows: int, total: int, most_rows: int, block_rows: int) -> NDArray[np.bool_]:
    """Returns True for the blocks of a recording that belong to its share of the sections."""
    sections = -(-SECTIONS * rows // total)
    size = max(1, most_rows * rows // (total * sections * block_rows))
    chosen = np.zeros(-(-rows // block_rows), dtype=bool)
    for first in np.linspace(0, max(len(chosen) - size, 0), sections).round().astype(int).tolist():
        chosen[first : first + size] = True
    return chosen


def _add_missing_values(
    recordings: Sequence[Recording], blocks: Sequence[NDArray[np.bool_]], block_rows: int
) -> None:
    """Adds blocks with the least and largest values, and with values and directions that are missing."""
    ends = np.cumsum([len(each) for each in blocks])
    block = np.concatenate(
        [
            end - len(chosen) + np.arange(len(each)) // block_rows
            for end, chosen, each in zip(ends, blocks, recordings, strict=True)
        ]
    )
    direction = np.concatenate([_directions(each) for each in recordings])
    chosen = np.concatenate(blocks)
    for parts in zip(*([each.position, *each.inputs.T] for each in recordings), strict=True):
        values = np.concatenate(parts)
        lower, reach = float(values.min()), float(np.ptp(values)) or 1.0
        chosen[block[[values.argmin(), values.argmax()]]] = True
        interval = np.floor((values - lower) * (INTERVALS / reach)).astype(np.int64)
        key = 3 * interval + direction + 1
        found = np.bincount(key[chosen[block]], minlength=3 * (INTERVALS + 1)) > 0
        missing = np.flatnonzero(~found[key])
        for row in missing[np.unique(key[missing], return_index=True)[1]].tolist():
            if not found[key[row]]:
                chosen[block[row]] = True
                found[key[block == block[row]]] = True
    for mine, part in zip(blocks, of_each(blocks, chosen), strict=True):
        mine[:] = part


def _directions(recording: Recording) -> NDArray[np.int64]:
    """Returns the stated direction of each row, else the sign of the motion to the row."""
    if recording.direction is not None:
        return recording.direction.astype(np.int64)
    return np.sign(np.diff(recording.position, prepend=recording.position[:1])).astype(np.int64)


def _of_rows(recording: Recording, kept: NDArray[np.bool_]) -> Recording:
    """Returns some rows of a recording. Without time, the strokes are still those of the whole motion."""
    motion = recording.motion
    rows = motion.rows[kept]
    if motion.time is not None:
        # Rows of the motion that the recording holds out belong to the section around them.
        inside = np.zeros(len(motion.position) + 1, dtype=np.int64)
        edges = np.flatnonzero(np.diff(kept, prepend=False, append=False))
        inside[motion.rows[edges[::2]]] += 1
        inside[motion.rows[edges[1::2] - 1] + 1] -= 1
        within = np.cumsum(inside[:-1]) > 0
        motion = Motion(motion.position[within], motion.time[within], (np.cumsum(within) - 1)[rows])
        rows = motion.rows
    return replace(recording.without(~kept), part_of=replace(motion, rows=rows))

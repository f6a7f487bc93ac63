# SPDX-License-Identifier: Apache-2.0
"""identify_files: from files that may be larger than memory to a model."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import reduce
from typing import Any, Literal

import numpy as np
from threadpoolctl import threadpool_limits

from ..errors import InputError
from ..model import Model
from ..recording import Source
from ..recording.long_recording import PART_ROWS, LongRecording, open_long_recording
from .environment import fit_environment
from .identify import model_of
from .options import IdentifyOptions, options_from
from .summary import Summary, merged, summarise
from .workers import in_order

Progress = Callable[[int, int], None]
"""Told how many parts of how many are read."""


def identify_files(
    files: str | os.PathLike[str] | Sequence[str | os.PathLike[str]],
    *,
    jobs: int = 1,
    scheduler: str | None = None,
    progress: Progress = lambda done, total: None,
    part_rows: int = PART_ROWS,
    position: str | None = None,
    force: str | None = None,
    direction: str | None = None,
    units: dict[str, str] | None = None,
    negate: Sequence[str] = (),
    invalid: Literal["refuse", "drop"] = "refuse",
    **options: Any,
) -> Model:
    """Identify one environment from CSV or Parquet files that are read part by part, and no more than once.

    Only force, position and direction are read: the rungs are constant, linear, position and hysteresis
    between strokes. Positions that do not repeat are gathered in at most 8192 cells.

    Parameters
    ----------
    files : path or sequence of paths
        Recordings of one environment in the same units.
    jobs : int
        Processes of this machine that read parts at the same time.
    scheduler : str, optional
        Address of a Dask scheduler whose workers read the parts; they need the files under the same names.
    progress : callable
        Called with (parts read, parts in all).
    part_rows : int
        Rows that a worker reads at a time, about.
    position, force, direction, units, negate, invalid
        As in :func:`palpate.read_recording`.
    **options
        Fields of :class:`IdentifyOptions`.

    Returns
    -------
    Model
        The same to the last bit whoever read the parts.

    Raises
    ------
    palpate.InputError
        As :func:`palpate.read_recording` and :func:`palpate.identify` do; an option that needs all rows.
    """
    settings = options_from(options)
    _require_summable(settings)
    paths = [files] if isinstance(files, (str, os.PathLike)) else list(files)
    if not paths:
        raise InputError("identify_files was given no file; give one, or a list of them")
    recordings = [
        open_long_recording(
            os.fspath(path),
            position=position,
            force=force,
            direction=direction,
            units=units,
            negate=tuple(negate),
            invalid=invalid,
            part_rows=part_rows,
        )
        for path in paths
    ]
    for other in recordings[1:]:
        if other.units != recordings[0].units or (other.direction is None) != (
            recordings[0].direction is None
        ):
            raise InputError(
                f"{other.path} differs from {recordings[0].path} in its units or in having a direction"
            )
    parts = [(recording, part) for recording in recordings for part in recording.parts]
    read = in_order(
        summary_of_part, parts, jobs=jobs, scheduler=scheduler, done=lambda count: progress(count, len(parts))
    )
    summaries = [summary for summary in read if summary is not None]
    if not summaries:
        raise InputError(f"{', '.join(str(path) for path in paths)}: there is no usable row")
    return _identified(reduce(merged, summaries), recordings, settings)


def summary_of_part(work: tuple[LongRecording, tuple[int, int]]) -> Summary | None:
    """The summary of one part of one file; None where no row is usable."""
    recording, part = work
    found: Summary | None = None
    for block in recording.blocks(part):
        summary = summarise(*block)
        found = summary if found is None else merged(found, summary)
    return found


def _identified(summary: Summary, recordings: Sequence[LongRecording], settings: IdentifyOptions) -> Model:
    side = summary.side.astype(np.float64) if recordings[0].direction is not None else None
    with threadpool_limits(limits=1, user_api="blas"):
        network = fit_environment(
            summary.position[:, None],
            summary.force,
            side,
            settings,
            weight=summary.count,
            within=summary.within,
        )
    spread = float(np.sqrt(summary.variance))
    source = Source.merged(recording.source for recording in recordings)
    return model_of(
        replace(
            network,
            lower=np.array([summary.lower]),
            upper=np.array([summary.upper]),
            nrmse=network.rmse / spread if spread > 0 else 0.0,
        ),
        recordings[0].units,
        replace(source, rows=int(summary.rows)),
        settings,
    )


def _require_summable(settings: IdentifyOptions) -> None:
    further = set(() if settings.inputs == "auto" else settings.inputs) - {"position", "hysteresis"}
    if further:
        raise InputError(
            f"inputs names {', '.join(sorted(further))}; files read part by part give a force over position"
        )
    if settings.loss != "squares":
        raise InputError(f"loss is {settings.loss!r}; sums over parts of files are squares")

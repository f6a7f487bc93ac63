# SPDX-License-Identifier: Apache-2.0
"""identify_files: from files that may be larger than memory to a model."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import reduce
from typing import Any, Literal

import numpy as np
from threadpoolctl import threadpool_limits

from .._core.model import ForceModel
from .._typing import Float1D
from ..arguments import path_of
from ..errors import InputError
from ..model import Model
from ..recording import Source
from ..recording.conversion import mirrored
from ..recording.motion import strokes_from_order
from ..recording.reading import PART_ROWS, LongRecording, open_long_recording
from ..recording.rows import LeftOut
from ..verdict import Finding, usable
from .classes.findings import verdict_of
from .data.large_files import Summary, in_order, merged, summarise
from .data.outliers import refuse_isolated
from .data.rows import modulo, require_in_range
from .environment import fit_environment
from .identify import model_of
from .network.fitted import FittedNetwork
from .options import IdentifyOptions, options_from

LEAST_KNOWN = 0.5
"""Share of the rows whose direction must be known to test hysteresis [-]."""

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
    time: str | None = None,
    direction: str | None = None,
    units: dict[str, str] | None = None,
    negate: Sequence[str] = (),
    invalid: Literal["refuse", "drop"] = "refuse",
    **options: Any,
) -> Model:
    """Identify one environment from CSV or Parquet files that are read part by part.

    Only force, position and direction are read: the model classes are constant, linear, position and
    hysteresis. Without a direction the strokes are taken from the order of rows within each block of 500 000
    rows. Positions that do not repeat are gathered in at most 8192 cells. Every row is used or left out and
    counted.

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
    position, force, time, direction, units, negate, invalid
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
    paths = [path_of("files", each) for each in (files if isinstance(files, (list, tuple)) else [files])]
    if not paths:
        raise InputError("identify_files was given no file; give one, or a list of them")
    recordings = [
        open_long_recording(
            os.fspath(path),
            position=position,
            force=force,
            time=time,
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
        read_part, parts, jobs=jobs, scheduler=scheduler, done=lambda count: progress(count, len(parts))
    )
    of_file = [PartRead() for _ in recordings]
    numbers = [number for number, recording in enumerate(recordings) for _ in recording.parts]
    for number, part in zip(numbers, read, strict=True):
        of_file[number].left_out.add(part.left_out, of_file[number].rows)
        of_file[number].add(part.summary, part.rows)
    notes: list[str] = []
    for recording, found in zip(recordings, of_file, strict=True):
        _require_all_rows(recording, found)
        told = found.left_out.sentences(recording.places())
        # The columns stand in the source of the model; the form of the file does not.
        told = [note for note in recording.notes[:1] if "read as" in note] + [*recording.notes[1:], *told]
        notes += [f"{recording.path}: {sentence}" for sentence in told] if len(recordings) > 1 else told
    summaries = [found.summary for found in of_file if found.summary is not None]
    if not summaries:
        raise InputError(f"{', '.join(str(path) for path in paths)}: there is no usable row")
    return _identified(reduce(merged, summaries), recordings, settings, notes)


@dataclass
class PartRead:
    """What was read of a part of a file, or of parts that follow each other."""

    summary: Summary | None = None
    """None where no row is usable"""
    rows: int = 0
    """Rows that were read"""
    left_out: LeftOut = field(default_factory=LeftOut)

    def add(self, summary: Summary | None, rows: int) -> None:
        """Add rows that follow, and the summary of those that are used."""
        self.rows += rows
        if summary is not None:
            self.summary = summary if self.summary is None else merged(self.summary, summary)


def read_part(work: tuple[LongRecording, tuple[int, int]]) -> PartRead:
    """Read one part of one file. Without a column of directions they are taken from the order of rows."""
    recording, part = work
    found = PartRead()
    for block in recording.blocks(part):
        summary = None
        if len(block.position):
            require_in_range("position", block.position)
            require_in_range("force", block.force)
            stated = block.direction is not None
            side = block.direction if stated else strokes_from_order(block.position)
            summary = summarise(block.position, block.force, side)
        found.add(summary, block.rows)
        found.left_out.add(block.left_out, 0)
    return found


def _require_all_rows(recording: LongRecording, read: PartRead) -> None:
    """Check that every row of the file was used or was left out and counted.

    Raises
    ------
    InputError
        The numbers of rows differ.
    """
    used = 0 if read.summary is None else round(read.summary.rows)
    if not used + read.left_out.rows == read.rows == recording.rows:
        raise InputError(
            f"{recording.path} has {recording.rows} rows, but {used} were used and {read.left_out.rows} left "
            "out: the file may have changed while it was read. Read it again, or without --out-of-core"
        )


def _error_on_rows(
    summary: Summary, network: FittedNetwork, side: Float1D | None, period: float | None
) -> float:
    """RMS error on the rows of a summary; the network is a line within each cell."""
    position, lower = summary.position, float(network.lower[0])
    if period is not None:
        position = lower + period * modulo((position - lower) / period)
    model = ForceModel(**network.parameters())
    given = {} if side is None or network.weight_hysteresis is None else {"direction": side}
    force, slope = (np.asarray(read(position, **given)) for read in (model.force, model.slope))
    inside = summary.yy - 2.0 * slope * summary.xy + slope**2 * summary.xx
    total = inside + summary.count * (summary.force - force) ** 2
    return float(np.sqrt(max(float(total.sum()), 0.0) / summary.rows))


def _identified(
    summary: Summary, recordings: Sequence[LongRecording], settings: IdentifyOptions, notes: list[str]
) -> Model:
    width = 0.0 if summary.level is None else 2.0**summary.level
    refuse_isolated(summary.position, summary.count, width)
    notes += mirrored(summary.correlation)
    side: Float1D | None = summary.side.astype(np.float64)
    findings: list[Finding] = []
    if all(recording.direction is None for recording in recordings):
        if settings.inputs != "auto" and "hysteresis" not in settings.inputs:
            side = None
        elif _known_strokes(summary):
            notes.append("direction is taken from the order of rows, block by block")
        else:
            side = None
            findings.append(_untested(summary))
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
    rmse = _error_on_rows(summary, network, side, settings.period)
    nrmse = rmse / spread if spread > 0 else 0.0
    source = Source.merged(recording.source for recording in recordings)
    network = replace(
        network,
        rmse=rmse,
        nrmse=nrmse,
        notes=(*notes, *network.notes),
        findings=(*findings, *network.findings),
    )
    if settings.period is None:
        network = replace(network, lower=np.array([summary.lower]), upper=np.array([summary.upper]))
    return model_of(
        network,
        recordings[0].units,
        replace(source, rows=int(summary.rows)),
        settings,
        verdict_of(network, ()),
    )


def _known_strokes(summary: Summary) -> bool:
    """Both directions occur, and most rows have one."""
    press, release = (float(summary.count[summary.side == side].sum()) for side in (1, -1))
    return min(press, release) > 0.0 and press + release >= LEAST_KNOWN * summary.rows


def _untested(summary: Summary) -> Finding:
    """Hysteresis could not be tested; reports the largest difference that the rows allow."""
    scatter = summary.scatter
    reach = float(np.ptp(summary.force)) or 1.0
    return usable(
        "hysteresis was not tested: no column states the direction, and the order of rows does not show it. "
        f"At the same position the force has a standard deviation of {scatter:.3g} ({scatter / reach:.1%} of "
        "its range), from noise or from a difference between press and release. Cure: add a column direction "
        "with the words press and release"
    )


def _require_summable(settings: IdentifyOptions) -> None:
    further = set(() if settings.inputs == "auto" else settings.inputs) - {"position", "hysteresis"}
    if further:
        raise InputError(
            f"inputs names {', '.join(sorted(further))}; files read part by part give a force over position"
        )
    if settings.loss != "squares":
        raise InputError(f"loss is {settings.loss!r}; sums over parts of files are squares")

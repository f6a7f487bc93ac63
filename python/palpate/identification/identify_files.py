# SPDX-License-Identifier: Apache-2.0
"""identify_files: identifies a model from files that may be larger than memory, one block of rows after the
other.

A block of rows becomes a summary: for each position cell and each stroke the number of rows, the mean
position and force, and the sums of squares and products of the differences from these means. Two summaries
merge into one for the rows of both (Chan, Golub and LeVeque 1979), so that the sums equal those of one pass
over all rows, up to rounding.

A cell is a single position if there are few positions, else an interval [k 2^level, (k + 1) 2^level). Two
cells of one level form one cell of the next level, so that the range of positions need not be known in
advance. The summary of a block depends on its rows alone, and blocks are merged in the order of rows: the
result does not depend on the order in which workers finish.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field, replace
from functools import partial, reduce
from importlib import import_module
from pathlib import Path
from typing import Any, Literal, TypeVar

import numpy as np
from numpy.typing import NDArray

from .._typing import Float1D, Float2D
from ..arguments import path_of
from ..errors import InputError
from ..model import Model
from ..recording import Source
from ..recording.checks.wrong_readings import wrong_readings
from ..recording.conversion import mirror_notes
from ..recording.files import unchanged
from ..recording.motion import strokes_from_order, waits
from ..recording.reading import PART_ROWS, LongRecording, open_long_recording
from ..recording.rows import LeftOut
from ..verdict import usable
from .classes.findings import verdict_of
from .data.compression import POOLED_CELLS
from .data.rows import Rows, modulo, require_in_range
from .data.strokes import DIRECTION_CURE
from .fit import fit_rows
from .identify import model_of
from .log import Decision, Log, in_words
from .network.fitted import FittedNetwork
from .options import IdentifyOptions, options_from
from .threads import one_thread

MOST_CELLS = 8192
"""Largest number of distinct positions, or of cell widths in the range of positions, in a summary of the
rows: enough for the resolution of an identification."""

UNKNOWN_STROKES = "the files have no direction column, and the order of rows does not show the direction"
"""Text of the decision that hysteresis is not tested, if the directions of the rows are not known."""

IN_PARTS = "the files were read part by part"
"""Reason for everything that is not tested because it needs all rows at once."""

UNTESTED = ("damping", "mass", "velocity", "memory")
"""Model classes of recordings with time that need all rows at once."""

Progress = Callable[[int, int], None]
"""Function that receives the number of file parts that were read so far, and the number of all file parts."""


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
    columns: Sequence[str] = (),
    decimal: Literal[".", ","] | None = None,
    negate: Sequence[str] = (),
    invalid: Literal["refuse", "drop"] = "refuse",
    **options: Any,
) -> Model:
    """Identifies one environment from CSV or Parquet files that are read part by part.

    Only force, position and direction are read: the model classes are constant, linear, position and
    hysteresis. Without a direction the strokes are taken from the order of rows within each block of 500 000
    rows. More than 8192 distinct positions are gathered in about 8192 cells at most. Every row is used or
    left out and counted.

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
        Approximate number of rows that a worker reads at a time.
    position, force, time, direction, units, columns, decimal, negate, invalid
        As in :func:`palpate.read_recording`.
    **options
        Fields of :class:`IdentifyOptions`.

    Returns
    -------
    Model
        The same to the last bit with any number of workers.

    Raises
    ------
    palpate.InputError
        As :func:`palpate.read_recording` and :func:`palpate.identify` do; an option that needs all rows.
    """
    settings = options_from(options)
    _require_summable(settings)
    paths = [path_of("files", each) for each in (files if isinstance(files, (list, tuple)) else [files])]
    if not paths:
        raise InputError("files is empty: give a path or a list of paths")
    with unchanged(*paths):
        summary, recordings, log = _read(
            paths,
            partial(in_order, jobs=jobs, scheduler=scheduler),
            progress,
            position=position,
            force=force,
            time=time,
            direction=direction,
            units=units,
            columns=columns,
            decimal=decimal,
            negate=tuple(negate),
            invalid=invalid,
            part_rows=part_rows,
        )
    return _identified(summary, recordings, settings, log)


def _read(
    paths: Sequence[Path], in_workers: Callable[..., Iterator[PartRead]], progress: Progress, **reading: Any
) -> tuple[Summary, list[LongRecording], Log]:
    """Returns the summary of all rows of files, the opened files, and a log of their format and rows.

    `reading` holds the arguments of :func:`open_long_recording`.
    """
    recordings = [open_long_recording(path, **reading) for path in paths]
    for other in recordings[1:]:
        if other.units != recordings[0].units or (other.direction is None) != (
            recordings[0].direction is None
        ):
            raise InputError(
                f"{other.path} and {recordings[0].path} differ in their units, or only one has a direction "
                "column; identify each one separately"
            )
    parts = [(recording, part) for recording in recordings for part in recording.parts]
    read = in_workers(read_part, parts, done=lambda count: progress(count, len(parts)))
    of_file = [PartRead() for _ in recordings]
    numbers = [number for number, recording in enumerate(recordings) for _ in recording.parts]
    for number, part in zip(numbers, read, strict=True):
        of_file[number].left_out.add(part.left_out, of_file[number].rows)
        of_file[number].add(part.summary, part.rows)
    log = Log()
    for recording, found in zip(recordings, of_file, strict=True):
        require_all_rows(recording, found)
        # The first note repeats the columns of the source, and is used only if it states the format of the
        # file.
        where = f"{recording.path}: " if len(recordings) > 1 else ""
        form = [note for note in recording.notes[:1] if "read as" in note]
        log.notes += [where + each for each in (*form, *recording.notes[1:])]
        log.rows += [where + each for each in found.left_out.sentences(recording.places())]
    summaries = [found.summary for found in of_file if found.summary is not None]
    if not summaries:
        raise InputError(f"{', '.join(str(path) for path in paths)}: no row is usable")
    return reduce(merged, summaries), recordings, log


@dataclass
class PartRead:
    """Summary of the rows read from one part of a file, or from successive parts."""

    summary: Summary | None = None
    """Summary of the usable rows; None if no row is usable"""
    rows: int = 0
    """Number of rows that were read from the file"""
    left_out: LeftOut = field(default_factory=LeftOut)

    def add(self, summary: Summary | None, rows: int) -> None:
        """Adds the number of the following rows, and the summary of those that are used."""
        self.rows += rows
        if summary is not None:
            self.summary = summary if self.summary is None else merged(self.summary, summary)


def read_part(work: tuple[LongRecording, tuple[int, int]]) -> PartRead:
    """Reads one part of one file. Without a direction column the directions are taken from the order of
    rows."""
    recording, part = work
    found = PartRead()
    for block in recording.blocks(part):
        summary = None
        if len(block.position):
            wrong = wrong_readings(block.position, block.position, block.force)
            position, force = block.position[~wrong], block.force[~wrong]
            require_in_range("position", position)
            require_in_range("force", force)
            if block.direction is None:
                side, waiting = strokes_from_order(position), waits(position)
                if side is not None and waiting is not None:
                    side = np.where(waiting, 0, side)
            else:
                side = block.direction[~wrong]
            summary = summarise(position, force, side)
            if wrong.any():
                first = int(np.flatnonzero(block.kept)[wrong][0])
                found.left_out.drop("with a wrong reading", int(wrong.sum()), found.rows + first)
        found.add(summary, len(block.kept))
        found.left_out.add(block.left_out, 0)
    return found


def require_all_rows(recording: LongRecording, read: PartRead) -> None:
    """Refuses a file whose numbers of used rows and of left out rows do not add up to all its rows."""
    used = 0 if read.summary is None else round(read.summary.rows)
    if not used + read.left_out.rows == read.rows == recording.rows:
        raise InputError(
            f"{recording.path} has {recording.rows} rows, but {used} were used and {read.left_out.rows} were "
            "not. The workers may have another file of this name: give all of them the same file"
        )


def _error_on_rows(summary: Summary, network: FittedNetwork) -> float:
    """Returns the RMS error of a network on the rows of a summary, with hysteresis on those with a direction;
    the network is taken as straight within a cell."""
    position, side, lower = summary.position, network.rows.side, float(network.lower[0])
    if (period := network.period) is not None:
        position = lower + period * modulo((position - lower) / period)
    model = network.force_model()
    given, rows = {}, summary.count
    if side is not None and network.weight_hysteresis is not None:
        given, rows = {"direction": side}, summary.count * (side != 0.0)
    force, slope = (np.asarray(read(position, **given)) for read in (model.force, model.slope))
    inside = summary.yy - 2.0 * slope * summary.xy + slope**2 * summary.xx
    total = inside / summary.count + (summary.force - force) ** 2
    return float(np.sqrt(max(float(np.average(total, weights=rows)), 0.0)))


def _identified(
    summary: Summary, recordings: Sequence[LongRecording], settings: IdentifyOptions, log: Log
) -> Model:
    if settings.below != "linear":
        log.notes += mirror_notes(summary.correlation)
    side: Float1D | None = summary.side.astype(np.float64)
    log.notes.append(f"Defects of the recording and a lag of the force were not searched: {IN_PARTS}.")
    untested = []
    if all(recording.direction is None for recording in recordings):
        if settings.inputs != "auto" and "hysteresis" not in settings.inputs:
            side = None
        elif _known_strokes(summary):
            log.notes.append("The direction is taken from the order of rows, block by block.")
        else:
            side = None
            untested.append(Decision("hysteresis", "not tested", UNKNOWN_STROKES))
            log.findings.append(
                usable(f"hysteresis was not tested: {UNKNOWN_STROKES}. Cure: {DIRECTION_CURE}")
            )
    if settings.inputs == "auto" and all(recording.has_time for recording in recordings):
        untested += [Decision(in_words(name), "not tested", IN_PARTS) for name in UNTESTED]
    with one_thread():
        rows = Rows(
            ("position",),
            summary.position[:, None],
            summary.force,
            side,
            weight=summary.count,
            within=summary.within,
            period=settings.period,
            position_unit=recordings[0].file_unit("position"),
            force_unit=recordings[0].file_unit("force"),
        )
        network = fit_rows(rows, settings)
    spread = float(np.sqrt(summary.variance))
    rmse = _error_on_rows(summary, network)
    nrmse = rmse / spread if spread > 0 else 0.0
    source, errors = Source.merged(recording.source for recording in recordings), network.errors
    log.extend(network.log)
    log.decisions += untested
    network = replace(
        network,
        errors=replace(errors, rmse=rmse, nrmse=nrmse, settled_nrmse=(nrmse, errors.left_out_nrmse)),
        log=log,
    )
    if settings.period is None:
        network = replace(network, lower=np.array([summary.lower]), upper=np.array([summary.upper]))
    return model_of(
        network,
        recordings[0].units,
        replace(source, rows=int(summary.rows)),
        verdict_of(network, ()),
    )


def _known_strokes(summary: Summary) -> bool:
    """True if both directions occur and most rows have a direction."""
    press, release = (float(summary.count[summary.side == side].sum()) for side in (1, -1))
    return min(press, release) > 0.0 and 2.0 * (press + release) >= summary.rows


def _require_summable(settings: IdentifyOptions) -> None:
    further = set(() if settings.inputs == "auto" else settings.inputs) - {"position", "hysteresis"}
    if further:
        raise InputError(
            f"inputs names {', '.join(sorted(further))}: must be position and hysteresis only, for files "
            "that are read part by part"
        )


@dataclass(frozen=True)
class Summary:
    """Sums over the rows of each cell: arrays (m,), sorted by cell, then by direction."""

    level: int | None
    """Cells of position are 2^level wide [position]; None: each distinct position is a cell"""
    cell: Float1D
    """Number of the position cell, or the position itself if each distinct position is a cell"""
    side: NDArray[np.int8]
    """Direction: +1 into the object, -1 out of the object, 0 neither or not known"""
    count: Float1D
    position: Float1D
    """Mean"""
    force: Float1D
    """Mean"""
    xx: Float1D
    """Sum of squared differences of the positions from their mean"""
    xy: Float1D
    yy: Float1D
    lower: float
    """Least position of all rows"""
    upper: float

    @property
    def rows(self) -> float:
        """Number of rows that the summary represents."""
        return float(self.count.sum())

    @property
    def variance(self) -> float:
        """Population variance of the force over all rows."""
        mean = np.average(self.force, weights=self.count)
        between = float(self.count @ (self.force - mean) ** 2)
        return (between + float(self.yy.sum())) / self.rows

    @property
    def correlation(self) -> float:
        """Correlation of position and force over all rows [-]; 0 if position or force is constant."""
        dx = self.position - np.average(self.position, weights=self.count)
        dy = self.force - np.average(self.force, weights=self.count)
        xx = float(self.count @ (dx * dx) + self.xx.sum())
        xy = float(self.count @ (dx * dy) + self.xy.sum())
        return xy / math.sqrt(xx * self.variance * self.rows) if xx * self.variance > 0.0 else 0.0

    @property
    def within(self) -> float:
        """Sum of squared force differences within cells that a slope of the force does not explain
        [force^2]."""
        if self.level is None:
            return float(self.yy.sum())
        _, group = np.unique(np.floor(self.cell / POOLED_CELLS), return_inverse=True)
        xx, xy = np.bincount(group, self.xx), np.bincount(group, self.xy)
        explained = np.divide(xy * xy, xx, out=np.zeros_like(xx), where=xx > 0)
        return max(float(self.yy.sum() - explained.sum()), 0.0)


def summarise(
    position: Float1D, force: Float1D, side: NDArray[np.int8] | None, most_cells: int = MOST_CELLS
) -> Summary:
    """Returns the summary of one block with at least one row."""
    side = np.zeros(len(position), dtype=np.int8) if side is None else side
    lower, upper = float(position.min()), float(position.max())
    level = None
    # if the first rows already have too many distinct positions, the rows after them need no search
    if len(np.unique(position[: 4 * most_cells])) > most_cells or len(np.unique(position)) > most_cells:
        level = _level_for(lower, upper, most_cells)
    cell = position if level is None else np.floor(np.ldexp(position, -level))
    ones, zeros = np.ones(len(position)), np.zeros(len(position))
    columns = np.array([ones, position, force, zeros, zeros, zeros])
    return _grouped(level, cell, side, columns, lower, upper)


def merged(first: Summary, second: Summary, most_cells: int = MOST_CELLS) -> Summary:
    """Returns one summary for the rows of two summaries."""
    parts = (first, second)
    lower, upper = min(first.lower, second.lower), max(first.upper, second.upper)
    levels = [part.level for part in parts if part.level is not None]
    level = None
    if levels or len(np.union1d(first.cell, second.cell)) > most_cells:
        # the cell width fits the whole range of positions, not only cells with rows: later rows may fill gaps
        level = max([*levels, _level_for(lower, upper, most_cells)])
    cell = np.concatenate([_at_level(part, level) for part in parts])
    side = np.concatenate([part.side for part in parts])
    names = ("count", "position", "force", "xx", "xy", "yy")
    columns = np.array([np.concatenate([getattr(part, name) for part in parts]) for name in names])
    return _grouped(level, cell, side, columns, lower, upper)


def _level_for(lower: float, upper: float, most_cells: int) -> int:
    """Returns the smallest level (cell width 2^level) at which the range of positions has at most most_cells
    + 1 cells."""
    return math.ceil(math.log2(max(upper - lower, np.finfo(float).tiny) / most_cells))


def _at_level(summary: Summary, level: int | None) -> Float1D:
    """Returns the numbers of the cells of the summary at a level with the same or wider cells."""
    if level is None:
        return summary.cell
    return np.asarray(np.floor(np.ldexp(summary.cell, (summary.level or 0) - level)))


def _grouped(
    level: int | None, cell: Float1D, side: NDArray[np.int8], columns: Float2D, lower: float, upper: float
) -> Summary:
    """Merges columns (6, k) by cell and direction: count, mean position x, mean force y, and the sums xx, xy,
    yy."""
    distinct, place = np.unique(cell, return_inverse=True)
    key = 3 * place.astype(np.int64) + (side + 1)
    used, group = np.unique(key, return_inverse=True)
    count, x, y, xx, xy, yy = columns
    total = np.bincount(group, count)
    # means are computed relative to a value of the group, so that a large offset does not cost digits
    first = np.zeros(len(used), dtype=np.int64)
    first[group[::-1]] = np.arange(len(group))[::-1]
    x0, y0 = x[first], y[first]
    mean_x = x0 + np.bincount(group, count * (x - x0[group])) / total
    mean_y = y0 + np.bincount(group, count * (y - y0[group])) / total
    dx, dy = x - mean_x[group], y - mean_y[group]
    return Summary(
        level=level,
        cell=distinct[used // 3],
        side=(used % 3 - 1).astype(np.int8),
        count=np.asarray(total, dtype=np.float64),
        position=mean_x,
        force=mean_y,
        xx=np.asarray(np.bincount(group, xx + count * dx * dx), dtype=np.float64),
        xy=np.asarray(np.bincount(group, xy + count * dx * dy), dtype=np.float64),
        yy=np.asarray(np.bincount(group, yy + count * dy * dy), dtype=np.float64),
        lower=lower,
        upper=upper,
    )


Item = TypeVar("Item")

Result = TypeVar("Result")


def in_order(
    work: Callable[[Item], Result],
    items: Sequence[Item],
    *,
    jobs: int = 1,
    scheduler: str | None = None,
    done: Callable[[int], None] = lambda count: None,
) -> Iterator[Result]:
    """Yields work(item) of every item, in the order of items, and calls `done` with the number of finished
    items after each.

    joblib starts `jobs` processes of this machine; with 1 this process works. With the address of a Dask
    `scheduler`, such as "tcp://host:8786", joblib sends the same work to it. Work that a lost worker had is
    done again by another. So that a result does not depend on the worker, it must depend on the item alone.
    """
    with ExitStack() as stack:
        results: Iterator[Result] = map(work, items)
        if scheduler is not None or jobs != 1:
            joblib = _needed("joblib")
            if scheduler is not None:
                client = stack.enter_context(_client(scheduler))
                stack.enter_context(joblib.parallel_config(backend="dask", client=client))
            parallel = joblib.Parallel(n_jobs=-1 if scheduler else jobs, return_as="generator")
            results = parallel(joblib.delayed(work)(item) for item in items)
        for count, result in enumerate(results, start=1):
            yield result
            done(count)


def _needed(name: str) -> Any:
    try:
        return import_module(name)
    except ImportError:
        raise InputError(
            f"several processes need {name}: install it with pip install palpate[parallel]"
        ) from None


def _client(scheduler: str) -> Any:
    distributed = _needed("distributed")
    try:
        return distributed.Client(scheduler, timeout="10s", set_as_default=False)
    except (OSError, ValueError, TimeoutError) as error:
        raise InputError(f"no Dask scheduler answers at {scheduler}: {error}") from None

# SPDX-License-Identifier: Apache-2.0
"""The part of `palpate show` that prints a recording: its findings, columns, ranges, rate and strokes."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import listed
from ..recording import Recording
from ..recording.checks import quality_findings
from ..recording.motion import GAP_RATIO, cycles_of, directions_of
from ..recording.parts import Part, SeveralPartsError
from ..recording.roles import Informative, counts_text, role_counts, roles_of
from ..verdict import Verdict
from .exit_status import end_with, finishing
from .figures import FrameFigure, drawing, picture_frame, picture_recording
from .printing import number, print_json, print_numbers, print_paragraph, print_table, print_verdict
from .verb import ReadingOptions

_MODEL_START = b"{"
"""First character of a model file, which is JSON; no recording format begins with it."""

_MODEL_HEAD = 64
"""Number of bytes at the start of a file in which the first character is searched."""


def is_recording(file: Path) -> bool:
    """Returns True if a file is a recording: its name does not end in .json, and its content is not JSON."""
    if file.suffix.lower() == ".json" or not file.is_file():
        return False
    with file.open("rb") as stream:
        return not stream.read(_MODEL_HEAD).lstrip(b"\xef\xbb\xbf \t\r\n").startswith(_MODEL_START)


def show_recording(
    file: Path,
    reading: ReadingOptions,
    *,
    plot: Path | None,
    frame: FrameFigure | None,
    as_json: bool,
) -> None:
    """Prints a recording, its verdict first, and draws its views."""
    try:
        recording = reading.read(file)
    except SeveralPartsError as error:
        if not as_json:
            _print_parts(error.parts)
        raise
    informative = Informative([recording])
    (kept,), dropped = informative.recordings, informative.dropped
    verdict = Verdict(tuple(quality_findings(kept)))
    strokes, roles = _strokes(recording), role_counts(roles_of(kept)) | dropped
    with drawing() as write_figures:
        notes = () if plot is None else picture_recording(plot, recording)
        if frame is not None:
            domain = float(recording.position.min()), float(recording.position.max())
            picture_frame(frame, domain, recording.units["position"], of=file.name)
    with finishing():
        write_figures()
        if as_json:
            record = _record(file, recording, strokes) | {"roles": roles}
            print_json(record | {"verdict": str(verdict)})
        else:
            print_verdict(verdict)
            print_numbers(_summary(recording, strokes, roles))
            for note in notes:
                print_paragraph(note, indent="  ")
        end_with(verdict)


def _print_parts(parts: Sequence[Part]) -> None:
    """Prints the parts of a file of which none was chosen."""
    rows = [(each.name, str(number), str(each.rows)) for number, each in enumerate(parts, 1)]
    print_table(("part", "number", "rows"), rows)


def _strokes(recording: Recording) -> dict[str, int] | None:
    """Returns the numbers of press and release strokes; None if neither direction nor order shows strokes."""
    direction = directions_of(recording)
    if direction is None or not direction.any():
        return None
    moving = direction[direction != 0]
    first = moving[np.flatnonzero(np.diff(moving, prepend=0))]
    return {"press": int(np.sum(first > 0)), "release": int(np.sum(first < 0))}


def _summary(recording: Recording, strokes: dict[str, int] | None, roles: dict[str, int]) -> dict[str, str]:
    """Explains a recording in five lines: rows, columns, ranges, strokes, and what is missing for what."""
    position, force = recording.file_unit("position"), recording.file_unit("force")
    file_rows = recording.source.file_rows or len(recording)
    columns = ", ".join(f"{role} {name!r}" for role, name in recording.source.columns.items())
    ranges = [
        f"position {position.interval(recording.position.min(), recording.position.max())}",
        f"force {force.interval(recording.force.min(), recording.force.max())}",
        *_time_text(recording),
    ]
    if strokes is None:
        stroke_text = "not known: neither a direction column nor the order of the rows shows them"
    else:
        source = "the order of the rows" if recording.direction is None else "the direction column"
        stroke_text = f"{strokes['press']} press, {strokes['release']} release, from {source}"
        if len(cycles := cycles_of(recording)) > 1:
            first, last = (f"(rows {each.start} to {each.stop - 1})" for each in (cycles[0], cycles[-1]))
            stroke_text += f"; --part 'cycle N' reads one: cycle 1 {first} to cycle {len(cycles)} {last}"
    missing = ["no time, so no velocity, damping or memory"] if recording.time is None else []
    missing += ["no direction, so no hysteresis"] if strokes is None else []
    return {
        "rows": f"{len(recording)} of {file_rows} in the file: {counts_text(roles)}",
        "columns": columns + (f"; not used: {listed(recording.columns)}" if recording.columns else ""),
        "ranges": ", ".join(ranges),
        "strokes": stroke_text,
        "missing": "; ".join(missing) or "nothing",
    }


def _time_text(recording: Recording) -> list[str]:
    """Returns duration, rate and gaps of a recording in words, if it has time."""
    time, period = recording.time, recording.sample_period
    if time is None or period is None:
        return []
    steps = np.diff(time)
    gaps = int(np.sum(steps > GAP_RATIO * period))
    text = f"time {number(time[-1] - time[0])} s at {number(1.0 / period)} Hz, {gaps} gap{'s' * (gaps != 1)}"
    return [text if gaps == 0 else f"{text} of up to {number(steps.max())} s"]


def _record(file: Path, recording: Recording, strokes: dict[str, int] | None) -> dict[str, Any]:
    """Returns the values that `palpate show --json` prints for a recording; ranges are in SI units."""
    time, period = recording.time, recording.sample_period
    return {
        "recording": str(file),
        "rows": len(recording),
        "columns": dict(recording.source.columns),
        "units": dict(recording.units),
        "position": [float(recording.position.min()), float(recording.position.max())],
        "force": [float(recording.force.min()), float(recording.force.max())],
        "duration_s": None if time is None else float(time[-1] - time[0]),
        "rate_hz": None if period is None else 1.0 / period,
        "strokes": strokes,
        "cycles": [[each.start, each.stop] for each in cycles_of(recording)],
    }

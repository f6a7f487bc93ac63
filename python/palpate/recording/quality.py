# SPDX-License-Identifier: Apache-2.0
"""Checks of a recording before it is used: each finding names the rows, the likely cause and the cure.

The checks look for implausible magnitudes, contradicting signs, clipped or stuck sensors, repeated samples,
gaps, and (in `comparison`) files that hold two objects or recordings that do not belong together.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from .._typing import Float1D
from ..verdict import Finding, no, usable
from .comparison import CellRows, Travel, cell_rows, merged_findings, scale_findings, sides
from .conversion import MIN_ROWS, mirror_notes
from .lag import LONGEST_LAG_S
from .motion import TURN_STEPS, gaps_of, waits

if TYPE_CHECKING:
    from .recording import Recording

PLAUSIBLE_TRAVEL = {"m": (1e-7, 0.5), "rad": (1e-3, 100.0 * np.pi)}
"""Least and largest plausible position range by unit: from microscope tip to arm; up to 50 revolutions."""

PLAUSIBLE_FORCE_RANGE = {"N*m": (1e-6, 1e3), "A": (1e-5, 1e3)}
"""Least and largest plausible range of the force by unit; for N it depends on the position range."""

MICROSCOPE_TRAVEL = 1e-4
"""Position range below which a recording is taken to be from a force microscope [m]."""

MICROSCOPE_FORCE_RANGE, USUAL_FORCE_RANGE = (1e-10, 0.1), (1e-3, 1e4)
"""Least and largest plausible force range of a force microscope, and of other recordings [N]."""

LEAST_SAME_SIGN_SHARE = 0.8
"""Hysteresis needs the sign of the mean of press minus release force at this share of the positions."""

LEAST_LOOP_SHARE = 0.02
"""Least mean of press minus release force that is hysteresis, divided by the force's standard deviation."""

LEAST_LOOP_ERRORS = 5.0
"""Least mean of press minus release force that is hysteresis, divided by the standard error of this mean."""

MIRRORED_CORRELATION, MIRRORED_RANGE = 0.5, 0.2
"""A release is the mirrored press if the correlation of press and negative release is above the first value,
and each stroke has at least the second value of the range of the force: a constant friction has none [-]."""

LOWEST_ROWS = 5
"""Number of rows of the release at its smallest positions, whose median force is that of its end."""

LEAST_ZERO_SHIFT = 0.02
"""A release that ends below minus this share of the range of the force, after a press that is never below it,
has another zero [-]. No release of 56 measured switches and domes does."""

LEAST_CLIPPED_ROWS = 5
"""Least number of rows at the largest or least force (or position) that are reported as a clipped sensor."""

LEAST_CLIPPED_POSITIONS = 3
"""A clipped force is reported if it occurs at this number of positions or more; a tool at rest has one."""

LEAST_CLIPPED_RATIO = 5.0
"""Least ratio of rows at a clipped value to rows at any near value; rounding alone gives at most 3."""

NEAR_EXTREME_SHARE = 0.1
"""Values within this share of the range from the largest or least value are near to it."""

CONTACT_FORCE_SHARE = 0.2
"""A largest or least force below this share of the largest |force| is not clipped: there is no contact."""

LEAST_FORCE_CHANGE_SHARE = 0.1
"""Least change of force at the largest or least position that reports a clipped position sensor.

The change is a share of the force's range.
"""

LEAST_FORCE_CHANGE_NOISE = 6.0
"""Least change of force at a constant position that reports a clipped or stuck position sensor.

The change is divided by the force noise.
"""

LEAST_STUCK_FORCE_SHARE = 0.005
"""Least change of force that reports a stuck position sensor, as a share of the force's range.

The force changes while the position is constant; then the position jumps.
"""

LEAST_JUMP_RATIO = 5.0
"""Least jump of the position that reports a stuck position sensor in the rows before the jump.

The jump is divided by the median change of position between rows with different positions.
"""

LEAST_REGULAR_SHARE = 0.8
"""Share of the rows that must be in runs of regular length, so that a column is reported as repeated.

A run is a series of rows with one value. Its length is regular if it is a multiple of the commonest length.
"""

LEAST_CHANGE_RATIO = 1.5
"""Least ratio of two numbers of changes at which a column is reported as repeated.

The number of changes of the other column (position or force) is divided by that of the repeated column.
"""

LEAST_REPORTED_LAG = 0.005
"""Least change of force between two new values of a repeated sensor that is reported as late.

Both are standard deviations: that of the change is divided by that of the force.
"""

LONGEST_HELD_ROWS = 1000
"""A value that is constant in this number of rows or more is a pause of the motion, not a repeated sample."""

LEAST_GAP_SHARE = 0.02
"""Least width of a position interval without rows that is reported, as a share of the position range."""

LEAST_GAP_RATIO = 8.0
"""Least width of a position interval without rows that is reported as a gap.

The width is divided by the 90th percentile of the distances of adjacent positions.
"""

MOST_NAMED_GAPS = 2
"""A finding on position intervals without rows states the limits of at most this number of intervals."""

LARGEST_END_GAP = 0.05
"""Share of the position range that a stroke may miss at the least or largest position without a finding."""

LEAST_LOST_SHARE = 0.05
"""Gaps in time are reported if they are together at least this share of the recording's duration."""


def findings_of(
    recordings: Sequence[Recording], side: Float1D | None = None, *, relaxes: bool = False
) -> list[Finding]:
    """Returns findings on each recording, with its name if there are several, and on all of them together.

    `side` (n,) is the direction of the rows of all recordings if they do not state it. The force of an object
    that relaxes may change at the same position.
    """
    if len(recordings) == 1:
        return quality_findings(recordings[0], relaxes=relaxes)
    found = [
        Finding(finding.level, f"{recording.source.files[0]}: {finding.sentence}")
        if recording.source.files
        else Finding(finding.level, f"recording {number}: {finding.sentence}")
        for number, recording in enumerate(recordings, 1)
        for finding in quality_findings(recording, relaxes=relaxes)
    ]
    return [*found, *scale_findings(recordings, side)]


def quality_findings(recording: Recording, *, relaxes: bool = False) -> list[Finding]:
    """Returns findings on a recording as it was read; empty without defects."""
    if len(recording) < MIN_ROWS:
        return []
    travel = Travel.of(recording.position)
    cells = None if recording.input_names else _moving_cells(recording)
    return [
        *magnitude_findings(recording, travel),
        *sign_findings(recording, travel, cells),
        *zero_findings(recording, cells),
        *saturation_findings(recording, travel),
        *hold_findings(recording),
        *gap_findings(recording, travel),
        *merged_findings(recording, None if relaxes else cells),
    ]


def _moving_cells(recording: Recording) -> CellRows | None:
    """Returns the rows of a recording by position cell, without the rows at which the tool waits."""
    waiting = waits(recording.position)
    if waiting is None:
        return cell_rows(recording, Travel.of(recording.position))
    moving, kept = np.flatnonzero(~waiting), recording.without(waiting)
    if not len(moving):
        return None
    cells = cell_rows(kept, Travel.of(kept.position))
    return None if cells is None else replace(cells, row=moving[cells.row])


def magnitude_findings(recording: Recording, travel: Travel) -> list[Finding]:
    """Returns findings on an implausible travel or force range. Unstated units are not checked."""
    position, force = recording.file_unit("position"), recording.file_unit("force")
    inner = recording.force[travel.inside]
    force_bounds = PLAUSIBLE_FORCE_RANGE.get(force.si)
    if position.si == "m" and force.si == "N":
        force_bounds = MICROSCOPE_FORCE_RANGE if travel.length < MICROSCOPE_TRAVEL else USUAL_FORCE_RANGE
    found = []
    for role, value, unit, bounds in (
        ("travel", travel.length, position, PLAUSIBLE_TRAVEL.get(position.si)),
        ("range of the force", float(np.ptp(inner)), force, force_bounds),
    ):
        if bounds is None or value == 0.0 or bounds[0] <= value <= bounds[1]:
            continue
        side, bound = ("below", bounds[0]) if value < bounds[0] else ("above", bounds[1])
        over = "" if role == "travel" else f" over a travel of {position.text(travel.length)}"
        found.append(
            usable(
                f"the {role} is {unit.text(value)}{over}, {side} {unit.text(bound)}: the unit of "
                "position or force is probably wrong; name the right one with --units"
            )
        )
    return found


def sign_findings(recording: Recording, travel: Travel, cells: CellRows | None) -> list[Finding]:
    """Returns findings on a reversed direction, release force above press force, and falling force."""
    signs = recording.direction
    if signs is not None and len(signs) > 1:
        # a spike of the position sensor goes up and down again, so it is not counted as motion
        step = np.where(travel.inside[1:] & travel.inside[:-1], np.diff(recording.position) * signs[1:], 0.0)
        if step.sum() < 0:
            against = float(np.mean(step[step != 0.0] < 0))
            return [
                usable(
                    f"the position falls in rows whose direction is into the object ({against:.0%} of the "
                    "moving rows): position or direction is probably reversed; if the position grows out of "
                    "the object give --negate position, else exchange the words of the direction column"
                )
            ]
    if recording.input_names:
        return []
    mean, is_loop = _loop(recording, cells)
    if is_loop and mean < 0.0:
        lag_s = _lag_of(recording, -mean)
        late = (
            f"; if the force was recorded late, --force-late-s {lag_s:.2g}" if lag_s <= LONGEST_LAG_S else ""
        )
        return [
            usable(
                f"on average the force on release is {recording.file_unit('force').text(-mean)} above that "
                "on press; a passive object cannot do that. If a sign is reversed, give --negate force or "
                f"--negate position{late}; for a latch or a stored spring, --no-hysteresis-nonnegative"
            )
        ]
    x, f = recording.position[travel.inside], recording.force[travel.inside]
    if is_loop or not (np.ptp(f) > 0.0 and np.ptp(x) > 0.0):
        return []
    return [usable(sentence) for sentence in mirror_notes(float(np.corrcoef(x, f)[0, 1]))]


def zero_findings(recording: Recording, cells: CellRows | None) -> list[Finding]:
    """Returns findings on a release with another zero than its press, and on a stroke with the wrong sign."""
    if cells is None or len(cells.press) < 4:
        return []
    press, release, unit = cells.press, cells.release, recording.file_unit("force")
    reach = _inner_range(recording.force)  # without the few rows of a hard stop
    varied = min(np.ptp(press), np.ptp(release)) > MIRRORED_RANGE * reach
    # A damper mirrors its force as well, but not at the turn, where it is slow.
    turned = min(abs(each[-1]) / np.abs(each).max() for each in (press, release)) > 0.5
    if turned and varied and float(np.corrcoef(press, -release)[0, 1]) > MIRRORED_CORRELATION:
        return [
            no(
                "the force of the release is that of the press with the opposite sign: one stroke was "
                "recorded with the wrong sign. Change the sign of the force of one stroke"
            )
        ]
    shift = LEAST_ZERO_SHIFT * reach
    start, end = (
        _lowest_force(recording, cells.row[(cells.cell >= cells.cells) == way]) for way in (False, True)
    )
    # The friction of an object that holds the tool is above zero in the press and below it in the release.
    if end > -shift or press.min() < -shift or abs(start) > 0.5 * abs(end) or not varied:
        return []
    return [
        usable(
            f"the release ends at {unit.text(end)}, but the press never pulls the tool. If the tool is not "
            "fixed to the object, the zero of the force changed between the strokes: record again without a "
            "tare in between"
        )
    ]


def _lowest_force(recording: Recording, rows: NDArray[np.intp]) -> float:
    """Returns the median force of the rows at the smallest positions, among some rows."""
    lowest = rows[np.argsort(recording.position[rows], kind="stable")[:LOWEST_ROWS]]
    return float(np.median(recording.force[lowest]))


def _loop(recording: Recording, cells: CellRows | None) -> tuple[float, bool]:
    """Returns the mean of press minus release force, and True if it differs from zero by more than noise."""
    if cells is None or len(cells.loop) < 4:
        return 0.0, False
    mean = float(np.mean(cells.loop))
    error = float(np.sqrt(np.mean(cells.loop_error**2) / len(cells.loop)))
    same_sign = float(np.mean(np.sign(cells.loop) == np.sign(mean)))
    large = abs(mean) > max(LEAST_LOOP_ERRORS * error, LEAST_LOOP_SHARE * float(np.std(recording.force)))
    return mean, large and same_sign >= LEAST_SAME_SIGN_SHARE


def _lag_of(recording: Recording, gap: float) -> float:
    """Returns the lag of the force that raises release above press by `gap` [s]; infinite without time.

    A force that is late by t is lower on press and higher on release by slope * speed * t.
    """
    period = recording.sample_period
    if period is None:
        return np.inf
    slope = abs(float(np.polyfit(recording.position, recording.force, 1)[0]))
    speed = float(np.mean(np.abs(np.diff(recording.position)))) / period
    return gap / (2.0 * slope * speed) if slope * speed > 0.0 else np.inf


def saturation_findings(recording: Recording, travel: Travel) -> list[Finding]:
    """Returns findings on a clipped force, a clipped position, and a stuck position."""
    x, f = recording.position, recording.force
    force_range = float(np.ptp(f))
    if not force_range > 0.0:
        return []
    largest = float(np.max(np.abs(f)))
    found = []
    for value, name in ((float(f.max()), "largest"), (float(f.min()), "least")):
        near = f[np.abs(f - value) <= NEAR_EXTREME_SHARE * force_range]
        rows = np.flatnonzero(f == value)
        if abs(value) < CONTACT_FORCE_SHARE * largest or len(rows) < LEAST_CLIPPED_ROWS:
            continue
        _, counts = np.unique(near, return_counts=True)
        others = np.delete(counts, -1 if name == "largest" else 0)
        most_near = others.max(initial=1)
        if (
            len(rows) >= LEAST_CLIPPED_RATIO * most_near
            and len(np.unique(x[rows])) >= LEAST_CLIPPED_POSITIONS
        ):
            found.append(
                usable(
                    f"the {name} force, {recording.file_unit('force').text(value)}, occurs in {len(rows)} "
                    f"rows ({len(rows) / len(f):.2g} of all) while the position changes from "
                    f"{recording.file_unit('position').interval(x[rows].min(), x[rows].max())}: the force "
                    "sensor or its converter is probably clipped there; record with a larger force range or "
                    "press less far"
                )
            )
    return [*found, *_constant_position_findings(recording, travel, force_range)]


def _constant_position_findings(recording: Recording, travel: Travel, force_range: float) -> list[Finding]:
    """Returns findings on a position that is constant in many rows while the force changes."""
    x, f = recording.position, recording.force
    noise = float(np.median(np.abs(np.diff(f)))) / 0.954
    bound = max(LEAST_FORCE_CHANGE_SHARE * force_range, LEAST_FORCE_CHANGE_NOISE * noise)
    unit = recording.file_unit("position")
    for value, name in ((travel.upper, "largest"), (travel.lower, "least")):
        rows = np.flatnonzero(x == value)
        if len(rows) >= max(LEAST_CLIPPED_ROWS, LEAST_CLIPPED_RATIO * _usual_count(x, value, travel)):
            change = _change_inside(f, rows)
            if change > bound:
                return [
                    usable(
                        f"the {name} position, {unit.text(value)}, occurs in {len(rows)} rows while the "
                        f"force changes by {recording.file_unit('force').text(change)} and returns: the "
                        "position sensor is probably clipped there; record with a larger range of position"
                    )
                ]
    step = np.diff(x)
    moving = np.abs(step[step != 0.0])
    if not len(moving):
        return []
    usual = float(np.median(moving))
    bound = max(LEAST_STUCK_FORCE_SHARE * force_range, LEAST_FORCE_CHANGE_NOISE * noise)
    edges = np.r_[0, np.flatnonzero(step != 0.0) + 1, len(x)]
    lengths = np.diff(edges)
    many = max(float(LEAST_CLIPPED_ROWS), LEAST_CLIPPED_RATIO * float(np.median(lengths)))
    for k in np.flatnonzero(lengths >= many).tolist():
        start, stop = int(edges[k]), int(edges[k + 1])
        jump = abs(float(x[stop] - x[stop - 1])) if stop < len(x) else 0.0
        # After a hold the tool moves on from where it is; a stuck sensor jumps to where it has gone.
        jump -= abs(float(x[stop + 1] - x[stop])) if stop + 1 < len(x) else 0.0
        if jump > LEAST_JUMP_RATIO * usual and _inner_range(f[start:stop]) > bound:
            return [
                usable(
                    f"the position is constant in rows {start} to {stop - 1}, then jumps by "
                    f"{unit.text(jump)}, while the force changes by "
                    f"{recording.file_unit('force').text(_inner_range(f[start:stop]))}: "
                    "the position sensor was probably stuck; use the rows before or after with --rows "
                    f"0:{start} or --rows {stop}:{len(x)}"
                )
            ]
    return []


def _usual_count(x: Float1D, value: float, travel: Travel) -> float:
    """Returns the median number of rows with equal position, for positions near `value`, without `value`."""
    near = x[(np.abs(x - value) <= NEAR_EXTREME_SHARE * travel.length) & (x != value)]
    return float(np.median(np.unique(near, return_counts=True)[1])) if len(near) else 1.0


def _change_inside(f: Float1D, rows: NDArray[np.intp]) -> float:
    """Returns how far the force inside a run of rows leaves the interval between its first and last force.

    A hand is at rest when it reverses, while friction changes its sign. The force then changes from one end
    of the run to the other, but does not leave that range.
    """
    first = np.flatnonzero(np.diff(rows, prepend=-2) != 1)
    last = np.r_[first[1:], len(rows)] - 1
    force = f[rows]
    ends = force[first], force[last]
    above = np.maximum.reduceat(force, first) - np.maximum(*ends)
    below = np.minimum(*ends) - np.minimum.reduceat(force, first)
    return float(max(above.max(), below.max()))


def _inner_range(values: Float1D) -> float:
    """Returns the difference between the 95th and the 5th percentile of the values."""
    low, high = np.percentile(values, (5.0, 95.0))
    return float(high - low)


def hold_findings(recording: Recording) -> list[Finding]:
    """Returns findings if position or force changes only once in several rows: a repeated, slower sensor.

    If both columns change equally often, this is a defect only with time: the time of most rows is wrong.
    """
    x, f = recording.position, recording.force
    rows = {"position": _held_for(x), "force": _held_for(f)}
    moved = np.abs(np.diff(x))[np.diff(x) != 0.0]
    if len(moved) and np.median(moved) <= TURN_STEPS * moved.min():
        rows["position"] = 1  # steps of a coarse sensor, not repeated values
    if rows["position"] == rows["force"]:
        return (
            []
            if recording.time is None
            else _held_findings(recording, "position and force change", rows["force"], "")
        )
    found = []
    for name, held, other in (("force", f, x), ("position", x, f)):
        if np.count_nonzero(np.diff(other)) >= LEAST_CHANGE_RATIO * np.count_nonzero(np.diff(held)):
            found += _held_findings(
                recording, f"the {name} changes", rows[name], " while the other column changes in between"
            )
    return found


def _held_findings(recording: Recording, subject: str, rows: int, other: str) -> list[Finding]:
    f, lag = recording.force, (rows - 1) / 2.0
    if rows < 2 or not np.std(f[rows:] - f[:-rows]) > LEAST_REPORTED_LAG * np.std(f):
        return []
    late = ""
    if subject == "the force changes" and (period := recording.sample_period) is not None:
        late = f", or give --force-late-s {lag * period:.3g}"
    return [
        usable(
            f"{subject} only once in {rows} rows{other}: a slower sensor was probably repeated, and "
            f"is late by {lag:g} rows on average; keep one row of each {rows}, the first with a new "
            f"value{late}"
        )
    ]


def _held_for(values: Float1D) -> int:
    """Returns the number of rows for which a column usually keeps one value; 1 if it is irregular."""
    edges = np.flatnonzero(np.diff(values)) + 1
    lengths = np.diff(edges)
    lengths = lengths[lengths < LONGEST_HELD_ROWS]
    if len(lengths) < 4:
        return 1
    rows = np.bincount(lengths) * np.arange(lengths.max() + 1)
    common = int(np.argmax(rows))
    return common if rows[::common].sum() >= LEAST_REGULAR_SHARE * rows.sum() else 1


def gap_findings(recording: Recording, travel: Travel) -> list[Finding]:
    """Returns findings on gaps in position and in time."""
    return [*_position_gaps(recording, travel), *_time_gaps(recording)]


def _position_gaps(recording: Recording, travel: Travel) -> list[Finding]:
    if not travel.length > 0.0 or recording.input_names:
        return []
    side = sides(recording, travel)
    strokes = [(1, "press stroke"), (-1, "release stroke")] if recording.direction is not None else []
    found: list[Finding] = []
    reported: set[tuple[float, float]] = set()
    for of, name in [(0, "recording"), *strokes]:
        at = np.unique(recording.position if of == 0 else recording.position[travel.inside & (side == of)])
        if len(at) < 10:
            continue
        distances = np.diff(at)
        bound = max(LEAST_GAP_SHARE * travel.length, LEAST_GAP_RATIO * float(np.percentile(distances, 90.0)))
        gaps = [(float(at[k]), float(at[k + 1])) for k in np.flatnonzero(distances > bound)]
        gaps = [gap for gap in gaps if gap not in reported]
        reported.update(gaps)
        if of and at[0] - travel.lower > LARGEST_END_GAP * travel.length:
            gaps.append((travel.lower, float(at[0])))
        if of and travel.upper - at[-1] > LARGEST_END_GAP * travel.length:
            gaps.append((float(at[-1]), travel.upper))
        if gaps:
            found.append(_gaps(recording, travel, name, gaps))
    return found


def _gaps(recording: Recording, travel: Travel, name: str, gaps: list[tuple[float, float]]) -> Finding:
    """Returns a finding on all position intervals without rows, with the limits of the longest ones."""
    unit = recording.file_unit("position")
    share = sum(stop - start for start, stop in gaps) / float(np.ptp(recording.position))
    longest = sorted(gaps, key=lambda gap: gap[0] - gap[1])[:MOST_NAMED_GAPS]
    named = " and ".join(unit.interval(*gap) for gap in sorted(longest))
    more = f" ({len(gaps) - len(longest)} shorter gaps are not listed)" if len(gaps) > len(longest) else ""
    return usable(
        f"the {name} has no rows from {named}{more}, {share:.0%} of the travel: the model is interpolated "
        "or extrapolated there; record these positions too, or remove single rows beyond a gap"
    )


def _time_gaps(recording: Recording) -> list[Finding]:
    if recording.time is None or len(recording) < 3:
        return []
    steps = np.diff(recording.time)
    period = float(np.median(steps))
    gaps = steps[gaps_of(recording.time, recording.position) - 1]
    duration = float(recording.time[-1] - recording.time[0])
    lost = float(np.sum(gaps - period)) / duration
    if lost < LEAST_LOST_SHARE:
        return []
    many = "s" * (len(gaps) > 1)
    return [
        usable(
            f"time has {len(gaps)} gap{many}, the longest {gaps.max():.4g} s at a sample period of "
            f"{period:.4g} s; {lost:.0%} of the duration has no rows: samples were probably dropped, and "
            "velocity and hysteresis are not judged across a gap; record without dropped samples"
        )
    ]

# SPDX-License-Identifier: Apache-2.0
"""Contradicting signs of position, force and direction, and strokes with another sign or zero."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..._typing import Float1D, Float2D
from ...verdict import FORCE_FLOOR, Finding, force_jnd, no, usable
from ..contact import air_rows
from ..conversion import FALLING_CORRELATION, mirror_notes
from ..motion import LEAST_STROKE_ROWS, LONGEST_LAG_S, directions_of
from ..rows import along
from .cells import LEAST_COMPARED_ROWS, LEAST_ROWS_PER_CELL, MOST_CELLS, CellRows, Checked, inner_range

if TYPE_CHECKING:
    from ..recording import Recording


def reversed_sign(checked: Checked, *, same_sign_share: float) -> list[Finding]:
    """Returns findings on a reversed direction, release force above press force, and falling force.

    Parameters
    ----------
    same_sign_share : float
        Share of the positions with the sign of the mean of press minus release force, for a hysteresis [-].
    """
    recording = checked.recording
    signs = recording.direction
    if signs is not None:
        steps = along(recording.position, signs)
        if steps.sum() < 0.0:
            against = float(np.mean(steps < 0.0))
            return [
                usable(
                    f"the position falls in rows whose direction is into the object ({against:.0%} of the "
                    "moving rows): position or direction is probably reversed; if the position grows out of "
                    "the object give --negate position, else exchange the words of the direction column"
                )
            ]
    if recording.input_names:
        return []
    cells, is_loop, x, f = checked.cells, False, recording.position, recording.force
    if cells is not None and len(cells.loop) >= 4:
        mean = float(np.mean(cells.loop))
        jnd = force_jnd(0.5 * (cells.press + cells.release), FORCE_FLOOR * float(np.abs(f).max()) or 1.0)
        large = abs(float(np.mean(cells.loop / jnd))) > 1.0
        is_loop = large and float(np.mean(np.sign(cells.loop) == np.sign(mean))) >= same_sign_share
    if is_loop and mean < 0.0:
        causes = []
        if _lag_of(recording, -mean) <= LONGEST_LAG_S:
            causes.append("if the force was recorded late, give its delay, --force-late-s SECONDS")
        # With a reversed sign, a force that rises over the whole file would fall.
        if not float(np.corrcoef(x, f)[0, 1]) > -FALLING_CORRELATION:
            causes.append("if a sign is reversed, give --negate force or --negate position")
        causes.append("if the zero of the force moved or a stroke has the wrong sign, record again")
        causes.append("for a latch or a stored spring, give --no-hysteresis-nonnegative")
        return [
            usable(
                f"on average the force on release is {recording.file_unit('force').text(-mean)} above that "
                f"on press; a passive object cannot do that: {'; '.join(causes)}"
            )
        ]
    if is_loop or checked.attracts or not (np.ptp(f) > 0.0 and np.ptp(x) > 0.0):
        return []
    # Equal parts of the travel count the same, so that neither a wait nor the rate of the rows decides.
    parts = min(max(len(x) // LEAST_ROWS_PER_CELL, 3), MOST_CELLS)
    part = np.minimum((parts * ((x - checked.lower) / checked.travel)).astype(np.intp), parts - 1)
    rows = np.bincount(part, minlength=parts)
    curve = np.bincount(part, (f - f.min()) / np.ptp(f), parts)[rows > 0] / rows[rows > 0]
    changes = np.diff(curve)
    noticed = np.abs(changes) > FORCE_FLOOR
    # A force that lets go falls once, and rises over most of the travel.
    if not np.ptp(curve) > 0.0 or np.sign(changes[noticed]).sum() >= 0.0:
        return []
    correlation = float(np.corrcoef(np.flatnonzero(rows), curve)[0, 1])
    return [usable(sentence) for sentence in mirror_notes(correlation)]


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


def _strokes_of(checked: Checked, cells: CellRows) -> tuple[list[NDArray[np.intp]], Float2D]:
    """Returns the compared rows of each stroke, and the mean force of each stroke at the parts of the travel
    (strokes, parts); NaN at a part with few rows. Without the order of a motion, all presses and all releases
    are one stroke each."""
    recording, release = checked.recording, cells.cell >= cells.cells
    edges = np.flatnonzero(np.diff(release)) + 1
    if recording.motion.waiting is not None and len(edges) < len(release) // LEAST_STROKE_ROWS:
        strokes = np.split(np.arange(len(release)), edges)
    else:
        strokes = [np.flatnonzero(~release), np.flatnonzero(release)]
    # The rows of each stroke are as many in a part of the travel as those of all strokes in a cell.
    parts = max(2 * cells.cells // len(strokes), 4)
    part, force = cells.cell % cells.cells * parts // cells.cells, recording.force[cells.row]
    count = np.array([np.bincount(part[each], minlength=parts) for each in strokes])
    total = np.array([np.bincount(part[each], force[each], parts) for each in strokes])
    return strokes, np.where(count >= LEAST_COMPARED_ROWS, total / np.maximum(count, 1), np.nan)


def _agreement(force: Float1D, other: Float1D) -> float:
    """Returns the agreement of a force with the negative other one at their common parts: 1 for equal values,
    0 with few parts."""
    shared = np.isfinite(force + other)
    first, second = force[shared], -other[shared]
    power = float(first @ first + second @ second)
    return 2.0 * float(first @ second) / power if len(first) >= 4 and power > 0.0 else 0.0


def mirrored_stroke(
    checked: Checked, *, agreement: float, correlation: float, range_share: float
) -> list[Finding]:
    """Returns a finding if the force of a stroke is that of another one with the opposite sign.

    Two strokes in one direction show this alone. A press and its only release can also be those of a friction
    that grows with the position: the strokes of a second cycle would agree.

    Parameters
    ----------
    agreement : float
        Agreement of a force with the negative other one in the same direction above which they are mirrored,
        1 for equal values [-].
    correlation : float
        Agreement and correlation of a press and its negative release above which they are mirrored [-].
    range_share : float
        Least range of a press and of its release as a share of that of the force [-]: a constant friction has
        none.
    """
    cells, recording = checked.cells, checked.recording
    if cells is None:
        return []
    strokes, curves = _strokes_of(checked, cells)
    found = np.array([_agreement(*each) for each in zip(curves, curves[2:], strict=False)])
    # The force of an inertia changes its sign with the speed, so that its strokes do not repeat.
    if (found > agreement).any() and float(np.median(np.abs(found))) > agreement:
        one = int(np.argmax(found > agreement))
        unit, x = recording.file_unit("position"), recording.position[cells.row]
        names = [
            f"the {('press', 'release')[cells.cell[each[0]] // cells.cells]} from row {cells.row[each[0]]} "
            f"on, {unit.interval(float(x[each[0]]), float(x[each[-1]]))}"
            for each in (strokes[one], strokes[one + 2])
        ]
        return [
            no(
                f"{names[0]}, and {names[1]}, have forces with opposite signs: one of these strokes was "
                "recorded with the wrong sign. Change the sign of its force"
            )
        ]
    press, released = cells.press, cells.release
    if len(strokes) > 3 or len(press) < 4 or not _varied(checked, range_share):
        return []
    # A damper mirrors its force as well, but not at the turn, where it is slow.
    turned = min(abs(each[-1]) / np.abs(each).max() for each in (press, released)) > 0.5
    similar = min(_agreement(curves[0], curves[1]), float(np.corrcoef(press, -released)[0, 1]))
    if not turned or similar <= correlation:
        return []
    return [
        no(
            "the force of the release is that of the press with the opposite sign. Either the object has "
            "only friction, which grows with the position: record a second press and release to show this. "
            "Or one stroke has the wrong sign. Change the sign of the force of one stroke"
        )
    ]


def moved_zero(checked: Checked, *, shift_share: float, range_share: float, rows: int) -> list[Finding]:
    """Returns a finding if the release has another zero of the force than its press.

    Parameters
    ----------
    shift_share : float
        The release ends below minus this share of the range of the force, and the press is never below it
        [-].
    range_share : float
        Least range of each stroke as a share of that of the force [-].
    rows : int
        Number of rows at the smallest positions whose median force is that of the end.
    """
    cells, recording = checked.cells, checked.recording
    if cells is None or len(cells.press) < 4 or not _varied(checked, range_share):
        return []
    shift = shift_share * inner_range(recording.force)
    start, end = (
        _lowest_force(recording, cells.row[(cells.cell >= cells.cells) == way], rows) for way in (False, True)
    )
    # The friction of an object that holds the tool is above zero in the press and below it in the release.
    held = float(np.median(cells.release)) < 0.0 or start > 0.5 * abs(end)
    if end > -shift or cells.press.min() < -shift or held:
        return []
    # Rows of the press behind a turn are in no cell, and pull as those of the release before it.
    direction = directions_of(recording)
    if direction is not None:
        into = np.flatnonzero(recording.motion.moving & (direction > 0))
        if len(into) and _lowest_force(recording, into, rows) < -shift:
            return []
    return [
        usable(
            f"the release ends at {recording.file_unit('force').text(end)}, but the press never pulls the "
            "tool. If the tool is not fixed to the object, the zero of the force changed between the "
            "strokes: record again without a tare in between"
        )
    ]


def _varied(checked: Checked, range_share: float) -> bool:
    """True if the force of both strokes varies; the few rows of a hard stop do not count for its range."""
    assert checked.cells is not None
    strokes = checked.cells.press, checked.cells.release
    return bool(min(map(np.ptp, strokes)) > range_share * inner_range(checked.recording.force))


def _lowest_force(recording: Recording, rows: NDArray[np.intp], count: int) -> float:
    """Returns the median force of some rows at the smallest positions."""
    lowest = rows[np.argsort(recording.position[rows], kind="stable")[:count]]
    return float(np.median(recording.force[lowest]))


def force_without_contact(checked: Checked) -> list[Finding]:
    """Returns a finding if the force before the contact has the sign of the force in contact.

    A hand feels it if it exceeds the floor of the just noticeable difference. A force of the other sign may
    be that of an object which pulls.
    """
    recording = checked.recording
    air = air_rows(recording.position, recording.force, recording.motion.moving)
    if recording.input_names or np.count_nonzero(air) < LEAST_STROKE_ROWS:
        return []
    mean = float(recording.force[air].mean())
    in_contact = float(recording.force[~air].mean()) - mean
    if mean * in_contact <= 0.0 or abs(mean) <= FORCE_FLOOR * float(np.ptp(recording.force)):
        return []
    position, force = recording.file_unit("position"), recording.file_unit("force")
    rows = f"{np.count_nonzero(air)} rows below {position.text(float(recording.position[~air].min()))}"
    return [
        usable(
            f"the force before the contact is {force.text(mean)}, not zero ({rows}): if the sensor was not "
            "set to zero, add --zero air"
        )
    ]

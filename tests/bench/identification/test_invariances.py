# SPDX-License-Identifier: Apache-2.0
"""Tests the changes of a recording that add no information, and that some of them give the same model."""

from collections.abc import Callable
from functools import cache

import numpy as np
import pytest
from bench.identification.invariances import (
    CHANGES,
    few_rows,
    half_the_rate,
    measure,
    one_file_a_stroke,
    order_alone,
    pauses,
    release_first,
    repeated_rows,
    stored_by_change,
    through_air,
    waiting_rows,
    with_direction,
    without_the_end,
)
from bench.identification.invariances import drawn as drawn_to_change
from bench.identification.ordinary_objects import OBJECTS

from palpate import Recording

ADDING = waiting_rows, repeated_rows, pauses, through_air

KEPT = {
    "repeated_rows": {"class"},
    "half_the_rate": {"class"},
    "stored_by_change": {"class"},
    "with_direction": {"class", "verdict"},
    "order_alone": {"class", "verdict"},
    "one_file_a_stroke": {"class"},
    "without_the_end": {"class", "verdict"},
    "other_units": {"class", "verdict"},
    "other_zero": {"error", "class", "verdict"},
    "release_first": {"class", "verdict"},
    "small_drift": {"class", "verdict"},
    "few_rows": {"class"},
}
"""What each change kept in all of 20 draws; the study prints the shares of all changes and measures."""

KEEPING = with_direction, order_alone, one_file_a_stroke

THINNING = half_the_rate, stored_by_change, without_the_end, few_rows


def readings(recordings: Recording | list[Recording]) -> set[tuple[float, float]]:
    """Returns the pairs of position and force of all rows."""
    parts = recordings if isinstance(recordings, list) else [recordings]
    return {pair for part in parts for pair in zip(part.position.tolist(), part.force.tolist(), strict=True)}


@cache
def readings_of(draw: int) -> set[tuple[float, float]]:
    return readings(drawn_to_change(draw)[0].recording())


@pytest.mark.parametrize("change", [*ADDING, *KEEPING, *THINNING], ids=lambda change: change.__name__)
def test_a_change_keeps_the_readings_of_the_strokes(change: Callable) -> None:
    for draw in range(len(OBJECTS)):
        before = readings_of(draw)
        changed = change(*drawn_to_change(draw))
        if changed is None:
            continue
        after = readings(changed.recordings)
        if change not in THINNING:
            assert before <= after, draw
        if change not in ADDING:
            assert after <= before, draw


def test_a_press_behind_a_release_begins_with_the_friction_of_the_release() -> None:
    rows, random = drawn_to_change(10)  # play without load, whose friction reverses on a wide way
    first = int(np.count_nonzero(rows.stroke == 0))
    later = release_first(rows, random).recordings
    press, moved = (
        each.force[part] for each, part in ((rows.recording(), slice(first)), (later, slice(-first, None)))
    )
    x, reach = rows.motion.x[:first], np.ptp(rows.force)
    wide = x > x.min() + 2.1 * rows.object.turning * rows.object.travel
    assert np.abs(moved - press)[wide].max() < 1e-4 * reach
    assert (press - moved)[0] > 0.1 * reach  # from rest, no friction


def test_waiting_rows_have_the_force_at_rest() -> None:
    rows, random = drawn_to_change(4)  # a spring, out of contact at the start and end
    added = readings(waiting_rows(rows, random).recordings) - readings(rows.recording())
    position, force = np.array(sorted(added)).T
    assert len(force) >= 30
    assert position.max() < 0.0
    assert np.abs(force).max() < 6.0 * rows.force_noise.std()


def test_air_has_no_force_and_the_approach_ends_where_the_recording_begins() -> None:
    rows, random = drawn_to_change(0)
    changed = through_air(rows, random).recordings
    added = np.array(sorted(readings(changed) - readings(rows.recording())))
    assert added[:, 0].max() < 0.0
    assert np.abs(added[:, 1]).max() < 6.0 * rows.force_noise.std()
    assert (np.diff(changed.time) > 0.0).all()


def test_each_change_is_listed_once() -> None:
    assert len({change.__name__ for change in CHANGES}) == len(CHANGES) >= 9


def test_a_recording_that_begins_with_the_release_has_no_jump() -> None:
    for draw in (0, 2, 4, 11):
        rows, random = drawn_to_change(draw)
        position = release_first(rows, random).recordings.position
        travel = np.ptp(position)
        assert position[0] > position.max() - 0.05 * travel
        assert np.abs(np.diff(position)).max() < 0.05 * travel


@pytest.mark.full
@pytest.mark.parametrize("draw", [pytest.param(5, id="spring with wall"), pytest.param(13, id="pedal")])
def test_changes_without_new_information_keep_class_and_verdict(draw: int) -> None:
    measured = measure(draw, list(KEPT))
    for change in KEPT.keys() & measured.keys():
        lost = [name for name in KEPT[change] if not measured[change].get(name, True)]
        assert not lost, change

# SPDX-License-Identifier: Apache-2.0
"""Sections of long recordings: bounded rows that contain the inputs and directions of all rows."""

import numpy as np
import pytest

from palpate import Recording, identify, verify
from palpate.identification.data.sections import INTERVALS, MOST_ROWS, in_sections
from palpate.recording.motion import ordered_strokes, pieces

MOST = 5_000
"""Largest number of fitted rows in tests of the selection"""


def strokes(rows: int, seed: int = 0, *, time: bool = True) -> Recording:
    """Simulates strokes of a hand at 1 kHz on a spring with friction."""
    random = np.random.default_rng(seed)
    at = np.arange(rows) / 1000.0
    position = 0.01 * np.sin(2.0 * np.pi * at)
    force = 300.0 * position + 0.1 * np.cos(2.0 * np.pi * at) + random.normal(0.0, 0.01, rows)
    return Recording.from_arrays(position, force, at if time else None)


def covered(recording: Recording, whole: Recording) -> set[int]:
    """Returns the intervals of the whole travel in which a recording has rows."""
    share = (recording.position - whole.position.min()) / np.ptp(whole.position)
    return set(np.minimum(share * INTERVALS, INTERVALS - 1).astype(int).tolist())


def test_short_recordings_are_fitted_as_they_are() -> None:
    given = [strokes(2_000), strokes(3_000)]
    found, notes = in_sections(given, MOST)
    assert found[0] is given[0]
    assert found[1] is given[1]
    assert notes == ()


def test_sections_are_spread_over_the_whole_recording() -> None:
    (found,), notes = in_sections([strokes(100_000)], MOST)
    assert notes == (f"{len(found)} of 100000 rows are used for the fit, in sections spread over all rows.",)
    assert MOST <= len(found) <= 1.1 * MOST
    assert found.time is not None
    assert np.diff(found.time).max() < 3.0
    assert found.time[0] < 0.1
    assert found.time[-1] > 99.9


def test_a_rare_position_and_the_extremes_are_fitted() -> None:
    whole = strokes(100_000)
    position = whole.position.copy()
    position[33_333:33_343] += np.linspace(0.0, 0.02, 10)
    position[77_777] = -0.015
    rare = Recording.from_arrays(position, whole.force, whole.time)
    (found,), _ = in_sections([rare], MOST)
    assert covered(found, rare) == covered(rare, rare)
    assert found.position.min() == position.min()
    assert found.position.max() == position.max()


def test_one_slow_stroke_is_fitted_without_gaps_in_a_bounded_number_of_rows() -> None:
    rows = 200_000
    slow = Recording.from_arrays(np.linspace(0.0, 1.0, rows), np.linspace(0.0, 5.0, rows))
    (found,), _ = in_sections([slow], MOST)
    assert covered(found, slow) == set(range(INTERVALS))
    assert len(found) <= 2 * MOST


def test_a_single_release_is_fitted() -> None:
    rows = 100_000
    position = np.tile(np.linspace(0.0, 1.0, 500), rows // 500)
    position[61_000:61_500] = position[61_000:61_500][::-1]
    direction = np.ones(rows)
    direction[61_000:61_500] = -1.0
    whole = Recording.from_arrays(position, 2.0 * position, direction=direction)
    (found,), _ = in_sections([whole], MOST)
    assert found.direction is not None
    assert covered(found.without(found.direction > 0), whole) == set(range(INTERVALS))


def test_rare_values_of_a_further_input_are_fitted() -> None:
    whole = strokes(100_000)
    heat = np.full(len(whole), 20.0)
    heat[50_100:50_110] = 40.0
    hot = Recording.from_arrays(whole.position, whole.force, whole.time, inputs={"heat": heat})
    (found,), _ = in_sections([hot], MOST)
    assert found.inputs.max() == 40.0


def test_each_recording_keeps_its_share() -> None:
    given = [strokes(90_000), strokes(10_000, 1)]
    found, _ = in_sections(given, MOST)
    shares = [len(part) / MOST for part in found]
    assert shares == pytest.approx([0.9, 0.1], abs=0.05)


def test_a_motion_without_time_keeps_its_strokes() -> None:
    whole = strokes(100_000, time=False)
    (found,), _ = in_sections([whole], MOST)
    all_strokes, some = ordered_strokes(whole), ordered_strokes(found)
    assert all_strokes is not None
    assert some is not None
    assert np.array_equal(some, all_strokes[found.motion.rows])


def test_held_out_rows_stay_in_the_motion_of_a_section() -> None:
    train, _ = strokes(100_000).split(5)
    (found,), _ = in_sections([train], MOST)
    for piece in pieces(found):
        assert np.diff(piece.time) == pytest.approx(0.001)
    assert len(found.motion.position) == pytest.approx(1.25 * len(found), rel=0.01)


@pytest.mark.full
def test_a_long_recording_has_the_model_of_its_force_law() -> None:
    rows = MOST_ROWS + 100_000
    position = 0.5 - 0.5 * np.cos(np.arange(rows) / 300.0)
    random = np.random.default_rng(0)
    long = Recording.from_arrays(position, 3.0 * position + random.normal(0.0, 0.05, rows))
    model = identify(long)
    assert model.data.rows < rows
    assert model.notes["rows"][0].startswith(f"{model.data.rows} of {rows} rows are used for the fit")
    fresh = Recording.from_arrays(position[:5_000], 3.0 * position[:5_000])
    assert verify(model, fresh).nrmse < 1e-3

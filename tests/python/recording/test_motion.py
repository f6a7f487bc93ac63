# SPDX-License-Identifier: Apache-2.0
"""Press and release strokes are found from the order of the rows."""

import numpy as np
import pytest

from palpate.recording.motion import strokes_from_order, turns_of

IN_AND_OUT = np.concatenate([np.linspace(0.0, 1.0, 200), np.linspace(1.0, 0.0, 200)])
STATED = np.repeat([1, -1], 200)


def noise(deviation: float, n: int) -> np.ndarray:
    return np.random.default_rng(1).normal(0.0, deviation, n)


@pytest.mark.parametrize("scale", [1e-12, 1e-3, 1e6])
@pytest.mark.parametrize("step", [0.0, 0.001, 0.01, 0.05], ids=lambda step: f"step_{step}")
def test_strokes_of_a_quantised_position_end_at_its_reversal(scale: float, step: float) -> None:
    position = np.round(IN_AND_OUT / step) * step if step else IN_AND_OUT
    found = strokes_from_order(scale * position)
    assert found is not None
    # Rows within one position step of a reversal may belong to the press or to the release.
    assert np.count_nonzero(found != STATED) <= 200 * step
    assert turns_of(found) == 1


@pytest.mark.parametrize("deviation", [0.001, 0.005, 0.02, 0.04])
def test_position_noise_is_not_counted_as_a_reversal(deviation: float) -> None:
    found = strokes_from_order(IN_AND_OUT + noise(deviation, 400))
    assert found is not None
    assert turns_of(found) == 1
    assert np.count_nonzero(found != STATED) <= 1 + 200 * 3 * deviation


def test_every_cycle_gives_two_strokes() -> None:
    found = strokes_from_order(np.tile(IN_AND_OUT, 5) + noise(0.001, 2000))
    assert found is not None
    assert turns_of(found) == 9
    assert np.count_nonzero(found != np.tile(STATED, 5)) <= 10


def test_a_small_reversal_above_two_percent_is_a_stroke() -> None:
    position = np.concatenate([np.linspace(0, 1, 100), np.linspace(0.99, 0.96, 10), np.linspace(0.97, 1, 10)])
    found = strokes_from_order(position)
    assert found is not None
    assert turns_of(found) == 2
    assert turns_of(strokes_from_order(np.delete(position, range(102, 118)))) == 0  # type: ignore[arg-type]


@pytest.mark.parametrize("rows", [5, 6, 10, 20])
def test_short_strokes_are_found(rows: int) -> None:
    found = strokes_from_order(np.concatenate([np.linspace(0, 1, rows), np.linspace(1, 0, rows)]))
    assert found is not None
    assert found.tolist() == [1] * rows + [-1] * rows


def test_a_hold_at_the_end_of_a_stroke_has_no_direction() -> None:
    hold = np.concatenate([np.linspace(0, 1, 100), np.ones(100), np.linspace(1, 0, 100)])
    for position in (hold, hold + noise(0.003, 300)):
        found = strokes_from_order(position)
        assert found is not None
        assert (found[110:190] == 0).all()
        assert (found[:90] == 1).all()
        assert (found[210:] == -1).all()


@pytest.mark.parametrize("strokes", [2, 5])
def test_repeated_strokes_in_one_direction_keep_that_direction(strokes: int) -> None:
    for sign in (1, -1):
        found = strokes_from_order(sign * np.tile(np.linspace(0.0, 1.0, 100), strokes))
        assert found is not None
        assert (found == sign).all()


@pytest.mark.parametrize("sign", [1, -1])
def test_a_position_without_a_reversal_has_one_direction(sign: int) -> None:
    found = strokes_from_order(sign * np.sort(np.random.default_rng(2).uniform(0, 1, 500)))
    assert found is not None
    assert (found == sign).all()


@pytest.mark.parametrize(
    "position",
    [
        np.random.default_rng(3).uniform(0, 1, 1000),
        np.random.default_rng(3).permutation(IN_AND_OUT),
        np.random.default_rng(3).permutation(np.arange(12.0)),
        np.tile([0.0, 1.0], 50),
        np.tile([0.0, 0.5, 1.0, 0.5], 50),
        np.zeros(50),
        np.arange(3.0),
        np.empty(0),
    ],
    ids=[
        "random",
        "shuffled",
        "few_shuffled",
        "two_places",
        "three_places",
        "resting",
        "three_rows",
        "empty",
    ],
)
def test_unordered_rows_have_no_direction(position: np.ndarray) -> None:
    assert strokes_from_order(position) is None

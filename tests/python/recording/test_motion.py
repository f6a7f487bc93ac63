# SPDX-License-Identifier: Apache-2.0
"""Press and release strokes are found from the order of the rows."""

import numpy as np
import pytest

from palpate._core.model import play
from palpate.recording.motion import noise_band, noise_of, resolution_of, strokes_from_order, turns_of, waits

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


def test_the_tool_waits_in_a_hold_at_the_end_of_a_stroke() -> None:
    hold = np.concatenate([np.linspace(0, 1, 100), np.ones(100), np.linspace(1, 0, 100)])
    for position in (hold, hold + noise(0.003, 300)):
        found = waits(position)
        assert found is not None
        assert found[110:190].all()
        assert not found[10:90].any()
        assert not found[210:290].any()


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


@pytest.mark.parametrize("steps", [8, 10, 12, 15])
@pytest.mark.parametrize("strokes", [2, 6])
def test_strokes_of_30_rows_and_few_steps_have_an_order(steps: int, strokes: int) -> None:
    press = np.linspace(0.0, 1.0, 30)
    position = np.concatenate([press, press[::-1]] * (strokes // 2))
    found = strokes_from_order(np.round(position * steps) / steps)
    assert found is not None
    assert turns_of(found) == strokes - 1


def test_rows_without_an_order_have_no_waits() -> None:
    assert waits(np.random.default_rng(0).permutation(np.linspace(0.0, 1.0, 200))) is None


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


def rests(position: np.ndarray) -> list[int]:
    found = waits(position)
    return [] if found is None else np.flatnonzero(found).tolist()


@pytest.mark.parametrize(
    "position",
    [
        IN_AND_OUT,
        IN_AND_OUT[:200],
        np.tile(IN_AND_OUT, 5) + noise(0.001, 2000),
        2.0 - 2.0 * np.cos(np.linspace(0.0, 14.0 * np.pi, 7000)),
        noise(0.001, 300),
    ],
    ids=["loop", "one_stroke", "noisy", "sine", "nothing_but_wait"],
)
def test_a_motion_without_waits_has_none(position: np.ndarray) -> None:
    assert rests(position) == []


@pytest.mark.parametrize("rows", [7, 8, 9, 12])
def test_few_rows_have_no_wait(rows: int) -> None:
    assert rests(np.linspace(0.0, 1.0, rows)) == []
    assert rests(np.sort(np.random.default_rng(rows).uniform(0.0, 1.0, rows))) == []


@pytest.mark.parametrize("waiting", [5, 10, 300, 20_000])
@pytest.mark.parametrize("at", [0, 200, 400], ids=["first", "turn", "last"])
@pytest.mark.parametrize("scale", [1e-90, 1e-9, 1.0, 1e90])
def test_a_wait_is_found_from_its_first_to_its_last_row(waiting: int, at: int, scale: float) -> None:
    position = np.insert(IN_AND_OUT, [at] * waiting, IN_AND_OUT[min(at, 399)])
    found = rests(scale * position)
    # One row of the motion is at the position of the wait, and two are at that of the turn.
    assert len(found) in (waiting, waiting + 1, waiting + 2)
    assert found == list(range(found[0], found[0] + len(found)))
    assert found[0] in (at, at - 1)


@pytest.mark.parametrize("step", [0.001, 0.0025, 0.005, 0.0125, 0.025])
@pytest.mark.parametrize("rows", [100, 300, 1000])
def test_a_wait_of_a_quantised_position_is_found(step: float, rows: int) -> None:
    press = np.linspace(0.0, 1.0, 150)
    position = np.concatenate([np.zeros(rows), press, press[::-1], np.zeros(rows)])
    found = waits(np.round(position / step) * step)
    assert np.count_nonzero(found[:rows]) + np.count_nonzero(found[-rows:]) >= 2 * rows - 8
    assert not found[rows + 5 : -rows - 5].any()


@pytest.mark.parametrize("deviation", [0.0003, 0.001, 0.003])
def test_a_wait_of_a_noisy_position_is_found(deviation: float) -> None:
    position = np.concatenate([np.zeros(300), IN_AND_OUT, np.zeros(300)]) + noise(deviation, 1000)
    found = waits(position)
    assert np.count_nonzero(found[:300]) + np.count_nonzero(found[-300:]) >= 570
    assert np.count_nonzero(found[330:-330]) == 0


@pytest.mark.parametrize("steps", [1.0, 1.7, 2.5])
def test_a_hand_that_trembles_while_it_waits_waits_all_the_time(steps: float) -> None:
    encoder, press = 1.0 / 12_000, np.linspace(0.0, 1.0, 7200)
    trembling = steps * encoder * np.sin(2.0 * np.pi * 0.7 * np.arange(100) / 200.0)
    position = np.concatenate([press, 1.0 + trembling, press[::-1], trembling])
    found = np.flatnonzero(waits(np.round(position / encoder) * encoder))
    waiting = np.r_[7200:7300, 14_500:14_600]
    assert len(np.intersect1d(found, waiting)) >= 190
    assert len(np.setdiff1d(found, waiting)) <= 2


def test_a_settling_position_waits_if_the_hold_is_sampled_at_a_lower_rate() -> None:
    settling = 1.0 + 0.002 * (1.0 - np.exp(-np.arange(50) / 10.0))
    position = np.concatenate([np.linspace(0.0, 1.0, 200), settling, np.full(400, settling[-1])])
    time = np.concatenate([0.01 * np.arange(250), 2.5 + np.arange(400.0)])
    found = waits(position, time)
    assert not found[:199].any()
    assert found[205:].all()


def test_a_slow_stroke_before_a_fast_one_does_not_wait() -> None:
    slow, fast = np.linspace(0.0, 1.0, 6000), np.linspace(1.0, 0.0, 200)
    assert rests(np.concatenate([slow, fast])) == []


def test_noise_is_found_from_sixth_differences_and_a_motion_has_none() -> None:
    assert noise_of(noise(0.01, 4000)) == pytest.approx(0.01, rel=0.05)
    assert noise_of(IN_AND_OUT + noise(0.01, 400)) == pytest.approx(0.01, rel=0.15)
    assert noise_of(IN_AND_OUT**3) < 1e-9
    assert noise_of(np.arange(6.0)) == 0.0


@pytest.mark.parametrize("rows", [30, 80, 150, 1000])
def test_the_steps_of_a_quantised_motion_are_not_noise(rows: int) -> None:
    press = np.linspace(0.0, 1.0, rows)
    position = np.round(np.concatenate([press, press[::-1]]) * 80.0) / 80.0
    assert noise_band(position) == pytest.approx(1.5 * resolution_of(position))


@pytest.mark.parametrize("repeat", [1, 20])
@pytest.mark.parametrize("steps", [20, 40, 80, 160, 320])
def test_a_quantised_motion_waits_only_in_its_first_step(steps: int, repeat: int) -> None:
    position = np.round(np.repeat(IN_AND_OUT, repeat) * steps) / steps
    assert all(position[row] == position[0] for row in rests(position))


def by_change(step: float) -> tuple[np.ndarray, np.ndarray]:
    """Returns positions and times of two cycles with friction, stored for each change of force by `step`."""
    time = np.linspace(0.0, 8.0, 80_001)
    x = np.abs((time / 2.0 + 1.0) % 2.0 - 1.0)
    force = 10.0 * x + (x - play(x, 0.005)) / 0.005
    rows = np.flatnonzero(np.diff(np.floor(force / step), prepend=np.nan))
    return x[rows], time[rows]


def test_rows_that_are_stored_by_change_do_not_wait_behind_a_turn() -> None:
    position, time = by_change(0.1)
    found, without_time = waits(position, time), waits(position)
    assert found is not None
    assert without_time is not None
    assert not found.any()
    assert without_time.any(), "rows at one distance in time would wait: there they move less"


def test_a_wait_of_few_rows_is_found_by_its_time() -> None:
    position, time = by_change(0.1)
    at = len(time) // 8
    position = np.insert(position, at, [position[at - 1]] * 3)
    time = np.r_[time[:at], time[at - 1] + np.array([1.0, 2.0, 3.0]), time[at:] + 3.0]
    found = waits(position, time)
    assert found is not None
    assert set(range(at, at + 3)) <= set(np.flatnonzero(found).tolist()) <= set(range(at - 1, at + 4))

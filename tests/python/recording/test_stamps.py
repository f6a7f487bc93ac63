# SPDX-License-Identifier: Apache-2.0
"""Rows that are stored faster than their clock steps get times between these steps."""

from pathlib import Path

import numpy as np
import pytest

from imperfect import Array
from palpate import identify, read_recording
from palpate.recording.stamps import between_steps

PERIOD_S = 0.01


def rows(pause_s: float = 0.0) -> Array:
    """Returns the times of 1000 rows, with a pause of the recorder after 400 of them."""
    return PERIOD_S * np.arange(1000) + 0.003 + np.where(np.arange(1000) < 400, 0.0, pause_s)


@pytest.mark.parametrize("step", [0.0156, 0.1, 1.0], ids=["operating_system", "bluetooth", "seconds"])
def test_rows_are_evenly_spaced_within_a_step_of_their_clock(step: float) -> None:
    clock = step * np.floor(rows() / step)
    time, found = between_steps(clock)
    assert found == pytest.approx(step)
    assert np.abs(time - clock - 0.5 * step).max() < 0.6 * step + PERIOD_S
    np.testing.assert_allclose(np.diff(time), PERIOD_S, rtol=0.11 if step == 1.0 else 0.02)


def test_a_pause_of_the_recorder_stays_a_pause() -> None:
    step, true = 0.0156, rows(pause_s=3.0)
    time, _ = between_steps(step * np.floor(true / step))
    assert np.diff(time).argmax() == 399
    assert np.abs(time - true).max() < 2.0 * step
    np.testing.assert_allclose(np.delete(np.diff(time), range(398, 402)), PERIOD_S, rtol=0.05)


@pytest.mark.parametrize(
    "clock", [[], [0.0, 1.0, 2.0], [0.0, 0.0, 1.0, 0.5], [0.0, 0.0, 1.0, 2.0], [0.0, 0.0, np.nan, 1.0, 2.0]]
)
def test_other_times_are_kept(clock: list[float]) -> None:
    time, step = between_steps(np.array(clock))
    assert step == 0.0
    np.testing.assert_array_equal(time, clock)


@pytest.mark.parametrize("whole_seconds", [False, True])
def test_damping_is_identified_from_a_file_whose_times_repeat(tmp_path: Path, whole_seconds: bool) -> None:
    """Such a file was refused, or its clock was not read."""
    time = PERIOD_S * np.arange(3000)
    x = 0.01 * (1.0 - np.cos(2.0 * np.pi * np.cumsum(np.repeat([0.2, 0.6], 1500)) * PERIOD_S))
    force = 200.0 * x + 50.0 * np.gradient(x, time) + np.random.default_rng(0).normal(0.0, 0.02, len(x))
    stamps = [f"10:00:{int(t):02d}" if whole_seconds else f"{0.0156 * int(t / 0.0156):.4f}" for t in time]
    path = tmp_path / "a.csv"
    lines = [f"{t},{a:.6f},{f:.4f}" for t, a, f in zip(stamps, x, force, strict=True)]
    path.write_text(
        "\n".join(["time_s,position_m,force_N".replace("_s", "_s" * (not whole_seconds)), *lines])
    )
    recording = read_recording(path)
    assert "the rows between them are evenly spaced" in str(recording.notes)
    assert identify(recording).damping == pytest.approx(50.0, rel=0.03)

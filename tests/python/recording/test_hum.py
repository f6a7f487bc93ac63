# SPDX-License-Identifier: Apache-2.0
"""Hum of the mains is subtracted from the force and named; periodic presses, clicks and other lines stay."""

import numpy as np
import pytest

import palpate
from imperfect import Array
from palpate.recording.hum import without_hum

RATE_HZ = 1000.0

TRAVEL = 4e-3


def button(x: Array, side: Array) -> Array:
    return 250.0 * x + 0.4 * np.exp(-(((x - 1.5e-3) / 0.4e-3) ** 2)) + 0.03 * side


def pressed(
    *lines: tuple[float, float], presses: int = 1, seed: int = 0, noise: float = 0.005
) -> palpate.Recording:
    """Returns presses of a push button by a hand, each with a release, with lines (Hz, N) in the force."""
    random = np.random.default_rng(seed)
    time = np.arange(2000 * presses) / RATE_HZ
    way = np.cumsum(1.0 + 0.4 * np.sin(3.7 * time + 1.0) + 0.3 * np.sin(10.3 * time))
    phase = (way / way[-1] * presses) % 1.0
    x = TRAVEL * (1.0 - np.abs(2.0 * phase - 1.0))
    force = button(x, np.where(phase < 0.5, 1.0, -1.0)) + random.normal(0.0, noise, len(x))
    for hertz, height in lines:
        force += height * np.sin(2.0 * np.pi * (hertz * time + random.uniform()))
    return palpate.Recording.from_arrays(x, force, time, units={"position": "m", "force": "N"})


def error_of(model: palpate.Model) -> float:
    """Largest error of the force in the strokes [N]"""
    x = np.linspace(0.1, 0.9, 500) * TRAVEL
    sides = (np.full(len(x), side) for side in (1.0, -1.0))
    return max(float(np.abs(model.force(x, direction=side) - button(x, side)).max()) for side in sides)


@pytest.mark.parametrize("height", [0.01, 0.04])
@pytest.mark.parametrize("hertz", [49.9, 60.1])
def test_a_hum_becomes_no_ripple_of_the_model(hertz: float, height: float) -> None:
    recording = pressed((hertz, height))
    model = palpate.identify(recording)
    clean = palpate.identify(pressed())
    assert model.verdict.level == "good"
    assert model.n_wavelets <= clean.n_wavelets + 2
    assert error_of(model) < 2.0 * error_of(clean) < 0.02
    (note,) = (each for each in model.notes["rows"] if "hum" in each)
    assert f"A hum of {hertz:.3g}" in note
    check = palpate.verify(model, pressed((hertz, height), seed=1))
    assert check.verdict.level == "good"
    assert check.rmse == pytest.approx(palpate.verify(clean, pressed(seed=1)).rmse, rel=0.05)
    assert any("hum" in each for each in check.notes)


def test_a_tool_that_oscillates_with_50_hz_has_no_hum() -> None:
    recording = pressed()
    assert recording.time is not None
    trembling = recording.position + 2e-5 * np.sin(2.0 * np.pi * 50.0 * recording.time)
    force = recording.force + 250.0 * (trembling - recording.position)
    shaken = palpate.Recording.from_arrays(trembling, force, recording.time)
    still = palpate.Recording.from_arrays(recording.position, force, recording.time)
    assert without_hum(shaken) == (shaken, [])
    assert len(without_hum(still)[1]) == 1


def test_each_line_of_a_hum_is_subtracted() -> None:
    noisy, clean = pressed((60.0, 0.05), (120.0, 0.02), (180.0, 0.03)), pressed()
    quiet, notes = without_hum(noisy)
    assert len(notes) == 3
    assert np.std(noisy.force - clean.force) == pytest.approx(0.0436, rel=0.01)
    assert np.std(quiet.force - clean.force) < 0.001


def test_the_mains_and_the_clock_of_a_long_recording_may_deviate() -> None:
    quiet, notes = without_hum(pressed((49.82, 0.04), presses=10))
    assert len(notes) == 1
    assert np.std(quiet.force - pressed(presses=10).force) < 0.002


def test_a_recording_without_hum_is_returned_as_it_is() -> None:
    for recording in (pressed(), pressed(noise=0.0), pressed((47.0, 0.05), (55.0, 0.02)), pressed(presses=8)):
        assert without_hum(recording) == (recording, [])


def test_clicks_at_whole_seconds_have_no_hum() -> None:
    time = np.arange(20_000) / RATE_HZ
    x = np.abs((time + 1.0) % 2.0 - 1.0)
    recording = palpate.Recording.from_arrays(x, 10.0 * x - 2.0 * (x > 0.43), time)
    assert without_hum(recording)[1] == []


def test_the_hum_of_a_recording_without_time_or_of_few_rows_is_not_searched() -> None:
    recording = pressed((50.0, 0.04))
    few = recording.without(np.arange(len(recording)) >= 60)
    assert without_hum(few) == (few, [])
    untimed = palpate.Recording.from_arrays(recording.position, recording.force)
    assert without_hum(untimed) == (untimed, [])
    two = recording.without(np.arange(len(recording)) >= 2)
    assert without_hum(two) == (two, [])


def test_missing_rows_and_a_recorder_that_paused_keep_the_phase() -> None:
    recording = pressed((50.0, 0.04))
    clean = pressed()
    kept = np.ones(len(clean), dtype=bool)
    kept[np.random.default_rng(1).integers(0, len(clean), 100)] = False
    kept[700:900] = False
    quiet, notes = without_hum(recording.without(~kept))
    assert len(notes) == 1
    assert np.std(quiet.force - clean.force[kept]) < 0.004
    time = recording.time
    assert time is not None
    paused = np.where(np.arange(len(time)) < 1000, time, time + 1e6)
    long = palpate.Recording.from_arrays(recording.position, recording.force, paused)
    assert without_hum(long) == (long, [])

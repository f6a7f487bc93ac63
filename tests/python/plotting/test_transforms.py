# SPDX-License-Identifier: Apache-2.0
"""Tests of the transforms of a force history: frequencies, amplitudes, places and short recordings."""

import sys
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from palpate import InputError, Recording
from palpate.plotting import (
    History,
    Plane,
    history_of,
    power_spectrum,
    short_time_transform,
    transforms,
    wavelet_transform,
)

RATE = 1000.0
TIME = np.arange(0.0, 8.0, 1.0 / RATE)
SINES = {5.0: 1.0, 40.0: 0.4, 120.0: 0.1}
"""Frequency [Hz] and amplitude [N] of the parts of a known force."""

TRANSFORMS = pytest.mark.parametrize("transform", [short_time_transform, wavelet_transform])


def history(force: Any, time: Any = TIME) -> History:
    return history_of(Recording.from_arrays(np.sin(time), force, time))


def known_sum() -> Any:
    return sum(a * np.sin(2.0 * np.pi * f * TIME) for f, a in SINES.items()) + 3.0


def ridge(plane: Plane, at: float) -> float:
    """Returns the frequency of the largest amplitude within 0.2 s of a time."""
    near = np.abs(plane.at - at) < 0.2
    return float(plane.frequency[np.argmax(np.abs(plane.value[:, near]).max(axis=1))])


def test_the_spectrum_has_the_power_of_each_sine_at_its_frequency() -> None:
    frequency, power = power_spectrum(history(known_sum()))
    for f, a in SINES.items():
        near = np.abs(frequency - f) < 2.0
        assert frequency[near][np.argmax(power[near])] == pytest.approx(f, abs=0.13)
        assert power[near].max() == pytest.approx(0.5 * a * a, rel=0.1)
    assert power[0] < 1e-3  # the mean force is subtracted


@pytest.mark.parametrize("f", SINES)
@TRANSFORMS
def test_a_transform_of_one_sine_has_its_frequency_and_amplitude(
    transform: Callable[[History], Plane], f: float
) -> None:
    plane = transform(history(0.7 * np.sin(2.0 * np.pi * f * TIME)))
    assert ridge(plane, 4.0) == pytest.approx(f, rel=0.05)
    inner = (plane.at > 1.0) & (plane.at < 7.0)
    assert np.abs(plane.value[:, inner]).max() == pytest.approx(0.7, rel=0.05)


@TRANSFORMS
def test_the_ridge_of_a_chirp_follows_its_frequency(transform: Callable[[History], Plane]) -> None:
    plane = transform(history(np.sin(2.0 * np.pi * (10.0 * TIME + 5.0 * TIME**2))))  # 10 to 90 Hz
    for at in (1.0, 3.0, 5.0, 7.0):
        column = np.abs(plane.at - at) < 0.1
        mean = np.mean(np.abs(plane.value[:, column]), axis=1)
        assert plane.frequency[np.argmax(mean)] == pytest.approx(10.0 + 10.0 * at, rel=0.1)


@TRANSFORMS
def test_a_pulse_is_found_at_its_time(transform: Callable[[History], Plane]) -> None:
    plane = transform(history(np.exp(-0.5 * ((TIME - 2.5) / 0.004) ** 2)))
    level = np.argmin(np.abs(plane.frequency - 60.0))
    # A window of the short-time transform is 0.5 s long, so its centre of gravity is compared.
    weight = np.abs(plane.value[level]) ** 2
    assert np.sum(weight * plane.at) / np.sum(weight) == pytest.approx(2.5, abs=0.01)


def test_a_recording_without_time_is_transformed_over_the_position_of_its_press_stroke() -> None:
    x = np.concatenate([np.linspace(0.0, 4e-3, 801), np.linspace(4e-3, 0.0, 801)])
    force = np.sin(2.0 * np.pi * 5e3 * x)  # five oscillations in a millimetre
    recording = Recording.from_arrays(x, force, units={"position": "m", "force": "N"})
    over = history_of(recording)
    assert (over.axis, over.unit, len(over.at)) == ("position", "m", 801)
    assert "no time" in over.notes[0]
    frequency, power = power_spectrum(over)
    assert frequency[np.argmax(power)] == pytest.approx(5e3, rel=0.05)


def test_the_longest_of_several_press_strokes_is_transformed() -> None:
    x = np.concatenate([np.linspace(0.0, 1.0, 50), np.linspace(1.0, 0.0, 50), np.linspace(0.0, 3.0, 50)])
    direction = np.repeat([1, -1, 1], 50)
    over = history_of(Recording.from_arrays(x, 2.0 * x, direction=direction))
    assert over.at[-1] == pytest.approx(3.0)
    assert over.force == pytest.approx(2.0 * over.at)
    assert over.notes[0].endswith("(rows 100 to 149)")


def test_rows_without_order_are_transformed_over_their_number() -> None:
    random = np.random.default_rng(0)
    over = history_of(Recording.from_arrays(random.uniform(size=300), random.uniform(size=300)))
    assert (over.axis, over.unit, over.step) == ("row", "row", 1.0)
    assert over.notes[0].endswith("over the row number")


def test_uneven_time_is_interpolated_and_the_limit_is_reported() -> None:
    random = np.random.default_rng(1)
    time = np.cumsum(random.uniform(0.5e-3, 1.5e-3, 8000))
    over = history(np.sin(2.0 * np.pi * 20.0 * time), time)
    assert np.ptp(np.diff(over.at)) < 1e-9
    assert over.gaps == ()
    assert over.notes[0].startswith("the time steps are uneven, from 0.0005")
    frequency, power = power_spectrum(over)
    assert frequency[np.argmax(power)] == pytest.approx(20.0, abs=0.2)


def test_gaps_in_time_are_reported() -> None:
    kept = (TIME < 2.0) | (TIME > 3.0)
    over = history(known_sum()[kept], TIME[kept])
    assert over.gaps == (pytest.approx((1.999, 3.001)),)
    assert over.notes[1].startswith("1 gap in time")
    assert len(over.at) == len(TIME)


@pytest.mark.parametrize("n", [10, 11, 12, 17])
@pytest.mark.parametrize("force", [np.zeros, np.arange], ids=["zero", "rising"])
@TRANSFORMS
def test_short_recordings_have_finite_transforms(
    transform: Callable[[History], Plane], force: Callable[[int], Any], n: int
) -> None:
    plane = transform(history(force(n), 0.01 * np.arange(n)))
    assert plane.value.shape == (len(plane.frequency), len(plane.at))
    assert plane.value.size
    assert np.isfinite(plane.value).all()
    assert plane.at[0] >= 0.0
    assert plane.at[-1] <= 0.01 * n


def test_nine_rows_are_refused() -> None:
    with pytest.raises(InputError, match="has 9 rows; its transforms need at least 10"):
        history(np.arange(9), np.arange(9))


@TRANSFORMS
def test_a_long_recording_is_decimated_without_moving_its_frequencies(
    transform: Callable[[History], Plane], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(transforms, "MOST_SHORT_TIME_SAMPLES", 3000)
    monkeypatch.setattr(transforms, "MOST_WAVELET_SAMPLES", 3000)
    plane = transform(history(np.sin(2.0 * np.pi * 12.0 * TIME)))
    assert len(plane.at) <= 3000
    assert ridge(plane, 4.0) == pytest.approx(12.0, rel=0.05)
    assert plane.at[-1] == pytest.approx(8.0, abs=0.05)


def test_a_long_uneven_recording_gets_a_longer_step(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(transforms, "MOST_SAMPLES", 1000)
    over = history(known_sum()[:2000], np.concatenate([TIME[:1999], [50.0]]))
    assert len(over.at) <= 1001
    assert over.notes[-1].startswith("the recording is long")


def test_without_pywavelets_the_message_names_the_cure(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pywt", None)
    with pytest.raises(InputError, match=r"pip install 'palpate\[analysis\]'"):
        wavelet_transform(history(known_sum()))

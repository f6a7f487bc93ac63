# SPDX-License-Identifier: Apache-2.0
"""Simulated sample recording of the package."""

import numpy as np
import pytest

from palpate import InputError
from palpate.recording import sample_force, sample_recording


def test_the_force_follows_the_formula() -> None:
    # Force at the wall, computed by hand: f(x) = 2x + 58*0.01*softplus((x - 0.4)/0.01), softplus(0) = ln 2.
    assert sample_force(0.4) == pytest.approx(0.8 + 0.58 * np.log(2), rel=1e-15)
    assert sample_force(-0.2) == pytest.approx(-0.4, rel=1e-12)
    assert sample_force(0.469) == pytest.approx(0.938 + 0.58 * (6.9 + np.log1p(np.exp(-6.9))), rel=1e-15)


def test_the_force_stays_within_the_device_limit() -> None:
    np.testing.assert_array_equal(sample_force([-9.0, 0.5, 9.0]), [-5.0, 5.0, 5.0])


def test_the_recording_is_sampled_as_described() -> None:
    recording = sample_recording(1)
    assert len(recording) == 60_000
    assert recording.time is not None
    np.testing.assert_allclose(np.diff(recording.time), 1e-3, rtol=1e-9)
    counts = recording.position / (2 * np.pi / 65536)
    np.testing.assert_allclose(counts, np.round(counts), atol=1e-6)
    step = np.pi / 65536
    assert recording.position.min() == pytest.approx(-0.2, abs=2 * step)
    assert recording.position.max() == pytest.approx(0.469, abs=2 * step)
    assert recording.units == {"position": "rad", "force": "N*m"}


def test_the_force_noise_has_the_stated_deviation() -> None:
    recording = sample_recording(1)
    # The encoder's noise of 28e-6 rad times a slope of up to 60 N*m/rad adds at most 0.002 N*m of noise.
    assert np.std(recording.force - sample_force(recording.position)) == pytest.approx(0.02, rel=0.02)


def test_the_encoder_rounds_to_the_nearest_count() -> None:
    # A position bias of half an encoder step would change the mean force on the wall by 0.003 N*m; the
    # noise of the mean is 0.0003 N*m.
    recording = sample_recording(1)
    wall = recording.position > 0.42
    assert abs(np.mean((recording.force - sample_force(recording.position))[wall])) < 1e-3


def test_the_hand_sweeps_at_a_varying_frequency_of_0_2_to_2_hz() -> None:
    recording = sample_recording(1)
    assert recording.time is not None
    middle = recording.position - (0.469 - 0.2) / 2
    crossings = recording.time[1:][(middle[:-1] < 0) & (middle[1:] >= 0)]
    frequencies = 1 / np.diff(crossings)
    assert frequencies.min() >= 0.2
    assert frequencies.max() <= 2.0
    assert frequencies.max() > 3 * frequencies.min()


def test_a_seed_determines_the_recording() -> None:
    a, b, c = sample_recording(1, 1.0), sample_recording(1, 1.0), sample_recording(2, 1.0)
    np.testing.assert_array_equal(a.force, b.force)
    assert not np.array_equal(a.force, c.force)
    assert not np.array_equal(a.position, c.position)


def test_the_metadata_state_that_it_is_simulated() -> None:
    assert "nothing here was measured" in sample_recording(2, 0.1).metadata["simulated"]


def test_a_duration_of_zero_is_refused() -> None:
    with pytest.raises(InputError, match=r"duration_s is 0\.0"):
        sample_recording(1, 0.0)

# SPDX-License-Identifier: Apache-2.0
"""Strokes that cross are told, with how far and where; a late force explains them."""

import re

import numpy as np
import pytest

from palpate.identification import fit_environment
from palpate.recording import Recording

LATE_S = 0.003
TURN = 0.004


def pressed_onto_a_wall(late_s: float, seed: int = 0) -> Recording:
    """0.4 N of friction that ends before a wall of 10^4 N/m at 3.6 mm, pressed and released at 10 mm/s."""
    t = np.arange(0.0, 0.8, 5e-4)

    def force(t: np.ndarray) -> np.ndarray:
        x = TURN * (1.0 - np.abs(np.clip(t, 0.0, 0.8) / 0.4 - 1.0))
        friction = np.where(t <= 0.4, 0.2, -0.2) * np.clip((3.5e-3 - x) / 1e-3, 0.0, 1.0)
        return 100.0 * x + 1e4 * np.maximum(x - 3.6e-3, 0.0) + friction

    x = TURN * (1.0 - np.abs(t / 0.4 - 1.0))
    noise = np.random.default_rng(seed).normal(0.0, 0.005, len(t))
    return Recording.from_arrays(x, force(t - late_s) + noise, t, np.where(t <= 0.4, 1, -1))


def told(recording: Recording) -> list[str]:
    assert recording.direction is not None
    network = fit_environment(recording.position[:, None], recording.force, recording.direction.astype(float))
    assert network.model_class == "hysteresis"
    return [note for note in network.notes if "release lies above press" in note]


@pytest.mark.parametrize("seed", range(2))
def test_a_late_force_crosses_its_strokes_and_the_notes_say_where(seed: int) -> None:
    recording = pressed_onto_a_wall(LATE_S, seed)
    (note,) = told(recording)
    found = re.search(r"by up to (\S+) between (\S+) and (\S+), ", note)
    assert found is not None
    depth, near, far = map(float, found.groups())
    # the wall moves by 2 v late = 0.06 mm between the strokes
    assert depth == pytest.approx(1e4 * 0.06e-3, rel=0.1)
    assert 3.3e-3 < near < 3.7e-3
    assert far == pytest.approx(TURN, abs=1e-4)
    assert told(recording.with_force_earlier(LATE_S)) == []


@pytest.mark.parametrize("seed", range(2))
def test_strokes_that_only_touch_are_not_told(seed: int) -> None:
    assert told(pressed_onto_a_wall(0.0, seed)) == []

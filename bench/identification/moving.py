# SPDX-License-Identifier: Apache-2.0
"""Simulates recordings of a moving object with known mass, damping and hysteresis."""

from __future__ import annotations

import numpy as np

from palpate import Recording, _core
from palpate.recording import sample_force
from palpate.recording.sample import ENCODER_STEP, FORCE_NOISE, LOWER, SAMPLE_PERIOD, UPPER

PLAY_RADIUS = 0.005
"""Play radius of the hysteresis [rad]."""


def simulate_recording(
    seed: int,
    *,
    seconds: float = 10.0,
    mass: float = 0.0,
    damping: float = 0.0,
    hysteresis: float = 0.0,
    slowest_hz: float = 0.2,
    fastest_hz: float = 2.0,
) -> Recording:
    """Returns F = f(x) + m a + B v + h s, with the sample's force f, along a sweep with varying frequency.

    mass [N*m*s^2/rad], damping [N*m*s/rad], hysteresis h [N*m] over the play radius PLAY_RADIUS.
    """
    random = np.random.default_rng(seed)
    time = np.arange(round(seconds / SAMPLE_PERIOD)) * SAMPLE_PERIOD
    variation = np.sin(2.0 * np.pi * (0.31 * time[:, None] * [0.1, 0.23, 0.41] + random.uniform(0, 1, 3)))
    frequency = slowest_hz * (fastest_hz / slowest_hz) ** ((1.0 + variation.mean(axis=1)) / 2.0)
    phase = 2.0 * np.pi * SAMPLE_PERIOD * np.cumsum(frequency)
    x = (LOWER + UPPER) / 2 + (UPPER - LOWER) / 2 * np.sin(phase)
    v = np.gradient(x, time)
    force = sample_force(x) + mass * np.gradient(v, time) + damping * v
    if hysteresis:
        force = force + hysteresis * np.clip((x - _core.model.play(x, PLAY_RADIUS)) / PLAY_RADIUS, -1.0, 1.0)
    return Recording.from_arrays(
        np.round(x / ENCODER_STEP) * ENCODER_STEP,
        force + random.normal(0.0, FORCE_NOISE, len(x)),
        time=time,
        units={"position": "rad", "force": "N*m"},
    )

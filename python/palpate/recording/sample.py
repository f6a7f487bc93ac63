# SPDX-License-Identifier: Apache-2.0
"""Sample recording of the package. It is simulated and always labelled as simulated."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from .._typing import Float1D
from ..errors import InputError
from .recording import Recording

STIFFNESS = 2.0
"""Stiffness of the sample's soft spring [N*m/rad]."""
WALL_STIFFNESS = 58.0
"""Stiffness that the sample's wall adds to the spring [N*m/rad]."""
WALL_POSITION = 0.4
"""Position of the sample's wall [rad]."""
WALL_WIDTH = 0.01
"""Width of the transition from soft spring to wall [rad]."""
LOWER, UPPER = -0.2, 0.469
"""Least and largest position of the simulated hand's motion [rad]."""
FORCE_LIMIT = 5.0
"""Force limit of the simulated device [N*m]."""
ENCODER_STEP = 2 * np.pi / 65536
"""Step of the simulated 16-bit encoder: one revolution divided by 65536 [rad]."""
FORCE_NOISE = 0.02
"""Standard deviation of the force sensor's noise [N*m]."""
SAMPLE_PERIOD = 1e-3
"""Time between two samples of the simulated recording [s]."""
SLOWEST_HZ, FASTEST_HZ = 0.2, 2.0
"""Lowest and highest frequency at which the simulated hand moves to and fro [Hz]."""
WANDER_HZ = (0.031, 0.073, 0.127)
"""Frequencies of the slow changes of the hand's frequency [Hz]; their sum repeats only after 1000 s."""


def sample_force(x: npt.ArrayLike) -> Float1D:
    """Returns the force of the sample's object [N*m] at position `x` [rad]: a spring and a smooth wall.

    f(x) = 2 x + 58 * 0.01 softplus((x - 0.4) / 0.01), softplus(u) = ln(1 + e^u), limited to +-5 N*m.
    """
    position = np.asarray(x, dtype=np.float64)
    wall = WALL_STIFFNESS * WALL_WIDTH * np.logaddexp(0.0, (position - WALL_POSITION) / WALL_WIDTH)
    return np.clip(STIFFNESS * position + wall, -FORCE_LIMIT, FORCE_LIMIT)


def sample_recording(seed: int, duration_s: float = 60.0) -> Recording:
    """Simulates a recording of the sample's object: a hand sweeps it at 0.2 to 2 Hz, sampled at 1 kHz.

    Parameters
    ----------
    seed : int
        Seed of the hand's motion and of the noise. Seed 1 is for identification, seed 2 for verification.
    duration_s : float
        Duration of the recording [s].

    Returns
    -------
    Recording
        Position of a 16-bit encoder [rad], force with 0.02 N*m of noise [N*m], time [s].
    """
    samples = round(duration_s / SAMPLE_PERIOD)
    if samples < 1:
        raise InputError(f"duration_s is {duration_s}; it must be at least one sample of {SAMPLE_PERIOD} s")
    random = np.random.default_rng(seed)
    time = np.arange(samples) * SAMPLE_PERIOD
    phases = random.uniform(0.0, 2 * np.pi, len(WANDER_HZ))
    wander = np.mean(
        [np.sin(2 * np.pi * hz * time + phase) for hz, phase in zip(WANDER_HZ, phases, strict=True)], axis=0
    )
    frequency = SLOWEST_HZ * (FASTEST_HZ / SLOWEST_HZ) ** ((1 + wander) / 2)
    phase = random.uniform(0.0, 2 * np.pi) + 2 * np.pi * SAMPLE_PERIOD * np.cumsum(frequency)
    position = (LOWER + UPPER) / 2 + (UPPER - LOWER) / 2 * np.sin(phase)
    force = sample_force(position) + random.normal(0.0, FORCE_NOISE, samples)
    return Recording.from_arrays(
        position=np.floor(position / ENCODER_STEP + 0.5) * ENCODER_STEP,
        force=force,
        time=time,
        units={"position": "rad", "force": "N*m"},
        metadata={
            "simulated": "yes, by palpate; nothing here was measured",
            "object": "f(x) = 2 x + 58*0.01 softplus((x - 0.4)/0.01) N*m, limited to +-5 N*m",
            "seed": str(seed),
        },
    )

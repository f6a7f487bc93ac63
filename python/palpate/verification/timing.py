# SPDX-License-Identifier: Apache-2.0
"""A recording on the even time grid of a controller, with a time of its own or an assumed one."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .._typing import Float1D
from ..errors import InputError
from ..recording import Recording

MOST_SAMPLES = 20_000_000
"""Samples of a motion on an even grid; more would fill the memory."""

ASSUMED_STROKE_S = 1.0
"""Time in which an assumed motion covers the range of positions once [s]."""


@dataclass(frozen=True)
class EvenMotion:
    """A recorded motion and force, sampled evenly."""

    time: Float1D
    """(k,) [s], from 0"""
    position: Float1D
    force: Float1D
    period_s: float
    assumed_speed: float | None
    """Assumed because the recording has no time [position unit per second]; None if time is recorded"""


def even_motion(recording: Recording, period_s: float, stroke_speed: float | None = None) -> EvenMotion:
    """Sample a recording every `period_s`, with straight lines between its rows.

    Parameters
    ----------
    recording : Recording
        Without time, its positions are followed in their order at a constant speed.
    period_s : float
        Sample time [s].
    stroke_speed : float, optional
        That speed [position unit per second]; the range of positions in one second when not given. Only for a
        recording without time.

    Raises
    ------
    InputError
        The recording does not move, is shorter than two samples, or has a time and a speed was given.
    """
    require_period(period_s)
    if recording.time is not None:
        if stroke_speed is not None:
            raise InputError("a stroke speed was given, but the recording has a time of its own")
        return _sampled(recording, recording.time - recording.time[0], period_s, None)
    travel = float(np.ptp(recording.position))
    if travel == 0:
        raise InputError("the recording does not move, so no time can be assumed for it")
    speed = travel / ASSUMED_STROKE_S if stroke_speed is None else stroke_speed
    if not 0 < speed < np.inf:
        raise InputError(f"stroke_speed is {speed}; it must be > 0 and finite")
    way = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(recording.position)))])
    with np.errstate(over="ignore"):  # an endless motion is refused below
        time = way / speed
    return _sampled(recording, time, period_s, speed)


def require_period(period_s: float) -> None:
    """Refuse a sample time that is not positive."""
    if not 0 < period_s < np.inf:
        raise InputError(f"period_s is {period_s}; it must be > 0 and finite")


def _sampled(recording: Recording, time: Float1D, period_s: float, assumed_speed: float | None) -> EvenMotion:
    if not time[-1] <= MOST_SAMPLES * period_s:
        raise InputError(
            f"the motion lasts {time[-1]:.4g} s, more than {MOST_SAMPLES} samples of {period_s:g} s: "
            + ("choose a larger period" if assumed_speed is None else "choose a higher stroke speed")
        )
    # Where an assumed motion rests, several rows share one time: the last of them stands for all.
    last = np.append(np.diff(time) > 0, True)
    samples = int(time[-1] / period_s * (1 + 1e-12)) + 1
    if samples < 2:
        raise InputError(f"the recording lasts {time[-1]:g} s, less than two samples of {period_s:g} s")
    grid: Float1D = np.arange(samples, dtype=np.float64) * period_s
    return EvenMotion(
        time=grid,
        position=np.interp(grid, time[last], recording.position[last]),
        force=np.interp(grid, time[last], recording.force[last]),
        period_s=period_s,
        assumed_speed=assumed_speed,
    )

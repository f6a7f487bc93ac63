# SPDX-License-Identifier: Apache-2.0
"""What a device and its handle do when it is pushed: sign, delay, inertia and damping."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from .._typing import Float1D

_MOST_LEFT = 0.05
"""RMS of what the two numbers leave unexplained, over what they explain; above, they are not told."""
_FEWEST_PUSHES = 3


@dataclass(frozen=True)
class Push:
    """How a handle answered."""

    moved: float
    """Mean way of a push in the direction that a right sign gives [m or rad]."""
    unsure: float
    """Standard error of that mean [m or rad]; infinite where it rests on less than three pushes."""
    obeyed: bool
    """Whether the force that the device says it made has the sign of the one that it was told to make."""
    delay_samples: int | None
    """Whole samples from command to force."""
    inertia: float | None
    """J [kg or kg*m^2]; None where the motion does not tell."""
    damping: float | None
    """b, viscous [N*s/m or N*m*s/rad]."""


def push_response(ticks: Mapping[str, Any]) -> Push:
    """Read sign, delay and mechanics from the ticks of alternating pushes.

    A force F > 0 pushes towards smaller positions. How far a push moved the handle is counted from where the
    handle would have gone on to by itself, since a hand may be on it. The mechanics J dv/dt = -F - b v of a
    handle at rest, integrated twice so that nothing is differentiated, are linear in both numbers:

        J (x - x_0) + b int (x - x_0) dt = - int int F dt dt.

    Everything but the delay is in the device's own time: how late the host was does not matter.

    Parameters
    ----------
    ticks : mapping
        ``force`` (sent), ``applied``, ``position``, ``device_time``, ``sequence``: (n,) each.
    """
    fresh = np.concatenate(([True], np.diff(ticks["sequence"].astype(np.int64)) > 0))
    sent, applied, position, time = (
        np.asarray(ticks[name])[fresh] for name in ("force", "applied", "position", "device_time")
    )
    ways: list[float] = []
    obedience = 0.0
    columns: list[Float1D] = []
    targets: list[Float1D] = []
    # A reading tells the force that acted until it was taken: a push begins one reading before it is seen.
    pushing = applied != 0.0
    begins = np.flatnonzero(pushing[1:] & ~pushing[:-1])
    for begin in begins[begins > 2]:  # before the first push nobody knows where the handle goes
        held = int(np.argmin(pushing[begin + 1 :])) or len(pushing) - begin - 1
        last = min(begin + 2 * held, len(position))
        rows = slice(begin, last)
        told = float(np.sign(sent[max(0, begin + 1 - held) : begin + 1 + held].sum()))
        obedience += told * float(np.sign(applied[begin + 1]))
        ways.append(-told * _way(time, position, begin, held))
        moved, seconds = position[rows] - position[begin], np.diff(time[rows])
        impulse = np.concatenate(([0.0], np.cumsum(applied[begin + 1 : last] * seconds)))
        columns.append(np.stack([moved, _integral(moved, seconds)], axis=1))
        targets.append(-_integral(impulse, seconds))
    inertia, damping = _mechanics(columns, targets)
    enough = len(ways) >= _FEWEST_PUSHES
    return Push(
        moved=float(np.mean(ways)) if ways else 0.0,
        unsure=float(np.std(ways, ddof=1)) / math.sqrt(len(ways)) if enough else math.inf,
        obeyed=obedience >= 0.0,
        delay_samples=_delay(ticks),
        inertia=inertia,
        damping=damping,
    )


def _way(time: Float1D, position: Float1D, begin: int, held: int) -> float:
    """How far a push moved the handle from where it was going: on a parabola, since hands are slow."""
    before, end = slice(max(0, begin - 2 * held), begin + 1), min(begin + held, len(position) - 1)
    hand = np.polynomial.Polynomial.fit(time[before], position[before], 2)
    return float(position[end] - hand(time[end]))


def _mechanics(columns: list[Float1D], targets: list[Float1D]) -> tuple[float | None, float | None]:
    """Least squares; nothing where the two numbers do not explain the motion."""
    if not columns:
        return None, None
    A, y = np.concatenate(columns), np.concatenate(targets)
    fit, *_ = np.linalg.lstsq(A, y, rcond=None)
    left = float(np.linalg.norm(A @ fit - y)) / max(float(np.linalg.norm(y)), 1e-300)
    if fit[0] <= 0.0 or fit[1] < 0.0 or left > _MOST_LEFT:
        return None, None
    return float(fit[0]), float(fit[1])


def _delay(ticks: Mapping[str, Any]) -> int | None:
    """Samples from a command to the first reading whose force is it, less the one that each command takes."""
    sent, applied = np.asarray(ticks["force"]), np.asarray(ticks["applied"])
    begins = np.flatnonzero((sent[1:] != 0.0) & (sent[:-1] == 0.0)) + 1
    delays = [int(np.argmax(applied[begin + 1 :] != 0.0)) for begin in begins if np.any(applied[begin + 1 :])]
    return int(np.median(delays)) if delays else None


def _integral(values: Float1D, seconds: Float1D) -> Float1D:
    """Trapezoids from the first value on."""
    return np.concatenate(([0.0], np.cumsum(0.5 * seconds * (values[1:] + values[:-1]))))

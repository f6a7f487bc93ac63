# SPDX-License-Identifier: Apache-2.0
"""What a device and its handle do when it is pushed: sign, delay, inertia and damping."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from .._typing import Float1D

_MOST_LEFT = 0.05
"""RMS of what the two numbers leave unexplained, over what they explain; above, they are not told."""


@dataclass(frozen=True)
class Push:
    """How a handle that nobody holds answered."""

    moved: float
    """Mean way of a push in the direction that a right sign gives [m or rad]."""
    delay_samples: int | None
    """Whole samples from command to force."""
    inertia: float | None
    """J [kg or kg*m^2]; None where the motion does not tell."""
    damping: float | None
    """b, viscous [N*s/m or N*m*s/rad]."""


def push_response(ticks: Mapping[str, Any]) -> Push:
    """Read sign, delay and mechanics from the ticks of alternating pushes.

    A force F > 0 pushes towards smaller positions. The mechanics J dv/dt = -F - b v of a handle at rest,
    integrated twice so that nothing is differentiated, are linear in both numbers:

        J (x - x_0) + b int (x - x_0) dt = - int int F dt dt.

    Everything but the delay is in the device's own time: how late the host was does not matter.

    Parameters
    ----------
    ticks : mapping
        ``force`` (sent), ``applied``, ``position``, ``device_time``, ``sequence``: (n,) each.
    """
    fresh = np.concatenate(([True], np.diff(ticks["sequence"].astype(np.int64)) > 0))
    applied, position, time = (
        np.asarray(ticks[name])[fresh] for name in ("applied", "position", "device_time")
    )
    ways: list[float] = []
    columns: list[Float1D] = []
    targets: list[Float1D] = []
    # A reading tells the force that acted until it was taken: a push begins one reading before it is seen.
    pushing = applied != 0.0
    begins = np.flatnonzero(pushing[1:] & ~pushing[:-1])
    for begin in begins:
        held = int(np.argmin(pushing[begin + 1 :])) or len(pushing) - begin - 1
        last = min(begin + 2 * held, len(position))
        rows = slice(begin, last)
        moved, seconds = position[rows] - position[begin], np.diff(time[rows])
        ways.append(-float(np.sign(applied[begin + 1]) * moved[min(held, len(moved) - 1)]))
        impulse = np.concatenate(([0.0], np.cumsum(applied[begin + 1 : last] * seconds)))
        columns.append(np.stack([moved, _integral(moved, seconds)], axis=1))
        targets.append(-_integral(impulse, seconds))
    inertia, damping = _mechanics(columns, targets)
    return Push(float(np.mean(ways)) if ways else 0.0, _delay(ticks), inertia, damping)


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
    """Samples from a command to the first reading whose force is it, less the one that every command takes."""
    sent, applied = np.asarray(ticks["force"]), np.asarray(ticks["applied"])
    begins = np.flatnonzero((sent[1:] != 0.0) & (sent[:-1] == 0.0)) + 1
    delays = [int(np.argmax(applied[begin + 1 :] != 0.0)) for begin in begins if np.any(applied[begin + 1 :])]
    return int(np.median(delays)) if delays else None


def _integral(values: Float1D, seconds: Float1D) -> Float1D:
    """Trapezoids from the first value on."""
    return np.concatenate(([0.0], np.cumsum(0.5 * seconds * (values[1:] + values[:-1]))))

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

    A command F > 0 pushes towards smaller positions. The mechanics J dv/dt = -F - b v of a handle at rest,
    integrated twice so that nothing is differentiated, are linear in both numbers:

        J (x - x_0) + b int (x - x_0) dt = - int int F dt dt.

    Parameters
    ----------
    ticks : mapping
        ``force`` (sent), ``applied``, ``position``, ``device_time``: (n,) each.
    """
    sent, applied, position = (np.asarray(ticks[name]) for name in ("force", "applied", "position"))
    period = float(np.median(np.diff(ticks["device_time"])))
    begins = np.flatnonzero((sent[1:] != 0.0) & (sent[:-1] == 0.0)) + 1
    ways, delays = [], []
    columns: list[Float1D] = []
    targets: list[Float1D] = []
    for begin, end in zip(begins, [*begins[1:], len(sent)], strict=True):
        felt = np.flatnonzero(applied[begin + 1 : end] != 0.0)
        pushing = np.flatnonzero(sent[begin:end])[-1] + 1
        ways.append(-np.sign(sent[begin]) * (position[min(begin + pushing, end - 1)] - position[begin]))
        if felt.size:
            delays.append(int(felt[0]))
        last = min(begin + 2 * pushing, end)
        moved = position[begin:last] - position[begin]
        force = applied[begin + 1 : last]  # a reading tells the force that acted until it was taken
        impulse = np.concatenate(([0.0], np.cumsum(force))) * period
        columns.append(np.stack([moved, _integral(moved, period)], axis=1))
        targets.append(-(_integral(impulse, period)))
    moved_by = float(np.mean(ways)) if ways else 0.0
    inertia = damping = None
    if columns:
        A, y = np.concatenate(columns), np.concatenate(targets)
        (fit_J, fit_b), *_ = np.linalg.lstsq(A, y, rcond=None)
        left = np.linalg.norm(A @ (fit_J, fit_b) - y) / max(float(np.linalg.norm(y)), 1e-300)
        if fit_J > 0.0 and fit_b >= 0.0 and left < _MOST_LEFT:
            inertia, damping = float(fit_J), float(fit_b)
    return Push(moved_by, int(np.median(delays)) if delays else None, inertia, damping)


def _integral(values: Float1D, period: float) -> Float1D:
    """Trapezoids from the first value on."""
    steps = 0.5 * period * (values[1:] + values[:-1])
    return np.concatenate(([0.0], np.cumsum(steps)))

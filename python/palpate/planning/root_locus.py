# SPDX-License-Identifier: Apache-2.0
"""Where the poles of the explicit structure lie, for the choice of its damping."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .._core.rendering import Scheme
from .._typing import Float1D


@dataclass(frozen=True)
class RootLocus:
    """Poles of the linearised explicit structure (paper figure 14) at a held device, over the damping B_o.

    z^2 + (T^2 K/m - 2 + T B/m) z + 1 - T B/m = 0, with K the object's slope and K_c together, B = B_o + B_c.
    """

    slopes: Float1D
    """(k,) slopes of the object [force/position]"""
    dampings: Float1D
    """(n,) B_o [force*s/position]"""
    poles: NDArray[np.complex128]
    """(k, n, 2)"""
    chosen: NDArray[np.complex128]
    """(k, 2) with the damping of the scheme"""


def root_locus(scheme: Scheme, slopes: Float1D, period_s: float, *, samples: int = 801) -> RootLocus:
    """Poles for a damping from 0 to where the step can follow it no more, (B_o + B_c) T = 2 m.

    Parameters
    ----------
    scheme : Scheme
        Mass, coupling and the damping that is marked.
    slopes : (k,) array
        Slopes of the object [force/position].
    period_s : float
        T [s].
    samples : int
        Dampings that are looked at.
    """
    slopes = np.asarray(slopes, dtype=np.float64)
    largest = max(2.0 * scheme.mass / period_s - scheme.coupling_damping, scheme.damping)
    # A sample where two poles meet, T B/m = 2 sqrt(c) - c with c = T^2 K/m: their path has a corner there.
    c = np.maximum(period_s**2 * (slopes + scheme.coupling_stiffness) / scheme.mass, 0.0)
    meeting = scheme.mass / period_s * (2.0 * np.sqrt(c) - c) - scheme.coupling_damping
    dampings = np.union1d(np.linspace(0.0, largest, samples), meeting[(meeting > 0.0) & (meeting < largest)])
    return RootLocus(
        slopes=slopes,
        dampings=dampings,
        poles=_poles(scheme, slopes[:, None], dampings[None, :], period_s),
        chosen=_poles(scheme, slopes, np.full_like(slopes, scheme.damping), period_s),
    )


def _poles(scheme: Scheme, slope: Float1D, damping: Float1D, period_s: float) -> NDArray[np.complex128]:
    drag = period_s * (damping + scheme.coupling_damping) / scheme.mass
    middle = period_s**2 * (slope + scheme.coupling_stiffness) / scheme.mass - 2.0 + drag
    root = np.sqrt((middle**2 - 4.0 * (1.0 - drag)).astype(np.complex128))
    return np.stack([(-middle + root) / 2.0, (-middle - root) / 2.0], axis=-1)

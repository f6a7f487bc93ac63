# SPDX-License-Identifier: Apache-2.0
"""Where each method fails: boundaries that the core measures in simulation, beside their theory."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from .. import _core
from .._core.failure import failure_map, guard_effects
from .._typing import Float1D

failure_map_names: tuple[str, ...] = tuple(_core.failure.failure_map_names)
"""Every map that can be measured."""


@dataclass(frozen=True)
class FailureLine:
    """One method along one quantity; all arrays (points,)."""

    name: str
    at: Float1D
    """The quantity."""
    measured: Float1D
    """The largest value that held; NaN: none failed."""
    theory: Float1D
    """What theory says of it; NaN: nothing is known."""

    @property
    def ratio(self) -> Float1D:
        """Measured over theory, where both are known."""
        known = np.isfinite(self.measured) & np.isfinite(self.theory) & (self.theory != 0.0)
        ratio: Float1D = self.measured[known] / self.theory[known]
        return ratio

    def as_json(self) -> dict[str, Any]:
        """Lists of numbers; null for NaN."""
        arrays = {"at": self.at, "measured": self.measured, "theory": self.theory}
        return {"name": self.name} | {
            key: [float(x) if np.isfinite(x) else None for x in array] for key, array in arrays.items()
        }


@dataclass(frozen=True)
class FailureMap:
    """Lines that share their axes."""

    name: str
    along: str
    """The quantity on the horizontal axis, with its unit."""
    limit: str
    """What is limited, with its unit."""
    lines: tuple[FailureLine, ...]
    searched: float
    """Up to how many times the theory it was searched where nothing failed."""
    linear: bool
    """The limit spans no decades, and may be negative."""

    def as_json(self) -> dict[str, Any]:
        """The same, for a file."""
        return {
            "name": self.name,
            "along": self.along,
            "limit": self.limit,
            "lines": [line.as_json() for line in self.lines],
        }


@dataclass(frozen=True)
class GuardEffect:
    """What one guard costs where nothing is wrong, and what it makes of what is."""

    guard: str
    cost: float
    """RMS change of the force, over its RMS [-]"""
    wrong: str
    """What is wrong, and what of it is measured, with its unit"""
    without: float
    with_guard: float


def measure_guard_effects() -> tuple[GuardEffect, ...]:
    """Every guard by itself, with its default setting, on the default knob."""
    return tuple(
        GuardEffect(row["guard"], row["cost"], row["wrong"], row["without"], row["with"])
        for row in guard_effects()
    )


def measure_failure_map(name: str, points: int) -> FailureMap:
    """Measure one map: every point is a bisection over closed loops, simulated in the core.

    Parameters
    ----------
    name : str
        One of `failure_map_names`.
    points : int
        Values along the horizontal axis, at least 2.

    Raises
    ------
    ValueError
        There is no such map, or points is below 2.
    """
    measured: Mapping[str, Any] = failure_map(name, points)
    return FailureMap(
        measured["name"],
        measured["along"],
        measured["limit"],
        tuple(FailureLine(**line) for line in measured["lines"]),
        measured["searched"],
        measured["linear"],
    )

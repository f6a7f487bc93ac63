# SPDX-License-Identifier: Apache-2.0
"""The outcome of an identification, as plain arrays in the units of the data."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from .._core.model import wavelet_columns
from .._typing import Float1D, Float2D
from ..verdict import Finding
from .growth import PathPoint
from .separable import Solution


@dataclass(frozen=True)
class IdentifiedNetwork:
    """An identified force law f = g(x) + s h(x), and how it came about."""

    inputs: tuple[str, ...]
    """(d,) names"""
    alpha: Float2D
    """(N, d) dilations [1/position]"""
    beta: Float2D
    """(N, d) translations [position]"""
    weight: Float1D
    """(N,) weights of g [force]"""
    linear: Float1D
    """(d,) slope of g's linear part [force/position]"""
    bias: float
    """Bias of g [force]"""
    weight_hysteresis: Float1D | None
    """(N,) weights of h, or None for a single-valued force"""
    linear_hysteresis: Float1D | None
    """(d,)"""
    bias_hysteresis: float | None
    lower: Float1D
    """(d,) domain: the least position of the data"""
    upper: Float1D
    """(d,) domain: the largest"""
    below: str
    """"free" where the object is left at the lower end, else "linear\""""
    above: str
    """"linear\""""
    play_radius: float | None
    """[position], where the play operator gave the hysteresis input"""
    mass: float | None
    """m of F = m a + B v + f, where it was fitted [force/position s^2]"""
    damping: float | None
    """B, where it was fitted [force/position s]"""
    rung: str
    """constant, linear, position, hysteresis, velocity, mass and damping; network over several inputs"""
    stop_reason: str
    """The criterion that stopped growth, "max_wavelets", or "data" where they allowed no further wavelet"""
    n_parameters: int
    """Fitted numbers, the play radius, mass and damping included"""
    rmse: float
    """On the samples of the identification [force]"""
    nrmse: float
    """rmse over the standard deviation of the force"""
    path: tuple[PathPoint, ...]
    """Every network that was considered"""
    notes: tuple[str, ...]
    """Sentences: what was refused, left out, or imposed at what price"""
    independent_rows: float = np.inf
    """Rows of the identification, fewer where repeats or correlated noise make them depend on each other"""
    findings: tuple[Finding, ...] = ()
    """Reservations for the verdict"""

    def parameters(self) -> dict[str, Any]:
        """Returns network and domain as keyword arguments of :class:`ForceModel`."""
        return {
            "alpha": self.alpha,
            "beta": self.beta,
            "weight": self.weight,
            "linear": self.linear,
            "bias": self.bias,
            "weight_hysteresis": self.weight_hysteresis,
            "linear_hysteresis": self.linear_hysteresis,
            "bias_hysteresis": self.bias_hysteresis,
            "lower": self.lower,
            "upper": self.upper,
        }


@dataclass(frozen=True)
class Readings:
    """g (and h) of a solution, in the units of the data."""

    alpha: Float2D
    beta: Float2D
    weights: Float2D
    """(1, N) or (2, N): of g, and of h"""
    linear: Float2D
    """(1, d) or (2, d)"""
    bias: Float1D
    at_lower: float
    """g at the lower corner of the domain [force]"""

    @staticmethod
    def of(solution: Solution, readout: Float2D, lower: Float1D, reach: Float1D) -> "Readings":
        """From the unit box, whose corner stands at lower and whose sides are reach, to positions."""
        d = len(lower)
        table = readout @ solution.coefficients
        linear = table[:, 1 : 1 + d] / reach
        corner = wavelet_columns(np.zeros((1, d)), solution.basis.alpha, solution.basis.beta)[0]
        return Readings(
            alpha=solution.basis.alpha / reach,
            beta=lower + solution.basis.beta * reach,
            weights=table[:, 1 + d :],
            linear=linear,
            bias=table[:, 0] - linear @ lower,
            at_lower=float(table[0, 0] + table[0, 1 + d :] @ corner),
        )

# SPDX-License-Identifier: Apache-2.0
"""The outcome of an identification, as plain arrays in the units of the data."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..._core.model import ForceModel
from ..._typing import Float1D, Float2D
from ...model import Fit, PathStep
from ...recording.units import UNSTATED_UNIT, Unit
from ...verdict import Finding
from ..data.limits import ForceScale
from ..decision import Decision
from .separable import Solution


@dataclass(frozen=True)
class PathPoint:
    """One network on the way: rmse in the unit of force, criterion as a deviance (see stopping)."""

    model_class: str
    n_wavelets: int
    rmse: float
    criterion: float


@dataclass(frozen=True)
class FittedNetwork:
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
    below: str = "linear"
    """free where the object is left at the lower end, else linear"""
    play_radius: float | None = None
    """[position], where the play operator gave the hysteresis input"""
    mass: float | None = None
    """m of F = m a + B v + f, where it was fitted [force/position s^2]"""
    damping: float | None = None
    """B, where it was fitted [force/position s]"""
    model_class: str = ""
    """Name of the accepted class"""
    stop_reason: str = ""
    """The criterion that stopped growth, "max_wavelets", or "data" where they allowed no further wavelet"""
    n_parameters: int = 0
    """Fitted numbers, the play radius, mass and damping included"""
    rmse: float = 0.0
    """On the samples of the identification [force]"""
    nrmse: float = 0.0
    """rmse over the standard deviation of the force"""
    path: tuple[PathPoint, ...] = ()
    """Every network that was considered"""
    decisions: tuple[Decision, ...] = ()
    """Last decision on each model class"""
    notes: tuple[str, ...] = ()
    """Sentences on unused rows, constraints with their cost, and replaced decisions"""
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

    def fit(self) -> Fit:
        """How the network came about, as a model file holds it."""
        path: list[PathStep] = [
            {
                "n_wavelets": at.n_wavelets,
                "rmse": at.rmse,
                "criterion": at.criterion if math.isfinite(at.criterion) else None,
                "model_class": at.model_class,
            }
            for at in self.path
        ]
        return Fit(
            model_class=self.model_class,
            stop_reason=self.stop_reason,
            nrmse=self.nrmse,
            n_wavelets=len(self.weight),
            n_parameters=self.n_parameters,
            path=path,
        )

    def unscaled(self, scale: ForceScale, force_unit: Unit = UNSTATED_UNIT) -> FittedNetwork:
        """Returns the network in the unit of the force, which is `force_unit` in messages."""

        factor = scale.factor
        notes = self.notes
        if factor != 1.0:
            multiplied = (
                f"The forces were multiplied by {factor:g} for the fit. Forces in these notes are multiplied."
            )
            notes = (multiplied, *notes)
        if scale.offset:
            offset = force_unit.text(scale.offset)
            notes = (f"An offset of {offset} was subtracted from the force for the fit.", *notes)
        scaled = ("weight", "linear", "weight_hysteresis", "linear_hysteresis", "bias_hysteresis")
        values: dict[str, Any] = {
            name: None if (value := getattr(self, name)) is None else value / factor
            for name in (*scaled, "mass", "damping", "rmse")
        }
        return replace(
            self,
            below="linear" if scale.offset else self.below,
            bias=self.bias / factor + scale.offset,
            path=tuple(replace(point, rmse=point.rmse / factor) for point in self.path),
            notes=notes,
            **values,
        )

    @classmethod
    def of(
        cls, solution: Solution, readout: Float2D, lower: Float1D, reach: Float1D, **described: Any
    ) -> FittedNetwork:
        """A solution in the units of the data: the unit box has its corner at lower and the sides reach.

        described holds the other fields.
        """
        d, two = len(lower), len(readout) == 2
        table = readout @ solution.coefficients
        linear, weights = table[:, 1 : 1 + d] / reach, table[:, 1 + d :]
        bias = table[:, 0] - linear @ lower
        return cls(
            alpha=solution.basis.alpha / reach,
            beta=lower + solution.basis.beta * reach,
            weight=weights[0],
            linear=linear[0],
            bias=float(bias[0]),
            weight_hysteresis=weights[1] if two else None,
            linear_hysteresis=linear[1] if two else None,
            bias_hysteresis=float(bias[1]) if two else None,
            lower=lower,
            upper=lower + reach,
            **described,
        )

    def force(self, positions: Float2D, side: Float1D | None) -> Float1D:
        """Force at rows (n, d)."""
        two, model = self.weight_hysteresis is not None, ForceModel(**self.parameters())
        inside = np.clip(positions, self.lower, self.upper)
        if len(self.lower) > 1:
            return np.asarray(model.predict(inside))
        if not two or side is None:
            return np.asarray(model.force(inside[:, 0]))
        return np.asarray(model.force(inside[:, 0], direction=np.clip(side, -1.0, 1.0)))

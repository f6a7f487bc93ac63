# SPDX-License-Identifier: Apache-2.0
"""Result of an identification: an identified network as arrays in the units of the recording."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sized
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from ..._core.model import ForceModel, Memory
from ..._typing import Float1D, Float2D
from ...model import Fit, PathStep
from ...model.band import Band
from ...recording.units import UNSTATED_UNIT, Unit
from ..data.limits import ForceScale
from ..data.rows import Rows
from ..log import Log
from .separable import Solution


@dataclass(frozen=True)
class Errors:
    """Errors of an identified force law on the rows of an identification."""

    rmse: float = 0.0
    """RMS error on the fitted samples [force]"""
    nrmse: float = 0.0
    """RMS error divided by the standard deviation of the force [-]"""
    left_out_nrmse: float = 0.0
    """NRMSE on rows that are left out of the fit, a fifth of them at a time [-]; 0 if not computed"""
    settled_nrmse: tuple[float, float] = (0.0, 0.0)
    """NRMSE on fitted and on left out rows, with their weights in the fit [-]"""
    rows: int = 0
    """Number of fitted rows"""
    correlation: float = 0.0
    """Correlation of the residuals of neighbouring rows in recorded order [-]"""
    residual: Float1D = field(default_factory=lambda: np.zeros(0))
    """(n,) force of each row minus that of the network [force]; empty if not computed"""
    share: Float1D = field(default_factory=lambda: np.zeros(0))
    """(n,) weight of each row in the fit, from 0 to 1, and 1 for rows that are not fitted"""

    def unscaled(self, factor: float) -> Errors:
        """Returns the errors of forces that are divided by a factor."""
        return replace(self, rmse=self.rmse / factor, residual=self.residual / factor)


@dataclass(frozen=True)
class FittedNetwork:
    """Identified force law f = g(x) + s h(x), with mean force g, direction state s, hysteresis h, and the
    tested networks."""

    inputs: tuple[str, ...]
    """(d,) names"""
    alpha: Float2D
    """(N, d) dilations [1/position]"""
    beta: Float2D
    """(N, d) translations [position]"""
    weight: Float1D
    """(N,) weights of the mean force g [force]"""
    linear: Float1D
    """(d,) slope of the linear part of the mean force g [force/position]"""
    bias: float
    """Bias of the mean force g [force]"""
    weight_hysteresis: Float1D | None
    """(N,) weights of the hysteresis h [force]; None for a single-valued force"""
    linear_hysteresis: Float1D | None
    """(d,)"""
    bias_hysteresis: float | None
    rows: Rows
    """Rows of the identification"""
    harmonics: int
    """Number of last wavelets that are harmonics of the period, w cos(alpha (x - beta))"""
    lower: Float1D
    """(d,) lower end of the domain"""
    upper: Float1D
    """(d,) upper end of the domain"""
    below: str = "linear"
    """Continuation below the domain: "free" if the tool leaves the object there; otherwise linear"""
    above: str = "linear"
    """The same above the domain"""
    period: float | None = None
    """Repeat length of a periodic force law [position]; None if the force law is not periodic"""
    play_radius: float | None = None
    """Play radius [position]; None if the direction state is not from a play operator"""
    mass: float | None = None
    """Object mass m of F = m a + B v + f, if it was fitted [force s^2/position]"""
    damping: float | None = None
    """Object damping B of F = m a + B v + f, if it was fitted [force s/position]"""
    memory: Memory | None = None
    """Branches that relax, in addition to the force at rest g; None for a force without memory"""
    model_class: str = ""
    """Name of the accepted model class"""
    stop_reason: str = ""
    """Reason why growth stopped: name of the criterion, "max_wavelets", "held-out rows", or "data" if
    no wavelet could be added"""
    n_parameters: int = 0
    """Number of fitted values, including play radius, mass and damping"""
    errors: Errors = Errors()
    """Errors on the rows"""
    shift_nrmse: float = 0.0
    """RMS change of the force by a shift of press against release, divided by the standard deviation of the
    force [-]; 0 if the rows show no shift"""
    independent_rows: float = np.inf
    """Number of independent rows; below the number of rows if rows are repeated or their noise is
    correlated"""
    band: Band | None = None
    """Band of a further recording; None for one recording"""
    remarks: tuple[str, ...] = ()
    """Sentences on a shift that a hand does not feel, and on the check of the band or its absence"""
    log: Log = field(default_factory=Log)
    """Tested networks, decisions, sentences and findings"""

    def parameters(self) -> dict[str, Any]:
        """Returns network and domain as keyword arguments of :class:`ForceModel`."""
        hysteresis = ("weight_hysteresis", "linear_hysteresis", "bias_hysteresis")
        names = ("alpha", "beta", "weight", "linear", "bias", *hysteresis, "harmonics", "lower", "upper")
        return {name: getattr(self, name) for name in names}

    def force_model(self) -> ForceModel:
        """Returns the force law over the domain; it is periodic if it has harmonics. A memory also depends on
        the motion outside the domain."""
        period = float(self.upper[0] - self.lower[0]) if self.harmonics else None
        law = self.parameters()
        if self.memory is not None:
            law |= {"below": self.below, "above": self.above, "memory": self.memory}
        return ForceModel(**law, period=period)

    def shows_all(self, recordings: Iterable[Sized]) -> bool:
        """True if every row of the recordings has a residual; rows at gaps of time can have none."""
        return len(self.errors.residual) == sum(map(len, recordings))

    def fit(self) -> Fit:
        """Returns the model class and the tested networks, in the form of a model file."""
        path: list[PathStep] = [
            {
                "n_wavelets": at.n_wavelets,
                "rmse": at.rmse,
                "criterion": at.criterion if math.isfinite(at.criterion) else None,
                "model_class": at.model_class,
            }
            for at in self.log.path
        ]
        return Fit(
            model_class=self.model_class,
            stop_reason=self.stop_reason,
            nrmse=self.errors.nrmse,
            n_wavelets=len(self.weight),
            n_parameters=self.n_parameters,
            path=path,
        )

    def unscaled(self, scale: ForceScale, force_unit: Unit = UNSTATED_UNIT) -> FittedNetwork:
        """Returns the network in the unit of the recorded force, without the offset and factor of the fit."""
        factor = scale.factor
        log = replace(self.log, path=[replace(point, rmse=point.rmse / factor) for point in self.log.path])
        if scale.offset:
            offset = force_unit.text(scale.offset)
            log.notes.insert(0, f"An offset of {offset} was subtracted from the recorded force for the fit.")
        scaled = ("weight", "linear", "weight_hysteresis", "linear_hysteresis", "bias_hysteresis")
        values: dict[str, Any] = {
            name: None if (value := getattr(self, name)) is None else value / factor
            for name in (*scaled, "mass", "damping")
        }
        return replace(
            self,
            below="linear" if scale.offset else self.below,
            above="linear" if scale.offset else self.above,
            bias=self.bias / factor + scale.offset,
            log=log,
            errors=self.errors.unscaled(factor),
            band=None if self.band is None else self.band.scaled(1.0 / factor),
            **values,
        )

    def force(self, positions: Float2D, side: Float1D | None) -> Float1D:
        """Returns the force at positions (n, d), limited to the domain, with direction states (n,)."""
        two, model = self.weight_hysteresis is not None, self.force_model()
        inside = np.clip(positions, self.lower, self.upper)
        if len(self.lower) > 1:
            return np.asarray(model.predict(inside))
        if not two or side is None:
            return np.asarray(model.force(inside[:, 0]))
        return np.asarray(model.force(inside[:, 0], direction=np.clip(side, -1.0, 1.0)))


def parameters_of(solution: Solution, readout: Float2D, lower: Float1D, reach: Float1D) -> dict[str, Any]:
    """Returns a solution in the units of the data as keyword arguments of :class:`ForceModel`; the unit box
    starts at `lower` (d,) and has the side lengths `reach` (d,)."""
    d, two, basis = len(lower), len(readout) == 2, solution.basis
    table = readout @ solution.coefficients
    linear, weights = table[:, 1 : 1 + d] / reach, table[:, 1 + d :]
    if basis.harmonics and not basis.hats:
        # harmonics repeat, so that equal ends leave a slope of rounding size
        linear = np.zeros_like(linear)
    bias = table[:, 0] - linear @ lower
    alpha, beta = basis.alpha / reach, lower + basis.beta * reach
    if basis.harmonics and not two:
        alpha, beta, weights = _one_per_order(alpha, beta, weights, basis.hats)
    return {
        "alpha": alpha,
        "beta": beta,
        "weight": weights[0],
        "linear": linear[0],
        "bias": float(bias[0]),
        "weight_hysteresis": weights[1] if two else None,
        "linear_hysteresis": linear[1] if two else None,
        "bias_hysteresis": float(bias[1]) if two else None,
        "harmonics": len(alpha) - basis.hats,
        "lower": lower,
        "upper": lower + reach,
    }


def _one_per_order(
    alpha: Float2D, beta: Float2D, weights: Float2D, hats: int
) -> tuple[Float2D, Float2D, Float2D]:
    """Returns dilations, translations and weights (1, N) in which harmonics of the same order, which follow
    the wavelets, are one harmonic with a positive amplitude and a phase from -pi to pi."""
    wave, order = np.unique(alpha[hats:, 0], return_inverse=True)
    phasor = np.zeros(len(wave), complex)
    np.add.at(phasor, order, weights[0, hats:] * np.exp(1j * alpha[hats:, 0] * beta[hats:, 0]))
    return (
        np.concatenate([alpha[:hats], wave[:, None]]),
        np.concatenate([beta[:hats], (np.angle(phasor) / wave)[:, None]]),
        np.concatenate([weights[:, :hats], np.abs(phasor)[None]], axis=1),
    )

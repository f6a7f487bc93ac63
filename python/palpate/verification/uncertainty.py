# SPDX-License-Identifier: Apache-2.0
"""Standard errors of the force and slope of a model.

Let theta be all fitted numbers of the network, dilations and translations included, and J = df/dtheta at the
rows. The covariance is sigma^2 (J'J)^-1 with sigma^2 = RSS / (n - p). The standard error of f at x is
sqrt(j(x)' Cov j(x)) (delta method; Seber and Wild, Nonlinear Regression, 1989, section 5.1). Residuals that
are correlated in time contain less information: with lag-1 autocorrelation rho > 0 the variance is larger by
the factor (1 + rho)/(1 - rho).

The standard error contains only the effect of noise. It does not contain the error of the model's form, nor
of its continuation outside the domain.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from .._core.model import wavelet_columns, wavelet_jacobian, wavelet_slope_columns
from .._typing import Float1D, Float2D
from ..errors import InputError
from ..model import Model
from ..recording import Recording
from .verification import verify

BLOCK_ROWS = 50_000
"""Number of rows whose Jacobian is in memory at a time."""

SLOPE_STEP = 1e-5
"""Half the distance of the two positions whose Jacobians give, by their difference, the Jacobian of the slope
[share of the domain]."""

LEAST_EIGENVALUE_SHARE = 1e-12
"""Share of the largest eigenvalue of J'J, with the Jacobian J of the force (columns of unit norm), below
which an eigenvalue is a rounding error [-]."""

LARGEST_RHO = 0.999
"""Largest autocorrelation of neighbouring residuals that is used [-]: one of 2000 residuals is
independent."""


@dataclass(frozen=True)
class Uncertainty:
    """Standard errors of force and slope of a model with one input, from :func:`uncertainty`."""

    model: Model
    covariance: Float2D
    """(p, p) covariance of bias, slope and weights of the mean force (and of the hysteresis), dilations and
    translations"""
    sigma: float
    """Standard deviation of the residuals [force]"""
    autocorrelation: float
    """Lag-1 autocorrelation of the residuals in recorded order, limited to 0 to LARGEST_RHO [-]"""

    def force(self, position: Float1D, direction: Float1D | None = None) -> Float1D:
        """Returns the standard error (n,) of the force; outside the domain, that at its edge. Plus and minus
        twice this value is a 95 % band."""
        inside = np.clip(position, self.model.lower[0], self.model.upper[0])
        return self._error(_jacobian(self.model, inside, direction))

    def slope(self, position: Float1D, direction: Float1D | None = None) -> Float1D:
        """Returns the standard error (n,) of the slope of the model's force over position
        [force/position]."""
        step = SLOPE_STEP * float(self.model.upper[0] - self.model.lower[0])
        inside = np.clip(position, self.model.lower[0], self.model.upper[0])
        ahead = _jacobian(self.model, inside + step, direction)
        return self._error((ahead - _jacobian(self.model, inside - step, direction)) / (2.0 * step))

    def _error(self, jacobian: Float2D) -> Float1D:
        variance = np.einsum("np,pq,nq->n", jacobian, self.covariance, jacobian, optimize=True)
        return np.asarray(np.sqrt(np.maximum(variance, 0.0)))


def uncertainty(model: Model, recordings: Recording | Sequence[Recording]) -> Uncertainty:
    """Returns standard errors of a model's force and slope, from the recordings that identified the model.

    Raises
    ------
    InputError
        The model has several inputs, a mass, a damping or a memory; or there are not more rows than
        parameters.
    """
    if model.memory is not None:
        raise InputError("the model has a memory: standard errors need a force without memory")
    if model.dimension != 1 or model.mass is not None or model.damping is not None:
        raise InputError(
            f"the inputs of the model are {', '.join(model.inputs)}, or it has mass or damping: standard "
            "errors need position as the only input"
        )
    parts = [recordings] if isinstance(recordings, Recording) else list(recordings)
    gram, squares, lagged, n = None, 0.0, 0.0, 0
    for part in parts:
        found = verify(model, part)
        for block, stroke in _blocks(part.position[found.rows], found.prediction.side):
            jacobian = _jacobian(model, block, stroke)
            gram = jacobian.T @ jacobian if gram is None else gram + jacobian.T @ jacobian
        squares += float(found.residual @ found.residual)
        lagged += float(found.residual[:-1] @ found.residual[1:])
        n += len(found.residual)
    if gram is None or n <= len(gram):
        raise InputError(f"there are {n} rows: standard errors need more rows than parameters")
    variance = squares / (n - len(gram))
    rho = min(max(lagged / squares, 0.0), LARGEST_RHO) if squares > 0 else 0.0
    covariance = variance * (1.0 + rho) / (1.0 - rho) * _inverse(gram)
    return Uncertainty(model, covariance, float(np.sqrt(variance)), rho)


def _blocks(position: Float1D, direction: Float1D | None) -> Iterator[tuple[Float1D, Float1D | None]]:
    for start in range(0, len(position), BLOCK_ROWS):
        part = slice(start, start + BLOCK_ROWS)
        yield position[part], None if direction is None else direction[part]


def _jacobian(model: Model, position: Float1D, direction: Float1D | None) -> Float2D:
    """Returns the Jacobian (n, p) of the force by the parameters; the columns for the hysteresis are those of
    the mean force times the direction +1 or -1."""
    x = np.ascontiguousarray(position, dtype=np.float64)[:, None]
    hats = model.n_wavelets - model.harmonics
    _, (by_alpha,), (by_beta,) = wavelet_jacobian(x, model.alpha[:hats], model.beta[:hats])
    value = wavelet_columns(x, model.alpha, model.beta, model.harmonics)
    # The order of a harmonic is a whole number and has no error, so that only its amplitude and phase count.
    by_phase = -wavelet_slope_columns(x[:, 0], model.alpha[hats:], model.beta[hats:], model.harmonics)
    linear = np.concatenate([np.ones_like(x), x - model.lower, value], axis=1)
    weight = np.broadcast_to(model.weight, value.shape)
    if model.weight_hysteresis is not None:
        side = np.asarray(direction, dtype=np.float64)[:, None]
        linear = np.concatenate([linear, side * linear], axis=1)
        weight = weight + side * model.weight_hysteresis
    shift = np.concatenate([by_beta, by_phase], axis=1)
    return np.concatenate([linear, weight[:, :hats] * by_alpha, weight * shift], axis=1)


def _inverse(gram: Float2D) -> Float2D:
    """Returns the pseudo-inverse of J'J for a Jacobian J, computed with columns of unit norm."""
    norm = np.sqrt(np.maximum(np.diag(gram), np.finfo(float).tiny))
    value, vector = np.linalg.eigh(gram / np.outer(norm, norm))
    kept = value > LEAST_EIGENVALUE_SHARE * value.max()
    scaled = vector[:, kept] / norm[:, None]
    return np.asarray((scaled / value[kept]) @ scaled.T)

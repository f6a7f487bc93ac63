# SPDX-License-Identifier: Apache-2.0
"""Baselines with parameters of mechanics: Hunt-Crossley contact, tissue parameters, and linear zones."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np
from scipy.optimize import least_squares

from .._typing import Float1D, Float2D
from .estimator import best_of

MOST_FITTED_ROWS = 20_000
"""Rows that are fitted; of more, evenly spread ones."""

EXPONENTS = (0.5, 6.0)
"""Range of the exponent."""

THRESHOLDS = (0.2, 0.1, 0.05, 0.03, 0.02, 0.01, 0.005, 0.002, 0.001)

PLACES = 256
"""Places at which a zone may be divided: quantiles of its positions."""

LEAST_ZONE_ROWS = 8
"""Rows in a zone for each of its parameters."""

RIDGE = 1e-10


@dataclass
class HuntCrossley:
    """F = k d^p (1 + lambda v) + F_0 with the depth d = max(x - x_0, 0) (Hunt and Crossley 1975).

    k, k lambda and F_0 are linear once x_0 and p are given, so only those two are searched for, from several
    starts. Velocity takes part where X holds it.
    """

    def fit(self, X: Float2D, y: Float1D) -> HuntCrossley:
        """Fit to X (n, 1 to 3), position and velocity, and y (n,)."""
        X = X[:, :2]
        step = -(-len(y) // MOST_FITTED_ROWS)
        rows, force = X[::step], y[::step]
        low, high = float(rows[:, 0].min()), float(rows[:, 0].max())
        self.reach_ = max(high - low, np.finfo(float).tiny)

        def residual(unknown: Float1D) -> Float1D:
            return np.asarray(self._linear(rows, force, unknown)[1])

        outcomes = [
            least_squares(
                residual,
                (low + share * self.reach_, exponent),
                bounds=((low - self.reach_, EXPONENTS[0]), (high - 1e-3 * self.reach_, EXPONENTS[1])),
                x_scale=(self.reach_, 1.0),
                max_nfev=60,
            )
            for share, exponent in product((0.0, 0.3, 0.6), (1.0, 2.0))
        ]
        best = min(outcomes, key=lambda outcome: float(outcome.cost))
        self.contact_, self.exponent_ = float(best.x[0]), float(best.x[1])
        self.parameters_ = self._linear(rows, force, best.x)[0]
        self.n_parameters_ = 2 + len(self.parameters_)
        return self

    def predict(self, X: Float2D) -> Float1D:
        """Force (n,) at the rows of X."""
        unknown = np.array([self.contact_, self.exponent_])
        return np.asarray(self._columns(X[:, :2], unknown) @ self.parameters_)

    def _linear(self, X: Float2D, y: Float1D, unknown: Float1D) -> tuple[Float1D, Float1D]:
        """F_0, k and k lambda for given contact and exponent, and the residuals they leave."""
        columns = self._columns(X, unknown)
        norm = np.maximum(np.linalg.norm(columns, axis=0), np.finfo(float).tiny)
        found = np.linalg.lstsq(columns / norm, y, rcond=None)[0] / norm
        return found, columns @ found - y

    def _columns(self, X: Float2D, unknown: Float1D) -> Float2D:
        contact, exponent = unknown
        spring = (np.maximum(X[:, :1] - contact, 0.0) / self.reach_) ** exponent
        return np.concatenate([np.ones((len(X), 1)), spring, spring * X[:, 1:]], axis=1)


@dataclass
class TissueParameters:
    """F = m a + B v + k_1 x + k_2 x^2 + ... + k_p x^p + F_0, all parameters from one linear least squares.

    After Scilingo, De Rossi, Bicchi and Iacconi (1997), who identified tissue grasped by instrumented forceps
    in this way. Velocity and acceleration take part where X holds them.

    Parameters
    ----------
    order : int
        p, the highest power of the position.
    """

    order: int = 3

    def fit(self, X: Float2D, y: Float1D) -> TissueParameters:
        """Fit to X (n, 1 to 3), position, velocity, acceleration, and y (n,)."""
        self.scale_ = np.maximum(np.abs(X).max(axis=0), np.finfo(float).tiny)
        self.parameters_ = np.linalg.lstsq(self._columns(X), y, rcond=None)[0]
        self.n_parameters_ = len(self.parameters_)
        return self

    def predict(self, X: Float2D) -> Float1D:
        """Force (n,) at the rows of X."""
        return np.asarray(self._columns(X) @ self.parameters_)

    def _columns(self, X: Float2D) -> Float2D:
        X = X / self.scale_
        powers = X[:, :1] ** np.arange(self.order + 1)
        return np.concatenate([powers, X[:, 1:]], axis=1)


@dataclass
class LinearZones:
    """The travel divided into zones, F = m a + B v + k (x - x_0) in each, by least squares.

    After MacLean (1996): the number of zones is set by a threshold on what a linear zone may leave. A zone
    whose RMS error is larger is divided where that helps most. Forces jump between zones.

    Parameters
    ----------
    threshold : float, optional
        RMS error that a zone may leave, as a share of the force's range; without it the one that predicts
        held-out rows best.
    """

    threshold: float | None = None

    def fit(self, X: Float2D, y: Float1D) -> LinearZones:
        """Fit to X (n, 1 to 3), position, velocity, acceleration, and y (n,)."""
        threshold = self.threshold or best_of(
            THRESHOLDS, lambda share, A, b: LinearZones(share).fit(A, b), X, y
        )
        order = np.argsort(X[:, 0], kind="stable")
        X, y = X[order], y[order]
        self.centre_, self.scale_ = X.mean(axis=0), np.maximum(X.std(axis=0), np.finfo(float).tiny)
        design = np.concatenate([np.ones((len(y), 1)), (X - self.centre_) / self.scale_], axis=1)
        allowed = threshold * float(np.ptp(y))
        zones, waiting = [], [(0, len(y))]
        while waiting:
            start, stop = waiting.pop()
            cut = _best_cut(X[start:stop, 0], design[start:stop], y[start:stop], allowed)
            if cut is None:
                zones.append((start, stop))
            else:
                waiting += [(start + cut, stop), (start, start + cut)]
        self.edges_ = np.array([0.5 * (X[start - 1, 0] + X[start, 0]) for start, _ in zones[1:]])
        self.parameters_ = np.array([_solved(design[a:b], y[a:b]) for a, b in zones])
        self.n_parameters_ = self.parameters_.size + len(self.edges_)
        return self

    def predict(self, X: Float2D) -> Float1D:
        """Force (n,) at the rows of X."""
        design = np.concatenate([np.ones((len(X), 1)), (X - self.centre_) / self.scale_], axis=1)
        zone = np.searchsorted(self.edges_, X[:, 0], side="right")
        return np.asarray(np.einsum("nk,nk->n", design, self.parameters_[zone]))


def _solved(design: Float2D, y: Float1D) -> Float1D:
    return np.asarray(np.linalg.lstsq(design, y, rcond=1e-9)[0])


def _best_cut(x: Float1D, design: Float2D, y: Float1D, allowed: float) -> int | None:
    """The row before which to divide a zone, or None where it is good enough or cannot be divided."""
    least = LEAST_ZONE_ROWS * design.shape[1]
    rest = y - design @ _solved(design, y)
    if len(y) < 2 * least or float(np.sqrt(np.mean(rest**2))) <= allowed:
        return None
    cuts = np.unique(np.linspace(least, len(y) - least, PLACES).astype(np.int64))
    # rows of one position stay together
    cuts = np.unique(np.searchsorted(x, x[cuts], side="left"))
    cuts = cuts[(cuts >= least) & (cuts <= len(y) - least)]
    if len(cuts) == 0:
        return None
    parts = np.split(np.arange(len(y)), cuts)
    grams = np.array([design[part].T @ design[part] for part in parts])
    products = np.array([design[part].T @ y[part] for part in parts])
    left, from_left = grams.cumsum(axis=0), products.cumsum(axis=0)
    gained = _explained(left[:-1], from_left[:-1])
    gained += _explained(left[-1] - left[:-1], from_left[-1] - from_left[:-1])
    return int(cuts[int(np.argmax(gained))])


def _explained(gram: Float2D, product: Float2D) -> Float1D:
    """Sum of squares that least squares explains, for each of several (k, k) systems."""
    ridge = RIDGE * np.trace(gram, axis1=1, axis2=2)[:, None, None] * np.eye(gram.shape[1])
    return np.asarray(
        np.einsum("nk,nk->n", product, np.linalg.solve(gram + ridge, product[:, :, None])[:, :, 0])
    )

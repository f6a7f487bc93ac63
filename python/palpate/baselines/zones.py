# SPDX-License-Identifier: Apache-2.0
"""Piecewise-linear zones: the "Haptic Camera"."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .._typing import Float1D, Float2D
from .estimator import best_of

THRESHOLDS = (0.2, 0.1, 0.05, 0.03, 0.02, 0.01, 0.005, 0.002, 0.001)

PLACES = 256
"""Places at which a zone may be divided: quantiles of its positions."""

LEAST_ROWS = 8
"""Rows in a zone for each of its parameters."""

RIDGE = 1e-10


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
    least = LEAST_ROWS * design.shape[1]
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

# SPDX-License-Identifier: Apache-2.0
"""Difference equations with a wavelet network, which predict from measured or from predicted outputs."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from palpate import WaveletNetworkRegressor
from palpate._core.model import wavelet_columns

Array = NDArray[np.float64]

N_FITS = 8
"""Number of times that first the linear part, then the wavelet network is fitted"""

DIVERGENCE_LIMIT = 3.0
"""Largest absolute output of a prediction that has not diverged [multiples of the measured output range]"""


class Lagged:
    """Models y_k = a'(y_(k-1) ... y_(k-p)) + b'(u_k ... u_(k-q)) - f(state) with a wavelet network f.

    With the last output as state it is physical: a discretised m a + B v + f(y) = u. Without a state it is
    a black box: one network over all lags.
    """

    def __init__(self, outputs: int, inputs: int, state: tuple[int, ...] | None) -> None:
        self._p, self._q, self._state = outputs, inputs, state
        self._network = WaveletNetworkRegressor(max_wavelets=24)
        self._sign = 1.0 if state is None else -1.0

    @property
    def start(self) -> int:
        """Number of measured outputs before the first predicted output."""
        return max(self._p, self._q)

    @property
    def n_parameters(self) -> int:
        linear = 0 if self._state is None else len(self._linear)
        return linear + int(self._network.n_parameters_)

    def fit(self, u: Array, y: Array) -> Lagged:
        """Fits the difference equation to measured inputs u (n,) and outputs y (n,)."""
        X, target = self._lags(u, y), y[self.start :]
        if self._state is None:
            self._network.fit(X, target)
            self._linear = np.zeros(X.shape[1])
            return self
        wavelets = np.zeros((len(target), 0))
        for _ in range(N_FITS):
            # the linear part is fitted with the wavelets: past outputs are nearly collinear with the wavelets
            columns = np.concatenate([X, np.ones((len(X), 1)), wavelets], axis=1)
            self._linear = np.linalg.lstsq(columns, target, rcond=1e-10)[0][: X.shape[1]]
            # f enters with a minus sign, as a force does: the continuation of f outside the domain must rise
            self._network.fit(X[:, list(self._state)], X @ self._linear - target)
            network = self._network.network_
            wavelets = wavelet_columns(
                X[:, [self._state[c] for c in self._network.columns_]], network.alpha, network.beta
            )
        return self

    def one_step(self, u: Array, y: Array) -> Array:
        """Predicts each output from the measured inputs and the earlier measured outputs."""
        lags = self._lags(u, y)
        inputs = lags if self._state is None else lags[:, list(self._state)]
        return np.asarray(lags @ self._linear + self._sign * self._network.predict(inputs))

    def free_run(self, u: Array, y: Array) -> Array:
        """Predicts outputs after the first `start` ones from inputs and predicted outputs; NaN: diverged."""
        limit = DIVERGENCE_LIMIT * float(np.ptp(y))
        simulated = y.copy()
        simulated[self.start :] = np.nan
        model, columns = self._network.network_, self._network.columns_
        state = np.arange(len(self._linear)) if self._state is None else np.array(self._state)
        network_inputs = state[columns]
        for k in range(self.start, len(y)):
            lags = np.concatenate([simulated[k - self._p : k][::-1], u[k - self._q : k + 1][::-1]])
            value = lags @ self._linear + self._sign * model.predict(lags[network_inputs][None, :])[0]
            if not abs(value) < limit:
                break
            simulated[k] = value
        return simulated[self.start :]

    def _lags(self, u: Array, y: Array) -> Array:
        rows = np.arange(self.start, len(y))
        columns = [y[rows - k] for k in range(1, self._p + 1)] + [u[rows - k] for k in range(self._q + 1)]
        return np.column_stack(columns)

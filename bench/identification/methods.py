# SPDX-License-Identifier: Apache-2.0
"""Identification methods: functions of inputs X and forces y; every fifth row tunes their settings."""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import UnivariateSpline, make_lsq_spline
from sklearn.exceptions import ConvergenceWarning
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import RBF, ConstantKernel, Matern, WhiteKernel
from sklearn.kernel_ridge import KernelRidge
from sklearn.linear_model import OrthogonalMatchingPursuit, Ridge
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import MinMaxScaler, PolynomialFeatures, SplineTransformer

from palpate import WaveletNetworkRegressor
from palpate._core.model import wavelet_columns
from palpate.baselines import PaperNetwork
from palpate.identification.network.basis import truncated_frame

Array = NDArray[np.float64]
Predict = Callable[[Array], Array]


@dataclass(frozen=True)
class Fitted:
    """Result of an identification method: the model fitted to all rows with the tuned setting, and times."""

    predict: Predict
    n_parameters: int
    fit_seconds: float
    tuning_seconds: float
    setting: str
    n_wavelets: int | None = None

    @property
    def seconds(self) -> float:
        """Returns the sum of the times of tuning the settings and of the final fit [s]."""
        return self.fit_seconds + self.tuning_seconds


@dataclass(frozen=True)
class Method:
    """An identification method, and the numbers of inputs, rows and draws for which the method is run."""

    name: str
    fit: Callable[[Array, Array], Fitted]
    inputs: tuple[int, ...] = (1, 2)
    most_rows: int = 10**9
    most_draws: int = 10**9


def network_method(
    estimator: Callable[[], WaveletNetworkRegressor | PaperNetwork],
) -> Callable[[Array, Array], Fitted]:
    """Returns a method that fits a network; the estimator chooses the number of wavelets itself."""

    def fit(X: Array, y: Array) -> Fitted:
        start = time.perf_counter()
        network = estimator().fit(X, y)
        seconds = time.perf_counter() - start
        return Fitted(network.predict, network.n_parameters_, seconds, 0.0, "", network.n_wavelets_)

    return fit


def tuned(
    fit: Callable[[Any, Array, Array], tuple[Predict, int]], settings: Iterable[Any], X: Array, y: Array
) -> Fitted:
    """Fits each setting without every fifth row, and fits all rows with the setting of least error there."""
    start = time.perf_counter()
    held_out = np.arange(len(y)) % 5 == 4
    scores = []
    for setting in settings:
        try:
            predict, _ = fit(setting, X[~held_out], y[~held_out])
        except (ValueError, np.linalg.LinAlgError):
            continue
        scores.append((float(np.mean((predict(X[held_out]) - y[held_out]) ** 2)), setting))
    best = min(scores, key=lambda score: score[0])[1]
    tuned_at_s = time.perf_counter()
    predict, n_parameters = fit(best, X, y)
    return Fitted(predict, n_parameters, time.perf_counter() - tuned_at_s, tuned_at_s - start, str(best))


def _sorted_means(x: Array, y: Array) -> tuple[Array, Array, Array]:
    positions, index_of_position, count = np.unique(x, return_inverse=True, return_counts=True)
    return positions, np.bincount(index_of_position, y) / count, count.astype(float)


def lsq_spline(X: Array, y: Array) -> Fitted:
    def fit(pieces: int, X: Array, y: Array) -> tuple[Predict, int]:
        order = np.argsort(X[:, 0], kind="stable")
        x, force = X[order, 0], y[order]
        inner_knots = np.linspace(x[0], x[-1], pieces + 1)[1:-1]
        knots = np.r_[(x[0],) * 4, inner_knots, (x[-1],) * 4]
        spline = make_lsq_spline(x, force, knots, k=3)
        return lambda x_new: spline(np.clip(x_new[:, 0], x[0], x[-1])), len(spline.c)

    return tuned(fit, (8, 16, 24, 32, 41, 50, 64, 80, 100, 130), X, y)


def univariate_spline(X: Array, y: Array) -> Fitted:
    def fit(share: float, X: Array, y: Array) -> tuple[Predict, int]:
        x, mean, count = _sorted_means(X[:, 0], y)
        order = np.argsort(X[:, 0], kind="stable")
        second_differences = np.diff(y[order], 2)
        noise = float(np.mean(second_differences**2)) / 6.0
        error_within_positions = float(np.sum((y - mean[np.searchsorted(x, X[:, 0])]) ** 2))
        spline = UnivariateSpline(
            x, mean, w=np.sqrt(count), s=max(share * len(y) * noise - error_within_positions, 0.0), ext=3
        )
        interior = len(spline.get_knots()) - 2
        return lambda x_new: spline(x_new[:, 0]), len(spline.get_coeffs()) + interior

    # 1e-6 makes the spline pass through rows without noise; with many rows this would take minutes
    shares = (0.98, 0.99, 1.0, 1.005, 1.01, 1.02, 1.05, 1.1)
    return tuned(fit, (1e-6, *shares) if len(y) <= 1_000 else shares, X, y)


def spline_ridge(X: Array, y: Array) -> Fitted:
    """Fits B-splines (one input) or products of B-splines (two inputs) by ridge regression."""

    def fit(setting: tuple[int, float], X: Array, y: Array) -> tuple[Predict, int]:
        knots, penalty = setting
        splines = SplineTransformer(n_knots=knots, degree=3, include_bias=True)
        ridge = Ridge(alpha=penalty, fit_intercept=False)
        if X.shape[1] == 1:
            pipeline = make_pipeline(splines, ridge).fit(X, y)
            return pipeline.predict, len(pipeline[-1].coef_)
        splines.fit(X)

        def products(x_new: Array) -> Array:
            each = splines.transform(x_new).reshape(len(x_new), x_new.shape[1], -1)
            product = each[:, 0]
            for k in range(1, x_new.shape[1]):
                product = np.einsum("ni,nj->nij", product, each[:, k]).reshape(len(x_new), -1)
            return product

        ridge.fit(products(X), y)
        return lambda x_new: ridge.predict(products(x_new)), len(ridge.coef_)

    knots = (25, 50, 100, 150) if X.shape[1] == 1 else (5, 8, 12, 18)
    return tuned(fit, [(k, a) for k in knots for a in (1e-8, 1e-4, 1e-2)], X, y)


def frame_pursuit(X: Array, y: Array) -> Fitted:
    """Fits wavelets that orthogonal matching pursuit selects from the frame that palpate also uses."""
    lower, width = X.min(axis=0), np.ptp(X, axis=0)

    def columns(atoms: Any, x_new: Array) -> Array:
        scaled = np.clip((x_new - lower) / width, 0.0, 1.0)
        return np.concatenate([scaled, wavelet_columns(scaled, atoms.alpha, atoms.beta)], axis=1)

    start = time.perf_counter()
    thinned = (X - lower)[:: max(1, len(X) // 20_000)] / width
    finest = 128.0 if X.shape[1] == 1 else 16.0
    atoms = truncated_frame(
        thinned, coarsest=1.0, finest=finest, frame_scale=2.0, frame_step=0.5, max_candidates=1200
    )
    held_out = np.arange(len(y)) % 5 == 4
    columns_at_rows = columns(atoms, X)
    built_at_s = time.perf_counter()
    scores = []
    for n_tried in (8, 16, 24, 32, 48, 64, 96, 128):
        pursuit = OrthogonalMatchingPursuit(n_nonzero_coefs=min(n_tried, len(y) // 3))
        with warnings.catch_warnings():
            # the pursuit warns when no further wavelet of the frame can be selected
            warnings.simplefilter("ignore", RuntimeWarning)
            pursuit.fit(columns_at_rows[~held_out], y[~held_out])
        scores.append(
            (float(np.mean((pursuit.predict(columns_at_rows[held_out]) - y[held_out]) ** 2)), n_tried)
        )
    tuned_at_s = time.perf_counter()
    n_atoms = min(min(scores)[1], len(y) // 3)
    pursuit = OrthogonalMatchingPursuit(n_nonzero_coefs=n_atoms).fit(columns_at_rows, y)
    fitted_at_s = time.perf_counter()
    # each wavelet has one dilation, one translation for each input, and one weight
    count = n_atoms * (X.shape[1] + 2) + 1
    fit_seconds = (built_at_s - start) + (fitted_at_s - tuned_at_s)
    return Fitted(
        lambda x_new: pursuit.predict(columns(atoms, x_new)),
        count,
        fit_seconds,
        tuned_at_s - built_at_s,
        f"{n_atoms} atoms",
    )


def kernel_ridge(X: Array, y: Array) -> Fitted:
    def fit(setting: tuple[float, float], X: Array, y: Array) -> tuple[Predict, int]:
        gamma, penalty = setting
        pipeline = make_pipeline(MinMaxScaler(), KernelRidge(kernel="rbf", gamma=gamma, alpha=penalty)).fit(
            X, y
        )
        return pipeline.predict, len(y)

    return tuned(
        fit, [(g, a) for g in (1.0, 3.0, 10.0, 30.0, 100.0) for a in (1e-12, 1e-10, 1e-8, 1e-5)], X, y
    )


def gaussian_process(X: Array, y: Array) -> Fitted:
    start = time.perf_counter()
    scaler = MinMaxScaler().fit(X)
    length_scale = 0.1 * np.ones(X.shape[1])
    processes = []
    for shape in (RBF(length_scale, (1e-3, 1e2)), Matern(length_scale, (1e-3, 1e2), nu=2.5)):
        kernel = ConstantKernel(1.0, (1e-3, 1e6)) * shape + WhiteKernel(1e-6, (1e-14, 1.0))
        process = GaussianProcessRegressor(kernel, normalize_y=True, random_state=0)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", ConvergenceWarning)
            processes.append(process.fit(scaler.transform(X), y))
    process = max(processes, key=lambda each: each.log_marginal_likelihood_value_)
    seconds = time.perf_counter() - start
    return Fitted(lambda x_new: process.predict(scaler.transform(x_new)), len(y), seconds, 0.0, "")


def polynomial_ridge(X: Array, y: Array) -> Fitted:
    def fit(degree: int, X: Array, y: Array) -> tuple[Predict, int]:
        pipeline = make_pipeline(
            MinMaxScaler((-1, 1)), PolynomialFeatures(degree), Ridge(1e-10, solver="svd")
        )
        pipeline.fit(X, y)
        return pipeline.predict, len(pipeline[-1].coef_)

    return tuned(fit, (3, 5, 7, 9, 12), X, y)


def mars(X: Array, y: Array) -> Fitted:
    """Fits multivariate adaptive regression splines; needs the package `pyearth`."""
    from pyearth import Earth

    start = time.perf_counter()
    model = Earth(max_degree=X.shape[1], max_terms=60).fit(X, y)
    seconds = time.perf_counter() - start
    terms = len(model.coef_.ravel())
    return Fitted(model.predict, 2 * terms, seconds, 0.0, f"{terms} terms")


METHODS = (
    Method("palpate", network_method(WaveletNetworkRegressor)),
    Method("paper, selection alone", network_method(PaperNetwork)),
    Method("paper, quasi-Newton", network_method(partial(PaperNetwork, quasi_newton=True))),
    Method("OMP on a Mexican-hat frame", frame_pursuit, most_rows=100_000),
    Method("make_lsq_spline", lsq_spline, inputs=(1,)),
    Method("UnivariateSpline", univariate_spline, inputs=(1,), most_rows=100_000),
    Method("SplineTransformer + Ridge", spline_ridge),
    Method("polynomial + Ridge", polynomial_ridge),
    Method("KernelRidge", kernel_ridge, most_rows=1_000),
    Method("Gaussian process", gaussian_process, most_rows=500),
    Method("MARS (pyearth)", mars, most_rows=100_000),
)
"""The compared identification methods, palpate first; a method that is not installed is left out."""

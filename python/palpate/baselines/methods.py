# SPDX-License-Identifier: Apache-2.0
"""Baseline methods: curves over position, models of mechanics, and one copy of a method for each stroke."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterable
from copy import deepcopy
from dataclasses import dataclass
from itertools import product
from typing import Protocol, TypeVar

import numpy as np
import scipy

from .._typing import Float1D, Float2D

HELD_OUT_EVERY = 5
"""Every fifth of the fitted rows is used to compare values of the settings that the caller did not give."""

SIZES = (2, 4, 8, 12, 16, 24, 32, 48, 64, 96, 128, 192, 256, 384, 512)
"""Numbers of entries of the force table that the baseline lookup table tries."""

SMOOTHINGS = (30.0, 10.0, 5.0, 3.0, 2.0, 1.5, 1.2, 1.1, 1.0, 0.9, 0.8)
"""Tried values of the largest mean squared residual of a smoothing spline [multiples of the noise variance of
the force]."""

MOST_FITTED_ROWS = 20_000
"""Largest number of rows to which the law of Hunt and Crossley is fitted; of more rows an evenly spread part
is used."""

EXPONENTS = (0.5, 6.0)
"""Smallest and largest exponent of the tissue law of Hunt and Crossley [-]."""

THRESHOLDS = (0.2, 0.1, 0.05, 0.03, 0.02, 0.01, 0.005, 0.002, 0.001)
"""Tried values of the largest RMS residual of a zone with a linear force law; a zone with a larger residual
is divided [share of the range of the force]."""

MOST_ZONE_BOUNDARIES = 256
"""Largest number of positions at which the division of a zone is tried: quantiles of the positions of its
rows."""

LEAST_ZONE_ROWS = 8
"""Least number of rows in a zone with a linear force law, for each fitted parameter of the zone."""

RIDGE = 1e-10
"""Factor of the ridge, a term that is added to the diagonal of the normal matrix of least squares [-]: two
equal columns stay solvable, and the ridge is far below any noise."""

C = TypeVar("C")
"""Type of the values that are tried for one setting of a baseline."""


class Estimator(Protocol):
    """Interface of a baseline: the methods fit and predict, as in scikit-learn."""

    n_parameters_: int
    """Number of fitted real numbers; available after the method fit was called"""

    def fit(self, X: Float2D, y: Float1D) -> Estimator:
        """Fits the baseline to the inputs X (n, d) and the force y (n,)."""

    def predict(self, X: Float2D) -> Float1D:
        """Returns the force (n,) at the rows of X (n, d)."""


def best_of(
    candidates: Iterable[C], fitted: Callable[[C, Float2D, Float1D], Estimator], X: Float2D, y: Float1D
) -> C:
    """Returns the simplest candidate within one standard error of the best, on held-out rows.

    Every fifth row is held out. Candidates are sorted, the simplest first; one that cannot be fitted is
    skipped. So no method is compared with an unsuitable setting.
    """
    kept = np.arange(len(y)) % HELD_OUT_EVERY != HELD_OUT_EVERY - 1
    if kept.all():
        return next(iter(candidates))
    tried: list[tuple[float, float, C]] = []
    for candidate in candidates:
        try:
            trial = fitted(candidate, X[kept], y[kept])
        except (ValueError, np.linalg.LinAlgError):
            continue
        square = (trial.predict(X[~kept]) - y[~kept]) ** 2
        if np.isfinite(square).all():
            tried.append((float(square.mean()), float(square.std() / np.sqrt(len(square))), candidate))
    if not tried:
        raise ValueError("no setting of this method can be fitted to these rows")
    least, uncertain, _ = min(tried, key=lambda one: one[0])
    return next(candidate for error, _, candidate in tried if error <= least + uncertain)


def merged(x: Float1D, y: Float1D) -> tuple[Float1D, Float1D, Float1D]:
    """Returns the distinct positions x in rising order, and the mean force y and the number of rows at
    each."""
    distinct, place, count = np.unique(x, return_inverse=True, return_counts=True)
    return distinct, np.bincount(place, y) / count, count.astype(np.float64)


@dataclass
class PerStroke:
    """One copy of an estimator for each stroke.

    The last column of X is the stroke: above 0 press, else release.

    Parameters
    ----------
    estimator
        Estimator that is copied and fitted to each stroke.
    passive : bool
        Replaces press and release force by their mean if the release force is above the press force, because
        such a loop would generate energy.
    """

    estimator: Estimator
    passive: bool = False

    def fit(self, X: Float2D, y: Float1D) -> PerStroke:
        """Fits one copy of the baseline to the press rows of X (n, d), and one copy to the release rows."""
        press = X[:, -1] > 0
        self.press_ = deepcopy(self.estimator).fit(X[press, :-1], y[press])
        self.release_ = deepcopy(self.estimator).fit(X[~press, :-1], y[~press])
        self.n_parameters_ = self.press_.n_parameters_ + self.release_.n_parameters_
        return self

    def predict(self, X: Float2D) -> Float1D:
        """Returns the force (n,) at the rows of X."""
        press = X[:, -1] > 0
        if self.passive:
            above, below = (each.predict(X[:, :-1]) for each in (self.press_, self.release_))
            half = 0.5 * np.maximum(above - below, 0.0)
            return np.asarray(0.5 * (above + below) + np.where(press, half, -half))
        force = np.empty(len(X))
        force[press] = self.press_.predict(X[press, :-1])
        force[~press] = self.release_.predict(X[~press, :-1])
        return force


@dataclass
class LookupTable:
    """Forces at evenly spaced positions with straight lines between them, fitted by least squares.

    Entries that the rows do not determine are left out. f(x) = (1 - t) f_i + t f_(i+1), t = (x - x_i) /
    (x_(i+1) - x_i). Outside the table the force keeps its end values.

    Parameters
    ----------
    size : int, optional
        Number of entries; by default the choice of :func:`best_of`.
    """

    size: int | None = None

    def fit(self, X: Float2D, y: Float1D) -> LookupTable:
        """Fits to the first column of X (n, d), the position, and the force y (n,)."""
        size = self.size or best_of(SIZES, lambda entries, A, b: LookupTable(entries).fit(A, b), X, y)
        x, mean, count = merged(X[:, 0], y)
        # Table entries without rows near them are not determined by the data: leave these entries out.
        entries = np.linspace(x[0], x[-1], size)
        cell = np.clip(np.searchsorted(entries, x, side="right") - 1, 0, size - 2)
        held = np.isin(np.arange(size - 1), cell)
        entries = entries[np.concatenate([[True], held[:-1] | held[1:], [True]])]
        while True:
            try:
                knots = np.concatenate([[x[0]], entries, [x[-1]]])
                spline = scipy.interpolate.make_lsq_spline(x, mean, knots, k=1, w=np.sqrt(count))
                break
            except (ValueError, np.linalg.LinAlgError):
                if len(entries) == 2:
                    raise
                entries = entries[np.unique(np.r_[0 : len(entries) : 2, len(entries) - 1])]
        self.positions_, self.forces_ = entries, np.asarray(spline.c)
        self.n_parameters_ = len(entries)
        return self

    def predict(self, X: Float2D) -> Float1D:
        """Returns the force (n,) at the rows of X."""
        return np.asarray(np.interp(X[:, 0], self.positions_, self.forces_))


@dataclass
class SmoothingSpline:
    """Cubic smoothing spline whose squared error is at most a multiple of the noise.

    FITPACK's algorithm (Dierckx 1975) adds knots at the largest error until sum_k (y_k - f(x_k))^2 <=
    smoothing * n * sigma^2. The noise sigma^2 is estimated from the difference of each row from the mean of
    its neighbours along x. The median excludes jumps. Outside the recorded positions the force keeps its end
    values.

    Parameters
    ----------
    smoothing : float, optional
        Largest mean squared residual as a multiple of the noise variance; by default the choice of
        :func:`best_of`.
    """

    smoothing: float | None = None

    def fit(self, X: Float2D, y: Float1D) -> SmoothingSpline:
        """Fits to the first column of X (n, d), the position, and the force y (n,)."""
        multiple = self.smoothing or best_of(
            SMOOTHINGS, lambda smoothing, A, b: SmoothingSpline(smoothing).fit(A, b), X, y
        )
        x, mean, count = merged(X[:, 0], y)
        if len(x) < 5:
            raise ValueError(f"there are {len(x)} positions: a cubic spline needs at least 5")
        # A spline cannot follow the scatter of the forces of rows with equal position.
        scatter = float(np.sum((y - mean[np.searchsorted(x, X[:, 0])]) ** 2))
        allowed = max(multiple * len(y) * _noise(X[:, 0], y) - scatter, 0.0)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # FITPACK warns if the largest number of knots is reached
            self.spline_ = scipy.interpolate.UnivariateSpline(
                x, mean, w=np.sqrt(count), s=allowed, k=3, ext=3
            )
        interior = len(self.spline_.get_knots()) - 2
        self.n_parameters_ = len(self.spline_.get_coeffs()) + interior
        return self

    def predict(self, X: Float2D) -> Float1D:
        """Returns the force (n,) at the rows of X."""
        return np.asarray(self.spline_(X[:, 0]))


def _noise(x: Float1D, y: Float1D) -> float:
    """Returns the noise variance of the force y, from rows that are neighbours in position x."""
    along = y[np.argsort(x, kind="stable")]
    apart = (along[1:-1] - 0.5 * (along[:-2] + along[2:])) ** 2 / 1.5
    # 0.455 is the median of a squared standard normal variable; with a coarse force step the median can be 0.
    return max(float(np.median(apart)) / 0.455, 0.01 * float(np.mean(apart)), np.finfo(float).tiny)


@dataclass
class HuntCrossley:
    """F = k d^p (1 + lambda v) + F_0 with the depth d = max(x - x_0, 0) (Hunt and Crossley 1975).

    k, k lambda and F_0 are linear for given x_0 and p, so only x_0 and p are searched, from several start
    values. Velocity is used if X contains it.
    """

    def fit(self, X: Float2D, y: Float1D) -> HuntCrossley:
        """Fits to X (n, 1 to 3), position and velocity, and the force y (n,)."""
        X = X[:, :2]
        step = -(-len(y) // MOST_FITTED_ROWS)
        rows, force = X[::step], y[::step]
        low, high = float(rows[:, 0].min()), float(rows[:, 0].max())
        self.reach_ = max(high - low, np.finfo(float).tiny)

        def residual(unknown: Float1D) -> Float1D:
            return np.asarray(self._linear(rows, force, unknown)[1])

        outcomes = [
            scipy.optimize.least_squares(
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
        """Returns the force (n,) at the rows of X."""
        unknown = np.array([self.contact_, self.exponent_])
        return np.asarray(self._columns(X[:, :2], unknown) @ self.parameters_)

    def _linear(self, X: Float2D, y: Float1D, unknown: Float1D) -> tuple[Float1D, Float1D]:
        """Returns constant force F_0, stiffness k and damping k lambda for given contact and exponent, and
        the residuals."""
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
    """F = m a + B v + k_1 x + k_2 x^2 + ... + k_p x^p + F_0, fitted by one linear least squares.

    After Scilingo, De Rossi, Bicchi and Iacconi (1997), who identified tissue in instrumented forceps in this
    way. Velocity and acceleration are used if X contains them.

    Parameters
    ----------
    order : int
        p, the highest power of the position.
    """

    order: int = 3

    def fit(self, X: Float2D, y: Float1D) -> TissueParameters:
        """Fits to X (n, 1 to 3), position, velocity, acceleration, and the force y (n,)."""
        self.scale_ = np.maximum(np.abs(X).max(axis=0), np.finfo(float).tiny)
        self.parameters_ = np.linalg.lstsq(self._columns(X), y, rcond=None)[0]
        self.n_parameters_ = len(self.parameters_)
        return self

    def predict(self, X: Float2D) -> Float1D:
        """Returns the force (n,) at the rows of X."""
        return np.asarray(self._columns(X) @ self.parameters_)

    def _columns(self, X: Float2D) -> Float2D:
        X = X / self.scale_
        powers = X[:, :1] ** np.arange(self.order + 1)
        return np.concatenate([powers, X[:, 1:]], axis=1)


@dataclass
class LinearZones:
    """Zones of the travel with F = m a + B v + k (x - x_0) in each, fitted by least squares.

    After MacLean (1996): a threshold on the error of a linear zone sets the number of zones. A zone with a
    larger RMS error and enough rows is divided at the place that reduces it most. Forces jump between zones.

    Parameters
    ----------
    threshold : float, optional
        Largest RMS error of a zone, as a share of the force's range; by default the choice of
        :func:`best_of`.
    """

    threshold: float | None = None

    def fit(self, X: Float2D, y: Float1D) -> LinearZones:
        """Fits to X (n, 1 to 3), position, velocity, acceleration, and the force y (n,)."""
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
        """Returns the force (n,) at the rows of X."""
        design = np.concatenate([np.ones((len(X), 1)), (X - self.centre_) / self.scale_], axis=1)
        zone = np.searchsorted(self.edges_, X[:, 0], side="right")
        return np.asarray(np.einsum("nk,nk->n", design, self.parameters_[zone]))


def _solved(design: Float2D, y: Float1D) -> Float1D:
    return np.asarray(np.linalg.lstsq(design, y, rcond=1e-9)[0])


def _best_cut(x: Float1D, design: Float2D, y: Float1D, allowed: float) -> int | None:
    """Returns the index of the row before which a zone is divided; None if the RMS error of the zone is at
    most `allowed`, or if its rows are too few or at too few positions."""
    least = LEAST_ZONE_ROWS * design.shape[1]
    rest = y - design @ _solved(design, y)
    if len(y) < 2 * least or float(np.sqrt(np.mean(rest**2))) <= allowed:
        return None
    cuts = np.unique(np.linspace(least, len(y) - least, MOST_ZONE_BOUNDARIES).astype(np.int64))
    # rows of equal position stay in one zone
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
    """Returns, for each of several least-squares problems, by how much its fit decreases the sum of squares
    of the force."""
    ridge = RIDGE * np.trace(gram, axis1=1, axis2=2)[:, None, None] * np.eye(gram.shape[1])
    return np.asarray(
        np.einsum("nk,nk->n", product, np.linalg.solve(gram + ridge, product[:, :, None])[:, :, 0])
    )

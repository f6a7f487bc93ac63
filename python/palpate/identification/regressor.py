# SPDX-License-Identifier: Apache-2.0
"""The wavelet network as a scikit-learn estimator, for rows of any meaning (needs scikit-learn)."""

from __future__ import annotations

import hashlib
import inspect
from dataclasses import fields, replace
from typing import Any

import numpy as np
import numpy.typing as npt
from numpy.typing import NDArray

from .._typing import Float1D, Float2D
from ..arguments import holds_numbers, shown
from ..errors import InputError
from ..model import Model
from ..recording import Source
from .classes.model_selection import select
from .data.compression import held_out_rows
from .data.limits import ForceScale, distinct_rows, evenly_spread
from .data.rows import LARGEST_MAGNITUDE, Rows
from .log import Log
from .network.fitted import Errors, FittedNetwork
from .options import IdentifyOptions
from .search.evidence import ON_HELD_OUT_ROWS, RowError
from .threads import one_thread

try:
    from sklearn.base import BaseEstimator, RegressorMixin
    from sklearn.utils.validation import check_is_fitted, validate_data
except ImportError as missing:
    raise ImportError(
        "WaveletNetworkRegressor needs scikit-learn 1.6 or later: install it with pip install "
        "palpate[sklearn]"
    ) from missing

SETTINGS = {
    each.name: None if each.name == "search" else each.default
    for each in fields(IdentifyOptions)
    if each.name in ("max_wavelets", "criterion", "search")
}
"""Settings of :class:`IdentifyOptions` that the estimator has, with their defaults. The value None of search
means the default search settings."""

LEAST_RELATIVE_RANGE = 1e-12
"""Least ratio of the range of a column to its largest absolute value [-]. Below this ratio the column is
taken as constant."""

MISSED_SHARE = 0.01
"""Probability that the true range of one of several inputs ends outside the domain, at each end [-]. For m
rows the distance of the extreme row from this end has the distribution exp(-m distance)."""


class WaveletNetworkRegressor(RegressorMixin, BaseEstimator):  # type: ignore[misc]
    """A wavelet network fitted to any X (n, d), y (n,).

    Minimises sum_k v_k (y_k - f(x_k))^2 plus a small penalty on large w over w,
    alpha, beta, c and b, with sample weights v and

        f(x) = sum_i w_i psi(alpha_i o (x - beta_i)) + c'x + b,  psi(u) = (|u|^2 - d) exp(-|u|^2 / 2).

    A wavelet may leave out inputs: its alpha along them is 1/8192 of the inverse range, and beta the middle.
    The number of wavelets is found by growing one at a time and refining all, until `criterion` stops it, on
    n = sum_k v_k samples.

    Parameters
    ----------
    **settings
        max_wavelets, criterion and search of :class:`palpate.IdentifyOptions`, with the same defaults.
        The settings of search that describe motion and contact are ignored.

    Attributes
    ----------
    network_ : palpate.Model
        The network over the columns of X that vary. The network can be printed, saved and, with one input,
        rendered.
    columns_ : (d,) array of int
        Indices of the columns of X that vary.
    n_wavelets_, n_parameters_ : int
        Size of the network; every fitted real number is counted.
    stop_reason_ : str
        The criterion that stopped growth, "max_wavelets", or "data" if no further wavelet can be added.
    path_ : list of dict
        Every network that was considered: n_wavelets, rmse, criterion, model_class.
    n_features_in_, feature_names_in_
        As in every scikit-learn estimator.

    Notes
    -----
    The network's domain is the smallest box around the rows of X, made wider on each side by 1/(m - 1) of
    its width for m distinct rows, with several inputs by 4.6/(m - 1). The extremes of m random values lie
    inside their true range by 1/(m - 1) on average, and by at most 4.6/(m - 1) in 99 of 100 cases. Outside
    the domain the network continues as a straight line. Its gradient is that at the nearest point of the
    domain, limited to values from 0 to the largest gradient inside. A falling force would push a hand
    further away. With one input, a force that pushes out of the domain rises at least as steeply as max|f|
    over the width of the domain.

    Q. Zhang, *Using wavelet network in nonparametric estimation*, IEEE Transactions on Neural Networks 8 (2),
    1997.

    Examples
    --------
    >>> import numpy as np
    >>> from palpate import WaveletNetworkRegressor
    >>> X = np.linspace(-1, 1, 200)[:, None]
    >>> network = WaveletNetworkRegressor(max_wavelets=8).fit(X, np.exp(-20 * X[:, 0] ** 2))
    >>> network.score(X, np.exp(-20 * X[:, 0] ** 2)) > 0.999
    True
    """

    def __init__(self, **settings: Any) -> None:
        given = inspect.signature(type(self)).bind(**settings)
        given.apply_defaults()
        for name, value in given.arguments.items():
            setattr(self, name, value)

    # scikit-learn reads the names and defaults of the settings from this signature
    __init__.__signature__ = inspect.Signature(  # type: ignore[attr-defined]
        [
            inspect.Parameter("self", inspect.Parameter.POSITIONAL_OR_KEYWORD),
            *(
                inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=default)
                for name, default in SETTINGS.items()
            ),
        ]
    )

    def fit(
        self, X: npt.ArrayLike, y: npt.ArrayLike, sample_weight: npt.ArrayLike | None = None
    ) -> WaveletNetworkRegressor:
        """Fits the network.

        Parameters
        ----------
        X : (n, d) array_like
        y : (n,) array_like
        sample_weight : (n,) array_like, optional
            Samples that each row represents; 0 leaves a row out.

        Returns
        -------
        self

        Raises
        ------
        ValueError
            A setting, shape or value is wrong; the message names it.
        """
        options = IdentifyOptions(**{name: _plain(getattr(self, name)) for name in SETTINGS})
        rows, values = _validated(self, X, y, dtype=np.float64, y_numeric=True)
        values = np.asarray(values, dtype=np.float64)
        weight = None if sample_weight is None else _weights(sample_weight, len(values))
        self.columns_, found = fit_regression(rows, values, weight, options)
        self.network_ = _model_of(found, self._input_names(self.columns_), rows, values, weight)
        self.n_wavelets_ = self.network_.n_wavelets
        self.n_parameters_ = self.network_.n_parameters
        self.stop_reason_ = self.network_.stop_reason
        self.path_ = list(self.network_.path)
        return self

    def predict(self, X: npt.ArrayLike) -> Float1D:
        """Returns the value of the fitted network at each row of X.

        Parameters
        ----------
        X : (n, d) array_like

        Returns
        -------
        (n,) array
        """
        check_is_fitted(self)
        rows = _validated(self, X, dtype=np.float64, reset=False)
        return self.network_.predict(rows[:, self.columns_])

    def _input_names(self, columns: NDArray[np.int64]) -> list[str]:
        names = getattr(self, "feature_names_in_", None)
        return [f"x{column}" if names is None else str(names[column]) for column in columns]


def fit_regression(
    X: Float2D, y: Float1D, weight: Float1D | None, options: IdentifyOptions
) -> tuple[NDArray[np.int64], FittedNetwork]:
    """Fits f(x) = sum_i w_i psi(alpha_i o (x - beta_i)) + c'x + b (paper eq. 4) to rows of any meaning.

    The model classes are constant, linear and network. A criterion that uses the fitted rows compares them on
    n samples, where n is the sum of the weights of the used rows. A model class with n or more parameters is
    not tried. Each row represents `weight` (n,) samples, by default 1.

    Returns the indices of the columns of X that are inputs of the network, and the network. Constant columns
    are left out; if all are constant, the first one is the input. The domain of the network is wider than the
    range of the rows by the distance of :func:`_margin`.
    """
    if weight is None:
        weight = np.ones(len(y))
    counted = weight > 0.0
    if not counted.any():
        raise InputError("sample_weight is zero in every row: at least one must be > 0")
    X, y, weight = X[counted], y[counted], weight[counted]
    largest = max(float(np.abs(X).max()), float(np.abs(y).max()))
    if largest > LARGEST_MAGNITUDE:
        raise InputError(
            f"the largest absolute value is {largest:.3g}: must be at most {LARGEST_MAGNITUDE:g}. Use other "
            "units"
        )
    scale = ForceScale.of(y, options)
    y, options = scale.scaled(y), scale.scaled_options(options)
    varies = np.ptp(X, axis=0) > LEAST_RELATIVE_RANGE * np.abs(X).max(axis=0)
    # a network needs an input: if no column of X varies, the first column is the input, in a box as wide as
    # its value, at least 1
    columns = np.flatnonzero(varies) if varies.any() else np.zeros(1, dtype=np.int64)
    lower, upper = X[:, columns].min(axis=0), X[:, columns].max(axis=0)
    if not varies.any():
        lower, upper = lower - 0.5 * _unit(lower), upper + 0.5 * _unit(upper)
    if options.criterion in ON_HELD_OUT_ROWS and not held_out_rows(len(y), None).any():
        raise InputError(
            f"criterion is {options.criterion!r}: needs held-out rows, and {len(y)} rows are too few"
        )
    names = tuple(f"x{column}" for column in columns)
    rows = Rows(names, X[:, columns], y, weight=weight, corners=(lower, upper))
    with one_thread():
        selection = select(rows, options)
        best = selection.best
        some = evenly_spread(np.arange(len(y)))
        error = RowError(y[some] - best.force_at(some), y[some], weight[some])
    margin = _margin(rows.box) * (upper - lower)
    log = Log(selection.log.path)
    network = replace(
        best.network, errors=Errors(error.rmse), log=log, lower=lower - margin, upper=upper + margin
    )
    return columns, network.unscaled(scale)


def _margin(box: Float2D) -> float:
    """Returns the estimated distance of the true range of positions from the extreme rows, on each side
    [box].

    The smallest and the largest of m uniformly distributed values lie inside their true range by 1/(m + 1) of
    this range on average, which is 1/(m - 1) of the span of the m values. With several inputs the distance
    is larger, so that a share `MISSED_SHARE` of the true ends lies outside: the network is smooth there,
    because the rows are further apart than this distance, and the straight continuation is not.
    """
    if box.shape[1] == 1:
        return 1.0 / max(len(np.unique(box)) - 1, 1)
    return -float(np.log(MISSED_SHARE)) / max(len(distinct_rows(box)[0]) - 1, 1)


def _unit(value: Float1D) -> Float1D:
    """Returns a width that is not lost to rounding if it is added to the value: at least 1."""
    return np.maximum(1.0, np.abs(value))


def _validated(estimator: WaveletNetworkRegressor, X: object, *y: object, **checks: Any) -> Any:
    """Returns X and y after the validation of scikit-learn; raises a ValueError of scikit-learn as
    InputError."""
    for name, values in zip("Xy", (X, *y), strict=False):
        if np.ma.is_masked(values):
            raise InputError(f"{name} is a masked array; remove the masked rows from X, y and sample_weight")
    try:
        return validate_data(estimator, X, *y, **checks)
    except InputError:
        raise
    except ValueError as error:
        reason = " ".join(str(error).split())[:300]
        raise InputError(f"X{' or y' if y else ''} cannot be used: {reason}") from None


def _plain(value: Any) -> Any:
    """Returns a NumPy number as Python number; a parameter grid of scikit-learn may hold NumPy numbers."""
    return value.item() if isinstance(value, np.generic) else value


def _weights(sample_weight: npt.ArrayLike, n: int) -> Float1D:
    try:
        given = np.asarray(sample_weight)
        if not holds_numbers(given) or np.ma.is_masked(sample_weight):
            raise TypeError
        weight = given.astype(np.float64)
    except (TypeError, ValueError):
        raise InputError(f"sample_weight is {shown(sample_weight)}: must contain real numbers") from None
    if weight.shape != (n,):
        raise InputError(f"sample_weight has shape {weight.shape}: must be ({n},), one for each row of X")
    if not np.isfinite(weight).all() or (weight < 0).any():
        wrong = weight[~np.isfinite(weight) | (weight < 0)][0]
        raise InputError(f"sample_weight contains {wrong}: every weight must be a finite number >= 0")
    return weight


def _model_of(
    found: FittedNetwork, inputs: list[str], X: Float1D, y: Float1D, weight: Float1D | None
) -> Model:
    digest = hashlib.sha256()
    for array in (X, y, weight):
        if array is not None:
            digest.update(np.ascontiguousarray(array).tobytes())
    mean = np.average(y, weights=weight)
    spread = float(np.sqrt(np.average((y - mean) ** 2, weights=weight)))
    rmse = found.errors.rmse
    found = replace(found, errors=Errors(rmse, rmse / spread if spread > 0 else 0.0))
    return Model(
        kind="general",
        inputs=inputs,
        units={"position": "", "force": ""},
        **found.parameters(),
        fit=found.fit(),
        data=Source(files=(), sha256=digest.hexdigest(), rows=len(y), columns={}),
    )

# SPDX-License-Identifier: Apache-2.0
"""The wavelet network as a scikit-learn estimator, for rows of any meaning (needs scikit-learn)."""

from __future__ import annotations

import hashlib
import inspect
import math
from dataclasses import fields
from typing import Any

import numpy as np
import numpy.typing as npt

try:
    from sklearn.base import BaseEstimator, RegressorMixin
    from sklearn.utils.validation import check_is_fitted, validate_data
except ImportError as missing:
    raise ImportError(
        "WaveletNetworkRegressor needs scikit-learn 1.6 or later: pip install palpate[sklearn] brings it"
    ) from missing

from .._typing import Float1D
from ..arguments import shown
from ..errors import InputError
from ..model import Fit, Model, PathStep
from ..recording import Source
from .options import IdentifyOptions
from .regression import Regression, fit_regression

OF_RECORDINGS = {
    "inputs",
    "hysteresis_nonnegative",
    "slope_bounds",
    "monotone",
    "fixed_force",
    "filters",
    "assumed_mass",
    "assumed_damping",
    "coupling_stiffness",
    "play_radius",
    "contact_share",
    "period",
}
"""Settings that only a recording gives a meaning to: strokes, contact, motion, a position with its slope."""

SETTINGS = {each.name: each.default for each in fields(IdentifyOptions) if each.name not in OF_RECORDINGS}
"""Those of :class:`IdentifyOptions` that the regressor takes, with their defaults."""


class WaveletNetworkRegressor(RegressorMixin, BaseEstimator):  # type: ignore[misc]
    """A wavelet network fitted to any X (n, d), y (n,).

    Minimises sum_k v_k (y_k - f(x_k))^2 over w, alpha, beta, c and b, with sample weights v and

        f(x) = sum_i w_i psi(alpha_i o (x - beta_i)) + c'x + b,  psi(u) = (|u|^2 - d) exp(-|u|^2 / 2).

    The number of wavelets is found by growing one at a time and refining all, until `criterion` stops it, on
    n = sum_k v_k samples.

    Parameters
    ----------
    **settings
        Fields of :class:`palpate.IdentifyOptions` that do not need a recording, with the same defaults:
        max_wavelets, criterion, patience, refine and others, which ``get_params()`` lists.

    Attributes
    ----------
    network_ : palpate.Model
        The network over the columns of X that vary; it can be printed, saved and, with one input, rendered.
    columns_ : (d,) array of int
        Which columns those are.
    n_wavelets_, n_parameters_ : int
        Size of the network; every fitted real number is counted.
    stop_reason_ : str
        The criterion that stopped growth, "max_wavelets", or "data" where it allows no further parameter.
    path_ : list of dict
        Every network that was considered: n_wavelets, rmse, criterion, rung.
    n_features_in_, feature_names_in_
        As in every scikit-learn estimator.

    Notes
    -----
    The network's domain is the box of the data and, on each side, 1/(m - 1) of its width, m distinct rows: by
    so much the extremes of a sample fall short of the range that it was drawn from. Outside the network goes
    on from the nearest point of the domain by the gradient there, falling ones cut to 0: as a force does that
    must not push a hand further away. Q. Zhang, *Using wavelet
    network in nonparametric estimation*, IEEE Transactions on Neural Networks 8 (2), 1997.

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

    # the keywords and defaults of IdentifyOptions, where scikit-learn looks for them
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
        """Fit the network.

        Parameters
        ----------
        X : (n, d) array_like
        y : (n,) array_like
        sample_weight : (n,) array_like, optional
            How many samples each row stands for; 0 leaves a row out.

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
        found = fit_regression(rows, values, weight, options)
        self.network_ = _model_of(found, self._input_names(found), rows, values, weight)
        self.columns_ = found.columns
        self.n_wavelets_ = self.network_.n_wavelets
        self.n_parameters_ = self.network_.n_parameters
        self.stop_reason_ = self.network_.stop_reason
        self.path_ = list(self.network_.path)
        return self

    def predict(self, X: npt.ArrayLike) -> Float1D:
        """The network at each row of X.

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

    def _input_names(self, found: Regression) -> list[str]:
        names = getattr(self, "feature_names_in_", None)
        return [f"x{column}" if names is None else str(names[column]) for column in found.columns]


def _validated(estimator: WaveletNetworkRegressor, X: object, *y: object, **checks: Any) -> Any:
    """What scikit-learn makes of X and y; its ValueError becomes an InputError that names them."""
    for name, values in zip("Xy", (X, *y), strict=False):
        if np.ma.is_masked(values):
            raise InputError(f"{name} is a masked array; leave the masked rows out of X, y and sample_weight")
    try:
        return validate_data(estimator, X, *y, **checks)
    except InputError:
        raise
    except ValueError as error:
        told = " ".join(str(error).split())[:300]
        raise InputError(f"X{' or y' if y else ''} cannot be used: {told}") from None


def _plain(value: Any) -> Any:
    """Python's own number for NumPy's, which parameter grids are made of."""
    return value.item() if isinstance(value, np.generic) else value


def _weights(sample_weight: npt.ArrayLike, n: int) -> Float1D:
    try:
        given = np.asarray(sample_weight)
        if given.dtype.kind == "c" or (hasattr(sample_weight, "mask") and np.ma.is_masked(sample_weight)):
            raise TypeError
        weight = given.astype(np.float64)
    except (TypeError, ValueError):
        raise InputError(f"sample_weight is {shown(sample_weight)}; it must hold real numbers") from None
    if weight.shape != (n,):
        raise InputError(f"sample_weight has shape {weight.shape}; it must be ({n},), one for each row of X")
    if not np.isfinite(weight).all() or (weight < 0).any():
        wrong = weight[~np.isfinite(weight) | (weight < 0)][0]
        raise InputError(f"sample_weight holds {wrong}; every weight must be a finite number of 0 or more")
    return weight


def _model_of(found: Regression, inputs: list[str], X: Float1D, y: Float1D, weight: Float1D | None) -> Model:
    digest = hashlib.sha256()
    for array in (X, y, weight):
        if array is not None:
            digest.update(np.ascontiguousarray(array).tobytes())
    mean = np.average(y, weights=weight)
    spread = float(np.sqrt(np.average((y - mean) ** 2, weights=weight)))
    path: list[PathStep] = [
        {
            "n_wavelets": at.n_wavelets,
            "rmse": at.rmse,
            "criterion": at.criterion if math.isfinite(at.criterion) else None,
            "rung": at.rung,
        }
        for at in found.path
    ]
    readings = found.readings
    return Model(
        kind="general",
        inputs=inputs,
        units={"position": "", "force": ""},
        alpha=readings.alpha,
        beta=readings.beta,
        weight=readings.weights[0],
        linear=readings.linear[0],
        bias=float(readings.bias[0]),
        lower=found.lower,
        upper=found.upper,
        fit=Fit(
            rung=found.rung,
            stop_reason=found.stop_reason,
            nrmse=found.rmse / spread if spread > 0 else 0.0,
            n_wavelets=len(readings.alpha),
            n_parameters=found.n_parameters,
            path=path,
        ),
        data=Source(files=(), sha256=digest.hexdigest(), rows=len(y), columns={}),
    )

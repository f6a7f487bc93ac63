# SPDX-License-Identifier: Apache-2.0
"""The wavelet network as scikit-learn estimator: scikit-learn's rules and tools, and weights of rows."""

import inspect
import pickle
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from sklearn.base import clone
from sklearn.model_selection import GridSearchCV, cross_validate
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler
from sklearn.utils.estimator_checks import parametrize_with_checks

import palpate
from any_input import SCALE
from palpate import IdentifyOptions, SearchOptions, WaveletNetworkRegressor


@parametrize_with_checks([WaveletNetworkRegressor(**({"max_wavelets": 1} if SCALE == 1 else {}))])
@pytest.mark.filterwarnings("ignore")
def test_scikit_learn_estimator_checks_pass(estimator: Any, check: Any) -> None:
    check(estimator)


def bump(n: int = 300, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Returns one input (n, 1), and a straight line plus a Gaussian of the input, with noise (n,)."""
    random = np.random.default_rng(seed)
    x = random.uniform(-1.0, 1.0, n)
    return x[:, None], x + np.exp(-(((x - 0.2) / 0.15) ** 2)) + random.normal(0.0, 0.01, n)


def saddle(n: int = 400, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    X = np.random.default_rng(seed).uniform(-1.0, 1.0, (n, 2))
    return X, X[:, 0] * X[:, 1] + np.random.default_rng(seed + 1).normal(0.0, 0.01, n)


def test_settings_and_defaults_are_those_of_identification() -> None:
    known = {each.name: each.default for each in fields(IdentifyOptions)}
    taken = WaveletNetworkRegressor().get_params()
    assert taken == {name: known[name] for name in ("max_wavelets", "criterion")} | {"search": None}
    assert set(inspect.signature(WaveletNetworkRegressor).parameters) == set(taken)


def test_unknown_setting_is_refused_by_name() -> None:
    with pytest.raises(TypeError, match="flavour"):
        WaveletNetworkRegressor(flavour="sweet")


def test_wrong_setting_is_refused_by_fit() -> None:
    with pytest.raises(ValueError, match=r"max_wavelets is -1: must be a whole number >= 0"):
        WaveletNetworkRegressor(max_wavelets=-1).fit(*bump())


def test_a_curve_and_a_surface_are_found() -> None:
    for X, y in (bump(), saddle()):
        network = WaveletNetworkRegressor().fit(X, y)
        assert network.score(X, y) > 0.998
        assert network.n_wavelets_ == network.network_.n_wavelets > 0
        assert (
            network.n_parameters_
            == 2 * X.shape[1] * network.n_wavelets_ + network.n_wavelets_ + X.shape[1] + 1
        )
        assert network.stop_reason_ == "bic"
        assert network.path_[0]["model_class"] == "constant"
        assert {"n_wavelets", "rmse", "criterion", "model_class"} == set(network.path_[-1])


@pytest.mark.parametrize("seed", range(3))
def test_a_weight_counts_as_that_many_rows(seed: int) -> None:
    X, y = bump(120, seed)
    times = np.random.default_rng(seed).integers(0, 4, len(y))
    weighted = WaveletNetworkRegressor().fit(X, y, sample_weight=times)
    repeated = WaveletNetworkRegressor().fit(np.repeat(X, times, axis=0), np.repeat(y, times))
    assert weighted.predict(X) == pytest.approx(repeated.predict(X), abs=1e-8)
    assert weighted.n_parameters_ == repeated.n_parameters_


def test_row_with_zero_weight_does_not_change_the_fit() -> None:
    X, y = bump()
    far = np.vstack([X, [[50.0]]])
    weight = np.append(np.ones(len(y)), 0.0)
    network = WaveletNetworkRegressor().fit(far, np.append(y, 1e6), sample_weight=weight)
    without = WaveletNetworkRegressor().fit(X, y)
    assert network.network_.upper[0] == without.network_.upper[0]
    assert np.array_equal(network.predict(X), without.predict(X))


def edges_beyond(inputs: int) -> np.ndarray:
    """Returns how far the domain reaches beyond the true range 0 to 1 of many samples of 30 rows."""
    random, edges = np.random.default_rng(0), []
    for _ in range(100 if SCALE == 1 else 200):
        X = random.uniform(size=(30, inputs))
        model = WaveletNetworkRegressor(max_wavelets=0).fit(X, X[:, 0]).network_
        assert np.all(model.lower < X.min(axis=0))
        assert np.all(model.upper > X.max(axis=0))
        edges.extend([*-model.lower, *(model.upper - 1.0)])
    return np.asarray(edges)


def test_domain_of_one_input_ends_at_the_true_range_on_average() -> None:
    assert abs(np.mean(edges_beyond(1))) < 0.2 / 31.0


def test_domain_of_several_inputs_contains_the_true_range() -> None:
    beyond = edges_beyond(2)
    assert 0.001 < np.mean(beyond < 0.0) < 0.02
    assert np.max(beyond) < 5.0 / 29.0


def test_repeated_rows_do_not_change_the_domain() -> None:
    X, y = bump(40)
    once, often = (
        WaveletNetworkRegressor(max_wavelets=0).fit(np.repeat(X, k, axis=0), np.repeat(y, k)) for k in (1, 5)
    )
    assert np.array_equal(once.network_.upper, often.network_.upper)


@pytest.mark.parametrize("weight", [[1.0] * 299, [-1.0] + [1.0] * 299, [np.nan] + [1.0] * 299, [0.0] * 300])
def test_invalid_weights_are_refused(weight: list[float]) -> None:
    with pytest.raises(ValueError, match=r"sample.weight"):
        WaveletNetworkRegressor().fit(*bump(), sample_weight=weight)


def test_constant_columns_are_not_used() -> None:
    X, y = bump()
    padded = np.column_stack([np.full(len(y), 1e8), X, np.zeros(len(y))])
    network = WaveletNetworkRegressor().fit(padded, y)
    assert network.columns_.tolist() == [1]
    assert network.network_.inputs == ("x1",)
    assert network.predict(padded) == pytest.approx(WaveletNetworkRegressor().fit(X, y).predict(X))
    moved = padded + np.array([5.0, 0.0, -3.0])
    assert np.array_equal(network.predict(moved), network.predict(padded))


def test_constant_columns_alone_give_the_mean() -> None:
    network = WaveletNetworkRegressor().fit(np.full((20, 3), 2.0), np.arange(20.0))
    assert network.predict(np.full((2, 3), 2.0)) == pytest.approx([9.5, 9.5])
    assert (network.n_wavelets_, network.n_parameters_) == (0, 1)


def test_there_are_always_fewer_parameters_than_samples() -> None:
    random = np.random.default_rng(0)
    for n in (1, 2, 3, 5, 8, 13):
        network = WaveletNetworkRegressor(search=SearchOptions(evidence=-1e9), criterion="fpe").fit(
            random.normal(size=(n, 2)), random.normal(size=n)
        )
        assert network.n_parameters_ < max(n, 2)


def test_it_works_inside_scikit_learn() -> None:
    X, y = bump()
    chain = make_pipeline(StandardScaler(), WaveletNetworkRegressor()).set_output(transform="pandas")
    frame = pd.DataFrame(X, columns=["depth"])
    assert chain.fit(frame, y).score(frame, y) > 0.99
    assert list(chain[-1].feature_names_in_) == ["depth"]
    assert chain[-1].network_.inputs == ("depth",)
    assert cross_validate(WaveletNetworkRegressor(), X, y, cv=2)["test_score"].min() > 0.98
    search = GridSearchCV(WaveletNetworkRegressor(), {"max_wavelets": np.arange(0, 5, 4)}, cv=2).fit(X, y)
    assert search.best_params_ == {"max_wavelets": 4}


def test_a_clone_and_a_pickle_are_the_same_estimator() -> None:
    X, y = saddle(150)
    network = WaveletNetworkRegressor(max_wavelets=4).fit(X, y)
    assert clone(network).get_params() == network.get_params()
    again = pickle.loads(pickle.dumps(network))
    assert np.array_equal(again.predict(X), network.predict(X))
    assert "max_wavelets=4" in repr(network)


def test_network_is_a_model_that_can_be_saved(tmp_path: Path) -> None:
    X, y = saddle(150)
    network = WaveletNetworkRegressor().fit(X, y)
    network.network_.save(tmp_path / "saddle.json")
    assert np.array_equal(palpate.load_model(tmp_path / "saddle.json").predict(X), network.predict(X))


def test_the_example_of_its_documentation_runs() -> None:
    import doctest

    from palpate.identification import regressor

    assert doctest.testmod(regressor).failed == 0

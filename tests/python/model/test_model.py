# SPDX-License-Identifier: Apache-2.0
"""Tests of models in memory and of model files."""

import copy
import json
import pickle
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from conftest import ROOT
from palpate import InputError, Model, _core, load_model
from palpate._core.model import ForceModel
from palpate.model import Fit
from palpate.recording import Source

N = 5


def content(hysteresis: bool = False, wavelets: int = N, **change: Any) -> dict[str, Any]:
    """Returns the arguments of a model whose numbers have no short decimal form."""
    random = np.random.default_rng(7)
    given: dict[str, Any] = {
        "kind": "hysteresis" if hysteresis else "position",
        "inputs": ["position"],
        "units": {"position": "m", "force": "N"},
        "alpha": np.exp(random.normal(3.0, 1.0, (wavelets, 1))),
        "beta": random.uniform(0.0, 0.6, (wavelets, 1)),
        "weight": random.normal(size=wavelets) / 3,
        "linear": random.normal(size=1),
        "bias": 1 / 3,
        "lower": [0.0],
        "upper": [0.6],
        "fit": Fit("network", "bic", 1e-3, wavelets, 3 * wavelets + 2),
        "data": Source(("a.csv",), "ab" * 32, 100, {"position": "depth_mm"}),
    }
    if hysteresis:
        given |= {
            "weight_hysteresis": random.normal(size=wavelets) / 30,
            "linear_hysteresis": [0.0],
            "bias_hysteresis": 0.2,
        }
    return given | change


def test_quantities_are_bound_directly() -> None:
    for name in ("force", "slope", "energy", "predict", "play", "extrapolated"):
        assert getattr(Model, name) is getattr(ForceModel, name)


def test_force_and_slope_follow_equation_four() -> None:
    given = content()
    model = Model(**given)
    x = np.linspace(0.0, 0.6, 201)
    u = given["alpha"].T * (x[:, None] - given["beta"].T)
    psi, slope = (u**2 - 1) * np.exp(-(u**2) / 2), (3 * u - u**3) * np.exp(-(u**2) / 2)
    np.testing.assert_allclose(
        model.force(x), psi @ given["weight"] + given["linear"] * x + given["bias"], rtol=1e-12, atol=1e-12
    )
    np.testing.assert_allclose(
        model.slope(x),
        slope @ (given["weight"] * given["alpha"][:, 0]) + given["linear"],
        rtol=1e-10,
        atol=1e-10,
    )


@pytest.mark.parametrize("hysteresis", [False, True], ids=["position", "hysteresis"])
@pytest.mark.parametrize("wavelets", [0, 1, N])
def test_a_saved_model_is_loaded_exactly(tmp_path: Path, hysteresis: bool, wavelets: int) -> None:
    model = Model(**content(hysteresis, wavelets))
    again = load_model(model.save(tmp_path / "a.json"))
    assert again.to_dict() == model.to_dict()
    for name in (
        "alpha",
        "beta",
        "weight",
        "linear",
        "weight_hysteresis",
        "linear_hysteresis",
        "lower",
        "upper",
    ):
        np.testing.assert_array_equal(getattr(again, name), getattr(model, name))
    x = np.linspace(-0.3, 0.9, 501)
    s = {"direction": np.sign(np.sin(20 * x))} if hysteresis else {}
    np.testing.assert_array_equal(again.force(x, **s), model.force(x, **s))


PLAN = {
    "structure": "direct",
    "solver": None,
    "coupling": None,
    "inertia": None,
    "compensated": False,
    "play_radius": 2e-4,
    "predict": None,
    "refused": ["none"],
    "network": None,
    "accepted_force_error": 0.2,
}


def test_every_field_of_a_model_is_saved_and_loaded(tmp_path: Path) -> None:
    step = {"n_wavelets": 0, "rmse": 0.25, "criterion": None, "model_class": "linear"}
    model = Model(
        **content(
            hysteresis=True,
            play_radius=1e-4,
            below="free",
            mass=0.1,
            damping=0.2,
            slope_bounds=(-1e6, 2e6),
            plan=PLAN,
            notes={"operator": "bench 3"},
            fit=Fit("hysteresis", "fresh", 0.1, N, 20, [step]),  # type: ignore[list-item]
            data=Source(("a.csv", "b.csv"), "aa bb", 30, {"force": "force_N"}, held_out_every=5),
        )
    )
    again = load_model(model.save(tmp_path / "a.json"))
    for name in (
        "kind",
        "inputs",
        "units",
        "mass",
        "damping",
        "slope_bounds",
        "plan",
        "below",
    ):
        assert getattr(again, name) == getattr(model, name), name
    assert again.data == model.data
    assert list(again.path) == [step]
    assert again.notes == {"operator": "bench 3", "held_out_every": 5}
    assert (again.play_radius, again.stop_reason, again.n_parameters) == (1e-4, "fresh", 20)
    assert again.created_by == f"palpate {_core.__version__}"


def test_numpy_numbers_are_saved_like_any_other(tmp_path: Path) -> None:
    step = {
        "n_wavelets": np.int64(N),
        "rmse": np.float64(0.1),
        "criterion": np.float64(2.0),
        "model_class": "network",
    }
    fit = Fit("network", "bic", np.float64(0.1), np.int64(N), np.int64(17), [step])  # type: ignore[arg-type,list-item]
    model = Model(**content(fit=fit))
    assert load_model(model.save(tmp_path / "a.json")).to_dict() == model.to_dict()


def test_the_slope_bounds_enclose_the_slopes_over_the_domain() -> None:
    model = Model(**content())
    slopes = model.slope(np.linspace(0.0, 0.6, 20_001))
    assert model.slope_bounds is not None
    low, high = model.slope_bounds
    assert low <= slopes.min()
    assert high >= slopes.max()
    spread = slopes.max() - slopes.min()
    assert low == pytest.approx(slopes.min(), abs=0.02 * spread)
    assert high == pytest.approx(slopes.max(), abs=0.02 * spread)


def test_a_model_of_two_inputs_predicts_and_is_saved(tmp_path: Path) -> None:
    given = content(
        kind="general",
        inputs=["position", "load_N"],
        alpha=np.ones((1, 2)),
        beta=np.zeros((1, 2)),
        weight=[1.0],
        linear=[2.0, 3.0],
        lower=[0.0, 0.0],
        upper=[1.0, 1.0],
        fit=Fit("network", "bic", 0.1, 1, 8),
    )
    again = load_model(Model(**given).save(tmp_path / "a.json"))
    # The mother wavelet of two inputs, (|u|^2 - 2) exp(-|u|^2 / 2), is 0 at u = (1, 1).
    assert again.predict([[1.0, 1.0]])[0] == pytest.approx(2.0 + 3.0 + 1 / 3, rel=1e-15)
    assert again.slope_bounds is None


def test_copies_and_pickles_are_equal() -> None:
    model = Model(**content(hysteresis=True))
    for duplicate in (copy.deepcopy(model), pickle.loads(pickle.dumps(model))):
        assert duplicate.to_dict() == model.to_dict()


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"weight": [1.0]}, "alpha has 5 values, must have 1"),
        ({"kind": "velocity"}, 'kind is "velocity": must be'),
        ({"units": {"position": "mm", "force": "N"}}, 'units.position is "mm": must be'),
        ({"inputs": ["position", "velocity"]}, "inputs has 2 values: must have 1, one for each dimension"),
        ({"kind": "hysteresis"}, "weight_hysteresis is null"),
        ({"fit": Fit("network", "bic", 1e-3, N + 1, 3)}, "fit.n_wavelets is 6: must be 5"),
        ({"fit": Fit("network", "bic", float("nan"), N, 3)}, "fit.nrmse is nan: must be a finite number"),
        ({"notes": {"seconds": float("inf")}}, "notes.seconds is inf: must be a finite number"),
    ],
)
def test_wrong_arguments_are_refused_by_name(change: dict[str, Any], sentence: str) -> None:
    with pytest.raises(ValueError, match=re.escape(sentence)):
        Model(**content(**change))


def test_a_missing_input_is_named() -> None:
    with pytest.raises(ValueError, match="direction="):
        Model(**content(hysteresis=True)).force(0.1)


def test_a_failed_save_leaves_the_old_file(tmp_path: Path) -> None:
    model = Model(**content())
    path = model.save(tmp_path / "a.json")
    before = path.read_bytes()
    model.notes["operator"] = float("nan")
    with pytest.raises(InputError, match=r"notes\.operator is nan"):
        model.save(path)
    assert path.read_bytes() == before
    assert list(tmp_path.iterdir()) == [path]
    with pytest.raises(InputError, match="there is no folder"):
        Model(**content()).save(tmp_path / "nowhere" / "a.json")


def test_a_saved_model_has_the_permissions_of_a_new_file(tmp_path: Path) -> None:
    plain = tmp_path / "plain"
    plain.touch()
    saved = Model(**content()).save(tmp_path / "a.json")
    assert saved.stat().st_mode == plain.stat().st_mode


def test_the_file_has_a_line_for_each_field(tmp_path: Path) -> None:
    text = Model(**content()).save(tmp_path / "a.json").read_text(encoding="utf-8")
    assert [line for line in text.splitlines() if line.startswith('    "alpha": [[')]
    assert json.loads(text)["format"] == "palpate-model"
    assert len(text.splitlines()) < 50


def with_harmonics(**change: Any) -> Model:
    """Returns a model of one wavelet and two harmonics of the period 0.6 m, of the orders 2 and 9."""
    wave = 2.0 * np.pi / 0.6
    given = {
        "alpha": [[40.0], [2.0 * wave], [9.0 * wave]],
        "beta": [[0.3], [0.1], [-0.02]],
        "linear": [0.0],
        "period": 0.6,
        "harmonics": 2,
    }
    return Model(**content(wavelets=3, **given | change))


def test_harmonics_follow_their_formula_in_every_period() -> None:
    model = with_harmonics()
    x = np.linspace(-1.9, 2.5, 401)
    at = np.mod(x, 0.6)
    u, waves = 40.0 * (at - 0.3), [model.alpha[k] * (x - model.beta[k]) for k in (1, 2)]
    force = model.bias + model.weight[0] * (u * u - 1.0) * np.exp(-0.5 * u * u)
    slope = 40.0 * model.weight[0] * (3.0 - u * u) * u * np.exp(-0.5 * u * u)
    for k, wave in enumerate(waves, start=1):
        force = force + model.weight[k] * np.cos(wave)
        slope = slope - model.weight[k] * model.alpha[k] * np.sin(wave)
    np.testing.assert_allclose(model.force(x), force, atol=1e-12)
    np.testing.assert_allclose(model.slope(x), slope, atol=1e-10)
    assert model.slope_bounds[0] <= slope.min()
    assert model.slope_bounds[1] >= slope.max()
    assert model.slope_bounds[1] < 1.03 * np.abs(slope).max()
    integral = model.energy(0.6 * np.arange(1, 4)) - model.energy(0.0)
    np.testing.assert_allclose(integral, model.bias * 0.6 * np.arange(1, 4), rtol=1e-9)


def test_harmonics_are_saved_shown_and_listed(tmp_path: Path) -> None:
    model = with_harmonics()
    again = load_model(model.save(tmp_path / "motor.json"))
    assert again == model
    assert _core.model.fingerprint(again) == _core.model.fingerprint(model)
    assert pickle.loads(pickle.dumps(model)) == model
    assert model.orders.tolist() == [2.0, 9.0]
    assert model.terms == "1 wavelet and 2 harmonics"
    phases = [float(np.angle(np.exp(1j * model.alpha[k, 0] * model.beta[k, 0]))) for k in (1, 2)]
    frame = model.to_frame()
    assert frame["order"].tolist() == [0.0, 2.0, 9.0]
    assert frame["phase_rad"].tolist() == pytest.approx([0.0, *phases])
    text = str(model)
    assert "1 wavelet and 2 harmonics" in text
    assert "sum_i w_i psi(alpha_i (x - beta_i)) + sum_k w_k cos(n_k 2 pi x / period - phase_k)" in text
    assert f"9  {phases[1]:>11.6g}  {model.weight[2]:.6g}" in text


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"period": None}, "harmonics is 2, must be 0 in a network without period"),
        ({"harmonics": 4}, "harmonics is 4, must be at most the number of wavelets, 3"),
        ({"harmonics": 3}, "alpha[0] is 40.000000: must be a whole multiple of 2 pi / period"),
        ({"harmonics": -1}, "harmonics is -1: must be >= 0"),
        ({"harmonics": 1.5}, "harmonics is 1.5; it must be a int: a whole number"),
    ],
)
def test_wrong_harmonics_are_refused(change: dict[str, Any], sentence: str) -> None:
    with pytest.raises(ValueError, match=re.escape(sentence)):
        with_harmonics(**change)


def test_the_text_of_a_model_names_terms_domain_and_error() -> None:
    text = str(Model(**content(hysteresis=True, play_radius=1e-4, wavelets=2)))
    assert "hysteresis model: 2 wavelets, 8 parameters (model class network, stopped by bic)" in text
    assert "NRMSE 0.001 on 100 rows of a.csv" in text
    assert "NRMSE 0.001 on 80 of 100 rows of a.csv" in str(Model(**content(notes={"error_rows": 80})))
    assert "position from 0 to 0.6 m" in text
    assert "play radius 0.0001 m" in text
    assert "f(x, s) = g(x) + s h(x)  [N]" in text
    assert "g(x) = sum_i w_i psi(alpha_i (x - beta_i))" in text
    assert "h(x) = sum_i v_i psi(alpha_i (x - beta_i))" in text
    assert len([line for line in text.splitlines() if re.match(r"  [01]  ", line)]) == 2
    spring = str(Model(**content(wavelets=0, linear=[2.0], bias=0.5)))
    assert spring.endswith("f(x) = +2 x +0.5  [N]")
    assert repr(Model(**content())) == "<palpate.Model: position, 5 wavelets, 17 parameters>"


GOOD = sorted((ROOT / "tests" / "models" / "good").glob("*.json"))


@pytest.mark.parametrize("path", GOOD, ids=lambda path: path.stem)
@pytest.mark.parametrize("position", [np.inf, -np.inf, np.nan])
def test_a_position_that_is_not_finite_gives_nan_in_a_number_and_in_an_array(
    path: Path, position: float
) -> None:
    model = load_model(path)
    if model.dimension > 1:
        rows = np.full((2, model.dimension), 0.1)
        rows[1, -1] = position
        force = model.predict(rows)
        assert np.isfinite(force[0])
        assert np.isnan(force[1])
        return
    one: Any = {"direction": 1.0} if model.hysteretic else {}
    many: Any = {"direction": np.ones(3)} if model.hysteretic else {}
    for name in ("force", "slope", "energy"):
        quantity = getattr(model, name)
        assert np.isnan(quantity(position, **one)), name
        array = quantity(np.array([0.1, position, 0.2]), **many)
        assert np.array_equal(np.isnan(array), [False, True, False]), name
    assert model.extrapolated(position)
    columns = [position, 1.0] if model.hysteretic else [position]
    assert np.isnan(model.predict(np.array([columns]))[0])

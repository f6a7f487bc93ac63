# SPDX-License-Identifier: Apache-2.0
"""The compiled module gives the same numbers as NumPy formulas, and refuses wrong arguments."""

import os

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.signal import lfilter

from palpate import _core
from palpate._core.device import DeviceProfile
from palpate._core.dynamics import environment_filters
from palpate._core.model import (
    ForceModel,
    wavelet_columns,
    wavelet_jacobian,
    wavelet_slope_columns,
    wavelet_steps,
)
from palpate._core.rendering import Scheme, structure_names
from palpate._core.simulation import Hand, force_driven, motion_driven, simulate

CASES = 100 * max(1, int(os.environ.get("PALPATE_TEST_SCALE", "1")))


def mexican_hat(u: NDArray[np.float64]) -> NDArray[np.float64]:
    """Returns the radial mother wavelet (|u|^2 - d) exp(-|u|^2 / 2) of vectors u (..., d)."""
    square = np.sum(u * u, axis=-1)
    return (square - u.shape[-1]) * np.exp(-0.5 * square)


def random_network(rng: np.random.Generator, size: int, dimension: int = 1) -> dict[str, object]:
    return {
        "alpha": np.exp(rng.uniform(0, 4, (size, dimension))),
        "beta": rng.uniform(-0.1, 1.1, (size, dimension)),
        "weight": rng.uniform(-1, 1, size),
        "linear": rng.uniform(-2, 4, dimension),
        "bias": float(rng.uniform(-0.5, 0.5)),
        "lower": np.zeros(dimension),
        "upper": np.ones(dimension),
    }


@pytest.mark.parametrize("dimension", [1, 2, 3])
def test_force_equals_a_numpy_reference(dimension: int) -> None:
    rng = np.random.default_rng(dimension)
    for _ in range(CASES):
        arguments = random_network(rng, int(rng.integers(0, 12)), dimension)
        model = ForceModel(**arguments)
        x = rng.uniform(0, 1, (7, dimension))
        scaled = arguments["alpha"] * (x[:, None, :] - arguments["beta"])
        expected = mexican_hat(scaled) @ arguments["weight"] + x @ arguments["linear"] + arguments["bias"]
        assert model.predict(x) == pytest.approx(expected, rel=1e-12, abs=1e-12)
        if dimension == 1:
            assert model.force(x[:, 0]) == pytest.approx(expected, rel=1e-12, abs=1e-12)


@pytest.mark.parametrize("dimension", [1, 2])
def test_columns_and_jacobian_equal_finite_differences(dimension: int) -> None:
    rng = np.random.default_rng(10 + dimension)
    x = rng.uniform(0, 1, (20, dimension))
    alpha = rng.uniform(1, 9, (5, dimension))
    beta = rng.uniform(0, 1, (5, dimension))
    columns = wavelet_columns(x, alpha, beta)
    assert columns.flags.f_contiguous
    assert columns == pytest.approx(mexican_hat(alpha * (x[:, None, :] - beta)), abs=1e-14)
    value, by_alpha, by_beta = wavelet_jacobian(x, alpha, beta)
    assert np.array_equal(value, columns)
    h = 1e-6
    for j in range(dimension):
        step = np.zeros(dimension)
        step[j] = h
        for derivative, up, down in (
            (by_alpha[j], (alpha + step, beta), (alpha - step, beta)),
            (by_beta[j], (alpha, beta + step), (alpha, beta - step)),
        ):
            difference = (wavelet_columns(x, *up) - wavelet_columns(x, *down)) / (2 * h)
            assert derivative == pytest.approx(difference, abs=1e-8)
    inputs = range(dimension)
    steps = [alpha[:, j] * by_alpha[j] for j in inputs] + [by_beta[j] / alpha[:, j] for j in inputs]
    every, used = np.ones(alpha.shape, dtype=bool), np.arange(alpha.size).reshape(alpha.shape) % 3 != 1
    all_steps = np.concatenate(steps, axis=1)
    assert wavelet_steps(x, alpha, beta, every) == pytest.approx(all_steps, abs=1e-13)
    some = np.concatenate([used.T.ravel(), used.T.ravel()])
    assert wavelet_steps(x, alpha, beta, used) == pytest.approx(all_steps[:, some], abs=1e-13)
    with pytest.raises(ValueError, match=r"used has 1 values, alpha has"):
        wavelet_steps(x, alpha, beta, np.ones(1, dtype=bool))


def test_columns_are_correct_for_extreme_positions_and_any_length() -> None:
    rng = np.random.default_rng(12)
    alpha, beta = rng.uniform(1, 50, 6), rng.uniform(0, 1, 6)
    for n in (0, 1, 7, 255, 256, 257, 1000):
        x = rng.uniform(-1, 2, n)
        expected = mexican_hat((alpha * (x[:, None] - beta))[:, :, None])
        assert wavelet_columns(x, alpha, beta) == pytest.approx(expected, abs=1e-13)
    far_positions = np.array([1e300, -1e300, np.inf, -np.inf, 1e10])
    value, by_alpha, by_beta = wavelet_jacobian(far_positions, alpha, beta)
    for columns in (value, by_alpha[0], by_beta[0]):
        assert np.all(np.abs(columns) < 1e-280)
    assert np.all(np.isnan(wavelet_columns(np.array([np.nan]), alpha, beta)))


def test_a_batch_equals_the_results_of_single_positions() -> None:
    rng = np.random.default_rng(13)
    for size in (0, 1, 5, 16, 33):
        model = ForceModel(**random_network(rng, size))
        x = np.concatenate([rng.uniform(-0.5, 1.5, 1001), [0.0, 1.0, 1e10, -1e10]])
        for quantity in (model.force, model.slope, model.energy):
            assert quantity(x) == pytest.approx(
                np.array([quantity(float(at)) for at in x]), rel=1e-12, abs=1e-12
            )


def test_slope_columns_equal_finite_differences_of_the_wavelets() -> None:
    rng = np.random.default_rng(3)
    x, alpha, beta, h = rng.uniform(0, 1, 30), rng.uniform(1, 9, 4), rng.uniform(0, 1, 4), 1e-6
    slope = (wavelet_columns(x + h, alpha, beta) - wavelet_columns(x - h, alpha, beta)) / (2 * h)
    assert wavelet_slope_columns(x, alpha, beta) == pytest.approx(slope, abs=1e-7)


def test_a_float_gives_a_float_and_an_array_keeps_its_shape() -> None:
    model = ForceModel(**random_network(np.random.default_rng(4), 3))
    assert type(model.force(0.3)) is float
    assert model.force(1) == model.force(1.0)
    grid = np.linspace(-0.5, 1.5, 12).reshape(3, 4)
    assert model.force(grid).shape == (3, 4)
    assert model.force(list(grid[0])) == pytest.approx([model.force(float(x)) for x in grid[0]], abs=0)
    assert model.force(grid.astype(np.float32)[0]).dtype == np.float64
    assert model.force(np.empty(0)).shape == (0,)
    assert np.isnan(model.force(float("nan")))
    assert list(model.extrapolated(np.array([-0.1, 0.5, 1.1]))) == [True, False, True]
    assert model.extrapolated(0.5) is False


def test_a_model_with_hysteresis_requires_a_direction() -> None:
    arguments = random_network(np.random.default_rng(5), 3)
    hysteresis = {"weight_hysteresis": [0.0, 0.0, 0.0], "linear_hysteresis": [0.0], "bias_hysteresis": 0.25}
    model = ForceModel(**arguments, **hysteresis)
    without_hysteresis = ForceModel(**arguments)
    x = np.linspace(0, 1, 5)
    assert model.force(x, direction=1) == pytest.approx(without_hysteresis.force(x) + 0.25, abs=1e-14)
    assert model.force(x, direction=np.full(5, -1, np.int8)) == pytest.approx(
        without_hysteresis.force(x) - 0.25, abs=1e-14
    )
    assert model.predict(np.column_stack([x, np.zeros(5)])) == pytest.approx(
        without_hysteresis.force(x), abs=1e-14
    )
    with pytest.raises(ValueError, match="give direction="):
        model.force(0.3)
    with pytest.raises(ValueError, match="no play radius"):
        model.force(0.3, play=0.2)
    with pytest.raises(ValueError, match=r"direction has shape \(3,\), must have 1 or 5 values"):
        model.force(x, direction=[1, 1, -1])


def test_an_array_of_objects_must_contain_numbers() -> None:
    model = ForceModel(**random_network(np.random.default_rng(6), 3))
    assert model.force(np.array([0.5, 1], dtype=object)) == pytest.approx(model.force(np.array([0.5, 1.0])))
    for text in ("0.5", b"0.5", np.str_("0.5"), np.bytes_(b"0.5"), bytearray(b"0.5"), None):
        array = np.empty(1, dtype=object)
        array[0] = text
        with pytest.raises(ValueError, match=r"^position contains .*must be a number or an array of numbers"):
            model.force(array)


def test_the_shape_of_an_argument_without_effect_is_checked() -> None:
    model = ForceModel(**random_network(np.random.default_rng(7), 3))
    x = np.linspace(0, 1, 5)
    assert model.force(x, direction=[1, 1, 1, -1, -1], play=0.0) == pytest.approx(model.force(x), abs=0)
    for name in ("direction", "play"):
        with pytest.raises(ValueError, match=rf"{name} has shape \(3,\), must have 1 or 5 values"):
            model.force(x, **{name: [1, 1, -1]})


def test_energy_of_a_direction_is_that_of_its_play_state() -> None:
    arguments = random_network(np.random.default_rng(8), 3)
    hysteresis = {"weight_hysteresis": [0.1, 0.0, 0.1], "linear_hysteresis": [0.2], "bias_hysteresis": 0.25}
    x = np.linspace(0, 1, 5)
    played = ForceModel(**arguments, **hysteresis, play_radius=0.02)
    for direction in (1.0, -1.0, 0.5):
        expected = played.energy(x, play=x - direction * 0.02)
        assert played.energy(x, direction=direction) == pytest.approx(expected, abs=1e-14)
        assert played.energy(0.3, direction=direction) == pytest.approx(
            played.energy(0.3, play=0.3 - direction * 0.02), abs=1e-14
        )
    without_radius = ForceModel(**arguments, **hysteresis)
    mean = ForceModel(**arguments)
    assert without_radius.energy(x, direction=1) == pytest.approx(mean.energy(x), abs=1e-14)


def test_only_an_object_with_mass_is_driven_by_a_force() -> None:
    model = ForceModel(**random_network(np.random.default_rng(9), 3))
    with pytest.raises(ValueError, match="must be implicit or explicit or energy-consistent: "):
        force_driven(model, Scheme(structure="massless"), np.zeros(3), 1e-3)
    force_driven(model, Scheme(structure="energy-consistent"), np.zeros(3), 1e-3)


def test_play_state_follows_the_motion() -> None:
    hysteresis = {
        "weight_hysteresis": [],
        "linear_hysteresis": [0.0],
        "bias_hysteresis": 0.2,
        "play_radius": 0.1,
    }
    line = {"alpha": np.empty((0, 1)), "beta": np.empty((0, 1)), "weight": [], "linear": [5.0], "bias": 0.0}
    model = ForceModel(**line, **hysteresis, lower=[0.0], upper=[1.0])
    position = np.array([0.2, 0.5, 0.45, 0.2])
    play = model.play(position)
    assert play == pytest.approx([0.2, 0.4, 0.4, 0.3])
    assert np.array_equal(_core.model.play(position, 0.1), play)
    assert _core.model.play(position, 0.1, start=0.25)[0] == 0.25
    assert model.force(position, play=play) == pytest.approx(5 * position + 0.2 * np.array([0, 1, 0.5, -1]))


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"alpha": [[-1.0], [1.0], [1.0]]}, r"alpha\[0\]\[0\] is -1.000000, must be > 0"),
        ({"weight": [1.0, float("nan"), 0.0]}, r"weight\[1\] is not a finite number"),
        ({"beta": [[0.5]]}, "beta has 1 values, must have 3"),
        ({"below": "open"}, "below is 'open', must be linear or free"),
        ({"play_radius": 0.1}, "play_radius is given, but the model has no hysteresis"),
        ({"bias_hysteresis": 0.1}, "must be given together"),
    ],
    ids=["negative-dilation", "nan-weight", "short-beta", "unknown-side", "radius-alone", "half-a-loss"],
)
def test_impossible_models_are_refused_by_field(change: dict[str, object], sentence: str) -> None:
    with pytest.raises(ValueError, match=sentence):
        ForceModel(**{**random_network(np.random.default_rng(6), 3), **change})


def test_simulation_returns_one_row_per_tick_and_the_same_rows_again() -> None:
    model = ForceModel(**random_network(np.random.default_rng(7), 0))
    trace = simulate(model, Scheme(), DeviceProfile(), Hand(), 0.25)
    assert {len(column) for column in trace.values()} == {250}
    assert set(trace["status"]) <= {int(_core.status.Status.Ok), int(_core.status.Status.Limited)}
    second_trace = simulate(model, Scheme(), DeviceProfile(), Hand(), 0.25)
    assert all(np.array_equal(trace[name], second_trace[name]) for name in trace)


def test_motion_driven_and_force_driven_simulations_are_inverse_for_a_spring() -> None:
    spring = ForceModel(
        alpha=np.empty((0, 1)),
        beta=np.empty((0, 1)),
        weight=[],
        linear=[5.0],
        bias=0.0,
        lower=[0.0],
        upper=[1.0],
    )
    position = 0.5 - 0.4 * np.cos(np.linspace(0, 2 * np.pi, 8000))
    force = motion_driven(spring, Scheme(structure="direct"), position, 1e-3)["force"]
    assert force == pytest.approx(5 * position, abs=1e-12)
    for structure in ("implicit", "explicit"):
        scheme = Scheme(structure=structure, object_damping=0.05)
        simulated = force_driven(spring, scheme, force, 1e-3, start_position=float(position[0]))
        assert simulated["environment_position"] == pytest.approx(position, abs=5e-3)


def test_defaults_and_names_equal_those_of_the_core() -> None:
    assert [status.name for status in _core.status.Status.__members__.values()] == list(
        _core.status.status_meanings
    )
    assert structure_names == (
        "direct",
        "massless",
        "implicit",
        "explicit",
        "energy-consistent",
        "tangent",
    )
    scheme = Scheme()
    assert (scheme.structure, scheme.mass, scheme.object_damping) == ("massless", 0.001, 0.5)
    profile = DeviceProfile()
    assert (profile.inertia, profile.viscous_damping, profile.force_limit) == (2e-4, 0.06, 5.0)
    assert profile.encoder_step == pytest.approx(2 * np.pi / 65536)


def test_filters_equal_scipy_filters() -> None:
    filters = environment_filters("explicit")
    signal = np.sin(0.05 * np.arange(400))
    b, a = filters.g1.numerator, filters.g1.denominator
    assert filters.g1.filter(signal) == pytest.approx(lfilter(b, a, signal), abs=1e-9)
    with pytest.raises(ValueError, match="must be implicit or explicit"):
        environment_filters("both")

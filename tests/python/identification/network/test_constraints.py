# SPDX-License-Identifier: Apache-2.0
"""Constraints hold everywhere over the domain, and notes name crossings of the strokes."""

import itertools
import re
from dataclasses import replace

import numpy as np
import pytest

from conftest import sampled
from palpate import InputError
from palpate._core.model import derivative_bounds, wavelet_columns, wavelet_slope_columns
from palpate.identification import FittedNetwork, IdentifyOptions, fit_environment
from palpate.identification.data.compression import Compressor
from palpate.identification.network import constraints
from palpate.identification.network.basis import Basis
from palpate.identification.network.constraints import (
    domain_bounds,
    impose,
    violated_positions,
)
from palpate.identification.network.separable import SeparableProblem, Solution, problem_of
from palpate.recording import Recording


def g_and_h(network: FittedNetwork, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    wavelets = wavelet_columns(x, network.alpha, network.beta)
    g = wavelets @ network.weight + network.linear[0] * x + network.bias
    if network.weight_hysteresis is None:
        return g, np.zeros_like(g)
    assert network.linear_hysteresis is not None
    assert network.bias_hysteresis is not None
    return g, wavelets @ network.weight_hysteresis + network.linear_hysteresis[
        0
    ] * x + network.bias_hysteresis


def strokes(h_of_x: np.ndarray, x: np.ndarray, noise: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    random = np.random.default_rng(5)
    side = np.repeat([1.0, -1.0], len(x))
    both = np.tile(x, 2)
    force = 100.0 * both + side * np.tile(h_of_x, 2) + random.normal(0.0, noise, len(both))
    return both[:, None], force, side


def random_network(seed: int) -> tuple[SeparableProblem, Solution]:
    random = np.random.default_rng(seed)
    x = np.linspace(0.0, 1.0, 80)
    side = np.repeat([1.0, -1.0], 80)
    y = random.normal(size=160) + 0.3 * side
    problem = problem_of(Compressor(np.tile(x, 2)[:, None], y, max_positions=500).rows(side), resolved_by=5)
    basis = Basis(random.uniform(3.0, 30.0, (6, 1)), random.uniform(0.0, 1.0, (6, 1)))
    return problem, problem.solve(basis)


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("slopes", [None, (-3.0, 8.0)], ids=["h", "h-and-slopes"])
def test_imposed_bounds_hold_between_grid_points(seed: int, slopes: tuple[float, float] | None) -> None:
    problem, free = random_network(seed)
    bounds = domain_bounds(problem, hysteresis=True, slopes=slopes)
    kept = impose(problem, free, bounds)
    x = np.linspace(0.0, 1.0, 200_001)
    value = np.column_stack([np.ones_like(x), x, wavelet_columns(x, kept.basis.alpha, kept.basis.beta)])
    slope = np.column_stack(
        [
            np.zeros_like(x),
            np.ones_like(x),
            wavelet_slope_columns(x, kept.basis.alpha, kept.basis.beta),
        ]
    )
    g, h = problem.readout @ kept.coefficients
    assert (value @ h).min() >= 0.0
    if slopes is not None:
        for stroke in (g + h, g - h):
            assert (slope @ stroke).min() >= slopes[0]
            assert (slope @ stroke).max() <= slopes[1]
    assert not any(len(violated_positions(problem, kept, bound)) for bound in bounds)
    assert kept.rss >= free.rss * (1 - 1e-9)


@pytest.mark.parametrize("slopes", [None, (-3.0, np.inf), (-np.inf, 8.0), (-3.0, 8.0)])
@pytest.mark.parametrize(("fixed", "periodic"), [(None, False), ((0.4, 0.1), False), (None, True)])
def test_constraints_hold_if_no_round_is_left(
    monkeypatch: pytest.MonkeyPatch,
    slopes: tuple[float, float] | None,
    fixed: tuple[float, float] | None,
    periodic: bool,
) -> None:
    """After the last round the fit is mixed with a straight line, as little as necessary."""
    problem, free = random_network(3)
    bounds = domain_bounds(problem, hysteresis=True, slopes=slopes, fixed=fixed, periodic=periodic)
    imposed = impose(problem, free, bounds)
    monkeypatch.setattr(constraints, "MOST_ROUNDS", 0)
    mixed = impose(problem, free, bounds)
    assert not any(len(violated_positions(problem, mixed, bound)) for bound in bounds)
    assert mixed.rss >= imposed.rss * (1 - 1e-9)
    if fixed is None and not periodic:  # no equality: the largest share of the free fit that is allowed
        nearer = problem.with_coefficients(
            free, mixed.coefficients + 1e-6 * (free.coefficients - mixed.coefficients)
        )
        assert any(len(violated_positions(problem, nearer, bound)) for bound in bounds)


def test_a_dip_between_two_samples_of_any_grid_is_found() -> None:
    """h = 1e-3 minus a hat 1e-3 wide: the certificate finds the dip that sampling the cells would miss."""
    problem, free = random_network(0)
    basis = Basis(np.array([[1000.0]]), np.array([[0.50195]]))
    coefficients = np.array([[1e-3, 0.0, 2e-3], [-1e-3, 0.0, -2e-3]])
    (bound,) = domain_bounds(problem, hysteresis=True, slopes=None)
    dipping = replace(free, basis=basis, coefficients=coefficients)
    where = violated_positions(problem, dipping, bound)
    assert where == pytest.approx([0.50195], abs=1e-3)


@pytest.mark.parametrize("order", [2, 3])
def test_cells_are_bounded_by_the_derivatives_of_the_core(order: int) -> None:
    """Sampled derivatives are below the bound of each cell; near the centre of a wavelet they reach it."""
    alpha, beta, weight = np.array([[3.0], [20.0]]), np.array([[0.2], [0.6]]), np.array([1.0, -0.5])
    edges = np.linspace(0.0, 1.0, 33)
    cells = derivative_bounds(
        alpha=alpha,
        beta=beta,
        weight=weight,
        linear=1.0,
        bias=0.0,
        lower=edges[:-1],
        upper=edges[1:],
        order=order,
    )
    samples = edges[:-1, None] + np.diff(edges)[:, None] * np.linspace(0.0, 1.0, 1001)
    u = alpha[:, 0] * (samples[..., None] - beta[:, 0])
    polynomial = u**4 - 6 * u**2 + 3 if order == 2 else -(u**5) + 10 * u**3 - 15 * u
    derivative = (polynomial * np.exp(-(u**2) / 2) * alpha[:, 0] ** order) @ weight
    largest = np.abs(derivative).max(axis=1)
    assert (largest <= cells).all()
    assert largest.max() == pytest.approx(cells.max(), rel=0.05)


def test_the_bounded_least_squares_is_the_best_one() -> None:
    """Compares the bounded fit of two straight strokes with the best of all four sets of active bounds."""
    random = np.random.default_rng(3)
    x = np.linspace(0.0, 1.0, 60)
    side = np.repeat([1.0, -1.0], 60)
    y = np.tile(x, 2) + side * np.tile(0.3 - 0.6 * x, 2) + random.normal(0.0, 0.02, 120)
    problem = problem_of(Compressor(np.tile(x, 2)[:, None], y, max_positions=500).rows(side), resolved_by=5)
    free = problem.solve(Basis.empty(1))
    kept = impose(problem, free, domain_bounds(problem, hysteresis=True, slopes=None))
    # the hysteresis h is a straight line: only h >= 0 at its two ends can be active, so there are four cases
    best = np.inf
    ends = np.array([[0.5, 0.0, -0.5, 0.0], [0.5, 0.5, -0.5, -0.5]])
    design = np.zeros((120, 4))
    design[:60, :2] = design[60:, 2:] = np.column_stack([np.ones(60), x])
    for active in itertools.chain.from_iterable(itertools.combinations([0, 1], k) for k in range(3)):
        held = ends[list(active)]
        system = np.block([[design.T @ design, held.T], [held, np.zeros((len(held), len(held)))]])
        found = np.linalg.solve(system, np.concatenate([design.T @ y, np.zeros(len(held))]))[:4]
        if (ends @ found >= -1e-12).all():
            best = min(best, float(np.sum((y - design @ found) ** 2)))
    assert best <= kept.rss <= best * 1.01


def test_vanishing_noisy_hysteresis_stays_nonnegative_without_error() -> None:
    x = np.linspace(0.0, 0.004, 300)
    positions, force, side = strokes(0.05 * np.clip(1.0 - x / 0.002, 0.0, None), x, 0.002)
    bounded = fit_environment(positions, force, side)
    free = fit_environment(positions, force, side, IdentifyOptions(hysteresis_nonnegative=False))
    fine = np.linspace(0.0, 0.004, 100_001)
    assert g_and_h(bounded, fine)[1].min() >= 0.0
    assert g_and_h(free, fine)[1].min() < 0.0
    assert bounded.errors.rmse <= 1.02 * free.errors.rmse
    assert any("press force >= release force imposed" in note for note in bounded.log.notes)


def test_crossing_strokes_are_replaced_by_their_mean() -> None:
    """If release force exceeds press force, hysteresis h becomes 0 and mean force g is the mean of both."""
    x = np.linspace(0.0, 0.004, 400)
    h = 0.05 * np.sin(np.pi * x / 0.002)
    positions, force, side = strokes(h, x, 0.002)
    network = fit_environment(positions, force, side)
    g, fitted = g_and_h(network, x)
    np.testing.assert_allclose(fitted, np.maximum(h, 0.0), atol=0.01)
    np.testing.assert_allclose(g, 100.0 * x, atol=0.01)


def test_slope_bounds_and_a_coupling_limit_the_slope_everywhere() -> None:
    x = np.linspace(0.0, 0.6, 600)
    y = 2.0 * x + 58.0 * 0.01 * np.logaddexp(0.0, (x - 0.4) / 0.01)
    y = y + np.random.default_rng(0).normal(0.0, 0.02, len(x))
    fine = np.linspace(0.0, 0.6, 100_001)
    for options, low, high in [
        (IdentifyOptions(slope_bounds=(2.5, 40.0)), 2.5, 40.0),
        (IdentifyOptions(coupling_stiffness=50.0), -np.inf, 45.0),
    ]:
        network = fit_environment(x[:, None], y, None, options)
        columns = wavelet_slope_columns(fine, network.alpha, network.beta)
        slope = columns @ network.weight + network.linear[0]
        assert slope.min() >= low
        assert slope.max() <= high
        assert slope.max() > 0.9 * high
        assert any("slope bounds imposed" in note for note in network.log.notes)


def test_the_slope_limited_fit_is_close_to_the_nearest_slope_limited_force() -> None:
    """Isotonic regression of the true force is the nearest force with the required slope."""
    from scipy.optimize import isotonic_regression

    x = np.linspace(0.0, 0.6, 1200)
    truth = 2.0 * x + 58.0 * 0.01 * np.logaddexp(0.0, (x - 0.4) / 0.01)
    y = truth + np.random.default_rng(0).normal(0.0, 0.02, len(x))
    nearest = 45.0 * x - isotonic_regression(45.0 * x - truth).x
    network = fit_environment(x[:, None], y, None, IdentifyOptions(coupling_stiffness=50.0))
    g, _ = g_and_h(network, x)
    loss = np.sqrt(np.mean((nearest - truth) ** 2))
    assert np.sqrt(np.mean((g - nearest) ** 2)) < 0.1 * loss


def test_a_monotone_force_never_falls() -> None:
    random = np.random.default_rng(4)
    x = np.linspace(0.0, 1.0, 800)
    y = x + 0.4 * np.exp(-(((x - 0.5) / 0.08) ** 2)) + random.normal(0.0, 0.01, len(x))
    network = fit_environment(x[:, None], y, None, IdentifyOptions(monotone=True))
    fine = np.linspace(0.0, 1.0, 100_001)
    columns = wavelet_slope_columns(fine, network.alpha, network.beta)
    assert (columns @ network.weight + network.linear[0]).min() >= 0.0
    assert any(
        "slope bounds imposed over the whole domain, which changes the RMS error from" in note
        for note in network.log.notes
    )


@pytest.mark.parametrize("hysteresis", [False, True], ids=["one-force", "two-strokes"])
def test_fixed_force_is_kept_with_small_error(hysteresis: bool) -> None:
    random = np.random.default_rng(5)
    x = np.tile(np.linspace(0.0, 0.6, 300), 2)
    side = np.repeat([1.0, -1.0], 300) if hysteresis else None
    y = 2.0 * x + 58.0 * 0.01 * np.logaddexp(0.0, (x - 0.4) / 0.01) + 0.03
    y = y + random.normal(0.0, 0.02, len(x)) + (0.0 if side is None else 0.2 * side)
    free = fit_environment(x[:, None], y, side)
    fixed = fit_environment(x[:, None], y, side, IdentifyOptions(fixed_force=(0.0, 0.03)))
    assert g_and_h(fixed, np.zeros(1))[0][0] == pytest.approx(0.03, abs=1e-7)
    assert abs(g_and_h(free, np.zeros(1))[0][0] - 0.03) > 1e-5
    assert fixed.errors.rmse <= 1.02 * free.errors.rmse
    assert any("fixed force" in note and "imposed" in note for note in fixed.log.notes)


def test_a_fixed_force_outside_the_data_is_refused() -> None:
    x = np.linspace(0.0, 1.0, 50)
    with pytest.raises(
        InputError, match="fixed_force is at position 2: must be within the recorded positions, 0 to 1"
    ):
        fit_environment(x[:, None], x, None, IdentifyOptions(fixed_force=(2.0, 0.0)))


LATE_S = 0.003
TURN = 0.004


def pressed_onto_a_wall(late_s: float, seed: int = 0) -> Recording:
    """Returns 0.4 N of friction that ends before a wall of 10^4 N/m at 3.6 mm; both strokes at 10 mm/s."""
    t = np.arange(0.0, 0.8, 1e-3)

    def force(t: np.ndarray) -> np.ndarray:
        x = TURN * (1.0 - np.abs(np.clip(t, 0.0, 0.8) / 0.4 - 1.0))
        friction = np.where(t <= 0.4, 0.2, -0.2) * np.clip((3.5e-3 - x) / 1e-3, 0.0, 1.0)
        return 100.0 * x + 1e4 * np.maximum(x - 3.6e-3, 0.0) + friction

    x = TURN * (1.0 - np.abs(t / 0.4 - 1.0))
    noise = np.random.default_rng(seed).normal(0.0, 0.005, len(t))
    return Recording.from_arrays(x, force(t - late_s) + noise, t, np.where(t <= 0.4, 1, -1))


def reported(recording: Recording) -> list[str]:
    assert recording.direction is not None
    network = fit_environment(recording.position[:, None], recording.force, recording.direction.astype(float))
    assert network.model_class == "hysteresis"
    return [note for note in network.log.notes if "release is up to" in note]


@pytest.mark.parametrize("seed", sampled(range(2), 0))
def test_notes_give_position_where_a_late_force_crosses_its_strokes(seed: int) -> None:
    recording = pressed_onto_a_wall(LATE_S, seed)
    (note,) = reported(recording)
    found = re.search(r"release is up to (\S+) above press at (\S+) to (\S+); ", note)
    assert found is not None
    depth, near, far = map(float, found.groups())
    # the wall moves by 2 v late = 0.06 mm between the strokes (speed v, force delay late)
    assert depth == pytest.approx(1e4 * 0.06e-3, rel=0.1)
    assert 3.3e-3 < near < 3.7e-3
    assert far == pytest.approx(TURN, abs=1e-4)
    assert reported(recording.with_force_earlier(LATE_S)) == []


@pytest.mark.parametrize("seed", sampled(range(2), 0))
def test_touching_strokes_are_not_reported(seed: int) -> None:
    assert reported(pressed_onto_a_wall(0.0, seed)) == []

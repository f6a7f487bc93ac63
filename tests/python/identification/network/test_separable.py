# SPDX-License-Identifier: Apache-2.0
"""Variable projection (fit of dilations and translations): exact, within bounds, error never larger."""

import numpy as np
import pytest

from palpate.identification import IdentifyOptions
from palpate.identification.data.compression import Compressor
from palpate.identification.network.basis import Basis
from palpate.identification.network.separable import (
    LARGEST_OVERHANG,
    LEAST_DILATION,
    SeparableProblem,
    problem_of,
    refine,
)
from palpate.identification.search.evidence import criterion_of
from palpate.identification.search.growth import Growth


def hat(x: np.ndarray, alpha: float, beta: float) -> np.ndarray:
    u = alpha * (x - beta)
    return (u * u - 1.0) * np.exp(-0.5 * u * u)


def problem_from(x: np.ndarray, y: np.ndarray, side: np.ndarray | None = None) -> SeparableProblem:
    return problem_of(Compressor(x[:, None], y, max_positions=2000).rows(side), resolved_by=5)


def noisy_switch(seed: int, kind: str) -> SeparableProblem:
    random = np.random.default_rng(seed)
    x = np.tile(np.linspace(0.0, 1.0, 200), 2)
    y = x + 0.4 * np.exp(-(((x - 0.4) / 0.05) ** 2)) + 3.0 * np.maximum(x - 0.9, 0.0)
    y = y + random.normal(0.0, 0.01, len(x))
    if kind == "one force":
        return problem_from(x, y)
    side = np.repeat([1.0, -1.0 if kind == "two strokes" else -0.5], 200)
    return problem_from(x, y + side * 0.1 * (1.0 - x), side)


def any_basis(seed: int, n: int = 5) -> Basis:
    random = np.random.default_rng(seed)
    return Basis(random.uniform(2.0, 25.0, (n, 1)), random.uniform(-0.1, 1.1, (n, 1)))


@pytest.mark.parametrize("kind", ["one force", "two strokes", "play"])
def test_descent_direction_is_the_gradient_of_the_eliminated_objective(kind: str) -> None:
    """Checks d objective / d(log alpha, alpha beta) = -2 * direction with central differences."""
    problem, basis = noisy_switch(1, kind), any_basis(2)
    problem = problem.with_prior(1.0)
    _, direction = problem.normal_equations(problem.solve(basis))
    n, step = len(basis), 1e-5
    for unknown in range(2 * n):
        values = []
        for sign in (1.0, -1.0):
            alpha, beta = basis.alpha.copy(), basis.beta.copy()
            if unknown < n:
                alpha[unknown] *= np.exp(sign * step)
            else:
                beta[unknown - n] += sign * step / alpha[unknown - n]
            values.append(problem.solve(Basis(alpha, beta)).objective)
        slope = (values[0] - values[1]) / (2.0 * step)
        assert slope == pytest.approx(-2.0 * direction[unknown], rel=1e-4, abs=1e-6)


@pytest.mark.parametrize("seed", range(10))
def test_refinement_is_never_worse_than_its_start_and_keeps_its_bounds(seed: int) -> None:
    problem = noisy_switch(seed, "two strokes")
    start = problem.solve(any_basis(seed, 8))
    refined = refine(problem, start, steps=25, tolerance=0.0)
    assert refined.objective <= start.objective
    assert np.all(refined.basis.alpha >= LEAST_DILATION)
    assert np.all(refined.basis.alpha <= np.maximum(problem.finest(refined.basis), LEAST_DILATION))
    assert np.all((refined.basis.beta >= -LARGEST_OVERHANG) & (refined.basis.beta <= 1 + LARGEST_OVERHANG))


def test_refinement_finds_the_generating_wavelet() -> None:
    x = np.linspace(0.0, 1.0, 400)
    problem = problem_from(x, 2.0 * x - 1.0 + 0.7 * hat(x, 13.0, 0.37))
    start = problem.solve(Basis(np.array([[8.0]]), np.array([[0.41]])))
    refined = refine(problem, start, steps=40, tolerance=0.0)
    assert refined.basis.alpha[0, 0] == pytest.approx(13.0, rel=1e-6)
    assert refined.basis.beta[0, 0] == pytest.approx(0.37, abs=1e-7)


@pytest.mark.parametrize("translation", [-0.5, 1.5])
def test_a_wavelet_outside_the_bounds_does_not_stop_the_refinement(translation: float) -> None:
    x = np.linspace(0.0, 1.0, 400)
    problem = problem_from(x, 2.0 * x - 1.0 + 0.7 * hat(x, 13.0, 0.37) + 20.0 * hat(x, 1.0, translation))
    start = Basis(np.array([[8.0], [1.0]]), np.array([[0.41], [translation]]))
    refined = refine(problem, problem.solve(start), steps=40, tolerance=0.0)
    within = Basis(start.alpha, np.clip(start.beta, -LARGEST_OVERHANG, 1 + LARGEST_OVERHANG))
    assert np.all((refined.basis.beta >= -LARGEST_OVERHANG) & (refined.basis.beta <= 1 + LARGEST_OVERHANG))
    assert refined.rss < 0.1 * problem.solve(within).rss


def test_dilations_stay_bounded_on_a_jump() -> None:
    """At a jump of the force dilations would grow to infinity; the resolution of the data limits them."""
    x = np.linspace(0.0, 1.0, 300)
    problem = problem_from(x, np.where(x < 0.5, 0.0, 1.0))
    start = problem.solve(Basis(np.full((4, 1), 60.0), np.array([[0.48], [0.49], [0.51], [0.52]])))
    refined = refine(problem, start, steps=60, tolerance=0.0)
    assert np.all(refined.basis.alpha <= problem.finest(refined.basis))
    assert np.isfinite(refined.coefficients).all()


def test_one_of_two_coincident_wavelets_is_removed_at_no_cost() -> None:
    x = np.linspace(0.0, 1.0, 300)
    y = x + hat(x, 9.0, 0.5) + np.random.default_rng(0).normal(0.0, 0.01, len(x))
    problem = problem_from(x, y)
    doubled = problem.solve(Basis(np.full((2, 1), 9.0), np.full((2, 1), 0.5)))
    problem = problem.with_prior(doubled.rss)
    _, pruned = Growth(IdentifyOptions()).prune(problem, problem.solve(doubled.basis))
    assert len(pruned.basis) == 1
    assert pruned.rss <= doubled.rss * (1 + 1e-6)


def test_growth_finds_the_number_of_generating_wavelets() -> None:
    x = np.linspace(0.0, 1.0, 1000)
    y = 3.0 * x + hat(x, 20.0, 0.3) - 0.5 * hat(x, 9.0, 0.7)
    y = y + np.random.default_rng(1).normal(0.0, 0.01, len(x))
    problem = problem_from(x, y)
    options = IdentifyOptions()
    grown = Growth(options).grow(problem, Basis.empty(1), "position")
    assert len(grown.solution.basis) == 2
    assert grown.stop_reason == "bic"
    assert grown.criterion == criterion_of(problem, grown.solution, options.criterion)
    assert sorted(grown.solution.basis.beta[:, 0]) == pytest.approx([0.3, 0.7], abs=2e-3)


def test_stop_reason_is_max_wavelets_at_the_limit() -> None:
    x = np.linspace(0.0, 1.0, 300)
    problem = problem_from(x, np.sin(30.0 * x))
    options = IdentifyOptions(max_wavelets=3)
    grown = Growth(options).grow(problem, Basis.empty(1), "position")
    assert (len(grown.solution.basis), grown.stop_reason) == (3, "max_wavelets")
    assert [point.n_wavelets for point in grown.path] == [0, 1, 2, 3, 3]


@pytest.mark.parametrize("kind", ["one force", "two strokes", "play"])
def test_a_part_represents_its_share_of_the_samples(kind: str) -> None:
    problem = noisy_switch(1, kind)
    part, again = problem.part(50), problem.part(50)
    for block, whole, same in zip(part.blocks, problem.blocks, again.blocks, strict=True):
        assert len(block.target) == 50 < len(whole.target)
        assert set(block.positions[:, 0]) <= set(whole.positions[:, 0])
        np.testing.assert_array_equal(block.positions, same.positions)
    weights = [
        sum(float(block.channels[:, 0] @ block.channels[:, 0]) for block in p.blocks) for p in (part, problem)
    ]
    assert part.samples / problem.samples == pytest.approx(weights[0] / weights[1])
    assert problem.part(10_000) is problem

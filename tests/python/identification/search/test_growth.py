# SPDX-License-Identifier: Apache-2.0
"""Adding wavelets ends with finer wavelets only without noise, and with wide ones only if these suffice."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from any_input import SCALE
from palpate._core.model import wavelet_columns
from palpate._typing import Float1D, Float2D
from palpate.identification import IdentifyOptions
from palpate.identification.data.compression import Compressor
from palpate.identification.data.limits import neighbour_correlation
from palpate.identification.network.basis import Basis
from palpate.identification.network.separable import (
    CORE_RADIUS,
    LEAST_DILATION,
    SeparableProblem,
    Solution,
    problem_of,
)
from palpate.identification.search import growth
from palpate.identification.search.growth import (
    FINER_ERROR_RATIO,
    LEAST_CORE_POSITIONS,
    SMOOTH_CORE_SHARE,
    Grown,
    Growth,
)
from palpate.recording.motion import FORCE_RESOLUTION

OPTIONS = IdentifyOptions()


def kinked(noise: float, seed: int = 0) -> SeparableProblem:
    """Returns the fit problem of 200 rows of a force with two kinks, which are 100 rows apart."""
    x = np.linspace(0.0, 1.0, 200)
    y = 2.0 * np.abs(x - 0.25) - 3.0 * np.maximum(x - 0.75, 0.0)
    y = y + np.random.default_rng(seed).normal(0.0, noise, len(x))
    return problem_of(
        Compressor(x[:, None], y, max_positions=2000).rows(), resolved_by=OPTIONS.search.resolved_by
    )


def grown(problem: SeparableProblem) -> Grown:
    return Growth(OPTIONS).grow(problem, Basis.empty(problem.dimension), "position")


def test_without_noise_wavelets_resolve_a_kink() -> None:
    problem = kinked(0.0)
    coarse = problem.finest(Basis(np.ones((1, 1)), np.array([[0.25]])))[0, 0]
    found = grown(problem)
    assert found.problem.resolved_by == LEAST_CORE_POSITIONS
    assert found.solution.basis.alpha.max() > 1.05 * coarse
    assert problem.rmse(found.solution) < 1e-3


@pytest.mark.parametrize("noise", [0.003, 0.03])
def test_noise_is_not_taken_for_structure(noise: float) -> None:
    problem = kinked(noise)
    found = grown(problem)
    assert found.problem.resolved_by == OPTIONS.search.resolved_by
    assert np.all(found.solution.basis.alpha <= problem.finest(found.solution.basis) * (1.0 + 1e-9))


def over_two_inputs(
    law: Callable[[Float1D, Float1D], Float1D], n: int, noise: float = 0.0
) -> SeparableProblem:
    """Returns the fit problem of a force of two inputs at n random points, each input from 0 to 1."""
    random = np.random.default_rng(1)
    x = random.uniform(size=(n, 2))
    y = law(x[:, 0], x[:, 1]) + random.normal(0.0, noise, n)
    return problem_of(Compressor(x, y, max_positions=2000).rows(), resolved_by=OPTIONS.search.resolved_by)


def smooth(x: Float1D, y: Float1D) -> Float1D:
    return np.asarray(x**2 * np.sin(6.0 * y))


def creased(x: Float1D, y: Float1D) -> Float1D:
    return np.asarray(np.abs(x - 0.4) * (1.0 + y))


def errors_between_rows(found: Grown, law: Callable[[Float1D, Float1D], Float1D]) -> Float1D:
    x = np.random.default_rng(2).uniform(size=(2000, 2))
    basis, (coefficients,) = found.solution.basis, found.solution.coefficients
    wavelets = wavelet_columns(x, basis.alpha, basis.beta)
    return np.asarray(np.column_stack([np.ones(len(x)), x, wavelets]) @ coefficients - law(x[:, 0], x[:, 1]))


@pytest.mark.full
def test_smooth_force_over_two_inputs_has_wide_wavelets(monkeypatch: pytest.MonkeyPatch) -> None:
    """Between distant rows, wide wavelets have less than half the error of the best fit of the rows."""
    problem = over_two_inputs(smooth, 200)
    found = grown(problem)
    assert problem.rmse(found.solution) <= FINER_ERROR_RATIO * FORCE_RESOLUTION * problem.force_range
    assert found.problem.resolved_by == OPTIONS.search.resolved_by
    problem = replace(problem, resolved_by=int(SMOOTH_CORE_SHARE * 200))
    widest = problem.finest(found.solution.basis)
    assert np.all(found.solution.basis.alpha <= np.maximum(widest, LEAST_DILATION) * (1.0 + 1e-9))
    monkeypatch.setattr(Growth, "_smooth", lambda *_: None)
    narrow = grown(over_two_inputs(smooth, 200))
    errors = [float(np.linalg.norm(errors_between_rows(each, smooth))) for each in (found, narrow)]
    assert errors[0] < 0.5 * errors[1]


def test_force_with_a_kink_is_grown_as_without_wide_wavelets(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    tried, wide = [], Growth._smooth

    def noted(*given: Any) -> Grown | None:
        tried.append(wide(*given))
        return tried[-1]

    monkeypatch.setattr(Growth, "_smooth", noted)
    problem = over_two_inputs(creased, 60)
    found = grown(problem)
    (smooth,) = tried
    assert smooth is not None
    assert problem.rmse(smooth.solution) > problem.rmse(found.solution)
    monkeypatch.setattr(Growth, "_smooth", lambda *_: None)
    without = grown(over_two_inputs(creased, 60))
    assert np.array_equal(found.solution.coefficients, without.solution.coefficients)


def test_wide_wavelets_are_not_tried_where_there_is_noise(monkeypatch: pytest.MonkeyPatch) -> None:
    def tried(*_: object) -> None:
        raise AssertionError

    monkeypatch.setattr(Growth, "_smooth", tried)
    assert len(grown(over_two_inputs(smooth, 200, noise=0.02)).solution.basis) > 0


def detents(noise: float, seed: int = 0) -> SeparableProblem:
    """Returns the fit problem of a knob with 20 detents of random sign, each five rows wide."""
    random, x = np.random.default_rng(seed), np.linspace(0.0, 1.0, 300)
    alpha, beta = np.full((20, 1), 2.0 * CORE_RADIUS / (5.0 / len(x))), np.linspace(0.03, 0.97, 20)[:, None]
    y = wavelet_columns(x[:, None], alpha, beta) @ random.choice([-1.0, 1.0], 20)
    y = y + random.normal(0.0, noise, len(x))
    return problem_of(
        Compressor(x[:, None], y, max_positions=2000).rows(), resolved_by=OPTIONS.search.resolved_by
    )


def test_correlated_residuals_lead_to_finer_wavelets() -> None:
    problem = detents(0.1)
    found = grown(problem)
    assert found.problem.resolved_by == LEAST_CORE_POSITIONS
    assert len(found.solution.basis) == 20
    assert problem.rmse(found.solution) < 0.11


@pytest.mark.parametrize("seed", range(5))
def test_noise_has_no_neighbour_correlation(seed: int) -> None:
    problem = kinked(0.03, seed)
    (noise,), (unfitted,) = (
        each.residuals for each in (grown(problem).solution, problem.solve(Basis.empty(1)))
    )
    assert neighbour_correlation(noise) * np.sqrt(len(noise)) < 3.0
    assert neighbour_correlation(unfitted) * np.sqrt(len(unfitted)) > 10.0


def sum_of_few_inputs(x: np.ndarray) -> Float1D:
    return np.asarray(
        np.tanh(6.0 * (x[:, 0] - 0.5)) + np.sin(3.0 * x[:, 1] * x[:, 3]) + 0.5 * np.sin(4.0 * x[:, 2])
    )


def over_four_inputs(n: int, noise: float) -> SeparableProblem:
    random = np.random.default_rng(1)
    x = random.uniform(size=(n, 4))
    y = sum_of_few_inputs(x) + random.normal(0.0, noise, n)
    return problem_of(Compressor(x, y, max_positions=n).rows(), resolved_by=OPTIONS.search.resolved_by)


def error_on_fresh_rows(found: Grown) -> float:
    fresh = np.random.default_rng(2).uniform(size=(4000, 4))
    basis, (coefficients,) = found.solution.basis, found.solution.coefficients
    columns = np.hstack([np.ones((len(fresh), 1)), fresh, wavelet_columns(fresh, basis.alpha, basis.beta)])
    return float(np.sqrt(np.mean((columns @ coefficients - sum_of_few_inputs(fresh)) ** 2)))


def test_wavelets_use_only_the_inputs_that_they_need() -> None:
    problem = over_four_inputs(1000 if SCALE == 1 else 3000, 0.02)
    found = grown(problem)
    used = found.solution.basis.used
    assert np.count_nonzero(used.sum(axis=1) <= 2) > 0.6 * len(used)
    assert problem.n_parameters(found.solution.basis) == 2 * used.sum() + len(used) + 5
    assert error_on_fresh_rows(found) < 0.008


@pytest.mark.full
def test_growth_on_parts_of_many_rows_costs_less_at_the_same_error(monkeypatch: pytest.MonkeyPatch) -> None:
    """Counts the rows of all refinement steps: they take most of the time."""
    step, problem = SeparableProblem.normal_equations, over_four_inputs(20_000, 0.05)
    rows, errors = [0, 0], []
    for case, least in enumerate((1000, 20_000)):

        def counted(at: SeparableProblem, solution: Solution, case: int = case) -> tuple[Float2D, Float1D]:
            rows[case] += sum(len(block.target) for block in at.blocks)
            return step(at, solution)

        monkeypatch.setattr(SeparableProblem, "normal_equations", counted)
        monkeypatch.setattr(growth, "LEAST_PART_ROWS", least)
        errors.append(error_on_fresh_rows(grown(problem)))
    assert rows[0] < 0.8 * rows[1]
    assert errors[0] < max(1.5 * errors[1], 0.006)

# SPDX-License-Identifier: Apache-2.0
"""Growth ends with finer wavelets where there is no noise, and only there."""

import numpy as np
import pytest

from palpate._core import wavelet_columns
from palpate.identification import IdentifyOptions
from palpate.identification.compression import Compressor
from palpate.identification.frame import resolved_frame
from palpate.identification.growth import WITHOUT_NOISE, Grown, grow
from palpate.identification.selection import Library
from palpate.identification.separable import CORE, Basis, SeparableProblem, problem_of

OPTIONS = IdentifyOptions()


def kinked(noise: float, seed: int = 0) -> SeparableProblem:
    """Two kinks 100 samples apart."""
    x = np.linspace(0.0, 1.0, 200)
    y = 2.0 * np.abs(x - 0.25) - 3.0 * np.maximum(x - 0.75, 0.0)
    y = y + np.random.default_rng(seed).normal(0.0, noise, len(x))
    return problem_of(Compressor(x[:, None], y, max_positions=2000).rows(), resolved_by=OPTIONS.resolved_by)


def grown(problem: SeparableProblem) -> Grown:
    library = Library(problem, resolved_frame(problem, OPTIONS))
    return grow(problem, library, Basis.empty(1), "position", OPTIONS)


def test_without_noise_wavelets_become_as_fine_as_a_kink_needs() -> None:
    problem = kinked(0.0)
    coarse = problem.finest(np.array([[0.25]]))[0, 0]
    found = grown(problem)
    assert problem.resolved_by == WITHOUT_NOISE
    assert found.solution.basis.alpha.max() > 1.05 * coarse
    assert problem.rmse(found.solution) < 1e-3


@pytest.mark.parametrize("noise", [0.003, 0.03])
def test_noise_is_not_taken_for_structure(noise: float) -> None:
    problem = kinked(noise)
    found = grown(problem)
    assert problem.resolved_by == OPTIONS.resolved_by
    assert np.all(found.solution.basis.alpha <= problem.finest(found.solution.basis.beta) * (1.0 + 1e-9))


def detents(noise: float, seed: int = 0) -> SeparableProblem:
    """A knob with 20 detents of either sign, each five samples wide."""
    random, x = np.random.default_rng(seed), np.linspace(0.0, 1.0, 300)
    alpha, beta = np.full((20, 1), 2.0 * CORE / (5.0 / len(x))), np.linspace(0.03, 0.97, 20)[:, None]
    y = wavelet_columns(x[:, None], alpha, beta) @ random.choice([-1.0, 1.0], 20)
    y = y + random.normal(0.0, noise, len(x))
    return problem_of(Compressor(x[:, None], y, max_positions=2000).rows(), resolved_by=OPTIONS.resolved_by)


def test_where_neighbours_agree_about_what_is_left_wavelets_become_finer() -> None:
    problem = detents(0.1)
    found = grown(problem)
    assert problem.resolved_by == WITHOUT_NOISE
    assert len(found.solution.basis) == 20
    assert problem.rmse(found.solution) < 0.11


@pytest.mark.parametrize("seed", range(5))
def test_neighbours_do_not_agree_about_noise(seed: int) -> None:
    problem = kinked(0.03, seed)
    assert problem.likeness(grown(problem).solution) < 3.0
    assert problem.likeness(problem.solve(Basis.empty(1))) > 10.0

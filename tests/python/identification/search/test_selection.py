# SPDX-License-Identifier: Apache-2.0
"""Forward orthogonal least squares equals least squares, one wavelet at a time."""

import itertools

import numpy as np
import pytest

from palpate._core.model import wavelet_columns
from palpate.identification.data.compression import Compressed, Compressor
from palpate.identification.network.basis import Basis, truncated_frame
from palpate.identification.network.separable import SeparableProblem, problem_of
from palpate.identification.search.evidence import CRITERIA, ON_HELD_OUT_ROWS, deviance
from palpate.identification.search.selection import (
    LEAST_DISTANCE,
    STRETCH_FACTORS,
    Library,
    OrderLibrary,
    OrthogonalSelection,
    orthogonal_gains,
)

SIDES = {"one force": None, "two strokes": 1.0, "play": 0.7}


def rows_of(kind: str) -> Compressed:
    random = np.random.default_rng(7)
    x = np.tile(np.linspace(0.0, 1.0, 120), 2)
    amplitude = SIDES[kind]
    side = None if amplitude is None else np.repeat([1.0, -amplitude], 120)
    y = np.sin(9.0 * x) * x + random.normal(0.0, 0.05, len(x))
    if side is not None:
        y = y + side * (0.3 + 0.2 * np.cos(12.0 * x))
    return Compressor(x[:, None], y, max_positions=1000).rows(side)


def library_of(problem: SeparableProblem, rows: Compressed) -> Library:
    frame = truncated_frame(
        rows.positions, coarsest=1.0, finest=32.0, frame_scale=2.0, frame_step=1.0, max_candidates=10**6
    )
    return Library(problem, frame)


def selected(problem: SeparableProblem, library: Library, most: int) -> tuple[list[int], list[float]]:
    """Returns the candidates that forward selection takes, and the squared error after each."""
    selection = OrthogonalSelection(library, problem.solve(Basis.empty(problem.dimension)))
    order: list[int] = []
    errors: list[float] = []
    while len(order) < most and (gains := selection.gains()).max() > 0.0:
        order.append(int(np.argmax(gains)))
        errors.append(selection.take(order[-1]))
    return order, errors


@pytest.mark.parametrize("kind", SIDES)
def test_gains_equal_those_of_a_new_least_squares(kind: str) -> None:
    rows = rows_of(kind)
    problem = problem_of(rows, resolved_by=5)
    library = library_of(problem, rows)
    start = problem.solve(Basis(np.array([[6.0]]), np.array([[0.3]])))
    gains = OrthogonalSelection(library, start).gains()
    np.testing.assert_allclose(orthogonal_gains(library, start), gains, rtol=1e-5, atol=1e-7 * gains.max())
    x = np.unique(rows.positions)[:, None]
    fixed = np.concatenate(
        [np.ones_like(x), x, wavelet_columns(x, start.basis.alpha, start.basis.beta)], axis=1
    )
    before = np.linalg.qr(fixed)[0]
    for index in np.argsort(gains)[-5:]:
        added = Basis(library.basis.alpha[[index]], library.basis.beta[[index]])
        direct = start.rss - problem.solve(start.basis.joined(added)).rss
        # the wavelet library has single precision, and orthogonalisation amplifies the rounding errors
        column = wavelet_columns(x, added.alpha, added.beta)[:, 0]
        new = column - before @ (before.T @ column)
        rounding = float(np.finfo(np.float32).eps) * (column @ column) / (new @ new)
        assert gains[index] == pytest.approx(direct, rel=16.0 * rounding)


@pytest.mark.parametrize("kind", SIDES)
def test_gains_of_orders_equal_those_of_a_new_least_squares(kind: str) -> None:
    problem = problem_of(rows_of(kind), resolved_by=5)
    orders = OrderLibrary(problem)
    assert orders.orders.tolist() == list(range(1, 60))  # 120 positions, of which two are equal in a period
    start = problem.solve(
        Basis(np.array([[6.0]]), np.array([[0.3]])).joined(Basis.of_orders(np.array([3.0])))
    )
    gains = OrthogonalSelection(orders, start).gains()
    assert gains[2] < 1e-6 * gains.max()
    for index in [0, 1, 5, 40]:
        one = Basis.of_orders(orders.orders[[index]])
        direct = start.rss - problem.solve(start.basis.joined(one)).rss
        assert gains[index] == pytest.approx(direct, rel=1e-4, abs=1e-6 * start.rss)


@pytest.mark.parametrize("kind", SIDES)
def test_updated_factors_give_the_error_of_a_new_least_squares_along_the_whole_path(kind: str) -> None:
    rows = rows_of(kind)
    problem = problem_of(rows, resolved_by=5)
    library = library_of(problem, rows)
    order, errors = selected(problem, library, 12)
    assert len(order) == 12
    for n in range(1, len(order) + 1):
        chosen = np.array(order[:n])
        direct = problem.solve(Basis(library.basis.alpha[chosen], library.basis.beta[chosen]))
        assert errors[n - 1] == pytest.approx(direct.rss, rel=1e-6)


def test_candidate_in_the_design_has_zero_gain_and_is_not_taken_twice() -> None:
    rows = rows_of("one force")
    problem = problem_of(rows, resolved_by=5)
    twice = Basis(np.array([[8.0], [8.0], [3.0]]), np.array([[0.4], [0.4], [0.6]]))
    order, _ = selected(problem, Library(problem, twice), 5)
    assert len(order) == 2
    assert 2 in order


def test_selection_finds_the_generating_wavelets() -> None:
    x = np.linspace(0.0, 1.0, 300)
    u, v = 16.0 * (x - 0.5), 8.0 * (x - 0.25)
    y = 1.0 + 2.0 * x + 3.0 * (u * u - 1) * np.exp(-u * u / 2) - 2.0 * (v * v - 1) * np.exp(-v * v / 2)
    rows = Compressor(x[:, None], y, max_positions=1000).rows()
    problem = problem_of(rows, resolved_by=5)
    library = library_of(problem, rows)
    order, _ = selected(problem, library, 2)
    chosen = {(library.basis.alpha[i, 0], library.basis.beta[i, 0]) for i in order}
    assert chosen == {(16.0, 0.5), (8.0, 0.25)}


def test_stretched_members_differ_from_a_member_in_one_dilation() -> None:
    X = np.random.default_rng(1).uniform(size=(400, 2))
    problem = problem_of(Compressor(X, X[:, 0], max_positions=1000).rows(), resolved_by=5)
    round_ones = Library(
        problem, Basis(np.array([[2.0, 2.0], [4.0, 4.0]]), np.array([[0.3, 0.5], [0.7, 0.2]]))
    )
    stretched = round_ones.stretched(problem, [1, 0]).basis
    assert len(stretched) == 2 * (1 + 2 * len(STRETCH_FACTORS))
    for alpha, beta in zip(stretched.alpha, stretched.beta, strict=True):
        own = int(np.flatnonzero((round_ones.basis.beta == beta).all(axis=1))[0])
        changed = alpha != round_ones.basis.alpha[own]
        assert changed.sum() <= 1
        assert set(alpha[changed] / round_ones.basis.alpha[own][changed]) <= set(STRETCH_FACTORS)


def test_distinct_candidates_differ_in_position_or_dilation() -> None:
    rows = rows_of("one force")
    library = library_of(problem_of(rows, resolved_by=5), rows)
    chosen = library.distinct(np.arange(len(library)), 8)
    assert len(chosen) == 8
    for first, second in itertools.combinations(chosen, 2):
        alpha, beta = library.basis.alpha[[first, second], 0], library.basis.beta[[first, second], 0]
        apart = abs(beta[0] - beta[1]) * np.sqrt(alpha[0] * alpha[1])
        assert max(apart, abs(np.log(alpha[0] / alpha[1]))) > LEAST_DISTANCE


@pytest.mark.parametrize("criterion", sorted(set(CRITERIA) - set(ON_HELD_OUT_ROWS)))
def test_every_criterion_rises_with_parameters_and_falls_with_error(criterion: str) -> None:
    assert deviance(criterion, 1.0, 100, 5) < deviance(criterion, 1.0, 100, 6)
    assert deviance(criterion, 0.9, 100, 5) < deviance(criterion, 1.0, 100, 5)


def test_bic_price_is_the_logarithm_of_the_number_of_samples() -> None:
    assert deviance("bic", 50.0, 1000, 7) == pytest.approx(1000 * np.log(0.05) + 7 * np.log(1000))

# SPDX-License-Identifier: Apache-2.0
"""The paper's network: selections, quasi-Newton refinement, and the force without an assumed motion."""

from dataclasses import replace

import numpy as np
import pytest

from conftest import sampled
from palpate import InputError, Model, Recording, identify
from palpate._core.dynamics import environment_filters
from palpate.baselines import PaperNetwork, paper_force
from palpate.baselines.paper import (
    SELECTIONS,
    backward_order,
    gradient,
    orthogonal_order,
    refine_all,
    residual_order,
    solved,
)
from palpate.identification.data.compression import Compressor
from palpate.identification.network.basis import Basis, truncated_frame
from palpate.identification.network.separable import (
    LARGEST_OVERHANG,
    LEAST_DILATION,
    SeparableProblem,
    problem_of,
)
from palpate.identification.search.selection import Library
from palpate.recording import sample_force, sample_recording


def wall(n: int, seed: int, noise: float = 0.02) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Returns positions, exact force and recorded force of a spring with a wall."""
    random = np.random.default_rng(seed)
    x = random.uniform(0.0, 0.6, n)
    truth = 2.0 * x + 58.0 * 0.01 * np.logaddexp(0.0, (x - 0.4) / 0.01)
    return x, truth, truth + random.normal(0.0, noise, n)


def problem_from(x: np.ndarray, y: np.ndarray) -> SeparableProblem:
    return problem_of(Compressor(x[:, None], y, max_positions=1000).rows(), resolved_by=7)


def noisy_switch(seed: int) -> SeparableProblem:
    x = np.linspace(0.0, 1.0, 400)
    y = x + 0.4 * np.exp(-(((x - 0.4) / 0.05) ** 2)) + 3.0 * np.maximum(x - 0.9, 0.0)
    return problem_from(x, y + np.random.default_rng(seed).normal(0.0, 0.01, len(x)))


def any_basis(seed: int, n: int = 5) -> Basis:
    random = np.random.default_rng(seed)
    return Basis(random.uniform(2.0, 25.0, (n, 1)), random.uniform(-0.1, 1.1, (n, 1)))


def two_wavelets() -> tuple[SeparableProblem, Library]:
    """Returns the problem of a force of two wavelets of a frame, and this frame."""
    x = np.linspace(0.0, 1.0, 300)
    u, v = 16.0 * (x - 0.5), 8.0 * (x - 0.25)
    y = 1.0 + 2.0 * x + 3.0 * (u * u - 1) * np.exp(-u * u / 2) - 2.0 * (v * v - 1) * np.exp(-v * v / 2)
    rows = Compressor(x[:, None], y, max_positions=1000).rows()
    frame = truncated_frame(
        rows.positions, coarsest=1.0, finest=32.0, frame_scale=2.0, frame_step=1.0, max_candidates=10**6
    )
    problem = problem_of(rows, resolved_by=5)
    return problem, Library(problem, frame)


NETWORKS = [(selection, quasi_newton) for selection in SELECTIONS for quasi_newton in (False, True)]


@pytest.mark.parametrize(
    ("selection", "quasi_newton"),
    sampled(NETWORKS, ("orthogonal", True), *((selection, False) for selection in SELECTIONS)),
)
def test_every_selection_finds_a_wall(selection: str, quasi_newton: bool) -> None:
    x, truth, y = wall(1000, 1)
    network = PaperNetwork(selection, quasi_newton=quasi_newton)
    assert network.fit(x[:, None], y) is network
    assert np.std(network.predict(x[:, None]) - truth) < (0.008 if quasi_newton else 0.01)
    assert 1 <= network.n_wavelets_ <= 30
    assert network.n_parameters_ == 3 * network.n_wavelets_ + 2


def test_quasi_newton_lowers_the_error_of_the_same_wavelets() -> None:
    x, truth, y = wall(1000, 1, noise=0.001)
    kept, moved = (PaperNetwork(quasi_newton=each).fit(x[:, None], y) for each in (False, True))
    errors = [float(np.std(each.predict(x[:, None]) - truth)) for each in (kept, moved)]
    assert kept.n_wavelets_ == moved.n_wavelets_
    assert errors[1] < 0.8 * errors[0]


def test_a_network_over_two_inputs_is_fitted() -> None:
    X = np.random.default_rng(0).uniform(-1.0, 1.0, (1500, 2)) * [2.0, 0.01]
    y = np.exp(-((X[:, 0] - 0.3) ** 2)) * (1.0 + 40.0 * X[:, 1])
    network = PaperNetwork().fit(X, y)
    assert np.std(network.predict(X) - y) < 0.05 * np.std(y)
    assert network.n_parameters_ == 5 * network.n_wavelets_ + 3


def test_few_rows_leave_fewer_parameters_than_rows() -> None:
    random = np.random.default_rng(0)
    network = PaperNetwork().fit(random.uniform(size=(20, 2)), random.normal(size=20))
    assert network.n_parameters_ < 20


def test_noise_alone_needs_no_wavelet() -> None:
    x = np.linspace(0.0, 1.0, 500)
    network = PaperNetwork(quasi_newton=True).fit(
        x[:, None], 3.0 * x + np.random.default_rng(1).normal(0.0, 0.1, 500)
    )
    assert network.n_wavelets_ == 0
    assert network.predict(np.array([[0.0], [1.0]])) == pytest.approx([0.0, 3.0], abs=0.05)


def test_orthogonal_selection_takes_the_generating_wavelets_first() -> None:
    problem, library = two_wavelets()
    chosen = library.members(orthogonal_order(problem, library, 2))
    assert {*zip(chosen.alpha[:, 0], chosen.beta[:, 0], strict=True)} == {(16.0, 0.5), (8.0, 0.25)}


def test_residual_selection_takes_the_best_fit_of_the_residual() -> None:
    problem, library = two_wavelets()
    order = residual_order(problem, library, 6)
    assert len(set(order)) == 6
    current = solved(problem, library.members(order[:5]))
    residual, x = current.residuals[0], problem.blocks[0].positions
    gains = []
    for index in range(len(library)):
        column = np.sqrt(problem.blocks[0].channels[:, 0] ** 2) * library.members([index]).columns(x)[:, 0]
        gains.append((column @ residual) ** 2 / (column @ column))
    assert order[5] == int(np.argmax(np.where(np.isin(np.arange(len(library)), order[:5]), -1.0, gains)))


def test_backward_selection_removes_the_wavelet_that_raises_the_error_least() -> None:
    problem, library = two_wavelets()
    order = backward_order(problem, library, 8)
    assert sorted(order) == sorted(orthogonal_order(problem, library, 8))
    for size in range(2, len(order) + 1):
        errors = [
            solved(problem, library.members([*order[:gone], *order[gone + 1 : size]])).rss
            for gone in range(size)
        ]
        assert errors[-1] <= 1.01 * min(errors) + 1e-12


@pytest.mark.parametrize("seed", range(3))
def test_refinement_is_better_than_its_start_and_keeps_the_resolution(seed: int) -> None:
    problem = noisy_switch(seed)
    start = problem.solve(any_basis(seed, 8))
    refined = refine_all(problem, start)
    assert refined.objective < start.objective
    assert np.all(refined.basis.alpha >= LEAST_DILATION)
    assert np.all(refined.basis.alpha <= np.maximum(problem.finest(refined.basis), LEAST_DILATION))


def test_a_translation_ends_at_its_bound() -> None:
    """The force is that of a wavelet whose centre is too far outside the positions."""
    x = np.linspace(0.0, 1.0, 400)
    u = 3.0 * (x - 1.8)
    problem = problem_from(x, (u * u - 1.0) * np.exp(-0.5 * u * u))
    refined = refine_all(problem, problem.solve(Basis(np.array([[3.0]]), np.array([[1.2]]))))
    assert refined.basis.beta[0, 0] == pytest.approx(1.0 + LARGEST_OVERHANG, abs=1e-6)


def test_quasi_newton_descends_along_the_gradient_of_all_parameters() -> None:
    """Checks the gradient of the error by central differences in a random direction of all parameters."""
    problem, basis = replace(noisy_switch(1), prior=1.0), any_basis(2)
    random, coefficients = np.random.default_rng(3), problem.solve(basis).coefficients[0]
    along = [random.normal(size=each.shape) for each in (coefficients, basis.alpha, basis.beta)]

    def value(step: float) -> float:
        moved = Basis(basis.alpha * np.exp(step * along[1]), basis.beta + step * along[2])
        return gradient(problem, coefficients + step * along[0], moved)[0]

    slopes = gradient(problem, coefficients, basis)[1:]
    slope = sum(float((by * way).sum()) for by, way in zip(slopes, along, strict=True))
    assert (value(1e-6) - value(-1e-6)) / 2e-6 == pytest.approx(slope, rel=1e-5)


@pytest.mark.parametrize(
    ("call", "sentence"),
    [
        (
            lambda: PaperNetwork("forward"),
            "selection is 'forward': must be one of orthogonal, residual, back",
        ),
        (
            lambda: PaperNetwork().fit(np.full((20, 1), 2.0), np.arange(20.0)),
            "column 0 of X is 2 in every",
        ),
        (lambda: PaperNetwork().fit(np.arange(20.0)[:, None], np.full(20, np.nan)), "y contains nan"),
    ],
)
def test_impossible_networks_are_refused(call: object, sentence: str) -> None:
    with pytest.raises(InputError, match=sentence):
        call()  # type: ignore[operator]


def spring(rate: float, *, mass: float = 0.0, damping: float = 0.0) -> Recording:
    """Returns a recording of a spring of 3 N*m/rad with mass and damping, moved sinusoidally."""
    t = np.arange(0.0, 10.0, 1e-3)
    x = 0.3 * np.sin(rate * t)
    force = 3.0 * x - mass * rate**2 * x + damping * 0.3 * rate * np.cos(rate * t)
    return Recording.from_arrays(x, force, time=t)


@pytest.mark.parametrize("moving", [{"mass": 0.02}, {"mass": 0.02, "damping": 0.5}], ids=["11", "13"])
def test_a_slow_motion_leaves_the_static_force(moving: dict[str, float]) -> None:
    """G I is within 5 % of 1 well below 100 rad/s; the remaining m and B_o are small."""
    recording = spring(4.0, **moving)
    left = paper_force(recording, **moving)[200:]
    wrong = np.abs(left - 3.0 * recording.position[200:]).max()
    assert wrong < 0.1 * np.abs(recording.force - 3.0 * recording.position).max() + 0.01


def test_paper_force_is_the_force_minus_filtered_motion() -> None:
    recording = spring(20.0)
    for name, damping in (("implicit", None), ("explicit", 0.2)):
        pair = environment_filters(name)
        velocity = pair.g2.filter(recording.position)
        expected = recording.force - 0.01 * pair.g1.filter(velocity) - (damping or 0.0) * velocity
        np.testing.assert_allclose(paper_force(recording, mass=0.01, damping=damping), expected, atol=1e-12)


@pytest.mark.full
def test_matched_identification_of_a_moving_object_is_closer_to_its_force() -> None:
    """Known truth: the lag of the paper causes an error, the matched route uses raw positions and forces."""
    recording = sample_recording(1, duration_s=20.0)
    x = np.linspace(-0.2, 0.469, 2001)

    def error(model: Model) -> float:
        return float(np.sqrt(np.mean((model.force(x) - sample_force(x)) ** 2)))

    def of_paper(**moving: float) -> float:
        force = paper_force(recording, mass=1e-3, **moving)
        return error(identify(recording.position, force, inputs="position"))

    assert error(identify(recording)) < 0.25 * of_paper() < 0.25 * of_paper(damping=0.5)


def test_recordings_that_the_filters_do_not_fit_are_refused() -> None:
    x = np.linspace(0.0, 1.0, 100)
    with pytest.raises(InputError, match=r"the recording has no time, .* read it with time=NAME"):
        paper_force(Recording.from_arrays(x, x), mass=1e-3)
    late = Recording.from_arrays(x, x, time=0.01 * np.arange(100))
    with pytest.raises(InputError, match=r"are 0.01 to 0.01 s: the paper's filters need 0.001 s"):
        paper_force(late, mass=1e-3)
    with pytest.raises(InputError, match="damping is nan; it must be a finite number"):
        paper_force(spring(4.0), mass=1e-3, damping=np.nan)

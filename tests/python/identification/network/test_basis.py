# SPDX-License-Identifier: Apache-2.0
"""The computed frame bounds agree with the digits of a published estimate; also of a finite frame."""

import numpy as np
import pytest

from palpate import InputError, frame_bounds
from palpate._core.model import wavelet_columns
from palpate.identification.network.basis import MOST_DISTANCES, Basis, Resolution, truncated_frame

# Unit-norm Mexican hat, a0 = 2: b0 -> (A, B) for 1, 2 and 4 voices; the frame table of section 2 of the
# mathematics that the package implements (Daubechies 1990, table of the Mexican hat).
TABLE = {
    0.25: [(13.091, 14.184), (27.273, 27.278), (54.552, 54.552)],
    0.50: [(6.545, 7.092), (13.637, 13.639), (27.276, 27.276)],
    1.00: [(3.223, 3.596), (6.768, 6.870), (13.586, 13.690)],
    1.50: [(0.325, 4.221), (2.608, 6.484), (6.593, 11.591)],
}


@pytest.mark.parametrize("b0", TABLE)
@pytest.mark.parametrize("voices", [1, 2, 4])
def test_frame_bounds_are_those_of_the_published_table_to_every_printed_digit(b0: float, voices: int) -> None:
    expected = TABLE[b0][{1: 0, 2: 1, 4: 2}[voices]]
    assert frame_bounds(2.0, b0, voices) == pytest.approx(expected, abs=5.01e-4)


def test_bounds_enclose_the_energy_of_a_function_in_the_frame() -> None:
    """A |f|^2 <= sum |<f, psi_mk>|^2 <= B |f|^2: the law behind the table, summed on a grid.

    f has almost no energy in wavelets narrower than 1/8.
    """
    x = np.linspace(-60.0, 60.0, 12001)
    f = np.exp(-0.5 * (x - 0.3) ** 2) * np.cos(1.7 * x)
    dx = x[1] - x[0]
    energy = 0.0
    for m in range(-3, 7):
        scale = 2.0**m
        for k in np.arange(-np.floor(50 / scale), np.floor(50 / scale) + 1):
            u = x / scale - k
            psi = scale**-0.5 * 2 / np.sqrt(3) * np.pi**-0.25 * (1 - u * u) * np.exp(-0.5 * u * u)
            energy += (np.sum(psi * f) * dx) ** 2
    low, high = frame_bounds(2.0, 1.0)
    assert low <= energy / (np.sum(f * f) * dx) <= high


def test_three_vectors_of_the_plane_are_a_tight_frame() -> None:
    """Example frame of the paper, section 2.4: T'T = 1.5 I, and its three coefficients reconstruct (1, 1)."""
    half, root = 0.5, np.sqrt(3.0) / 2.0
    frame = np.array([[0.0, 1.0], [root, half], [root, -half]])
    np.testing.assert_allclose(frame.T @ frame, 1.5 * np.eye(2), atol=1e-15)
    dual = np.linalg.pinv(frame)
    third = np.sqrt(3.0) / 3.0
    np.testing.assert_allclose(dual, [[0.0, third, third], [2 / 3, 1 / 3, -1 / 3]], atol=1e-15)
    np.testing.assert_allclose(dual @ [1.0, root + half, root - half], [1.0, 1.0], atol=1e-15)


@pytest.mark.parametrize(
    ("arguments", "named"), [((1.0, 1.0), "a0"), ((2.0, 0.0), "b0"), ((2.0, 1.0, 0), "voices")]
)
def test_an_impossible_frame_is_refused_by_name(arguments: tuple[float, ...], named: str) -> None:
    with pytest.raises(InputError, match=named):
        frame_bounds(*arguments)  # type: ignore[arg-type]


@pytest.mark.parametrize("dimension", [1, 2])
def test_every_member_of_the_truncated_frame_has_data_within_it(dimension: int) -> None:
    positions = np.random.default_rng(4).uniform(size=(50, dimension)) ** 3
    frame = truncated_frame(
        positions, coarsest=1.0, finest=64.0, frame_scale=2.0, frame_step=0.5, max_candidates=10**6
    )
    assert set(frame.alpha[:, 0]) == {1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0}
    u = frame.alpha[:, None] * (positions - frame.beta[:, None])
    nearest = np.linalg.norm(u, axis=2).min(axis=1)
    assert nearest.max() <= 0.75 * np.sqrt(dimension) + 1e-12


def test_truncated_frame_ends_within_first_level_above_the_limit() -> None:
    positions = np.linspace(0.0, 1.0, 1000)[:, None]
    frame = truncated_frame(
        positions, coarsest=1.0, finest=400.0, frame_scale=2.0, frame_step=0.5, max_candidates=100
    )
    assert len(frame) == 100
    assert frame.alpha.max() == 32.0


@pytest.mark.parametrize("dimension", [1, 2, 3])
@pytest.mark.parametrize("count", [1, 2, 7, 40])
def test_reach_contains_the_given_number_of_positions(dimension: int, count: int) -> None:
    random = np.random.default_rng(count)
    positions = random.normal(size=(40, dimension)).round(6)
    places = np.concatenate([random.normal(scale=2.0, size=(200, dimension)), positions[:5]])
    at_places = Basis(np.ones_like(places), places)
    resolution = Resolution(np.repeat(positions, 2, axis=0))
    assert len(resolution) == 40
    distance = np.linalg.norm(places[:, None] - positions, axis=2)
    np.testing.assert_allclose(
        resolution.reach(at_places, count), np.sort(distance, axis=1)[:, count - 1], atol=1e-12
    )


def test_reach_counts_distinct_positions_over_the_used_inputs() -> None:
    random = np.random.default_rng(3)
    positions = np.column_stack([np.repeat([0.0, 0.5, 1.0], 40), random.uniform(size=(120, 4))])
    resolution = Resolution(positions)
    place = np.full((1, 5), 0.4)
    first = Basis(np.ones((1, 1)), place[:, :1]).over([0], 5)
    assert resolution.reach(first, 3) == pytest.approx([0.6])
    assert resolution.reach(first, 4) == [np.inf]
    for inputs in ([1], [1, 3], [0, 2, 4], [1, 2, 3, 4]):
        distance = np.linalg.norm(positions[:, inputs] - place[:, inputs], axis=1)
        some = Basis(np.ones((1, len(inputs))), place[:, inputs]).over(inputs, 5)
        assert resolution.reach(some, 7) == pytest.approx([np.sort(distance)[6]])


@pytest.mark.parametrize("rows", [MOST_DISTANCES, MOST_DISTANCES + 1, 5 * MOST_DISTANCES])
def test_reach_among_many_positions_of_many_inputs_is_of_the_right_size(rows: int) -> None:
    positions = np.random.default_rng(4).uniform(size=(rows, 5))
    places = Basis(np.ones((20, 5)), positions[:20])
    exact = np.sort(np.linalg.norm(positions[:20, None] - positions, axis=2), axis=1)[:, 6]
    assert np.median(Resolution(positions).reach(places, 7) / exact) == pytest.approx(1.0, abs=0.35)


def test_harmonics_stay_behind_the_wavelets_and_leave_in_pairs() -> None:
    hats = Basis(np.array([[3.0], [9.0]]), np.array([[0.3], [0.8]]))
    joined = Basis.of_orders(np.array([2.0])).joined(hats).joined(Basis.of_orders(np.array([5.0])))
    assert (joined.hats, joined.harmonics, joined.size, len(joined)) == (2, 4, 4, 6)
    x = np.linspace(-0.2, 1.3, 40)
    waves = [wave(2.0 * np.pi * n * x) for n in (2.0, 5.0) for wave in (np.cos, np.sin)]
    expected = np.column_stack([wavelet_columns(x[:, None], hats.alpha, hats.beta), *waves])
    assert joined.columns(x[:, None]) == pytest.approx(expected, abs=1e-13)
    step = 1e-6
    differences = (joined.columns(x[:, None] + step) - joined.columns(x[:, None] - step)) / (2.0 * step)
    assert joined.slopes(x) == pytest.approx(differences, abs=1e-6)
    assert not joined.used[2:].any()
    assert joined.without(2).columns(x[:, None]) == pytest.approx(expected[:, [0, 1, 4, 5]], abs=1e-13)
    assert joined.without(0).columns(x[:, None]) == pytest.approx(expected[:, 1:], abs=1e-13)
    assert joined.without_harmonics().alpha.tolist() == hats.alpha.tolist()


def test_the_widest_gap_of_a_period_includes_its_ends() -> None:
    positions = np.array([[0.1], [0.15], [0.4], [1.2], [-0.5]])
    assert Resolution(positions).widest_gap() == pytest.approx(0.6)  # from 0.5 to 1.1


def test_a_wavelet_does_not_change_along_an_unused_input() -> None:
    one = Basis(np.array([[3.0]]), np.array([[0.3]])).over([1], 3)
    x = np.random.default_rng(5).uniform(size=(1000, 3))
    moved = x.copy()
    moved[:, [0, 2]] = np.random.default_rng(6).uniform(size=(1000, 2))
    values = wavelet_columns(x, one.alpha, one.beta)
    assert np.abs(values - wavelet_columns(moved, one.alpha, one.beta)).max() < 1e-7 * np.abs(values).max()
    assert np.array_equal(one.used, [[False, True, False]])
    both = Basis(np.ones((1, 3)), np.zeros((1, 3))).without_input(0, 2)
    assert np.array_equal(both.used, [[True, True, False]])

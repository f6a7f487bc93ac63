# SPDX-License-Identifier: Apache-2.0
"""The reported error is the error of the rows; findings name forces that no input explains."""

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

import palpate
from conftest import measured_data, sampled
from imperfect import Array, noise, recorded, strokes, sweep, wall
from palpate import WaveletNetworkRegressor

N = 4000
X = strokes(N)
Y = wall(X) + noise(N)
PLAIN = palpate.identify(recorded(X, Y))


def test_reported_nrmse_is_that_of_the_rows() -> None:
    residual = Y - PLAIN.force(X)
    assert PLAIN.fit.nrmse == pytest.approx(np.sqrt(np.mean(residual**2)) / np.std(Y), rel=1e-9)
    assert PLAIN.fit.nrmse == pytest.approx(palpate.verify(PLAIN, recorded(X, Y)).nrmse, rel=1e-9)


@pytest.mark.parametrize("scale", sampled([2.0**170, 2.0**300, 2.0**-170, 2.0**-300], 2.0**300, 2.0**-300))
def test_force_of_any_size_gives_the_same_model(scale: float) -> None:
    model = palpate.identify(recorded(X, scale * Y))
    assert model.n_wavelets == PLAIN.n_wavelets
    assert model.fit.nrmse == pytest.approx(PLAIN.fit.nrmse, rel=1e-6)
    np.testing.assert_allclose(model.force(X) / scale, PLAIN.force(X), atol=1e-6)
    regressor = WaveletNetworkRegressor().fit(X[:, None], scale * Y)
    assert regressor.n_wavelets_ >= 3
    assert regressor.score(X[:, None], scale * Y) > 0.9999


@pytest.mark.parametrize("offset", sampled([1e6, 1e9, -1e12], 1e6, -1e12))
def test_wall_is_found_with_force_offset(offset: float) -> None:
    model = palpate.identify(recorded(X, Y + offset))
    assert model.n_wavelets == PLAIN.n_wavelets
    assert model.fit.nrmse == pytest.approx(PLAIN.fit.nrmse, rel=0.01)
    assert model.below == "linear"


@pytest.mark.parametrize("offset", sampled([1e6, 1e9], 1e9))
def test_wall_is_found_with_position_offset(offset: float) -> None:
    model = palpate.identify(recorded(X + offset, Y))
    assert model.n_wavelets >= 3
    assert model.fit.nrmse == pytest.approx(PLAIN.fit.nrmse, rel=0.01)


def test_ordinary_forces_are_not_touched() -> None:
    scaled = palpate.identify(recorded(X, 2.0**-20 * Y))
    np.testing.assert_array_equal(scaled.alpha, PLAIN.alpha)
    assert not any("multiplied" in note for note in scaled.notes["identification"])


@pytest.mark.full
def test_slope_bounds_hold_for_huge_forces() -> None:
    scale = 2.0**170
    model = palpate.identify(recorded(X, scale * Y), slope_bounds=(0.0, 30.0 * scale))
    plain = palpate.identify(recorded(X, Y), slope_bounds=(0.0, 30.0))
    assert model.slope_bounds is not None
    assert plain.slope_bounds is not None
    assert model.slope_bounds[1] == pytest.approx(plain.slope_bounds[1] * scale, rel=1e-3)
    assert model.fit.nrmse == pytest.approx(plain.fit.nrmse, rel=0.01)


@pytest.mark.parametrize(
    ("x", "y", "words"),
    [
        (X, Y * 1e150, "force reaches"),
        (X, Y * 1e-150, "the largest .force. is"),
        (X * 1e200, Y, "position reaches"),
        (X * 1e-200, Y, "position has a range of"),
    ],
)
def test_numbers_beyond_the_bound_are_refused_with_it(x: Array, y: Array, words: str) -> None:
    with pytest.raises(palpate.InputError, match=rf"{words} .*e[+-]\d+: .*Use another unit"):
        palpate.identify(recorded(x, y))


@pytest.mark.parametrize("scale", [1e154, 1e200, 1e300, -1e300, 2.9e307])
@pytest.mark.parametrize("out_of_core", [False, True], ids=["in_memory", "out_of_core"])
def test_a_file_of_forces_beyond_the_bound_is_refused_without_warnings(
    tmp_path: Path, scale: float, out_of_core: bool
) -> None:
    x = np.tile(np.concatenate([np.linspace(0.0, 4.0, 400), np.linspace(4.0, 0.0, 400)]), 2)
    side = np.tile(np.repeat([0.1, -0.1], 400), 2)
    table = np.column_stack([x, scale * (np.sin(5.0 * x) + 2.0 * x - 3.0 + side)])
    np.savetxt(tmp_path / "a.csv", table, delimiter=",", header="depth_mm,force_N", comments="")
    with pytest.raises(palpate.InputError, match=r"force reaches .*: must be at most 1e\+100"):
        (palpate.identify_files if out_of_core else palpate.identify)(tmp_path / "a.csv")
    with pytest.raises(palpate.InputError, match=r"force reaches .*: must be at most 1e\+100"):
        palpate.verify(PLAIN, tmp_path / "a.csv")


def test_constant_force_is_a_constant() -> None:
    model = palpate.identify(recorded(X, np.full(N, 3.0)))
    assert (model.n_wavelets, model.fit.nrmse) == (0, 0.0)
    assert model.force(0.3) == pytest.approx(3.0)


def test_noise_alone_gives_no_wavelet() -> None:
    model = palpate.identify(recorded(X, np.random.default_rng(3).normal(size=N)))
    assert model.n_wavelets == 0
    assert model.verdict.level == "no"


def test_a_force_within_the_recorded_ones_gives_no_finding() -> None:
    rows = sweep(400)
    model = palpate.identify(recorded(rows, wall(rows) + noise(400)))
    assert not any("between the rows" in reason for reason in model.verdict.reasons)


def test_a_force_that_pulls_in_no_row_does_not_pull_between_them() -> None:
    x = np.r_[-8e-5, np.linspace(0.0, 3e-3, 40)]
    x = np.r_[x, x[::-1]]
    side, share = np.repeat([1.0, -1.0], 41), np.maximum(x, 0.0) / 3e-3
    button = (6.0 + 0.3 * side) * (1.0 - np.exp(-share / 0.02)) + 3.0 * share
    click = 3.0 * np.exp(-(((share - 0.4) / 0.05) ** 2))
    force = button - click + np.random.default_rng(3).normal(0.0, 0.03, len(x))
    model = palpate.identify(palpate.Recording.from_arrays(x, force, direction=side))
    before = np.linspace(-1e-4, 0.0, 101)
    press, release = (model.force(before, direction=np.full(101, side)) for side in (1.0, -1.0))
    assert min(press.min(), release.min()) > -0.1  # -1.01 N without the rule
    assert model.force(-8e-5, direction=1.0) == pytest.approx(0.0, abs=0.05)


def test_waits_outside_the_domain_are_compared_with_the_force_that_the_model_has_there() -> None:
    """The tool waits in air; between few rows before the contact a network has a force, its continuation has
    none."""
    u = np.r_[0.0, np.arange(0.0, 4.0, 1.0 / 30.0)]
    x, press = 1.02 * (1.0 - np.abs(1.0 - u % 2.0)) - 0.02, np.where(u % 2.0 < 1.0, 1.0, -1.0)
    pad = np.maximum(x, 0.0)
    force = 50.0 * (0.4 * np.tanh(10.0 * pad) + 0.2 * pad + pad**5) * (1.0 + 0.2 * press)
    force += np.random.default_rng(0).normal(0.0, 0.1, len(x))
    recording = palpate.Recording.from_arrays(0.02 * x, force, time=0.05 * np.arange(float(len(x))))
    assert palpate.identify(recording, inputs=("position", "hysteresis")).verdict.level == "good"


def cycles(count: int, drift: float, side: bool = False) -> palpate.Recording:
    """Returns presses and releases of a wall, with a zero that moves evenly by `drift`."""
    x = np.tile(np.r_[np.linspace(0.0, 1.0, 40), np.linspace(1.0, 0.0, 40)], count)
    force = (
        2.0 * x + 20.0 * np.maximum(x - 0.7, 0.0) ** 2 + np.random.default_rng(8).normal(0.0, 0.02, len(x))
    )
    force += drift * np.linspace(0.0, 1.0, len(x))
    direction = np.tile(np.repeat([1.0, 0.0, -1.0], [39, 2, 39]), count) if side else None
    return palpate.Recording.from_arrays(x, force, time=0.01 * np.arange(len(x)), direction=direction)


@pytest.mark.parametrize("side", [pytest.param(False, marks=pytest.mark.full), True])
def test_a_zero_that_moves_during_the_recording_is_named_once(side: bool) -> None:
    reasons = palpate.identify(cycles(3, -0.3, side)).verdict.reasons
    moved = [reason for reason in reasons if "the zero of the force or the object changed" in reason]
    assert len(moved) == 1
    assert "stroke falls by 0.3" in moved[0] or "stroke falls by 0.29" in moved[0]


@pytest.mark.parametrize(("count", "drift"), sampled([(3, 0.0), (3, 0.02), (1, 0.3)], (3, 0.0), (3, 0.02)))
def test_a_zero_that_cannot_be_felt_to_move_gives_no_finding(count: int, drift: float) -> None:
    """One press and release cannot show the movement, and 0.02 is below a just noticeable difference."""
    verdict = str(palpate.identify(cycles(count, drift)).verdict)
    assert "the zero of the force or the object changed" not in verdict


@pytest.mark.parametrize(("count", "hidden"), [(1, True), (2, False)])
def test_what_friction_can_hide_is_stated_not_to_be_tested(count: int, hidden: bool) -> None:
    x = np.tile(np.r_[np.linspace(0.0, 1.0, 60), np.linspace(1.0, 0.0, 60)], count)
    force = 2.0 * x + 0.1 * np.repeat([1.0, -1.0] * count, 60)
    model = palpate.identify(palpate.Recording.from_arrays(x, force, time=0.01 * np.arange(len(x))))
    (decision,) = (each for each in model.notes["model_selection"] if each.startswith("measuring faults"))
    names = ["backlash", *(["a moved zero"] if hidden else []), "a late force"]
    assert f": not tested (the loop of friction hides {', '.join(names)}; " in decision


def conditioned(count: int, loss: float) -> palpate.Recording:
    """Returns presses and releases of an elastomer whose first press is harder than the others (Mullins)."""
    x = np.tile(np.r_[np.linspace(0.0, 1.0, 60), np.linspace(1.0, 0.0, 60)], count)
    reached = np.maximum.accumulate(x)
    soft = 1.0 - loss * ((reached - x) / np.maximum(reached, 0.01)) ** 0.6
    force = 20.0 * (x + 0.8 * x**3) * soft + np.random.default_rng(8).normal(0.0, 0.02, len(x))
    return palpate.Recording.from_arrays(x, force, time=0.01 * np.arange(len(x)))


@pytest.mark.parametrize("count", [2, 5])
def test_a_first_press_that_differs_from_the_others_is_named(count: int) -> None:
    """The releases are equal: an object that changes with time is not named for two presses either."""
    named = "behind the first stroke over a position"
    assert named in str(palpate.identify(conditioned(count, 0.3)).verdict)
    assert palpate.identify(conditioned(count, 0.005)).verdict.level == "good"


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_first_press_that_differs_is_not_fitted(sign: float) -> None:
    """An object that softens is the same in all later strokes; a stroke with the wrong sign is not the
    object's."""
    recording = conditioned(3, 0.4)
    first = np.arange(len(recording)) < 60
    force = np.where(first, sign, 1.0) * recording.force
    model = palpate.identify(palpate.Recording.from_arrays(recording.position, force, recording.time))
    later = recording.position[~first], recording.force[~first]
    error = (
        model.force(later[0], direction=np.tile(np.repeat([-1.0, 1.0], 60), 3)[: len(later[0])]) - later[1]
    )
    assert np.std(error) < 0.02 * np.std(later[1])
    assert any(
        "60 of 360 rows dropped (first strokes over their places, " in each for each in model.notes["rows"]
    )
    assert model.verdict.reasons[0].startswith("behind the first stroke over a position")


@pytest.mark.parametrize("rows", [60, 237])
def test_the_first_of_two_presses_is_not_fitted_if_it_is_stiffer(rows: int) -> None:
    """The second press is a little deeper, so that the last place of the travel is first met there."""
    press = np.sin(np.linspace(0.0, 0.5 * np.pi, rows)) ** 2
    x = np.r_[press, press[::-1], 1.005 * press, 1.005 * press[::-1]]
    stiffer = np.where(np.arange(len(x)) < rows, 1.2, 1.0)
    force = 10.0 * x * stiffer + np.random.default_rng(rows).normal(0.0, 0.02, len(x))
    model = palpate.identify(palpate.Recording.from_arrays(x, force, time=0.01 * np.arange(len(x))))
    assert model.force(0.5) == pytest.approx(5.0, abs=0.1)
    (reason,) = model.verdict.reasons
    assert "rows are left out: the model is that of the later strokes" in reason


def test_the_first_of_two_presses_of_few_rows_is_not_fitted_if_it_is_stiffer() -> None:
    """No two rows are in the same hundredth of the travel."""
    first, later = (np.sin(np.linspace(0.0, 0.5 * np.pi, rows)) ** 2 for rows in (25, 32))
    x = np.r_[first, first[::-1], later, later[::-1]]
    force = 10.0 * x * np.where(np.arange(len(x)) < 25, 1.2, 1.0)
    model = palpate.identify(x, force + np.random.default_rng(0).normal(0.0, 0.02, len(x)))
    assert model.force(0.5, direction=1.0) == pytest.approx(5.0, abs=0.1)


def test_strokes_that_differ_by_their_speed_are_not_only_called_a_changed_object() -> None:
    """The strokes become faster, and velocity is not among the inputs."""
    x = np.concatenate([np.r_[np.linspace(0.0, 1.0, n), np.linspace(1.0, 0.0, n)] for n in (200, 100, 50)])
    time = 0.01 * np.arange(len(x))
    force = 4.0 * x + 0.2 * np.abs(np.gradient(x, time)) + np.random.default_rng(8).normal(0.0, 0.02, len(x))
    recording = palpate.Recording.from_arrays(x, force, time=time)
    (reason,) = palpate.identify(recording, inputs=("position", "hysteresis")).verdict.reasons
    assert "from the slowest to the fastest by 0.3" in reason
    assert "Alternate slow and fast strokes" in reason


def test_strokes_that_differ_by_their_amplitude_are_not_called_a_changed_object() -> None:
    """Friction of plays in parallel grows with the distance from the last turn."""
    turns = np.array([0.0, 1.0, 0.1, 0.9, 0.2, 0.8, 0.3])
    x = np.concatenate([np.linspace(a, b, 100) for a, b in pairwise(turns)])
    away = np.abs(x - np.repeat(turns[:-1], 100))
    side = np.repeat(np.sign(np.diff(turns)), 100)
    force = 5.0 * x + side * away + np.random.default_rng(8).normal(0.0, 0.01, len(x))
    verdict = str(palpate.identify(palpate.Recording.from_arrays(x, force, direction=side)).verdict)
    assert "or the object changed" not in verdict
    assert "the force depends on the position of the last turn" in verdict
    assert "it falls with that position, by 0.2" in verdict


DATA = measured_data() or Path("no measured data")


def relaxation() -> tuple[Array, Array, Array]:
    """Returns a ramp, then a pause during which the force relaxes and the position sensor flickers."""
    random = np.random.default_rng(4)
    x = np.concatenate([np.linspace(0.0, 1.0, 200), 1.0 + random.normal(0.0, 1e-5, 2000)])
    force = np.concatenate([np.linspace(0.0, 1.0, 200), 0.3 + 0.7 * np.exp(-np.arange(2000) / 400.0)])
    return x, force + random.normal(0.0, 0.002, len(x)), 0.01 * np.arange(len(x))


def test_relaxation_is_named_and_gives_no_steep_slope() -> None:
    x, force, time = relaxation()
    assert palpate.identify(recorded(x, force, time)).fit.model_class == "memory"
    model = palpate.identify(recorded(x, force, time), inputs=("position",))
    assert "in 2000 rows that are not fitted (2000 wait in contact) the force differs" in str(model.verdict)
    assert "(relaxation, creep or drift)" in str(model.verdict)
    assert model.slope_bounds is not None
    assert max(np.abs(model.slope_bounds)) < 200.0


def test_waits_in_which_the_force_is_constant_are_not_called_relaxation() -> None:
    """Ten places of different stiffness are pressed and held in one file."""
    random = np.random.default_rng(2)
    press, stiffness = np.r_[np.linspace(0.0, 1.0, 100), np.ones(100)], random.uniform(0.6, 1.4, 10)
    x = np.tile(np.r_[press, press[::-1]], 10)
    force = x * np.repeat(stiffness, 400) + random.normal(0.0, 0.003, len(x))
    for time in (None, 0.01 * np.arange(len(x))):
        verdict = str(palpate.identify(recorded(x, force, time)).verdict)
        assert "rows that are not fitted" in verdict
        assert "relaxation" not in verdict


def test_the_domain_keeps_rows_that_are_recorded_without_force() -> None:
    """The release of a syringe with friction pulls a little between few rows at the contact, where the press
    is steep."""
    x = np.linspace(-1.5, 40.0, 250)
    x = np.r_[x, x[::-1]]
    side, contact = np.repeat([1.0, -1.0], 250), np.tanh(np.maximum(x, 0.0) / 0.3)
    seal = (3.5 + 3.0 * np.exp(-(((x - 0.8) / 0.5) ** 2))) * contact + 0.01 * x + 2.0 * side
    force = np.where(x > 0.0, np.maximum(seal, 0.0), 0.0) + np.random.default_rng(0).normal(0.0, 0.03, len(x))
    recording = palpate.Recording.from_arrays(x, force, direction=side)
    model = palpate.identify(recording)
    assert palpate.verify(model, recording).nrmse == pytest.approx(model.fit.nrmse, rel=0.01)


def test_a_tool_that_is_held_at_a_stop_moves_within_a_step_of_the_position() -> None:
    press = np.r_[np.arange(0.0, 7.25, 0.006), np.full(70, 7.25)]
    x = np.tile(np.r_[press, press[::-1]], 2)
    force = 0.18 * x + 0.9 * np.logaddexp(0.0, (x - 7.0) / 0.06)
    force += np.random.default_rng(0).normal(0.0, 0.006, len(x))
    model = palpate.identify(recorded(0.02 * np.round(x / 0.02), force))
    assert "rows that are not fitted" not in str(model.verdict)


def test_an_error_that_a_hand_does_not_feel_requires_no_more_wavelets() -> None:
    x = sweep(2000)
    rendered = palpate.identify(recorded(x, wall(x)), max_wavelets=4)
    assert rendered.fit.stop_reason == "max_wavelets"
    assert rendered.fit.nrmse < 0.01
    assert rendered.verdict.level == "good"


def test_release_above_press_at_a_place_is_not_called_another_input() -> None:
    x = np.r_[sweep(400), sweep(400)[::-1]]
    side = np.repeat([1.0, -1.0], 400)
    above = 0.3 * np.exp(-(((x - 0.1) / 0.008) ** 2))
    force = 2.0 * x + 0.02 * side + np.where(side < 0.0, above, 0.0) + 0.1 * noise(len(x))
    recording = palpate.Recording.from_arrays(x, force, direction=side)
    (reason,) = palpate.identify(recording).verdict.reasons
    assert "release is 0.2" in reason
    assert "--no-hysteresis-nonnegative" in reason
    assert "depends on more" not in reason


@pytest.mark.parametrize(
    ("release_from", "rows", "release_click", "width"),
    [(3.8, 20, 1.6, 0.15), (3.6, 19, 1.4, 0.1)],
)
def test_few_rows_are_named_as_the_cause_when_only_rows_left_out_do_not_fit(
    release_from: float, rows: int, release_click: float, width: float
) -> None:
    x = np.r_[np.linspace(0.0, 3.8, 20), np.linspace(release_from, 0.0, rows)]
    side = np.repeat([1.0, -1.0], [20, rows])
    click = np.exp(-(((x - np.where(side > 0.0, 1.6, release_click)) / width) ** 2))
    force = 20.0 * (1.0 - np.exp(-x / 0.1)) + 20.0 * click + 1.5 * side + 200.0 * np.maximum(x - 3.5, 0.0)
    model = palpate.identify(palpate.Recording.from_arrays(x, force, direction=side))
    (reason,) = (each for each in model.verdict.reasons if "left out" in each)
    assert model.fit.nrmse < 0.1
    assert "record more rows per stroke" in reason
    assert "depends on more" not in reason


@pytest.mark.parametrize(
    ("timed", "cure"),
    sampled([(False, "record the time"), (True, "give --force-late-s")], (False, "record the time")),
)
def test_strokes_shifted_by_backlash_are_not_only_called_late(timed: bool, cure: str) -> None:
    x = np.r_[np.linspace(0.0, 4.0, 800), np.linspace(4.0, 0.0, 800)]
    side = np.repeat([1.0, -1.0], 800)
    moved = np.where(side > 0.0, x, x + 0.03)
    click = np.where(side > 0.0, np.exp(-(((x - 1.8) / 0.15) ** 2)), -np.exp(-(((x - 1.5) / 0.25) ** 2)))
    force = 30.0 * (1.0 - np.exp(-x / 0.06)) + 15.0 * click + 20000.0 * np.maximum(moved - 3.9, 0.0)
    time = 0.01 * np.arange(len(x)) if timed else None
    (reason, *_) = palpate.identify(palpate.Recording.from_arrays(x, force, time, side)).verdict.reasons
    assert "backlash" in reason
    assert cure in reason


@pytest.mark.full
@pytest.mark.skipif(not DATA.is_dir(), reason="needs measured data, set PALPATE_DATA")
@pytest.mark.parametrize("stretch", ["1d5", "2d0", "4d0", "6d0"])
def test_measured_relaxation_is_named(stretch: str) -> None:
    """Most rows wait: they are not fitted, and the model is not good for them."""
    recording = palpate.read_recording(DATA / "vhb4910_viscoelastic" / f"relax_stretch_{stretch}.csv")
    assert palpate.verify(palpate.identify(recording), recording).nrmse < 0.05
    model = palpate.identify(recording, inputs=("position",))
    waits = model.notes["roles"]["wait in contact"]
    assert waits > 0.8 * len(recording)
    assert model.verdict.level == "usable"
    assert f"{waits + model.notes['roles'].get('wait in air', 0)} rows that are not fitted" in str(
        model.verdict
    )
    assert "relaxation, creep or drift" in str(model.verdict)
    secant = float(np.ptp(recording.force) / np.ptp(recording.position))
    assert model.slope_bounds is not None
    assert max(np.abs(model.slope_bounds)) < 500.0 * secant  # formerly 100 000 times


@pytest.mark.skipif(not DATA.is_dir(), reason="needs measured data, set PALPATE_DATA")
def test_measured_probing_at_several_places_is_named() -> None:
    recording = palpate.read_recording(
        DATA / "organ_probing" / "pig_liver_20150826_v2_region2.csv",
        position="depth_mm",
        force="normal_force_N",
    )
    model = palpate.identify(recording)
    assert model.n_wavelets <= 3
    assert model.verdict.level == "no"
    assert "identify different objects or places separately" in str(model.verdict)


def test_shuffled_rows_lose_nothing() -> None:
    order = np.random.default_rng(6).permutation(N)
    x = sweep(N)
    model = palpate.identify(recorded(x[order], (wall(x) + noise(N))[order]))
    assert 3 <= model.n_wavelets <= 8
    assert model.verdict.level == "good"


@pytest.mark.parametrize("rows", [20, pytest.param(45, marks=pytest.mark.full)])
def test_the_error_on_left_out_rows_is_not_below_that_between_few_rows(rows: int) -> None:
    """A model of few rows can have many parameters, if the rows determine them."""
    between = np.linspace(0.0, sweep(rows).max(), 2001)
    ratios = []
    for seed in range(4):
        random = np.random.default_rng(seed)
        model = palpate.identify(recorded(sweep(rows), wall(sweep(rows)) + random.normal(0.0, 0.02, rows)))
        true = np.sqrt(np.mean((model.force(between) - wall(between)) ** 2)) / np.std(wall(between))
        ratios.append(true / model.notes["left_out_nrmse"])
    assert max(ratios) < 1.3
    assert np.median(ratios) > 0.2


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_force_of_velocity_that_gains_energy_is_named(sign: float) -> None:
    time = 1e-3 * np.arange(N)
    speed = np.gradient(X, time)
    force = Y + sign * 0.2 * np.ptp(Y) * speed / np.abs(speed).max()
    model = palpate.identify(recorded(X, force, time), inputs="position,velocity")
    assert ("a press at the same speed" in str(model.verdict)) == (sign < 0.0)

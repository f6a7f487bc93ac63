# SPDX-License-Identifier: Apache-2.0
"""Rows that wait, or that move far from the contact, are not fitted: only the motion decides the model."""

from collections.abc import Callable
from itertools import product

import numpy as np
import pytest

import palpate
from conftest import sampled
from imperfect import Array, knob, loop, press_and_release, recorded
from palpate.recording.contact import contact_at
from palpate.recording.roles import Informative, Role, counts_text, roles_of

MOTION = press_and_release()


def with_wait(rows: int, at: int) -> tuple[Array, Array]:
    """Returns position and force of a press and a release with a noisy wait before row `at`."""
    rng = np.random.default_rng(3)
    x, f = MOTION, loop(MOTION) + rng.normal(0.0, 0.05, len(MOTION))
    row = min(at, len(x) - 1)
    wait = np.full(rows, x[row])
    return np.insert(x, [at] * rows, wait), np.insert(f, [at] * rows, f[row] + rng.normal(0.0, 0.05, rows))


def counts(x: Array, f: Array) -> list[int]:
    return np.bincount(roles_of(recorded(x, f)), minlength=len(Role)).tolist()


def test_a_motion_without_a_wait_has_only_moving_rows() -> None:
    assert counts(MOTION, loop(MOTION)) == [300, 0, 0, 0, 0]
    press = MOTION[:150]
    assert counts(press, 12.0 * press) == [150, 0, 0, 0, 0]


@pytest.mark.parametrize("rows", [300, 5000])
@pytest.mark.parametrize("at", [0, 150, 300], ids=["first", "turn", "last"])
def test_the_rows_of_a_wait_are_not_moving(rows: int, at: int) -> None:
    moving, approach, *waiting = counts(*with_wait(rows, at))
    assert sum(waiting) == pytest.approx(rows, abs=2)
    assert (moving + sum(waiting), approach) == (300 + rows, 0)


def test_a_wait_in_air_is_a_rest_and_a_wait_in_contact_a_hold() -> None:
    x = press_and_release() - 1.0
    f = np.where(x > 0.0, 50.0 * x, 0.0)
    x = np.concatenate([np.full(200, x[0]), x[:150], np.full(100, x[149]), x[150:]])
    f = np.concatenate([np.zeros(200), f[:150], np.full(100, f[149]), f[150:]])
    role = roles_of(recorded(x, f))
    assert (role[:200] == Role.REST).all()
    assert (role[352:448] == Role.HOLD).all()


def test_a_wait_at_the_smallest_position_of_a_preloaded_object_is_in_contact() -> None:
    """A gas spring pushes with 150 N from its first position on."""
    press = np.linspace(0.0, 4e-3, 300)
    x = np.concatenate([np.zeros(100), press, press[::-1], np.zeros(100)])
    noise = np.random.default_rng(0).normal(0.0, 0.1, len(x))
    role = roles_of(palpate.Recording.from_arrays(x, 150.0 + 1e3 * x + noise))
    assert np.count_nonzero(role == Role.HOLD) > 190
    assert not (role == Role.REST).any()


def test_a_long_approach_is_fitted_only_near_the_contact() -> None:
    x = np.linspace(-40.0, 4.0, 4400)
    role = roles_of(recorded(x, np.maximum(50.0 * x, 0.0)), 4.0)
    assert (role[x < -0.6] == Role.APPROACH).all()
    assert (role[x > -0.3] == Role.MOVING).all()


def test_a_release_that_ends_before_the_tool_leaves_keeps_the_contact_of_the_press() -> None:
    x = np.linspace(-0.2, 4.0, 1000)
    press = recorded(x, np.maximum(50.0 * x, 0.0))
    release = recorded(x[::-1], np.maximum(80.0 * (x[::-1] - 1.5), 0.0))
    assert Informative([release]).dropped["approach"] > 200
    assert Informative([press, release]).dropped == {}


def contact() -> tuple[Array, Array]:
    """Returns position and force of a press and a release that begin and end near the contact."""
    x = np.concatenate([np.linspace(-0.2, 4.0, 1000), np.linspace(4.0, -0.2, 1000)])
    noise = np.random.default_rng(4).normal(0.0, 0.05, len(x))
    return x, np.maximum(12.0 * x, 0.0) + 8.0 * np.maximum(x - 2.0, 0.0) + noise


@pytest.fixture(scope="module")
def near() -> palpate.Model:
    return palpate.identify(recorded(*contact()))


@pytest.mark.parametrize(("rows", "travels"), [(40, 100.0), (2000, 2.0)], ids=["fast and far", "slow"])
def test_an_approach_does_not_change_the_model(near: palpate.Model, rows: int, travels: float) -> None:
    x, f = contact()
    way = np.linspace(-4.0 * travels, -0.2, rows, endpoint=False)
    air = np.random.default_rng(5).normal(0.0, 0.05, (2, rows))
    far = recorded(np.concatenate([way, x, way[::-1]]), np.concatenate([air[0], f, air[1]]))
    model = palpate.identify(far)
    assert abs(model.n_wavelets - near.n_wavelets) <= 1
    assert model.verdict.level == "good"
    at = np.linspace(0.0, 4.0, 200)
    assert np.abs(model.force(at) - near.force(at)).max() < 0.05
    assert "rows dropped (far from the contact)" in str(model.notes["rows"])
    assert "compared, fewer than" not in str(palpate.verify(model, far).verdict)


@pytest.mark.parametrize(
    "force",
    [lambda x: np.cos(9.0 * x), lambda x: np.cos(70.0 * x), lambda x: 0.7 * x],
    ids=["wave", "short waves", "noisy line"],
)
def test_a_force_that_changes_along_the_travel_is_not_an_approach(force: Callable[[Array], Array]) -> None:
    x = np.linspace(0.0, 4.0, 2000)
    for seed in range(20):
        noise = np.random.default_rng(seed).normal(0.0, 0.3, len(x))
        assert contact_at(x, force(x) + noise) < 0.2


def test_the_contact_is_where_the_force_leaves_its_noise() -> None:
    x = np.linspace(-2.0, 2.0, 2000)
    f = 50.0 * np.maximum(x, 0.0) + np.random.default_rng(0).normal(0.0, 0.05, len(x))
    assert contact_at(x, f) == pytest.approx(0.0, abs=0.02)
    assert contact_at(x, np.full(len(x), 3.0)) == x[0]


def test_a_contact_at_the_largest_position_is_found() -> None:
    x = np.append(np.linspace(0.0, 4.0, 1000), np.full(40, 4.0))
    f = np.append(np.zeros(1000), np.full(40, 5.0))
    assert contact_at(x, f) == 4.0


@pytest.mark.parametrize("rows", [10, 8, 7])
def test_few_rows_all_move(rows: int) -> None:
    x = np.linspace(0.0, 1.0, rows)
    assert counts(x, 3.0 * x) == [rows, 0, 0, 0, 0]


def test_a_recording_in_which_everything_waits_has_only_moving_rows_and_no_model() -> None:
    rng = np.random.default_rng(0)
    x, f = rng.normal(0.0, 1e-3, 300), rng.normal(0.0, 1.0, 300)
    assert counts(x, f) == [300, 0, 0, 0, 0]
    assert palpate.identify(recorded(x, f)).verdict.level == "no"


@pytest.mark.parametrize("length", [1e-90, 1e-9, 1e90])
@pytest.mark.parametrize("force", [1e-9, 1e90])
def test_roles_do_not_depend_on_the_units(length: float, force: float) -> None:
    x, f = with_wait(300, 150)
    assert counts(length * x, force * f) == counts(x, f)


def test_rows_that_are_held_out_keep_the_roles_of_the_whole_motion() -> None:
    whole = recorded(*with_wait(300, 0))
    role = roles_of(whole)
    rows = np.arange(len(whole)) % 5 == 4
    for part, of in zip(whole.split(5), (~rows, rows), strict=True):
        different = np.count_nonzero(roles_of(part) != role[of])
        assert different <= 1  # the contact is found from the rows of the part


@pytest.fixture(scope="module")
def without_wait() -> palpate.Model:
    return palpate.identify(recorded(*with_wait(0, 0)))


@pytest.mark.parametrize(
    ("rows", "at"),  # before the strokes, at their turn, behind them
    sampled(product((30, 300, 5000), (0, 150, 300)), (30, 150)),
)
def test_waiting_rows_change_neither_size_nor_verdict_of_the_model(
    without_wait: palpate.Model, rows: int, at: int
) -> None:
    model = palpate.identify(recorded(*with_wait(rows, at)))
    assert abs(model.n_wavelets - without_wait.n_wavelets) <= 1
    assert model.verdict.level == without_wait.verdict.level
    at_middle = np.array([2.0])
    press = np.ones(1)
    assert model.force(at_middle, direction=press) == pytest.approx(
        without_wait.force(at_middle, direction=press), rel=1e-3
    )
    assert f"of {300 + rows} rows are not fitted: " in str(model.notes["rows"])


@pytest.mark.parametrize("held", sampled([2, 4], 4))
def test_rows_of_a_hold_at_the_end_do_not_bend_the_curve(held: int) -> None:
    x = np.concatenate([np.linspace(0.0, 10.0, 90), 10.0 + 1e-6 * np.arange(1, held + 1)])
    f = 86.0 / (1.0 + np.exp(-(x - 5.2) / 1.6)) + 9.0 * np.exp(-(((x - 3.9) / 0.9) ** 2))
    f[90:] -= np.array([20.0, 27.0, 30.5, 33.5])[:held]
    model = palpate.identify(recorded(x, f))
    error = model.force(x[:90]) - f[:90]
    assert float(np.sqrt(np.mean(error**2))) < 0.01 * float(np.std(f))


def test_several_recordings_are_fitted_without_the_waits_of_each() -> None:
    model = palpate.identify([recorded(*with_wait(rows, 0)) for rows in (0, 300, 5000)])
    note = " ".join(model.notes["rows"])
    assert "5302 of 6200 rows are not fitted" in note
    assert model.n_wavelets <= 8


@pytest.mark.full
def test_a_pause_of_a_knob_leaves_no_spike() -> None:
    rng = np.random.default_rng(1)
    turn = np.linspace(0.0, 1080.0, 7200)
    angle = np.concatenate([turn, np.full(100, 1080.0), turn[::-1], np.zeros(100)])
    way = np.repeat([1.0, 0.0, -1.0, 0.0], [7200, 100, 7200, 100])
    torque = knob(angle) + 2.5 * way + rng.normal(0.0, 0.25, len(angle))
    model = palpate.identify(recorded(angle, torque), period=15.0)
    at = np.linspace(0.0, 15.0, 2000)
    for direction in (1.0, -1.0):
        error = model.force(at, direction=np.full(len(at), direction)) - (knob(at) + 2.5 * direction)
        assert np.abs(error).max() < 0.3


def test_one_row_waits_and_two_rows_wait() -> None:
    assert counts_text({"move": 3, "wait in air": 1, "wait in contact": 2}) == (
        "3 move, 1 waits in air, 2 wait in contact"
    )

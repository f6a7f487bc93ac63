# SPDX-License-Identifier: Apache-2.0
"""Identification of hysteresis if the direction state at the start of the motion is unknown."""

import os
import re

import numpy as np
import pytest

from imperfect import Array, wandering
from palpate import InputError, SearchOptions, identify, verify
from palpate._core.model import play
from palpate._typing import Int8Vector
from palpate.identification.classes.hysteresis import PlaySearch
from palpate.identification.data.rows import Rows
from palpate.identification.data.strokes import HysteresisInput
from palpate.identification.network.basis import Basis
from palpate.identification.options import IdentifyOptions
from palpate.identification.search.evidence import Samples
from palpate.recording import Recording
from palpate.recording.roles import Role
from palpate.verification import compare

BOX = np.zeros(1), np.ones(1)

MOTIONS = 20 * max(1, int(os.environ.get("PALPATE_TEST_SCALE", "1")))


def state(motion: Array, radius: float, start: float) -> Array:
    """Returns the direction states along a motion (n,) that begins with a given one."""
    return np.asarray((motion - play(motion, radius, start=motion[0] - start * radius)) / radius)


def test_known_hysteresis_input_does_not_depend_on_earlier_motion() -> None:
    rng = np.random.default_rng(3)
    for seed in range(MOTIONS):
        motion, radius = wandering(1500, seed), float(rng.uniform(0.001, 0.3))
        found, other = HysteresisInput.of_play([motion], radius), state(motion, radius, rng.uniform(-1, 1))
        np.testing.assert_allclose(found.side[found.known], other[found.known], atol=1e-12)
        first = int(np.argmax(found.known))
        if first:  # no row is left out of the fit without reason
            edge, far = (state(motion, radius, start)[first - 1] for start in (1.0, -1.0))
            assert edge != pytest.approx(far, abs=1e-9)


@pytest.mark.full
def test_a_motion_that_begins_in_the_middle_of_its_play_is_fitted_to_its_noise() -> None:
    x = wandering(10_000, 1)
    side = state(x, 0.01, -0.6)
    noise = np.random.default_rng(2).normal(0.0, 0.005, len(x))
    force = np.tanh(6 * (x - 0.5)) + side * (0.2 + 0.1 * x) + noise
    recording = Recording.from_arrays(x, force, time=1e-3 * np.arange(len(x)))
    model = identify(recording, search=SearchOptions(play_radius=(0.005, 0.01 / np.ptp(x), 0.02)))
    assert model.play_radius == pytest.approx(0.01, rel=0.005)
    assert verify(model, recording).rmse < 1.05 * 0.005


@pytest.mark.parametrize(
    ("radius", "noise"),
    [
        pytest.param(0.0033, 0.0, marks=pytest.mark.full),
        pytest.param(0.0071, 0.0, marks=pytest.mark.full),
        pytest.param(0.0033, 2e-3, marks=pytest.mark.full),
        (0.0071, 2e-3),
    ],
)
def test_play_radius_between_the_options_is_found_without_more_wavelets(radius: float, noise: float) -> None:
    """With a wrong play radius, more and more wavelets are selected to model the resulting force error."""
    x = 0.45 * wandering(3000, 1)
    side = HysteresisInput.of_play([x], radius).side
    force = 1.5 * np.tanh(12 * (x - 0.2)) + side * (0.1 + 0.1 * x)
    force += np.random.default_rng(2).normal(0.0, noise, len(x)) if noise else 0.0
    model = identify(Recording.from_arrays(x, force, time=1e-3 * np.arange(len(x))))
    assert (model.fit.model_class, model.damping, model.mass) == ("hysteresis", None, None)
    assert model.play_radius == pytest.approx(radius, rel=0.005)
    assert model.n_wavelets <= 8
    assert model.fit.nrmse * np.std(force) < 1.02 * noise + 1e-4 * np.ptp(force)


def test_strokes_that_turn_at_one_depth_predict_those_that_turn_at_another() -> None:
    """At one depth, wavelets behind the turn fit the change of direction as well as a play radius does."""

    def tissue(seed: int, depth: float) -> Recording:
        time = np.arange(0.0, 60.0, 0.02)
        x = 0.5 * depth * (1.0 - np.cos(2.0 * np.pi * time / 10.0))
        force = 0.4 * np.expm1(x / 0.003) * (1.0 + 0.25 * state(x, 2e-4, 0.0))
        force += np.random.default_rng(seed).normal(0.0, 0.01, len(x))
        return Recording.from_arrays(x, force, time, units={"position": "m", "force": "N"})

    model = identify(tissue(1, 0.008))
    assert model.play_radius == pytest.approx(2e-4, rel=0.02)
    assert verify(model, tissue(2, 0.007)).nrmse < 0.01


def test_rows_of_reversing_friction_do_not_make_a_steep_slope() -> None:
    """The rows behind a turn, in which the friction reverses, were fitted by narrow wavelets."""
    u = np.r_[np.linspace(-0.02, 1.0, 300), np.linspace(1.0, -0.02, 300)]
    force = np.where(u > 0.0, (np.tanh(u / 0.1) + u) * (1.0 + 0.2 * state(u, 0.004, 0.0)), 0.0)
    force += np.random.default_rng(0).normal(0.0, 2e-3, len(u))
    model = identify(Recording.from_arrays(u, force))
    at = np.linspace(0.05, 1.0, 4001)
    for side in (1.0, -1.0):
        slope = np.diff(model.force(at, direction=np.full(len(at), side))) / np.diff(at)
        assert slope.max() < 15.0  # the steepest of the object is 13.2


@pytest.mark.parametrize("seed", [0, 2])
def test_a_stop_at_which_the_tool_turns_keeps_its_slope(seed: int) -> None:
    """A wheel is turned into both end stops, whose rows are next to the turns."""
    corner = np.array([0.0, 460.0, -460.0, 460.0, -460.0, 0.0])
    time = np.arange(0.0, 5.0, 0.0035)
    part = time.astype(int)
    x = corner[part] + np.diff(corner)[part] * (3.0 * (time - part) ** 2 - 2.0 * (time - part) ** 3)
    stop = 0.7 * np.maximum(np.abs(x) - 450.0, 0.0) * np.sign(x)
    force = 2.2 * np.tanh(x / 60.0) + 0.0044 * x + 0.8 * state(x, 1.15, 0.0) + stop
    model = identify(np.round(x, 1), force + np.random.default_rng(seed).normal(0.0, 0.04, len(x)))
    slopes = [float(model.slope(end, direction=way)) for end, way in ((459.0, 1.0), (-459.0, -1.0))]
    assert model.verdict.level == "good"
    assert min(slopes) > 0.6


def test_wavelets_do_not_imitate_a_play_between_the_tried_radii() -> None:
    """Narrow wavelets fitted the reversals at the end of the travel: the slope of the release was five times
    the true one, and no play radius was found."""

    def foam(u: Array, s: Array | float) -> Array:
        return np.where(u > 0.0, 0.4 * np.tanh(u / 0.1) + 0.2 * u + np.maximum(u, 0.0) ** 5, 0.0) * (
            1.0 + 0.2 * s
        )

    cycle = np.r_[np.linspace(-0.02, 1.0, 200), np.linspace(1.0, -0.02, 200)]
    u, at = np.tile(cycle, 2), np.linspace(0.0, 1.0, 4001)
    force = foam(u, state(u, 0.02, 0.0)) + np.random.default_rng(0).normal(0.0, 2e-3, len(u))
    model = identify(Recording.from_arrays(u, force, 0.02 * np.arange(len(u))))
    assert model.play_radius == pytest.approx(0.02, rel=0.03)
    assert model.n_wavelets <= 9
    for side in (1.0, -1.0):
        steepest = np.diff(foam(at, side)).max()
        assert np.diff(model.force(at, direction=np.full(len(at), side))).max() == pytest.approx(
            steepest, rel=0.1
        )


@pytest.mark.full
def test_short_strokes_along_a_sweep_are_as_simple_as_long_ones() -> None:
    """Press a little, release a little, while the mean advances: both strokes cover every position."""
    k = np.arange(10_000)
    x = 0.4 * np.interp(k, [0, 5000, 10_000], [0.0, 1.0, 0.0]) + 0.03 * np.abs((k % 200) / 100.0 - 1.0)
    side = HysteresisInput.of_play([x], 0.005).side
    force = 1.5 * np.tanh(12 * (x - 0.2)) + side * (0.1 + 0.1 * x)
    model = identify(Recording.from_arrays(x, force, time=1e-3 * k))
    assert model.play_radius == pytest.approx(0.005, rel=0.005)
    assert model.n_wavelets <= 8
    assert model.fit.nrmse < 3e-4


def test_one_play_radius_is_taken_as_given() -> None:
    x = wandering(3000, 1)
    side = HysteresisInput.of_play([x], 0.01).side
    recording = Recording.from_arrays(x, x + 0.2 * side, time=1e-3 * np.arange(len(x)))
    model = identify(recording, inputs="position,hysteresis", search=SearchOptions(play_radius=(0.02,)))
    assert model.play_radius == pytest.approx(0.02 * np.ptp(x))


def test_models_of_several_inputs_are_not_compared() -> None:
    rng = np.random.default_rng(0)
    X = rng.uniform(0.0, 1.0, (100, 2))
    recording = Recording.from_arrays(X[:, 0], X.sum(axis=1), inputs={"temperature": X[:, 1]})
    model = identify(recording, inputs=("position", "temperature"))
    with pytest.raises(InputError, match="must be position only for a comparison"):
        compare(model, model)


def test_rows_that_wait_do_not_change_the_play_of_the_other_rows() -> None:
    rng, options = np.random.default_rng(4), IdentifyOptions()
    exact = np.tile(np.r_[np.linspace(0.0, 1.0, 400), np.linspace(1.0, 0.0, 400)], 2)
    x, at = exact + rng.normal(0.0, 1e-4, len(exact)), np.full(3000, 400)
    force, role = x + 0.1 * state(exact, 0.004, 0.0), np.full(len(x), Role.MOVING, dtype=np.int8)
    waited = np.insert(x, at, x[399] + rng.normal(0.0, 1e-3, len(at)))

    def states(position: Array, force: Array, role: Int8Vector) -> list[Array]:
        rows = Rows(("position",), position[:, None], force, starts=(0,), role=role, corners=BOX).limited()
        found = PlaySearch(Samples(rows, options), options).best_of_options(Basis.empty(1))
        return [each.side[rows.fitted] for each in found]

    alone = states(x, force, role)
    with_waits = states(waited, np.insert(force, at, force[399]), np.insert(role, at, Role.HOLD))
    assert len(alone) >= 1
    np.testing.assert_array_equal(with_waits, alone)


def test_the_verdict_counts_rows_behind_a_turn_as_the_fit_does() -> None:
    """The friction reverses over a tenth of the travel as no play operator does; noise is left elsewhere."""
    time, noise = np.arange(0.0, 8.0, 0.008), 0.001
    x = np.abs((time / 2.0 + 1.0) % 2.0 - 1.0)
    way = np.where(np.gradient(x) > 0.0, 1.0, -1.0)
    since = np.where(way > 0.0, x, 1.0 - x)
    side = way * np.where(time < 1.0, 1.0, 1.0 - 2.0 * np.exp(-((since / 0.08) ** 5)))
    force = 0.02 * x + 0.1 * side + np.random.default_rng(0).normal(0.0, noise, len(x))
    model = identify(Recording.from_arrays(x, force, time))
    assert model.hysteretic
    assert model.fit.nrmse > 0.1
    assert model.verdict.level == "good"
    (note,) = (each for each in model.notes["identification"] if each.startswith("Rows behind turns"))
    of_all, settled = map(float, re.findall(r"NRMSE (\S+) on all rows, (\S+) with", note)[0])
    assert of_all == float(f"{model.fit.nrmse:.2g}")
    assert settled * float(np.std(force)) == pytest.approx(noise, rel=0.3)

# SPDX-License-Identifier: Apache-2.0
"""identify: the simulated sample, several recordings, and measured switches, domes and springs."""

import os
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import palpate
from conftest import sampled
from imperfect import loop, press_and_release
from palpate import InputError, Model, Recording, identify
from palpate._core.model import play
from palpate.recording.sample import sample_recording

SCALE = int(os.environ.get("PALPATE_TEST_SCALE", "1"))


@pytest.fixture(scope="module")
def sample_model() -> Model:
    return identify(sample_recording(1))


def test_the_sample_needs_ten_wavelets_or_fewer_and_reaches_its_noise_on_fresh_data(
    sample_model: Model,
) -> None:
    fresh = sample_recording(2)
    error = sample_model.force(fresh.position) - fresh.force
    assert 1 <= sample_model.n_wavelets <= 10
    assert np.sqrt(np.mean(error**2)) <= 1.1 * 0.02
    assert sample_model.kind == "position"
    assert sample_model.stop_reason == "bic"


def test_the_model_is_the_network_that_was_identified(sample_model: Model) -> None:
    fit = sample_model.fit
    assert fit.n_wavelets == sample_model.n_wavelets
    assert sample_model.n_parameters == 3 * sample_model.n_wavelets + 2
    recording = sample_recording(1)
    error = sample_model.force(recording.position) - recording.force
    assert fit.nrmse == pytest.approx(np.sqrt(np.mean(error**2)) / np.std(recording.force), rel=5e-3)
    assert sample_model.domain[0][0] == recording.position.min()
    assert sample_model.domain[1][0] == recording.position.max()
    assert any("hysteresis: not accepted" in line for line in sample_model.notes["model_selection"])


def test_several_recordings_of_one_environment_are_identified_together() -> None:
    x = np.linspace(0.0, 1.0, 300)
    random = np.random.default_rng(0)
    noisy = x + np.maximum(x - 0.4, 0.0) * 5.0 + random.normal(0.0, 0.01, 300)
    left = Recording.from_arrays(x[x < 0.6], noisy[x < 0.6])
    right = Recording.from_arrays(x[x >= 0.6], noisy[x >= 0.6])
    whole = identify(Recording.from_arrays(x, noisy), inputs="position")
    together = identify([left, right], inputs="position")
    assert together.force(0.9) == pytest.approx(whole.force(0.9), abs=1e-6)
    assert together.data.rows == 300


def test_play_starts_at_rest_in_every_recording() -> None:
    """One recording moves; twenty others rest between the strokes, so each starts its own play operator."""
    random = np.random.default_rng(1)
    t = np.linspace(0.0, 4.0 * np.pi, 1600)
    x = 0.5 - 0.5 * np.cos(t)
    sliding = np.clip((x - play(x, 0.01)) / 0.01, -1.0, 1.0)
    y = x + 0.2 * sliding + random.normal(0.0, 0.01, len(t))
    recordings = [Recording.from_arrays(x, y, time=t)]
    for place in random.uniform(0.1, 0.9, 20):
        rest = place + random.uniform(-1e-4, 1e-4, 40)
        force = rest + random.normal(0.0, 0.01, 40)
        recordings.append(Recording.from_arrays(rest, force, time=np.arange(40.0)))
    model = identify(recordings)
    assert model.kind == "hysteresis"
    assert model.play_radius is not None
    spread = np.std(np.concatenate([part.force for part in recordings]))
    assert model.fit.nrmse * spread < 0.015


def test_force_of_hysteresis_model_without_direction_is_refused() -> None:
    x = np.concatenate([np.linspace(0.0, 1.0, 200), np.linspace(1.0, 0.0, 200)])
    direction = np.repeat([1, -1], 200)
    model = identify(Recording.from_arrays(x, x + 0.1 * direction, direction=direction))
    assert model.kind == "hysteresis"
    assert model.force(0.5, direction=1.0) - model.force(0.5, direction=-1.0) == pytest.approx(0.2, abs=1e-6)
    with pytest.raises(ValueError, match="direction"):
        model.force(0.5)


def test_recordings_in_different_units_are_refused() -> None:
    x = np.linspace(0.0, 1.0, 20)
    metres = Recording.from_arrays(x, x, units={"position": "m", "force": "N"})
    radians = Recording.from_arrays(x, x, units={"position": "rad", "force": "N*m"})
    with pytest.raises(InputError, match="different units"):
        identify([metres, radians])


def test_no_recording_and_unknown_options_are_refused() -> None:
    with pytest.raises(InputError, match="recording is an empty list"):
        identify([])
    with pytest.raises(InputError, match="no option 'wavelets'; its options are inputs, max_wavelets"):
        identify(sample_recording(1, duration_s=1.0), wavelets=3)


def test_a_period_that_is_given_is_kept() -> None:
    x = np.linspace(0.0, 2.0 * np.pi, 400)
    model = identify(Recording.from_arrays(x, np.sin(3.0 * x)), period=2.0 * np.pi)
    assert model.period == 2.0 * np.pi
    assert model.force(0.7 + 2.0 * np.pi) == pytest.approx(model.force(0.7))


def test_control_c_interrupts_identify_immediately(monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("palpate.identification.search.growth.refine", interrupted)
    with pytest.raises(KeyboardInterrupt):
        identify(sample_recording(1, duration_s=2.0))


def held_out_nrmse(path: Path, **options: object) -> tuple[float, Model]:
    """Fits both strokes without every fifth row; returns the NRMSE on the omitted rows, and the model."""
    kept, held = palpate.read_recording(path).split(every=5)
    model = identify(kept, **options)
    return palpate.verify(model, held).nrmse, model


@pytest.mark.parametrize("bounded", sampled([True, False], True), ids=["h-nonnegative", "h-free"])
@pytest.mark.parametrize(
    ("folder", "every", "median"),
    [
        pytest.param("keyswitches", 4, 0.025, marks=pytest.mark.full),
        pytest.param("rubber_domes", 4, 0.0125, marks=pytest.mark.full),
        ("switch_springs", 4, 0.024),
    ],
)
def test_error_of_measured_strokes_does_not_grow(
    data: Path, folder: str, every: int, median: float, bounded: bool
) -> None:
    """Tests some files of each folder, more in long runs; bench/identification/real_data.py tests all."""
    errors = []
    apart = every if SCALE > 1 else 6 * every
    for path in sorted((data / folder).glob("*.csv"))[::apart]:
        nrmse, model = held_out_nrmse(path, hysteresis_nonnegative=bounded)
        errors.append(nrmse)
        assert nrmse <= 0.06, path.name
        assert model.kind == "hysteresis", path.name
        if bounded:
            low, high = model.domain
            x = np.linspace(low[0], high[0], 20_001)
            h = 0.5 * (model.force(x, direction=np.ones_like(x)) - model.force(x, direction=-np.ones_like(x)))
            assert h.min() >= -1e-9 * np.ptp(model.force(x, direction=np.ones_like(x))), path.name
    assert np.median(errors) <= median


@pytest.mark.parametrize(
    "folder",
    sampled(
        ["motor_cogging", "vhb4910_viscoelastic", "afm_indentation", "magnet_attraction"],
        "magnet_attraction",
    ),
)
def test_nothing_diverges_on_other_measured_files(data: Path, folder: str) -> None:
    for path in sorted((data / folder).glob("*.csv"))[:: 3 if SCALE > 1 else 9]:
        recording = palpate.read_recording(path)
        model = identify(recording)
        assert np.isfinite(model.weight).all(), path.name
        assert model.fit.nrmse <= 1.0, path.name
        low, high = model.domain
        x = np.linspace(low[0], high[0], 5001)
        if model.dimension > 1:
            force = model.predict(np.random.default_rng(0).uniform(low, high, (5001, model.dimension)))
        else:
            force = model.force(x, **({"direction": np.ones_like(x)} if model.kind == "hysteresis" else {}))
        margin = np.ptp(recording.force)
        assert recording.force.min() - margin < force.min(), path.name
        assert force.max() < recording.force.max() + margin, path.name


@pytest.mark.parametrize("rows", sampled([30, 50, 80], 30))
def test_few_rows_without_direction_and_time_show_the_hysteresis(rows: int) -> None:
    x = press_and_release(rows)
    f = loop(x) + np.random.default_rng(0).normal(0.0, 0.2, len(x))
    model = identify(Recording.from_arrays(x, f))
    assert model.kind == "hysteresis"
    at = np.linspace(1.5, 3.5, 100)
    press, release = (model.force(at, direction=np.full(100, way)) for way in (1.0, -1.0))
    assert press - release == pytest.approx(6.0 * np.tanh(at), rel=0.15)


def push_button() -> Recording:
    """Returns three presses of a button whose force does not pull the tool [m, N]."""
    press = np.linspace(0.0, 3.6e-3, 360)
    x = np.tile(np.concatenate([press, press[::-1]]), 3)
    way = np.tile(np.repeat([1.0, -1.0], 360), 3)
    drop = 0.13 / (1.0 + np.exp(-(x - np.where(way > 0, 1.55e-3, 1.15e-3)) / 6e-5))
    f = 0.18 * (1.0 - np.exp(-x / 8e-5)) + 90.0 * x - drop + 0.03 * way
    f = np.where(x < 1e-5, 0.0, np.clip(f, 0.0, None))
    noise = np.random.default_rng(0).normal(0.0, 2e-3, len(x))
    return Recording.from_arrays(x, f + noise, units={"position": "m", "force": "N"})


@cache
def model_of_the_button(**ends: str) -> Model:
    return identify(push_button(), **ends)


BELOW = np.array([-1e-2, -1e-3])


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_a_button_that_never_pulls_does_not_pull_below_the_recording(way: float) -> None:
    model = model_of_the_button()
    assert model.below == "free"
    assert model.force(BELOW, direction=np.full(2, way)) == pytest.approx(0.0, abs=0.02)


def test_a_button_that_is_pressed_towards_smaller_positions_is_the_mirror_image() -> None:
    button = push_button()
    model = identify(replace(button, position=-button.position, force=-button.force))
    assert (model.below, model.above) == ("linear", "free")
    assert model.force(-BELOW, direction=np.ones(2)) == pytest.approx(0.0, abs=0.02)


def test_an_object_that_attracts_towards_its_stop_does_not_let_the_tool_leave_there() -> None:
    """The pull of a solenoid grows up to its stop and has one sign."""
    x = np.linspace(0.0, 12e-3, 400)
    force = -12.0 / (1.0 + (12e-3 - x) / 1e-3) ** 2
    model = identify(x, force, below="linear", max_wavelets=8)
    assert (model.below, model.above) == ("linear", "linear")


def test_an_object_that_pulls_in_the_recording_continues_below_it() -> None:
    x = press_and_release(400) - 2.0
    f = 3.0 * x + np.random.default_rng(0).normal(0.0, 0.01, len(x))
    model = identify(Recording.from_arrays(x, f))
    assert model.below == "linear"
    assert model.force(-3.0) == pytest.approx(-9.0, rel=0.02)


def test_a_pull_in_some_strokes_only_does_not_continue_below_the_recording() -> None:
    button = push_button()
    moved = np.where(np.arange(len(button)) < 720, 0.0, -0.06)  # zero set again behind the first release
    model = identify(replace(button, force=button.force + moved))
    assert model.below == "free"
    assert model.force(BELOW, direction=np.ones(2)) == pytest.approx(0.0, abs=0.02)


def test_an_object_that_pulls_in_each_release_continues_below_the_recording() -> None:
    button = push_button()
    release = np.tile(np.repeat([False, True], 360), 3)
    model = identify(replace(button, force=np.where(release, button.force - 0.1, button.force)))
    assert model.below == "linear"


@pytest.mark.parametrize("end", ["below", "above"])
@pytest.mark.parametrize("way", [1.0, pytest.param(-1.0, marks=pytest.mark.full)])
def test_both_ends_continue_as_they_are_given(end: str, way: float) -> None:
    at = {"below": -1e-2, "above": 2e-2}[end]
    other = {"below": "above", "above": "below"}[end]
    models = [
        model_of_the_button(**dict(sorted({end: this, other: that}.items())))
        for this, that in (("linear", "free"), ("free", "linear"))
    ]
    straight, free = (model.force(at, direction=way) for model in models)
    assert abs(straight) > 0.5
    assert free == pytest.approx(0.0, abs=0.02)


@pytest.mark.parametrize("rows", sampled([80, 2000], 80))
def test_a_hold_in_which_the_force_relaxes_does_not_change_the_strokes(rows: int) -> None:
    press, relaxing = np.linspace(0.0, 5.0, 1000), np.linspace(0.0, 5.0, rows)
    curve = 60.0 * press + 14.0 * press**2
    held = curve[-1] * (1.0 - 0.4 * (1.0 - np.exp(-relaxing)))
    x = np.concatenate([press, np.full(rows, 5.0), press[::-1]])
    f = np.concatenate([curve, held, 0.6 * curve[::-1]])
    f += np.random.default_rng(0).normal(0.0, 1.0, len(f))
    model = identify(Recording.from_arrays(x, f))
    for way, of in ((1.0, curve), (-1.0, 0.6 * curve)):
        error = model.force(press, direction=np.full(1000, way)) - of
        assert np.abs(error).max() < 4.0
    assert model.force(-1.0, direction=-1.0) == pytest.approx(0.0, abs=2.0)

# SPDX-License-Identifier: Apache-2.0
"""Velocity, mass, damping and hysteresis are identified only if they are present."""

import os
import re
from collections.abc import Callable, Sequence
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from conftest import sampled
from imperfect import Array
from palpate import Model, Recording, identify, read_recording, verify
from palpate._core.model import play
from palpate.identification import IdentifyOptions
from palpate.identification.classes.dynamics import Dynamics
from palpate.identification.data.rows import rows_of
from palpate.identification.network.basis import Basis
from palpate.recording import sample_force
from palpate.recording.motion import (
    LowPass,
    acceleration_of,
    derivative,
    pieces,
    quiet_low_pass,
    velocity,
    velocity_of,
)

SCALE = int(os.environ.get("PALPATE_TEST_SCALE", "1"))
DRAWS = 100 if SCALE > 1 else 1
MOST_MISJUDGED = 5 if SCALE > 1 else 0
SECONDS = 10.0 if SCALE > 1 else 3.0
"""Duration of a recording [s]."""


ENCODER_STEP = 2.0 * np.pi / 65536
NOISE = 0.02


def moved(
    seed: int, *, seconds: float = SECONDS, mass: float = 0.0, damping: float = 0.0, hysteresis: float = 0.0
) -> Recording:
    """Returns the sample's object with mass, damping, hysteresis and noise, moved at 0.2 to 2 Hz."""
    random = np.random.default_rng(seed)
    time = np.arange(round(seconds * 1000)) * 1e-3
    wander = np.sin(2.0 * np.pi * (0.31 * time[:, None] * [0.1, 0.23, 0.41] + random.uniform(0, 1, 3)))
    phase = 2.0 * np.pi * 1e-3 * np.cumsum(0.2 * 10.0 ** ((1.0 + wander.mean(axis=1)) / 2.0))
    x = 0.1345 + 0.3345 * np.sin(phase)
    v = np.gradient(x, time)
    force = sample_force(x) + mass * np.gradient(v, time) + damping * v
    if hysteresis:
        force = force + hysteresis * np.clip((x - play(x, 0.005)) / 0.005, -1.0, 1.0)
    return Recording.from_arrays(
        np.round(x / ENCODER_STEP) * ENCODER_STEP,
        force + random.normal(0.0, NOISE, len(x)),
        time=time,
        units={"position": "rad", "force": "N*m"},
    )


@cache
def identified(seed: int, *, damping: float = 0.0, hysteresis: float = 0.0) -> Model:
    return identify(moved(seed, damping=damping, hysteresis=hysteresis))


def test_a_pull_that_the_force_of_a_mass_hides_is_part_of_the_model() -> None:
    """At the lowest positions of a fast motion the mass pushes more than the object pulls."""
    time = 1e-3 * np.arange(5000.0)
    x = 0.15 * np.sin(2.0 * np.pi * (8.0 * time - 0.7 * time**2))
    force = 2.0 * x + 1e-3 * np.gradient(np.gradient(x, time), time)
    noise = np.random.default_rng(0).normal(0.0, 0.002, len(x))
    model = identify(Recording.from_arrays(x, force + noise, time=time))
    assert model.mass == pytest.approx(1e-3, rel=0.05)
    assert model.below == "linear"
    at = np.linspace(x.min(), x.max(), 50)
    np.testing.assert_allclose(model.force(at), 2.0 * at, atol=0.01)


def test_mass_and_damping_are_recovered_from_one_recording() -> None:
    for seed in range(1 if SCALE == 1 else 20):
        recording = moved(seed, seconds=8.0 * SECONDS, mass=1e-3, damping=0.06)
        model = identify(recording)
        assert (model.kind, model.fit.model_class) == ("position", "mass and damping")
        assert model.mass == pytest.approx(1e-3, rel=0.05)
        assert model.damping == pytest.approx(0.06, rel=0.05)
        assert model.fit.nrmse == pytest.approx(verify(model, recording).nrmse, rel=1e-6)
        other = moved(seed + 1000, mass=1e-3, damping=0.06)
        fresh = verify(model, other)
        assert fresh.rmse == pytest.approx(NOISE, rel=0.03)
        assert fresh.n < len(other)


@pytest.mark.parametrize(
    ("there", "model_class", "kind"),
    [
        ({}, "position", "position"),
        ({"damping": 0.03}, "velocity", "position"),
        ({"hysteresis": 0.1}, "hysteresis", "hysteresis"),
        pytest.param({"hysteresis": 0.1, "damping": 0.03}, "velocity", "hysteresis", marks=pytest.mark.full),
    ],
    ids=["neither", "velocity", "hysteresis", "both"],
)
def test_velocity_and_hysteresis_are_accepted_only_if_present(
    there: dict[str, float], model_class: str, kind: str
) -> None:
    misjudged = 0
    for draw in range(DRAWS):
        model = identified(draw, **there)
        misjudged += (model.fit.model_class, model.kind) != (model_class, kind)
    assert misjudged <= MOST_MISJUDGED


def test_decision_on_each_term_reports_its_gain() -> None:
    decisions = identified(0, damping=0.03).notes["model_selection"]
    (accepted,) = (line for line in decisions if line.startswith("damping: accepted"))
    assert "lowers the squared error on held-out sections by " in accepted
    assert ", lowers BIC by " in accepted
    assert any(line.startswith("mass: not accepted (") for line in decisions)


@pytest.mark.full
def test_damping_that_depends_on_position_makes_velocity_an_input() -> None:
    """Hunt-Crossley: f = 800 x^1.5 (1 + 1.2 v)."""

    def contact(seed: int) -> Recording:
        motion = moved(seed, seconds=10.0)
        assert motion.time is not None
        x = -0.002 + (motion.position + 0.2) / 0.669 * 0.012
        time = motion.time / 8.0
        force = 800.0 * np.maximum(x, 0.0) ** 1.5 * (1.0 + 1.2 * np.gradient(x, time))
        noise = np.random.default_rng(seed).normal(0.0, 0.003, len(x))
        return Recording.from_arrays(x, force + noise, time=time)

    model = identify(contact(1))
    assert (model.kind, model.inputs) == ("position_velocity", ("position", "velocity"))
    assert (model.fit.model_class, model.damping) == ("velocity", None)
    assert verify(model, contact(2)).rmse < 0.004
    decisions = model.notes["model_selection"]
    assert any(line.startswith("curve over position and velocity: accepted (") for line in decisions)


def jointed(seed: int, friction: float, viscous: float = 0.3) -> Recording:
    """Returns a soft joint with Coulomb and viscous friction, moved for 20 s and sampled at 100 Hz."""
    random = np.random.default_rng(seed)
    time = 0.01 * np.arange(2000)
    phase = 2.0 * np.pi * 0.01 * np.cumsum(0.4 + 0.2 * np.sin(0.7 * time + random.uniform(0.0, 6.0)))
    x = 0.5 - 0.5 * np.cos(phase)
    v = np.gradient(x, time)
    force = 0.2 * x + friction * ((1.0 + 0.5 * x) * np.tanh(v / 0.05) + viscous * v)
    force = force + random.normal(0.0, 0.005, len(x))
    return Recording.from_arrays(x, force, time, units={"position": "rad", "force": "N*m"})


@pytest.mark.full
def test_friction_without_passive_hysteresis_makes_velocity_an_input() -> None:
    """Torque of a motor that drives the joint: it has the opposite sign."""
    kept, held = jointed(1, -0.3).split(5)
    model = identify(kept)
    assert (model.fit.model_class, model.inputs) == ("velocity", ("position", "velocity"))
    result = verify(model, held)
    assert result.nrmse < 0.1
    assert result.n < len(held)
    assert "give --negate force" in str(model.verdict)
    assert any(
        line.startswith("curve over position and velocity: accepted (lowers the squared error by ")
        for line in model.notes["model_selection"]
    )


@pytest.mark.full
def test_rows_without_a_velocity_keep_their_error() -> None:
    """Between gaps of time only the first rows have a velocity: a network over it ignores the others."""
    whole = jointed(0, 0.3)
    row = np.arange(len(whole))
    assert whole.time is not None
    gaps = np.cumsum((row >= 0.3 * len(row)) & (row % 10 == 0))
    model = identify(Recording.from_arrays(whole.position, whole.force, whole.time + gaps))
    (decision,) = (each for each in model.notes["model_selection"] if "position and velocity: " in each)
    share = re.search(r"lowers the squared error by ([\d.]+) %", decision)
    assert share is not None
    assert float(share[1]) <= 30.0


@pytest.mark.full
def test_friction_explained_by_hysteresis_is_hysteresis() -> None:
    model = identify(jointed(1, 0.3, viscous=0.0))
    assert model.kind == "hysteresis"
    assert model.fit.nrmse < 0.15


def test_noise_independent_of_velocity_does_not_make_velocity_an_input() -> None:
    time = 0.01 * np.arange(2000)
    x = 0.5 - 0.5 * np.cos(2.0 * np.pi * 0.3 * time)
    force = x + np.random.default_rng(3).normal(0.0, 0.3, len(x))
    model = identify(Recording.from_arrays(x, force, time))
    assert model.inputs == ("position",)
    assert not any("as an input" in note for note in model.notes["identification"])


@pytest.mark.full
def test_measured_relaxation_is_identified_without_velocity(data: Path) -> None:
    """The position is constant in all rows that have a velocity."""
    model = identify(read_recording(data / "vhb4910_viscoelastic" / "relax_stretch_6d0.csv"))
    assert model.kind == "memory"
    assert model.damping is None


def test_velocity_of_split_rows_is_formed_from_all_rows() -> None:
    whole = jointed(2, 0.3)
    derived, known = velocity(whole)
    kept, held = whole.split(5)
    test_rows = np.arange(len(whole)) % 5 == 4
    for part, rows in ((kept, ~test_rows), (held, test_rows)):
        values, here = velocity(part)
        np.testing.assert_array_equal(here, known[rows])
        np.testing.assert_allclose(values, derived[rows], atol=1e-12)


def test_velocity_of_a_range_of_rows_is_formed_from_the_rows_around_it(tmp_path: Path) -> None:
    whole = read_recording(jointed(2, 0.3).write(tmp_path / "a.csv"), negate=("position",))
    derived, known = velocity(whole)
    part = read_recording(tmp_path / "a.csv", negate=("position",), rows=(800, 900))
    values, here = velocity(part)
    assert known[800:900].all()
    assert here.all()
    np.testing.assert_allclose(values, derived[800:900], atol=1e-12)


@pytest.mark.full
def test_error_of_measured_joints_does_not_grow(data: Path) -> None:
    """Joints of da Vinci tools: a force of position alone has an NRMSE of 0.34 to 0.97 on held-out rows."""
    for name in ("tool_4_maryland_l_4__09", "tool_4_maryland_r_5__23", "tool_4_maryland_l_4__45"):
        path = data / "davinci_grip" / f"{name}.csv"
        for side in ("back", "front"):
            recording = read_recording(path, position=f"{side}_angle_rad", force=f"{side}_torque_Nm")
            kept, held = recording.split(5)
            model = identify(kept)
            assert model.kind == "position_velocity", name
            assert verify(model, held).nrmse < 0.16, name


def to_and_fro(seed: int, speeds: list[float], *, damping: float, noise: float = 2e-3) -> Recording:
    """Returns a recording of a spring with damping, moved over 0.3 rad and back, each stroke at one speed."""
    path = np.cumsum(np.repeat(speeds, [round(300 / speed) for speed in speeds])) * 1e-3
    x = 0.3 * np.abs((path / 0.3 + 1.0) % 2.0 - 1.0)
    time = 1e-3 * np.arange(len(x))
    force = 3.0 * x + damping * np.gradient(x, time)
    force = force + np.random.default_rng(seed).normal(0.0, noise, len(x))
    return Recording.from_arrays(np.round(x / ENCODER_STEP) * ENCODER_STEP, force, time=time)


@pytest.mark.full
def test_damping_is_not_tested_at_one_speed_but_at_two() -> None:
    """At one speed the velocity is proportional to its sign, and Coulomb friction explains a loop of constant
    height equally well."""
    rounds = 1 if SCALE == 1 else 2
    for seed in range(1 if SCALE == 1 else 20):
        one = identify(to_and_fro(seed, [0.3] * (2 if SCALE == 1 else 6), damping=0.06))
        assert (one.kind, one.damping) == ("hysteresis", None)
        decisions = [line for line in one.notes["model_selection"] if line.startswith("damping: not tested")]
        assert len(decisions) == 1
        assert "the speed was nearly constant: it varies by " in decisions[0]
        two = identify(to_and_fro(seed, [0.15, 0.15, 0.45, 0.45] * rounds, damping=0.06))
        assert two.kind == "position"
        assert two.damping == pytest.approx(0.06, rel=0.05)


@pytest.mark.full
def test_a_negative_damping_is_refused() -> None:
    model = identify(moved(2, damping=-0.03))
    assert model.damping is None
    (decision,) = (line for line in model.notes["model_selection"] if line.startswith("damping: "))
    assert decision.startswith("damping: not accepted (the fitted damping is -0.0")


def test_a_negative_damping_that_a_hand_notices_is_named() -> None:
    """A force that is late by t0 shows the damping -k t0 of a stiffness k."""
    verdict = str(identify(to_and_fro(0, [0.15, 0.15, 0.45, 0.45], damping=-0.1)).verdict)
    assert "the fitted damping is -0.1, a passive object has > 0, and a hand notices its force" in verdict
    verdict = str(identify(to_and_fro(0, [0.15, 0.15, 0.45, 0.45], damping=-0.01)).verdict)
    assert "the fitted damping" not in verdict


def test_a_static_force_below_that_of_a_damping_is_kept_in_the_whole_domain() -> None:
    """What counts as no force is a share of the static force: the damping has 25 times its range."""
    time = np.arange(3000) * 1e-3
    x = 0.02 * (1.0 - np.cos(2.0 * np.pi * np.cumsum(0.4 + 0.3 * time) * 1e-3))
    force = 40.0 * np.gradient(x, time) + 4.0 * x + np.random.default_rng(0).normal(0.0, 0.01, len(x))
    model = identify(Recording.from_arrays(x, force, time))
    assert model.damping == pytest.approx(40.0, rel=0.01)
    assert model.above == "linear"
    assert model.force(0.04) == pytest.approx(0.16, rel=0.05)


def test_a_damping_that_the_last_fit_makes_negative_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Dynamics, "accepted", lambda *_: ({"damping": -0.01}, [], []))
    model = identify(moved(1))
    assert (model.fit.model_class, model.damping) == ("position", None)


@pytest.mark.full
def test_gaps_and_uneven_steps_do_not_disturb_mass_and_damping() -> None:
    whole = moved(3, seconds=6.0 * SECONDS, mass=2e-3, damping=0.06)
    random = np.random.default_rng(0)
    kept = random.uniform(size=len(whole)) > 0.03
    kept[6_000:8_000] = False
    kept[11_000:11_020] = False
    assert whole.time is not None
    some = Recording.from_arrays(whole.position[kept], whole.force[kept], time=whole.time[kept])
    assert len(pieces(some)) >= 3
    model = identify(some)
    assert model.mass == pytest.approx(2e-3, rel=0.05)
    assert model.damping == pytest.approx(0.06, rel=0.05)


@pytest.mark.full
def test_several_recordings_of_one_object_are_one_regression() -> None:
    parts = [moved(seed, seconds=2.0 * SECONDS, mass=2e-3, damping=0.06) for seed in range(3)]
    model = identify(parts)
    assert model.mass == pytest.approx(2e-3, rel=0.05)
    assert model.damping == pytest.approx(0.06, rel=0.05)


def presses(in_air: bool) -> list[Recording]:
    """Returns presses of a damped spring at three constant speeds, from the contact or from the air."""
    random, found = np.random.default_rng(0), []
    for speed in (3.0, 10.0, 25.0):
        x = np.arange(-2.4 if in_air else 0.0, 40.0, 0.01 * speed)
        contact = np.tanh(np.maximum(x, 0.0) / 0.3) if in_air else np.ones(len(x))
        force = contact * (3.5 + 0.1 * x + 0.2 * speed) + random.normal(0.0, 0.03, len(x))
        found.append(Recording.from_arrays(x, force, time=0.01 * np.arange(len(x))))
    return found


def test_presses_at_constant_speeds_show_damping_without_an_acceleration() -> None:
    model = identify(presses(in_air=False))
    assert model.damping == pytest.approx(0.2, rel=0.01)
    assert (model.mass, model.verdict.level) == (None, "good")
    assert any(line.startswith("mass: not tested") for line in model.notes["model_selection"])


def test_a_mass_that_is_not_tested_is_stated_in_kg() -> None:
    position = np.repeat(0.01 * np.abs(np.linspace(-1.0, 1.0, 100)), 2)
    units = {"position": "m", "force": "N"}
    recording = Recording.from_arrays(position, 500.0 * position, time=np.arange(200.0), units=units)
    options = IdentifyOptions()
    _, decisions, _ = Dynamics(rows_of([recording], options), options).accepted(Basis.empty(1), None)
    assert " kg changes the force" in str(decisions[-1])


def test_constant_speeds_do_not_show_the_force_between_them() -> None:
    """The damping acts in contact only: a network over position and velocity fits the three speeds alone."""
    model = identify(presses(in_air=True))
    assert (model.kind, model.damping) == ("position", pytest.approx(0.2, rel=0.02))
    assert model.verdict.level == "usable"
    assert "two objects" not in str(model.verdict)


def test_presses_that_are_too_short_alone_have_a_velocity_together() -> None:
    model = identify(presses(in_air=True), inputs=("position", "velocity"))
    assert model.kind == "position_velocity"
    assert model.fit.nrmse < 0.05


def test_low_pass_has_no_delay_and_keeps_slow_motion() -> None:
    low_pass, period = LowPass(100.0), 1e-3
    t = np.arange(4000) * period
    inner = slice(low_pass.margin(period), -low_pass.margin(period))
    for rate in (1.0, 10.0, 100.0):
        passed = low_pass(np.sin(rate * t), period)[inner]
        gain = 1.0 / (1.0 + (rate / 100.0) ** 2) ** 2
        np.testing.assert_allclose(passed, gain * np.sin(rate * t)[inner], atol=0.05 * gain + 1e-3)
    np.testing.assert_allclose(low_pass(np.full(500, 3.0), period), 3.0, rtol=1e-12)


def test_the_derivatives_of_a_noisy_position_are_those_of_the_motion() -> None:
    t = np.arange(20_000) * 1e-3
    x = np.sin(4.0 * t)
    noisy = np.round(x / 1e-4) * 1e-4
    recording = Recording.from_arrays(noisy, noisy, time=t)
    speed = 4.0 * np.cos(4.0 * t)
    for derived, true in (
        (velocity(recording), speed),
        (derivative(recording, 1), speed),
        (derivative(recording, 2), -16.0 * x),
    ):
        values, known = derived
        assert known.mean() > 0.9
        error = values[known] - true[known]
        assert np.sqrt(np.mean(error**2)) < 0.1 * true.std()


def test_central_differences_have_no_phase() -> None:
    t = np.arange(2000) * 1e-3
    x = np.sin(30.0 * t)
    assert abs(np.sum(velocity_of(x, 1e-3)[5:-5] * x[5:-5])) < 1e-2 * np.sum(np.abs(x)) * 30.0
    np.testing.assert_allclose(acceleration_of(x, 1e-3)[5:-5], -900.0 * x[5:-5], rtol=1e-3, atol=1e-6)


def test_an_acceleration_near_the_sampling_rate_keeps_its_amplitude() -> None:
    """Motion of 7 Hz, sampled at 100 Hz by an encoder."""
    t = np.arange(1000) / 100.0
    x = np.sin(14.0 * np.pi * t)
    recording = Recording.from_arrays(np.round(x / ENCODER_STEP) * ENCODER_STEP, x, time=t)
    values, known = derivative(recording, 2)
    true = acceleration_of(x, 0.01)[known]
    assert np.std(values[known] - true) < 0.01 * true.std()


def driven(seed: int, friction: float) -> Recording:
    """Returns a soft centring spring with inertia, damping and friction, shaken at up to 7 Hz."""
    random = np.random.default_rng(seed)
    t = np.arange(1000) / 250.0
    waves = zip((0.5, 2.8, 7.0), (0.8, 0.15, 0.06), random.uniform(0.0, 6.0, 3), strict=True)
    x = np.sum([size * np.sin(2.0 * np.pi * rate * t + phase) for rate, size, phase in waves], axis=0)
    force = 3.0 * np.tanh(x / 0.8) + 0.12 * np.gradient(x, t) + 0.045 * acceleration_of(x, 0.004)
    force += friction * np.clip((x - play(x, 0.01)) / 0.01, -1.0, 1.0)
    force += random.normal(0.0, 0.03, len(x))
    return Recording.from_arrays(np.round(x / ENCODER_STEP) * ENCODER_STEP, force, time=t)


@pytest.mark.parametrize("friction", sampled([0.0, 0.25], 0.25))
def test_inertia_of_a_fast_motion_leaves_only_noise(friction: float) -> None:
    model = identify(driven(1, friction))
    assert model.kind == ("hysteresis" if friction else "position")
    assert (model.mass, model.damping) == (pytest.approx(0.045, rel=0.01), pytest.approx(0.12, rel=0.02))
    for seed in (1, 11):
        assert verify(model, driven(seed, friction)).rmse < 0.036  # noise 0.03


def stroked(law: Callable[[Array, Array], Array], speeds: Sequence[float], noise: float) -> Recording:
    """Returns a recording of a force of position and velocity; the travel is 1, each stroke has one speed."""
    path = np.cumsum(np.repeat(speeds, [round(200.0 / speed) for speed in speeds])) / 200.0
    x = np.abs((path + 1.0) % 2.0 - 1.0)
    soft = np.hanning(9) / np.hanning(9).sum()
    x = np.convolve(np.pad(x, 4, "edge"), soft, "valid")
    time, random = np.arange(len(x)) / 200.0, np.random.default_rng(1)
    force = law(x, np.gradient(x, time)) + random.normal(0.0, noise, len(x))
    return Recording.from_arrays(x + random.normal(0.0, 1e-5, len(x)), force, time=time)


def test_damping_that_differs_between_press_and_release_makes_velocity_an_input() -> None:
    """Shock absorbers have more damping in rebound than in compression."""
    phase = 2.0 * np.pi * np.cumsum(np.repeat([0.1, 0.2, 0.4], 2000)) / 200.0
    x, time, random = 0.5 - 0.5 * np.cos(phase), np.arange(6000) / 200.0, np.random.default_rng(1)
    velocity = np.gradient(x, time)
    force = 4.0 * x + np.where(velocity > 0.0, 0.3, 0.9) * velocity + random.normal(0.0, 0.02, len(x))
    model = identify(Recording.from_arrays(x + random.normal(0.0, 1e-5, len(x)), force, time=time))
    assert model.kind == "position_velocity"
    assert "the zero of the force or the object changed" not in str(model.verdict)


def late_position() -> Recording:
    """Returns a spring with a wall and friction at three constant speeds, without noise of the position,
    which is 20 ms late."""
    ends = np.tile([4.0, 0.0, 4.0, 0.0], 3)
    at = np.cumsum(4.0 / np.repeat([1.0, 3.0, 10.0], 4))
    time = np.arange(0.0, at[-1], 1.0 / 300.0)
    x, late = (np.interp(time - delay, np.r_[0.0, at], np.r_[0.0, ends]) for delay in (0.0, 0.02))
    friction = 0.3 * (x - play(x, 0.04)) / 0.04
    force = 0.8 * x + 6.0 * np.maximum(x - 3.2, 0.0) ** 1.5 + friction
    noise = np.random.default_rng(0).normal(0.0, 0.01, len(x))
    return Recording.from_arrays(1e-3 * late, force + noise, time=time)


@pytest.mark.full
def test_turns_alone_show_neither_the_force_between_constant_speeds_nor_a_mass() -> None:
    """A network over position and velocity was 5 N wrong at a speed between those of the recording."""
    model = identify(late_position())
    assert model.dimension == 1
    assert any(line.startswith("mass: not tested") for line in model.notes["model_selection"])


def test_a_row_at_the_turn_with_the_force_of_the_release_shows_no_mass() -> None:
    """A file without noise, as many testers export it, had a mass of 5.5 kg."""
    x = 8.0 * np.abs((np.arange(2000) / 500.0 + 1.0) % 2.0 - 1.0)
    friction = np.tile(np.repeat([0.1, -0.1], 500), 2)
    force = np.round(0.5 * x + 0.4 * np.maximum(x - 5.0, 0.0) ** 2 + friction, 2)
    recording = Recording.from_arrays(np.round(1e-3 * x, 8), force, time=0.02 * np.arange(2000))
    assert identify(recording).mass is None


def test_damping_is_accepted_although_the_speed_rises_over_the_recording() -> None:
    """Each tenth of the recording has one speed, and friction falls with the speed (Stribeck)."""

    def joint(x: Array, v: Array) -> Array:
        friction = np.clip((x - play(x, 0.002)) / 0.002, -1.0, 1.0) * (2.0 + 1.5 * np.exp(-((v / 0.4) ** 2)))
        return 8.0 * np.sin(x) + friction + 1.5 * v

    speeds = np.repeat([0.2, 0.6, 1.2, 2.0, 3.0], 2)
    decisions = identify(stroked(joint, speeds, 0.15), max_wavelets=4).notes["model_selection"]
    assert any(line.startswith("damping: accepted") for line in decisions)


def test_a_position_that_is_all_noise_has_no_low_pass() -> None:
    noise = np.random.default_rng(0).normal(size=3000)
    recording = Recording.from_arrays(noise, noise, time=np.arange(3000.0))
    assert quiet_low_pass(pieces(recording), order=2) is None

# SPDX-License-Identifier: Apache-2.0
"""Identification of memory: known branches, objects without branches, and measured relaxation."""

from functools import cache
from pathlib import Path

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter1d

import palpate
from conftest import sampled
from palpate import Model, Recording
from palpate._core.model import Memory, play, stretches
from palpate.identification.classes.memory import balanced
from palpate.identification.log import squared_error_change
from palpate.planning import hand_for, rig_for
from palpate.planning.simulation import holding_hand
from palpate.verification.metrics import force_floor


def ramps_and_holds(seed: int, step_s: float = 0.02) -> tuple[np.ndarray, np.ndarray]:
    """Returns time and position of ramps at 0.3 to 6 travels a second, each followed by a hold."""
    random = np.random.default_rng(seed)
    knots, places = [0.0], [0.0]
    for rate in np.exp(random.uniform(np.log(0.3), np.log(6.0), 12)):
        place = random.uniform(0.05, 1.0)
        knots.append(knots[-1] + abs(place - places[-1]) / rate)
        knots.append(knots[-1] + np.exp(random.uniform(np.log(0.3), np.log(8.0))))
        places += [place, place]
    time = np.arange(0.0, 40.0, step_s)
    return time, np.interp(time, knots, places)


def relaxing(stiffness: list[float], tau: list[float], ratio: float = 0.0) -> Model:
    memory = Memory(
        alpha=[], beta=[], weight=[], linear=ratio, bias=1.0, stiffness=stiffness, time_constant_s=tau
    )
    return Model.from_network(
        alpha=[[3.0]],
        beta=[[0.4]],
        weight=[0.2],
        linear=[2.0],
        lower=[0.0],
        upper=[1.0],
        memory=memory,
    )


def with_noise(force: np.ndarray, share: float, seed: int = 0) -> np.ndarray:
    return force + share * force.std() * np.random.default_rng(seed).standard_normal(len(force))


@cache
def identified(*tau: float) -> Model:
    """Returns the model of an object with these relaxation times [s]."""
    time, position = ramps_and_holds(1, 0.04)
    truth = relaxing([2.0, 1.5, 1.0][: len(tau)], list(tau))
    force = with_noise(truth.force_over_time(time, position)[0], 0.005)
    return palpate.identify(position, force, time=time)


@pytest.mark.parametrize(
    "tau",
    sampled([[0.7], [0.3, 4.0], [0.2, 1.1, 6.0]], [0.7]),
    ids=["one", "two", "three"],
)
def test_known_branches_are_found(tau: list[float]) -> None:
    model = identified(*tau)
    assert model.kind == model.fit.model_class == "memory"
    assert model.memory is not None
    np.testing.assert_allclose(model.memory.time_constant_s, tau, rtol=0.1)
    assert model.fit.nrmse == pytest.approx(0.005, rel=0.1)
    assert any("memory: accepted" in line for line in model.notes["model_selection"])
    assert any("s are resolved by the recordings" in line for line in model.notes["identification"])
    assert model.notes["roles"]["wait in contact"] > 0
    assert not any("not fitted" in line for line in model.notes["rows"]), "a memory fits all rows"


def test_strokes_that_change_by_relaxation_do_not_hide_it() -> None:
    """Most rows wait, so that the strokes alone differ by more than the error over all rows."""
    time, position = ramps_and_holds(37)
    truth = relaxing([2.0], [2.9])
    model = palpate.identify(position, with_noise(truth.force_over_time(time, position)[0], 0.01), time=time)
    assert model.memory is not None
    np.testing.assert_allclose(model.memory.time_constant_s, [2.9], rtol=0.02)


def pressed_twice() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Returns time, position and a wave of the force at rest of an object pressed twice at one speed."""
    time = np.arange(1200) / 1000.0
    position = 0.5 - 0.5 * np.cos(2.0 * np.pi * 1.7 * time) * np.exp(-0.2 * time)
    return time, position, 0.3 * np.sin(9.0 * position)


@pytest.mark.full
def test_a_branch_has_fewer_parameters_than_a_network_of_position_and_velocity() -> None:
    """At one speed of pressing, both fit the force down to its noise."""
    time, position, wave = pressed_twice()
    truth = relaxing([2.0], [0.05])
    branch = truth.force_over_time(time, position)[0] - truth.force(position)
    model = palpate.identify(position, with_noise(3.0 * position**2 + wave + branch, 1e-3), time=time)
    assert model.kind == "memory"
    assert model.n_parameters <= 30


@pytest.mark.full
def test_nonlinear_damping_does_not_become_a_branch_with_fewer_parameters() -> None:
    time, position, wave = pressed_twice()
    velocity = np.gradient(position, time)
    contact = 5.0 * np.maximum(position - 0.4, 0.0)
    force = with_noise(contact + wave + 0.01 * velocity * np.abs(velocity), 1e-3)
    model = palpate.identify(position, force, time=time)
    assert model.memory is None


@pytest.mark.full
def test_a_curved_force_at_rest_does_not_hide_a_branch() -> None:
    time, position = ramps_and_holds(21)
    memory = Memory(
        alpha=[], beta=[], weight=[], linear=0.0, bias=1.0, stiffness=[1.0], time_constant_s=[0.21]
    )
    truth = Model.from_network(
        alpha=[[3.92]],
        beta=[[0.276]],
        weight=[-0.291],
        linear=[1.385],
        lower=[0.0],
        upper=[1.0],
        memory=memory,
    )
    force = with_noise(truth.force_over_time(time, position)[0], 0.003)
    model = palpate.identify(position, force, time=time)
    assert model.memory is not None
    np.testing.assert_allclose(model.memory.time_constant_s, [0.21], rtol=0.02)


@pytest.mark.full
def test_a_ratio_that_depends_on_the_position_is_found() -> None:
    time, position = ramps_and_holds(5)
    truth = relaxing([2.0, 1.5], [0.3, 4.0], ratio=1.0)
    force = with_noise(truth.force_over_time(time, position)[0], 0.003)
    model = palpate.identify(position, force, time=time)
    assert model.memory is not None
    np.testing.assert_allclose(model.memory.time_constant_s, [0.3, 4.0], rtol=0.1)
    x = np.array([0.1, 0.5, 0.9])
    memory = model.memory
    found = memory.linear * x + memory.bias
    assert len(memory.weight) or found[2] / found[0] == pytest.approx(1.9 / 1.1, rel=0.1)
    assert palpate.verify(model, position, force, time=time).nrmse < 0.004


@pytest.mark.full
def test_irregular_times_and_several_recordings_are_one_object() -> None:
    truth = relaxing([2.0], [0.7])
    recordings = []
    for seed in (3, 4):
        time, position = ramps_and_holds(seed)
        rows = np.sort(np.random.default_rng(seed).choice(len(time), 900, replace=False))
        time, position = time[rows], position[rows]
        force = with_noise(truth.force_over_time(time, position)[0], 0.005, seed)
        recordings.append(Recording.from_arrays(position, force, time=time))
    model = palpate.identify(recordings)
    assert model.memory is not None
    np.testing.assert_allclose(model.memory.time_constant_s, [0.7], rtol=0.05)
    # the band and its check belong to the model without memory
    assert model.band is None
    assert not any("left out of the fit" in note for note in model.notes["identification"])


def test_a_second_recording_that_never_touches_the_object_is_not_called_good() -> None:
    time, position = ramps_and_holds(1, 0.2)
    touching = np.maximum(position - 0.3, 0.0)
    force = np.maximum(relaxing([2.0], [0.7]).force_over_time(time, touching)[0], 0.0)
    pair = [Recording.from_arrays(position, force * factor, time=time) for factor in (1.0, 1e-3)]
    assert palpate.identify(pair).verdict.level != "good"


@pytest.mark.full
@pytest.mark.parametrize(("tau", "seconds"), [([0.3], 1.5), ([0.3, 2.0], 8.0)])
def test_a_rendered_memory_is_identified_again_within_a_just_noticeable_difference(
    tau: list[float], seconds: float
) -> None:
    truth = relaxing([2.0, 1.5][: len(tau)], tau)
    device = rig_for(truth).device
    plan = palpate.plan(truth, device)
    hands = [hand_for(plan, device), holding_hand(plan, 0.3), holding_hand(plan, 0.9)]
    found = palpate.identify([palpate.simulate(plan, device, hand, seconds) for hand in hands])
    assert found.memory is not None
    np.testing.assert_allclose(found.memory.time_constant_s[: len(tau)], tau, rtol=0.1)
    fresh = palpate.simulate(plan, device, holding_hand(plan, 0.6), seconds)
    soon = round(500 * max(tau))
    assert fresh.force[soon] > 1.3 * fresh.force[-1], "the rendered object relaxes"
    assert palpate.verify(found, fresh).within_jnd == 1.0


@pytest.mark.parametrize("kind", sampled(["static", "hysteretic", "viscous"], "static", "hysteretic"))
def test_objects_that_do_not_relax_have_no_memory(kind: str) -> None:
    time, position = ramps_and_holds(5)
    position = gaussian_filter1d(position, 5)
    force = 2.0 * position + 0.3 * np.sin(5.0 * position)
    if kind == "hysteretic":
        force += 0.2 * (position - play(position, 0.01)) / 0.01
    if kind == "viscous":
        force += 0.1 * np.gradient(position, time)
    model = palpate.identify(position, with_noise(force, 0.02), time=time)
    assert model.memory is None
    (decision,) = [line for line in model.notes["model_selection"] if line.startswith("memory: ")]
    assert decision.startswith("memory: not ")


def test_position_as_the_only_input_excludes_memory() -> None:
    time, position = ramps_and_holds(1)
    force = relaxing([2.0], [0.7]).force_over_time(time, position)[0]
    model = palpate.identify(position, force, time=time, inputs=("position",))
    assert model.memory is None


@pytest.mark.full
def test_small_forces_and_offsets_do_not_change_the_branches() -> None:
    time, position = ramps_and_holds(1)
    force = with_noise(relaxing([2.0], [0.7]).force_over_time(time, position)[0], 0.005)
    model = palpate.identify(1e-6 * position + 3.0, 1e-9 * force, time=time)
    assert model.memory is not None
    np.testing.assert_allclose(model.memory.time_constant_s, [0.7], rtol=0.05)
    # the band and its check belong to the model without memory
    assert model.band is None
    assert not any("left out of the fit" in note for note in model.notes["identification"])


def tissue(time: np.ndarray, depth: np.ndarray) -> np.ndarray:
    """Returns the force of a tissue that relaxes within 0.8 s and only pushes."""
    pressed = np.maximum(depth, 0.0)
    elastic = pressed + 1.5 * pressed**2
    relaxing = stretches(time, elastic[:, None], np.array([0.8]))[:, 0, 0]
    return np.asarray(np.where(depth > 0.0, np.maximum(elastic + 0.6 * relaxing, 0.0), 0.0))


@pytest.mark.parametrize("hold_s", sampled([0.5, 2.0], 0.5))
def test_a_tissue_under_holds_gets_a_memory_and_never_pulls(hold_s: float) -> None:
    """Hysteresis fits the rows of the motion, but its loop is twice as wide as without the holds."""
    rate, speed = 100.0, 1.0
    places = np.array([-0.05, 0.5, 1.0, 0.5, -0.05])
    knots, at = [0.0], [places[0]]
    for place, hold in zip(places[1:], (hold_s, hold_s, hold_s, 0.2), strict=True):
        arrived = knots[-1] + abs(place - at[-1]) / speed
        knots, at = [*knots, arrived, arrived + hold], [*at, place, place]
    time = np.arange(0.0, knots[-1], 1.0 / rate)
    depth = np.interp(time, knots, at)
    model = palpate.identify(depth, with_noise(tissue(time, depth), 0.01), time=time)
    assert model.memory is not None
    np.testing.assert_allclose(model.memory.time_constant_s, [0.8], rtol=0.15)
    assert model.verdict.level == "good"
    # a fresh stroke without holds
    time = np.arange(0.0, 2.1, 1.0 / rate)
    depth = np.interp(time, [0.0, 1.05, 2.1], [-0.05, 1.0, -0.05])
    force, found = tissue(time, depth), model.force_over_time(time, depth)[0]
    assert np.sqrt(np.mean((found - force) ** 2)) < 0.05 * force.std()
    assert np.asarray(found).min() >= -force_floor(force)  # no pull that a hand notices


def test_a_memory_that_forgets_while_the_tool_is_away_states_it() -> None:
    time = 0.02 * np.arange(500)
    speed = 1.0 + 0.4 * np.sin(0.5 * time)
    depth = 0.48 - 0.52 * np.cos(2.0 * np.pi * 0.5 * 0.02 * np.cumsum(speed))
    force = with_noise(tissue(time, depth), 0.005)
    model = palpate.identify(depth, force, time=time)
    assert model.memory is not None
    assert model.below == "free"
    assert model.fit.nrmse > 0.1
    assert (
        "the model forgets how far the object had relaxed when the tool leaves it" in model.verdict.reasons[0]
    )
    assert "--below linear" in model.verdict.reasons[0]
    remembers = palpate.identify(depth, force, time=time, below="linear")
    assert remembers.memory is not None
    assert remembers.fit.nrmse < 0.05


def test_a_memory_that_never_touches_the_object_is_refused() -> None:
    """A metal that yields and springs back at 20 times the slope: in contact, branches that relax fit it."""
    time = np.concatenate([np.arange(0.0, 5.0, 0.01), np.arange(5.0, 25.0, 0.4), np.arange(25.0, 30.0, 0.01)])
    depth = np.interp(time, [0.0, 5.0, 25.0, 30.0], [0.0, 0.05, 0.3, 0.25])
    force = np.where(time < 25.0, 2400.0 * (1.0 - np.exp(-depth / 0.015)), 2400.0 - (0.3 - depth) * 48_000.0)
    force += np.random.default_rng(2).normal(0.0, 2.0, len(time))
    model = palpate.identify(1e-3 * depth, force, time=time)
    assert model.memory is None
    assert model.fit.nrmse < 0.3
    assert model.verdict.level == "usable"
    assert "memory: not accepted (contact is lost" in str(model.notes["model_selection"])


@pytest.mark.full
def test_plasticity_at_one_speed_is_not_stated_to_be_relaxation() -> None:
    """Cycles of growing depth at one speed, without a pause: time and motion cannot be separated."""
    turns = np.stack([np.zeros(7), np.linspace(0.3, 1.0, 7)], axis=1).ravel()
    way = np.r_[0.0, np.cumsum(np.abs(np.diff(turns)))]
    time = np.arange(0.0, way[-1], way[-1] / 3500)
    x = np.interp(time, way, turns)
    springs = sum((x - play(x, radius)) / radius for radius in (0.02, 0.05, 0.1, 0.2, 0.4))
    force = with_noise(0.5 * x + 0.1 * springs, 0.003)
    model = palpate.identify(x, force, time=time)
    assert model.memory is not None
    (reason,) = (each for each in model.verdict.reasons if "relaxes with time" in each)
    assert "depends on earlier motion" in reason
    assert "speed was nearly constant" in reason
    assert reason.endswith("Cure: wait in contact for some seconds, or record slow and fast strokes")
    # both errors are those of the recorded rows, not of the curve of the force at rest
    assert model.notes["error_rows"] == len(x)
    assert model.notes["left_out_nrmse"] < 1.5 * model.fit.nrmse


def test_an_identified_memory_is_planned_saved_and_verified(tmp_path: Path) -> None:
    model = identified(0.7)
    model.save(tmp_path / "model.json")
    read = palpate.load_model(tmp_path / "model.json")
    assert read == model
    other_time, other = ramps_and_holds(7)
    fresh = relaxing([2.0], [0.7]).force_over_time(other_time, other)[0]
    assert palpate.verify(read, other, fresh, time=other_time).nrmse < 0.02


@pytest.mark.full
def test_measured_relaxation_of_four_stretches_is_one_model(data: Path) -> None:
    files = sorted((data / "vhb4910_viscoelastic").glob("relax_*.csv"))
    model = palpate.identify(files)
    assert model.memory is not None
    assert model.fit.nrmse <= 0.05
    # a force that changes at the same position does not mean two objects in one file
    assert model.verdict.level == "good"


@pytest.mark.full
def test_friction_that_creeps_in_pauses_gives_no_memory() -> None:
    """The rows of the pauses alone would accept a memory: they are half of the recording."""
    step, pause = 0.01, 1500
    way = np.tile(np.repeat([1.0, 0.0, -1.0, 0.0], [300, pause, 300, pause]), 2)
    position = np.cumsum(way) / 300.0
    moving = np.maximum.accumulate(np.where(way != 0.0, np.arange(len(way)), 0))
    kept = 0.5 + 0.5 * np.exp(-step * (np.arange(len(way)) - moving))
    turned = np.clip((position - play(position, 0.05, start=0.0)) / 0.05, -1.0, 1.0)
    force = position + 0.3 * turned * kept
    model = palpate.identify(position, with_noise(force, 0.01), time=step * np.arange(len(way)))
    assert model.memory is None
    assert model.hysteretic
    at = np.linspace(0.2, 0.8, 50)
    loop = model.force(at, direction=np.ones(50)) - model.force(at, direction=-np.ones(50))
    assert loop == pytest.approx(0.6, rel=0.05)


def slipping(position: np.ndarray) -> np.ndarray:
    """Returns the force of two springs that slip from stretches of 0.05 and 0.3 on, and of a soft one."""
    return 0.5 * position + sum(
        k * (position - play(position, most, start=position[0])) for k, most in ((4.0, 0.05), (1.5, 0.3))
    )


def growing(*amplitudes: float) -> np.ndarray:
    """Returns the positions of cycles of these amplitudes."""
    turns = np.array([0.0, *np.ravel([(a, -a) for a in amplitudes]), 0.0])
    at = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(turns)))])
    return np.interp(np.arange(0.0, at[-1], 0.008), at, turns)


@pytest.mark.parametrize("timed", [True, False])
def test_loops_that_grow_with_the_distance_become_branches_that_slip(timed: bool) -> None:
    """Branches that only slip depend on the order of rows, so that a recording needs no time."""
    position = growing(0.2, 0.5, 1.0)
    time = np.linspace(0.0, 30.0, len(position)) if timed else None
    recording = Recording.from_arrays(position, with_noise(slipping(position), 0.005), time)
    model = palpate.identify(recording)
    assert model.memory is not None
    assert np.isinf(model.memory.time_constant_s).all()
    np.testing.assert_allclose(model.memory.yield_stretch, [0.05, 0.3], rtol=0.05)
    np.testing.assert_allclose(model.memory.stiffness, [4.0, 1.5], rtol=0.05)
    other = growing(0.8, 0.1, 0.6)
    fresh = Recording.from_arrays(other, slipping(other), None)
    assert palpate.verify(model, fresh).nrmse < 0.01
    assert any("slip from stretches" in line for line in model.notes["identification"])


@pytest.mark.parametrize("seed", sampled([1, 2], 1))
def test_one_branch_that_slips_is_the_play_operator_of_hysteresis(seed: int) -> None:
    time, position = ramps_and_holds(seed)
    position = gaussian_filter1d(position, 5)
    force = 2.0 * position + 0.3 * np.sin(5.0 * position) + 15.0 * (position - play(position, 0.01))
    model = palpate.identify(position, with_noise(force, 0.003, seed), time=time)
    assert model.memory is None
    assert model.play_radius == pytest.approx(0.01, rel=0.05)


def left_pad() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Returns time, position and force of a pad with one branch that the tool leaves between its presses."""
    step, tau, ways = 0.02, 0.6, []
    for speed in (0.5, 2.0, 8.0):
        press = np.arange(-0.3, 3.7, speed * step)
        ways += [np.full(75, -0.3), press, np.full(75, 3.7), press[::-1]]
    x = np.concatenate([*ways, np.full(75, -0.3)])
    branch = np.zeros(len(x))
    for row in range(1, len(x)):
        stretch = branch[row - 1] + max(x[row], 0.0) - max(x[row - 1], 0.0)
        branch[row] = stretch / (1.0 + step / tau) if x[row] > 0.0 else 0.0
    force = np.maximum(0.15 * np.maximum(x, 0.0) + 0.12 * branch, 0.0)
    return step * np.arange(len(x)), x, force + np.random.default_rng(0).normal(0.0, 0.003, len(x))


def test_a_pad_that_the_tool_leaves_gets_a_memory() -> None:
    """A network of position and velocity fits the motion as well, but not the waits."""
    time, x, force = left_pad()
    model = palpate.identify(x, force, time=time)
    assert model.memory is not None
    assert model.below == "free"
    np.testing.assert_allclose(model.memory.time_constant_s, [0.6], rtol=0.05)
    held = x == x.max()
    error = (model.force_over_time(time, x)[0] - force)[held]
    assert np.sqrt(np.mean(error**2)) < 0.02 * np.ptp(force[held])


@pytest.mark.full
def test_a_mirrored_pad_gets_the_error_of_the_model_that_is_returned() -> None:
    time, x, force = left_pad()
    model = palpate.identify(-x, -force, time=time)
    assert model.memory is not None
    assert (model.below, model.above) == ("linear", "free")
    np.testing.assert_allclose(model.memory.time_constant_s, [0.6], rtol=0.05)
    found = model.force_over_time(time, -x)[0]
    assert found.max() <= 0.0
    weight = balanced(np.diff(x, prepend=0.0) != 0.0)
    spread = np.sqrt(np.average((force - np.average(force, weights=weight)) ** 2, weights=weight))
    error = np.sqrt(np.average((found + force) ** 2, weights=weight)) / spread
    assert model.fit.nrmse == pytest.approx(error, rel=0.02)
    verified = palpate.verify(model, Recording.from_arrays(-x, -force, time))
    assert verified.settled_nrmse == pytest.approx(error, rel=0.02)


@pytest.mark.full
def test_long_waits_do_not_hide_an_error_of_the_strokes() -> None:
    """Each stroke is stiffer than the one before; the waits are not."""
    errors = []
    for wait in (30, 300):
        press, stays = np.linspace(0.1, 1.0, 60), np.ones(wait)
        position = np.tile(np.concatenate([press, stays, press[::-1], 0.1 * stays]), 4)
        time, stroke = 0.02 * np.arange(len(position)), np.repeat(np.arange(4), 2 * (60 + wait))
        stiffer = np.where(np.diff(position, prepend=0.1) != 0.0, 0.82 + 0.12 * stroke, 1.0)
        force = stiffer * relaxing([2.0], [0.7]).force_over_time(time, position)[0]
        model = palpate.identify(position, with_noise(force, 0.005), time=time)
        assert any("from the first row to the last" in each for each in model.verdict.reasons)
        errors.append(model.fit.nrmse)
    assert min(errors) > 0.1


def test_rows_that_wait_count_at_most_as_much_as_those_that_move() -> None:
    moving = np.repeat([True, False], [10, 40])
    assert balanced(moving)[~moving].sum() == pytest.approx(10.0)
    assert (balanced(moving)[moving] == 1.0).all()
    assert (balanced(~moving) == 1.0).all()


@pytest.mark.full
def test_strokes_that_differ_are_found_in_the_residual_of_the_memory() -> None:
    time, position = ramps_and_holds(1, 0.04)
    force = relaxing([2.0], [0.7]).force_over_time(time, position)[0] * (1.0 + 0.1 * time / time[-1])
    model = palpate.identify(position, with_noise(force, 0.005), time=time)
    assert model.memory is not None
    assert model.fit.nrmse < 0.1
    assert "from the first row to the last" in model.verdict.reasons[0]


def test_a_zero_that_drifts_is_not_a_branch_that_slips() -> None:
    """Branches that start at rest make the first stroke differ from the others too."""
    x = np.tile(np.r_[np.linspace(-0.5, 0.5, 200), np.linspace(0.5, -0.5, 200)], 2)
    force = 2.0 * x + 0.05 * np.clip((x - play(x, 0.005, start=x[0])) / 0.005, -1.0, 1.0)
    force -= 0.1 * np.linspace(0.0, 1.0, len(x))
    model = palpate.identify(x, force + np.random.default_rng(0).normal(0.0, 0.004, len(x)))
    assert model.memory is None
    assert "from the first row to the last" in model.verdict.reasons[0]
    assert "compared with a zero or an object that changes" in str(model.notes["model_selection"])


@pytest.mark.full
def test_an_object_that_softens_has_no_branches_that_slip() -> None:
    """Without the first press the force is a loop of friction, with a smaller error than that of branches."""
    random = np.random.default_rng(1)
    x = np.tile(np.r_[np.linspace(0.0, 1.0, 14), np.linspace(1.0, 0.0, 14)[1:-1]], 2)
    x += random.uniform(-0.02, 0.02, len(x))
    side = np.clip((x - play(x, 0.02, start=x[0])) / 0.02, -1.0, 1.0)
    soft = 1.0 - 0.2 * -np.expm1(-(np.maximum.accumulate(x) - x) / 0.1)
    force = (x + 0.9 * x**2) * (1.0 + 0.08 * side) * soft
    model = palpate.identify(x, force + random.normal(0.0, 0.003, len(x)))
    assert model.memory is None
    assert model.verdict.reasons[0].startswith("behind the first stroke over a position")


@pytest.mark.full
def test_branches_that_slip_explain_a_first_press_from_rest() -> None:
    x = np.tile(np.r_[np.linspace(0.0, 1.0, 40), np.linspace(1.0, 0.0, 40)[1:-1]], 3)
    force = x + sum(k * (x - play(x, r, start=x[0])) for k, r in ((0.6, 0.1), (0.5, 0.3), (0.4, 0.8)))
    model = palpate.identify(x, force + np.random.default_rng(0).normal(0.0, 0.004, len(x)))
    assert model.memory is not None


def test_a_large_rise_of_the_error_is_stated_as_a_multiple() -> None:
    text = squared_error_change(-569.79, 0.0)
    assert text == "raises the squared error on held-out sections to 571 times"


@pytest.mark.full
def test_a_network_of_velocity_is_judged_in_the_waits() -> None:
    """Limits of the slope exclude a memory."""
    time, x, force = left_pad()
    model = palpate.identify(x, force, time=time, slope_bounds=(-10.0, 10.0))
    assert (model.kind, model.verdict.level) == ("position_velocity", "usable")
    assert any("wait in contact) the force differs from the model" in each for each in model.verdict.reasons)

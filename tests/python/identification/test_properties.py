# SPDX-License-Identifier: Apache-2.0
"""Properties of identification that hold for every object: a change of unit, zero, order or sign of a
recording changes the model in the same way and nothing else; a plan follows the units too."""

import os
from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray

from conftest import sampled
from palpate import DeviceProfile, Model, Recording, identify, plan, verify
from palpate._core.model import play

SCALE = int(os.environ.get("PALPATE_TEST_SCALE", "1"))

Array = NDArray[np.float64]

KINDS = ("position", "hysteresis", "position_velocity", "memory")

ROWS = 1200

NOISE = 0.005
"""Standard deviation of the noise divided by that of the force"""

DECADES = 12
"""The units of position and of force vary over this number of decades"""

ROUNDING = 1e-12
"""Largest accepted change of the force by other units or another zero of position, divided by its range"""

RECOVERED = 1e-4
"""Largest accepted change of the force by another unit of time, divided by its range; a relaxation time is
found to a tolerance"""


def device(position: float = 1.0, force: float = 1.0) -> DeviceProfile:
    """Returns the profile of one device in other units."""
    stiffness = force / position
    return DeviceProfile(
        id="device",
        inertia=stiffness * 2e-4,
        viscous_damping=stiffness * 0.06,
        coulomb_friction=force * 0.005,
        encoder_step=position * 1e-4,
        force_step=force * 1e-3,
        force_limit=force * 20.0,
        delay_s=5e-4,
        jitter_s=1e-4,
    )


def recorded(kind: str, seed: int = 0) -> Recording:
    """Simulates pressing a contact with a ripple, and a force of the given kind."""
    random = np.random.default_rng(seed)
    time = np.arange(ROWS) / 1000.0
    x = 0.5 - 0.5 * np.cos(2.0 * np.pi * 1.7 * time) * np.exp(-0.2 * time)
    force = 5.0 * np.maximum(x - 0.4, 0.0) + 0.3 * np.sin(9.0 * x)
    if kind == "hysteresis":
        force += 0.3 * np.clip((x - play(x, 0.02)) / 0.02, -1.0, 1.0)
    elif kind == "position_velocity":
        force += 0.05 * np.gradient(x, time)
    elif kind == "memory":
        kept = np.exp(-0.001 / 0.05)
        branch = 0.0
        for row in range(1, ROWS):
            branch = kept * branch + 0.5 * (1.0 + kept) * (x[row] - x[row - 1])
            force[row] += 2.0 * branch
    force += random.normal(0.0, NOISE * np.std(force), ROWS)
    return Recording.from_arrays(x, force, time=time)


def changed(
    recording: Recording,
    position: float = 1.0,
    force: float = 1.0,
    time: float = 1.0,
    position_zero: float = 0.0,
    force_zero: float = 0.0,
) -> Recording:
    """Returns the recording in other units and with other zeros; a zero is stated in the old unit."""
    assert recording.time is not None
    return Recording.from_arrays(
        position * (recording.position + position_zero),
        force * (recording.force + force_zero),
        time=time * recording.time,
    )


def identified(recording: Recording | list[Recording], kind: str) -> Model:
    if kind == "position_velocity":
        return identify(recording, inputs=["position", "velocity"], max_wavelets=4)
    return identify(recording)


@cache
def reference(kind: str) -> Model:
    model = identified(recorded(kind), kind)
    assert model.kind == kind
    return model


def forces(model: Model, position: float = 1.0, time: float = 1.0, position_zero: float = 0.0) -> Array:
    """Returns the static force, or that of position and velocity, at positions in the units of the model."""
    x = recorded("position").position
    at = position * (x + position_zero)
    if model.kind == "position_velocity":
        velocity = np.gradient(x, 1e-3) * position / time
        return np.asarray(model.predict(np.column_stack([at, velocity])))
    return np.asarray(model.force(at, direction=1.0) if model.kind == "hysteresis" else model.force(at))


def units(draws: int, seed: int) -> list[tuple[float, float]]:
    """Returns random factors of position and force, and first the ends of the decades."""
    end = 10.0 ** (DECADES / 2)
    random = np.random.default_rng(seed)
    drawn = 10.0 ** random.uniform(-DECADES / 2, DECADES / 2, (draws, 2))
    return [(1.0 / end, end), (end, 1.0 / end), *((float(x), float(f)) for x, f in drawn)]


def assert_equal(kind: str, model: Model, force: Array, within: float = ROUNDING) -> None:
    """`force` is that of the model, in the units of the reference."""
    old = forces(reference(kind))
    assert model.kind == kind
    assert model.n_wavelets == reference(kind).n_wavelets
    assert np.abs(force - old).max() <= within * np.ptp(old)


@pytest.mark.parametrize("kind", sampled(KINDS, "position"))
def test_a_change_of_units_changes_the_units_of_the_model_only(kind: str) -> None:
    for x, f in units(2 * (SCALE - 1), 0):
        model = identified(changed(recorded(kind), position=x, force=f), kind)
        assert_equal(kind, model, forces(model, position=x) / f)


@pytest.mark.parametrize("kind", sampled(KINDS, "position"))
def test_units_of_powers_of_two_give_the_same_model_bit_by_bit(kind: str) -> None:
    x, f = 2.0**20, 2.0**-20
    model = identified(changed(recorded(kind), position=x, force=f), kind)
    assert np.array_equal(forces(model, position=x) / f, forces(reference(kind)))


@pytest.mark.parametrize("kind", sampled(["position_velocity", "memory"], "position_velocity"))
@pytest.mark.parametrize("factor", sampled([1e-3, 1e3], 1e3))
def test_a_change_of_the_unit_of_time_changes_velocities_and_relaxation_times_only(
    kind: str, factor: float
) -> None:
    model = identified(changed(recorded(kind), time=factor), kind)
    assert_equal(kind, model, forces(model, time=factor), RECOVERED)
    if kind == "memory":
        old, new = reference(kind).memory, model.memory
        assert old is not None
        assert new is not None
        assert new.time_constant_s == pytest.approx(factor * old.time_constant_s, rel=1e-4)


@pytest.mark.parametrize("kind", sampled(KINDS, "position"))
@pytest.mark.parametrize(
    ("position_zero", "force_zero", "within"), [(1e3, 0.0, ROUNDING), (0.0, -1e3, NOISE)]
)
def test_another_zero_moves_the_model_only(
    kind: str, position_zero: float, force_zero: float, within: float
) -> None:
    model = identified(changed(recorded(kind), position_zero=position_zero, force_zero=force_zero), kind)
    assert_equal(kind, model, forces(model, position_zero=position_zero) - force_zero, within)


@pytest.mark.parametrize("kind", sampled(KINDS, "position"))
def test_the_order_of_recordings_has_no_effect(kind: str) -> None:
    pair = [recorded(kind, seed) for seed in (0, 1)]
    model, turned = identified(pair, kind), identified(pair[::-1], kind)
    spread = np.ptp(forces(model))
    assert turned.kind == model.kind
    assert np.abs(forces(turned) - forces(model)).max() <= NOISE * spread


@pytest.mark.parametrize("kind", sampled(KINDS, "position"))
def test_a_recording_that_is_given_twice_has_no_other_model(kind: str) -> None:
    model = identified([recorded(kind), recorded(kind)], kind)
    assert model.kind == kind
    old = forces(reference(kind))
    assert np.abs(forces(model) - old).max() <= NOISE * np.ptp(old)


@pytest.mark.parametrize("kind", sampled(KINDS, "position"))
def test_both_signs_reversed_reverse_the_force(kind: str) -> None:
    model = identified(changed(recorded(kind), position=-1.0, force=-1.0), kind)
    assert model.kind == kind
    old = forces(reference(kind))
    if kind == "hysteresis":
        new = -np.asarray(model.force(-recorded("position").position, direction=-1.0))
    else:
        new = -forces(model, position=-1.0)
    assert np.abs(new - old).max() <= NOISE * np.ptp(old)


@pytest.mark.parametrize("kind", sampled(["position", "hysteresis", "memory"], "hysteresis"))
def test_a_network_is_identified_from_its_own_force(kind: str) -> None:
    recording = recorded(kind)
    assert recording.time is not None
    prediction = verify(reference(kind), recording).prediction
    noise = np.random.default_rng(1).normal(0.0, 1e-3 * np.std(prediction.force), len(prediction.force))
    rows = prediction.rows
    own = Recording.from_arrays(recording.position[rows], prediction.force + noise, time=recording.time[rows])
    model = identified(own, kind)
    assert model.kind == kind
    assert model.fit.nrmse <= 1.2e-3
    assert model.n_parameters <= 1.5 * reference(kind).n_parameters


@pytest.mark.parametrize("kind", sampled(KINDS, "position"))
def test_a_plan_has_the_same_margins_in_all_units(kind: str) -> None:
    old = plan(reference(kind), device()).certificate
    assert old is not None
    for x, f in units(SCALE - 1, 1):
        model = identified(changed(recorded(kind), position=x, force=f), kind)
        new = plan(model, device(x, f)).certificate
        assert new is not None
        assert new.certified == old.certified
        for one, two in zip(old.inequalities, new.inequalities, strict=True):
            assert one.id == two.id
            assert one.left * two.right == pytest.approx(one.right * two.left, rel=1e-3)

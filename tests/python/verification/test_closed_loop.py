# SPDX-License-Identifier: Apache-2.0
"""Simulated rendering of recorded motions and of recorded forces, and recordings without time."""

import re
from typing import Any

import numpy as np
import pytest

from palpate import InputError, Model, Recording, Scheme
from palpate.recording import sample_recording
from palpate.verification import force_driven, motion_driven
from palpate.verification.closed_loop import even_motion

RAD = {"position": "rad", "force": "N*m"}


def spring(stiffness: float = 2.0, hysteresis: float = 0.0, **change: Any) -> Model:
    given: dict[str, Any] = {
        "units": RAD,
        "alpha": np.empty((0, 1)),
        "beta": np.empty((0, 1)),
        "weight": [],
        "linear": [stiffness],
        "lower": [-1.0],
        "upper": [1.0],
    }
    if hysteresis:
        given |= {"weight_hysteresis": [], "linear_hysteresis": [0.0], "bias_hysteresis": hysteresis}
    return Model.from_network(**given | change)


def sweep(stiffness: float = 2.0, timed: bool = True, seconds: float = 4.0) -> Recording:
    """Returns the recording of a spring whose handle starts at rest and moves slowly."""
    t = np.arange(round(seconds * 1000)) * 1e-3
    x = 0.25 * (1 - np.cos(np.pi * t))
    return Recording.from_arrays(x, stiffness * x, t if timed else None, units=RAD)


def test_a_recorded_motion_renders_the_recorded_force() -> None:
    recording = sweep()
    loop = motion_driven(spring(), recording)
    np.testing.assert_allclose(loop.rendered_force, recording.force, atol=1e-12)
    np.testing.assert_array_equal(loop.rendered_position, loop.recorded_position)
    assert loop.rmse < 1e-12
    assert (loop.view, loop.scheme.structure, loop.assumed_speed) == ("motion-driven", "direct", None)
    assert loop.status == {"Ok": len(recording)}
    assert loop.notes == ()


def test_a_coupling_makes_the_rendered_spring_softer() -> None:
    loop = motion_driven(spring(50.0), sweep(50.0), Scheme(structure="massless", coupling_stiffness=100.0))
    # In series with the coupling: K_c K / (K_c + K); the damping of the coupling has no effect at rest.
    turning = np.argmax(loop.recorded_position)
    assert loop.rendered_force[turning] == pytest.approx(0.5 * 50 * 100 / 150, rel=1e-3)
    assert loop.rmse > 1.0


def test_a_recorded_force_moves_the_environment_to_the_recorded_position() -> None:
    recording = sweep()
    loop = force_driven(spring(), recording)
    np.testing.assert_array_equal(loop.rendered_force, loop.recorded_force)
    # m y'' + B_o y' + K y = F = K x: |y/x| is 1/|1 + j B w/K - m w^2/K|.
    w = np.pi
    gain = 1 / abs(1 + 0.5j * w / 2.0 - 1e-3 * w**2 / 2.0)
    late = loop.rendered_position[2000:]
    assert np.ptp(late) == pytest.approx(0.5 * gain, rel=2e-3)
    assert (loop.scheme.structure, loop.scheme.mass, loop.scheme.object_damping) == ("explicit", 0.001, 0.5)


def test_the_error_of_a_force_driven_loop_is_that_of_the_position() -> None:
    loop = force_driven(spring(), sweep(), Scheme(structure="implicit", object_damping=0.0, mass=1e-4))
    difference = loop.rendered_position - loop.recorded_position
    assert loop.rmse == pytest.approx(np.sqrt(np.mean(difference**2)), rel=1e-12)
    assert loop.nrmse == pytest.approx(loop.rmse / np.std(loop.recorded_position), rel=1e-12)
    assert loop.nrmse < 0.02


@pytest.mark.parametrize(("stiffness", "structure"), [(2990.0, "explicit"), (3010.0, "implicit")])
def test_unstable_explicit_environment_is_replaced_and_reported(stiffness: float, structure: str) -> None:
    # Largest slope of the explicit structure: (4 m - 2 B_o T) / T^2 = 3000 at m = 0.001, B_o = 0.5, T = 1 ms.
    loop = force_driven(spring(stiffness), sweep(stiffness))
    assert loop.scheme.structure == structure
    assert loop.rmse < 0.01
    if structure == "implicit":
        assert "The implicit environment is used" in loop.notes[0]
        assert "stable below a slope of 3000, and the steepest slope of the model is 3010" in loop.notes[0]
    else:
        assert loop.notes == ()


def test_requested_implicit_environment_is_kept() -> None:
    loop = force_driven(spring(), sweep(), Scheme(structure="implicit"))
    assert loop.scheme.structure == "implicit"
    assert loop.notes == ()


@pytest.mark.parametrize("structure", ["direct", "massless"])
def test_a_force_can_drive_only_an_environment_with_mass(structure: str) -> None:
    with pytest.raises(InputError, match=f"structure is {structure}"):
        force_driven(spring(), sweep(), Scheme(structure=structure))


def test_hysteresis_is_rendered_with_a_play_radius_of_one_per_cent_of_the_travel() -> None:
    recording = sweep()
    loop = motion_driven(spring(hysteresis=0.1), recording)
    assert loop.scheme.play_radius == pytest.approx(0.02)
    assert recording.time is not None
    pressing = (recording.time > 0.5) & (recording.time < 0.9)
    releasing = (recording.time > 1.5) & (recording.time < 1.9)
    np.testing.assert_allclose((loop.rendered_force - recording.force)[pressing], 0.1, atol=1e-9)
    np.testing.assert_allclose((loop.rendered_force - recording.force)[releasing], -0.1, atol=1e-9)


def test_a_play_radius_that_is_known_is_used() -> None:
    model = spring(hysteresis=0.1, play_radius=0.05)
    assert motion_driven(model, sweep()).scheme.play_radius == 0.0
    assert force_driven(model, sweep()).scheme.play_radius == 0.0
    scheme = Scheme(structure="implicit", play_radius=0.03)
    assert force_driven(spring(hysteresis=0.1), sweep(), scheme).scheme.play_radius == 0.03


def test_sticking_counts_as_slope_of_the_explicit_environment() -> None:
    # In the stick phase the slope is K + h/r = 2 + 0.1 / 0.00003 > 3000.
    loop = force_driven(spring(hysteresis=0.1, play_radius=3e-5), sweep())
    assert loop.scheme.structure == "implicit"
    assert force_driven(spring(hysteresis=0.1, play_radius=4e-5), sweep()).scheme.structure == "explicit"


def test_a_recording_without_time_is_followed_at_an_assumed_speed() -> None:
    loop = motion_driven(spring(), sweep(timed=False))
    # The recording has four strokes of 0.5 rad; the assumed speed is 0.5 rad/s.
    assert loop.assumed_speed == pytest.approx(0.5)
    assert loop.time[-1] == pytest.approx(4.0, abs=2e-3)
    speed = np.abs(np.diff(loop.recorded_position)) / 1e-3
    assert np.median(speed) == pytest.approx(0.5, rel=1e-6)
    assert loop.rmse < 1e-12
    assert loop.notes == ("The recording has no time. A stroke speed of 0.5 rad/s is assumed.",)
    faster = motion_driven(spring(), sweep(timed=False), stroke_speed=1.0)
    assert faster.time[-1] == pytest.approx(2.0, abs=2e-3)


def test_rests_of_a_recording_without_time_take_no_time() -> None:
    x = np.repeat(np.linspace(0, 1, 101), 7)
    motion = even_motion(Recording.from_arrays(x, np.arange(707.0), units=RAD), 1e-3)
    assert motion.time[-1] == pytest.approx(1.0)
    np.testing.assert_allclose(motion.position, motion.time, atol=1e-12)
    assert np.isfinite(motion.force).all()


def test_an_even_recording_is_resampled_to_itself() -> None:
    recording = sweep()
    motion = even_motion(recording, 1e-3)
    np.testing.assert_allclose(motion.position, recording.position, atol=1e-12)
    np.testing.assert_allclose(motion.force, recording.force, atol=1e-12)


def test_an_uneven_recording_is_resampled_along_straight_lines() -> None:
    t = np.cumsum(np.random.default_rng(3).uniform(0.001, 0.02, 500)) + 7.0
    motion = even_motion(Recording.from_arrays(3 * t, -2 * t, t, units=RAD), 1e-3)
    assert motion.time[0] == 0.0
    assert t[-1] - t[0] - motion.time[-1] < 1e-3
    np.testing.assert_allclose(motion.position, 3 * (motion.time + t[0]), rtol=1e-12)
    np.testing.assert_allclose(motion.force, -2 * (motion.time + t[0]), rtol=1e-12)


def test_below_its_wall_the_sample_is_a_spring_to_within_its_noise() -> None:
    recording = sample_recording(1, 5.0)
    loop = motion_driven(spring(2.0, lower=[-0.2], upper=[0.3]), recording)
    soft = loop.recorded_position < 0.3
    assert np.std((loop.rendered_force - loop.recorded_force)[soft]) == pytest.approx(0.02, rel=0.05)


@pytest.mark.parametrize(
    ("recording", "options", "sentence"),
    [
        (sweep(), {"stroke_speed": 0.1}, "stroke_speed is given, but the recording has time"),
        (sweep(timed=False), {"stroke_speed": -1.0}, "stroke_speed is -1.0: must be > 0"),
        (sweep(), {"period_s": 0.0}, "period_s is 0.0: must be > 0"),
        (sweep(), {"period_s": 9.0}, "must be at least one sample of 9 s"),
        (sweep(), {"period_s": np.inf}, "period_s is inf: must be > 0 and finite"),
        (sweep(), {"period_s": 1e-12}, "samples of 1e-12 s: choose a larger period"),
        (sweep(timed=False), {"stroke_speed": np.inf}, "stroke_speed is inf: must be > 0 and finite"),
        (sweep(timed=False), {"stroke_speed": 1e-9}, "samples of 0.001 s: choose a higher stroke speed"),
        (sweep(timed=False), {"stroke_speed": 5e-324}, "more than 20000000 samples"),
        (
            Recording.from_arrays(np.ones(20), np.ones(20), units=RAD),
            {},
            "position of the recording is constant",
        ),
        (
            Recording.from_arrays([0.0, 1.0], [0.0, 1.0], units={"position": "m", "force": "N"}),
            {},
            "the position of the model is in rad, that of the recording in m",
        ),
    ],
)
def test_invalid_motion_is_refused_with_its_value(
    recording: Recording, options: dict[str, Any], sentence: str
) -> None:
    for drive in (motion_driven, force_driven):
        with pytest.raises(InputError, match=re.escape(sentence)):
            drive(spring(), recording, **options)


def test_unsuitable_scheme_is_refused_by_name() -> None:
    with pytest.raises(InputError, match="coupling_stiffness"):
        motion_driven(spring(), sweep(), Scheme(structure="massless", coupling_stiffness=0.0))
    with pytest.raises(InputError, match="mass"):
        force_driven(spring(), sweep(), Scheme(structure="implicit", mass=0.0))

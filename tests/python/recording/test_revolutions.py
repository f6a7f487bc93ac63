# SPDX-License-Identifier: Apache-2.0
"""An angle that jumps by a revolution continues if the jumps are certain to be those of an encoder."""

import numpy as np
import numpy.typing as npt
import pandas as pd
import pytest

import palpate
from palpate import Recording

Array = npt.NDArray[np.float64]

SWEEP = 450.0 * np.sin(np.linspace(0.0, 4.0 * np.pi, 1200))
"""Angle of a steering wheel [deg]"""


def frame(angle: Array, torque: Array) -> pd.DataFrame:
    """Returns a table of an angle [deg] and a torque with noise."""
    noise = np.random.default_rng(0).normal(0.0, 0.02, len(angle))
    return pd.DataFrame(
        {"time_s": 0.01 * np.arange(len(angle)), "angle_deg": angle, "torque_Nm": torque + noise}
    )


def wheel(angle: Array) -> Array:
    """Returns the torque of a wheel with a spring and friction."""
    return 2.0 * np.tanh(angle / 60.0) + 0.004 * angle + 0.4 * np.sign(np.gradient(angle))


def read(angle: Array, torque: Array) -> Array:
    """Returns the angles of a recording [deg]."""
    return np.degrees(Recording.from_frame(frame(angle, torque)).position)


@pytest.mark.parametrize("first", [0.0, -180.0])
def test_an_angle_that_jumps_by_a_revolution_continues_from_its_first_row(first: float) -> None:
    angle = np.round(np.mod(SWEEP - first, 360.0) + first, 1)
    assert read(angle, wheel(SWEEP)) == pytest.approx(SWEEP, abs=0.051)
    recording = Recording.from_frame(frame(angle, wheel(SWEEP)))
    jumps = np.count_nonzero(np.abs(np.diff(angle)) > 180.0)
    assert any(f"angle_deg jumps by a revolution in {jumps} rows" in note for note in recording.notes)


def test_arrays_in_radians_continue_and_arrays_without_a_unit_do_not() -> None:
    angle, units = np.radians(np.mod(SWEEP, 360.0)), {"position": "rad", "force": "N*m"}
    continued = Recording.from_arrays(angle, wheel(SWEEP), units=units)
    assert continued.position == pytest.approx(np.radians(SWEEP), abs=1e-9)
    assert "jumps by a revolution" in continued.notes[0]
    assert np.ptp(Recording.from_arrays(angle, wheel(SWEEP)).position) < 2.0 * np.pi


def test_the_model_of_a_wheel_whose_encoder_starts_again_is_good() -> None:
    model = palpate.identify(frame(np.round(np.mod(SWEEP, 360.0), 1), wheel(SWEEP)), max_wavelets=8)
    assert model.verdict.level == "good"
    assert np.degrees([model.lower[0], model.upper[0]]) == pytest.approx([-450.0, 450.0], abs=0.1)


def test_a_force_that_repeats_after_a_revolution_keeps_its_period() -> None:
    turned = np.concatenate([np.linspace(20.0, 900.0, 900), np.linspace(900.0, 20.0, 900)])
    torque = np.sin(np.radians(12.0 * turned)) + 0.2 * np.sign(np.gradient(turned))
    recording = Recording.from_frame(frame(np.mod(turned, 360.0), torque))
    found = palpate.identify(recording, max_wavelets=4)
    given = palpate.identify(recording, period=2.0 * np.pi, max_wavelets=4)
    assert found.period == 2.0 * np.pi / 12
    assert max(found.fit.nrmse, given.fit.nrmse) < 0.1


def test_rows_without_a_number_and_a_range_of_rows_do_not_change_the_angles(tmp_path: object) -> None:
    table = frame(np.mod(SWEEP, 360.0), wheel(SWEEP))
    table.loc[[100, 500], "angle_deg"] = np.nan
    path = f"{tmp_path}/wheel.csv"
    table.to_csv(path, index=False)
    recording = palpate.read_recording(path, invalid="drop", rows=(300, 1100))
    assert np.degrees(recording.position) == pytest.approx(np.delete(SWEEP, 500)[300:1099], abs=1e-6)


RAMP = np.linspace(0.0, 359.0, 300)


@pytest.mark.parametrize(
    ("angle", "torque"),
    [
        pytest.param(np.tile(RAMP, 3), np.tile(0.01 * RAMP, 3), id="a torsion spring turned again"),
        pytest.param(np.tile(0.95 * RAMP, 3), np.tile(np.sin(RAMP), 3), id="less than a revolution"),
        pytest.param(np.random.default_rng(1).permutation(RAMP), 0.01 * RAMP, id="rows without an order"),
        pytest.param(np.insert(RAMP / 3.0, 100, 355.0), np.linspace(0.0, 1.0, 301), id="a wrong reading"),
        pytest.param(np.mod(np.linspace(0.0, 2000.0, 19), 360.0), np.zeros(19), id="steps of 111 degrees"),
    ],
)
def test_jumps_that_may_not_be_those_of_an_encoder_are_kept(angle: Array, torque: Array) -> None:
    assert read(angle, torque) == pytest.approx(angle, abs=1e-9)

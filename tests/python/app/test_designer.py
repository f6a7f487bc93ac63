# SPDX-License-Identifier: Apache-2.0
"""Designer's numbers of a force curve, and curves that are changed by them."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import palpate
from palpate.app.designer import Curves, edited, recording_of, write_recording
from palpate.errors import InputError
from palpate.recording.units import UNITS

NUMBERS = {
    "peak force": 0.6,
    "peak position": 1.5e-3,
    "contact force": 0.3,
    "click travel": 0.4e-3,
    "stop position": 3.4e-3,
}
"""Wanted numbers [N, m]"""


def switch() -> Curves:
    """Returns a switch of straight lines: peak 0.5 N at 1 mm, contact 0.2 N at 2 mm, stop at 3 mm."""
    x = np.linspace(0.0, 4e-3, 401)
    press = np.interp(x, [0.0, 1e-3, 2e-3, 3e-3, 4e-3], [0.0, 0.5, 0.2, 0.3, 2.0])
    return Curves(x, press, press - 0.1 * np.minimum(1.0, x / 1e-4))


def value_of(curves: Curves, name: str) -> float:
    return curves.numbers()[name][0]


def test_the_numbers_are_those_of_the_drawn_lines() -> None:
    found = {name: value for name, (value, _) in switch().numbers().items()}
    assert found["peak force"] == pytest.approx(0.5)
    assert found["peak position"] == pytest.approx(1e-3)
    assert found["contact force"] == pytest.approx(0.2)
    assert found["snap ratio"] == pytest.approx(0.6)
    assert found["click travel"] == pytest.approx(1e-3)
    assert found["release point"] == pytest.approx(1e-3)
    assert found["stop position"] == pytest.approx(3e-3 + 0.2e-3 / 1.7, abs=5e-6)
    assert found["work"] == pytest.approx(1e-3 * (0.25 + 0.35 + 0.25 + 1.15), rel=1e-3)
    assert found["lost work"] == pytest.approx(0.1 * (4e-3 - 0.05e-3), rel=1e-3)


@pytest.mark.parametrize("name", NUMBERS)
def test_an_edited_number_is_reached(name: str) -> None:
    assert value_of(edited(switch(), {name: NUMBERS[name]}), name) == pytest.approx(NUMBERS[name], rel=5e-3)


def test_all_numbers_can_be_edited_together_with_the_hysteresis() -> None:
    found = edited(switch(), {**NUMBERS, "hysteresis": 2.0})
    for name, wanted in NUMBERS.items():
        assert value_of(found, name) == pytest.approx(wanted, rel=5e-3), name
    np.testing.assert_allclose(found.press - found.release, 2.0 * (switch().press - switch().release))


def test_an_object_without_a_click_is_edited_by_its_largest_force_and_travel() -> None:
    x = np.linspace(0.0, 1e-2, 801)
    spring = Curves(x, 100.0 * x, 100.0 * x)
    found = edited(spring, {"largest force": 2.0, "travel": 2e-2})
    np.testing.assert_allclose(found.press, 100.0 * found.position)
    with pytest.raises(InputError, match="peak force cannot be edited: choose one of largest force, travel"):
        edited(spring, {"peak force": 2.0})


def test_a_contact_behind_the_stop_is_refused() -> None:
    with pytest.raises(InputError, match="peak, contact, stop and end would not follow each other"):
        edited(switch(), {"click travel": 3e-3})


def test_an_edited_object_is_identified_with_its_numbers() -> None:
    model = palpate.identify(recording_of(switch(), source(), "none"))
    found = edited(Curves.of(model), {"peak force": 0.6, "hysteresis": 0.5})
    recording = recording_of(found, model, "peak force 0.6 N")
    assert recording.metadata["edited"].startswith("peak force 0.6 N; from the model of")
    between = np.arange(len(recording)) % 4 > 0
    again = Curves.of(palpate.identify(recording.without(between)))
    assert value_of(again, "peak force") == pytest.approx(0.6, rel=0.01)
    assert value_of(again, "lost work") == pytest.approx(0.5 * value_of(switch(), "lost work"), rel=0.02)


@cache
def source() -> palpate.Model:
    """Returns a model, of which an edited recording takes only the units and the names of the files."""
    return palpate.identify(switch().position, switch().position)


def test_an_edited_recording_keeps_the_units_of_the_file(tmp_path: Path) -> None:
    made = recording_of(switch(), source(), "peak force 60 gf")
    made = replace(made, units={"position": "m", "force": "N"})
    write_recording(made, {"position": UNITS["mm"], "force": UNITS["gf"]}, tmp_path / "edited.csv")
    read = palpate.read_recording(tmp_path / "edited.csv")
    assert read.source.columns["force"] == "force [gf]"
    assert read.metadata["edited"] == made.metadata["edited"]
    np.testing.assert_allclose(read.position, made.position, atol=1e-12)
    np.testing.assert_allclose(read.force, made.force, atol=1e-12)
    assert read.direction is not None
    np.testing.assert_array_equal(read.direction, made.direction)


def test_the_click_is_the_first_fall_and_not_a_larger_one_at_the_stop() -> None:
    x = np.linspace(0.0, 4e-3, 801)
    press = np.interp(x, [0.0, 1e-3, 2e-3, 3.6e-3, 3.61e-3, 4e-3], [0.0, 0.5, 0.4, 1.2, 0.8, 2.0])
    found = {name: value for name, (value, _) in Curves(x, press, press).numbers().items()}
    assert (found["peak force"], found["contact force"]) == pytest.approx((0.5, 0.4))
    assert found["peak position"] == pytest.approx(1e-3)

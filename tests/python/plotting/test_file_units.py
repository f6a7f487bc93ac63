# SPDX-License-Identifier: Apache-2.0
"""Figures of a file show the units of the file."""

from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

from palpate import Recording, identify, read_recording
from palpate.plotting import draw_forces, draw_model, draw_recording


@pytest.fixture
def inches(tmp_path: Path) -> Recording:
    x = np.r_[np.linspace(0.0, 0.2, 60), np.linspace(0.2, 0.0, 60)]
    path = tmp_path / "press.csv"
    rows = (f"{each:.5f},{10.0 * each:.5f}" for each in x)
    path.write_text("\n".join(["Travel (inch),Load (lbs)", *rows, ""]))
    return read_recording(path)


def test_a_recording_is_drawn_in_the_units_of_its_file(inches: Recording) -> None:
    axes = Figure().subplots()
    draw_recording(axes, inches)
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("position [in]", "force [lbf]")
    (dots,) = axes.get_lines()
    assert np.max(dots.get_xdata()) == pytest.approx(0.2)
    assert np.max(dots.get_ydata()) == pytest.approx(2.0)


def test_a_model_on_the_axes_of_a_recording_has_the_same_units(inches: Recording) -> None:
    axes = Figure().subplots()
    draw_recording(axes, inches)
    draw_model(axes, identify(inches))
    assert np.max(axes.get_lines()[-1].get_ydata()) == pytest.approx(2.0, rel=0.01)


def test_a_force_of_position_and_velocity_is_drawn_as_few_dots_not_as_an_area(inches: Recording) -> None:
    axes = Figure().subplots()
    draw_forces(axes, inches, inches.force, one_curve=False)
    assert axes.get_lines()[-1].get_linestyle() == "None"

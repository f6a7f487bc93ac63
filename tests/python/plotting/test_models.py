# SPDX-License-Identifier: Apache-2.0
"""Figures of a model: drawn data, units, and lines that differ in black and white."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from palpate import Recording
from palpate.plotting import draw_measured_and_modelled

UNITS = {"position": "rad", "force": "N*m"}


def press_and_release(n: int = 50) -> Recording:
    position = np.concatenate([np.linspace(0.0, 1.0, n), np.linspace(1.0, 0.0, n)])
    force = 2.0 * position + np.repeat([0.1, -0.1], n)
    return Recording.from_arrays(position, force, direction=np.repeat([1, -1], n), units=UNITS)


def axes(rows: int) -> list[Axes]:
    return list(Figure().subplots(rows, squeeze=False)[:, 0])


def legend(of: Axes) -> list[str]:
    found = of.get_legend()
    assert found is not None
    return [text.get_text() for text in found.get_texts()]


def test_both_strokes_have_their_dots_and_their_line() -> None:
    recording = press_and_release()
    force, residual = axes(2)
    draw_measured_and_modelled(force, residual, recording, 2.0 * recording.position)
    assert legend(force) == ["measured, press", "measured, release", "model, press", "model, release"]
    press, release = force.lines[2:]
    assert press.get_linestyle() != release.get_linestyle()
    assert force.lines[0].get_markerfacecolor() != force.lines[1].get_markerfacecolor()


def test_a_recording_without_directions_is_one_stroke() -> None:
    recording = Recording.from_arrays([0.0, 1.0, 2.0], [0.0, 1.0, 2.0], units=UNITS)
    force, residual = axes(2)
    draw_measured_and_modelled(force, residual, recording, recording.force, seen="rendered")
    assert legend(force) == ["rendered", "model"]


def test_residuals_are_measured_minus_modelled() -> None:
    recording = press_and_release()
    force, residual = axes(2)
    draw_measured_and_modelled(force, residual, recording, 2.0 * recording.position)
    np.testing.assert_allclose(residual.lines[0].get_ydata(), 0.1)
    np.testing.assert_allclose(residual.lines[1].get_ydata(), -0.1)


def test_a_model_s_curve_runs_over_increasing_position_and_a_loop_in_its_order() -> None:
    position = np.array([0.0, 2.0, 1.0, 3.0])
    recording = Recording.from_arrays(position, position, units=UNITS)
    for one_curve, expected in ((True, np.sort(position)), (False, position)):
        force, residual = axes(2)
        draw_measured_and_modelled(force, residual, recording, position, one_curve=one_curve)
        np.testing.assert_array_equal(force.lines[-1].get_xdata(), expected)


def test_axes_carry_the_units_of_the_recording() -> None:
    recording = press_and_release()
    force, residual = axes(2)
    draw_measured_and_modelled(force, residual, recording, recording.force)
    assert residual.get_xlabel() == "position [rad]"
    assert force.get_ylabel() == "force [N·m]"
    assert residual.get_ylabel() == "residual [N·m]"


def test_an_object_of_millimetres_is_drawn_in_millimetres() -> None:
    x = np.linspace(0.0, 0.004, 50)
    recording = Recording.from_arrays(x, 100.0 * x, units={"position": "m", "force": "N"})
    force, residual = axes(2)
    draw_measured_and_modelled(force, residual, recording, 99.0 * x)
    assert residual.get_xlabel() == "position [mm]"
    assert force.get_ylabel() == "force [N]"
    assert residual.get_ylabel() == "residual [mN]"
    np.testing.assert_allclose(force.lines[0].get_xdata(), 1e3 * x)
    np.testing.assert_allclose(residual.lines[0].get_ydata(), 1e3 * x)


def test_legend_does_not_cover_curves() -> None:
    recording = press_and_release()
    force, residual = axes(2)
    draw_measured_and_modelled(force, residual, recording, recording.force)
    legend_box = force.get_legend()
    assert legend_box is not None
    force.figure.draw_without_rendering()
    assert legend_box.get_window_extent().y0 >= force.get_window_extent().y1

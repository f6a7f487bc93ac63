# SPDX-License-Identifier: Apache-2.0
"""Tests of the views of a force history: labels with units, common frequency axes, drawn values."""

from typing import Any

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.collections import QuadMesh
from matplotlib.figure import Figure

from conftest import sampled
from palpate import Recording
from palpate.plotting import draw_views, history_of
from palpate.plotting.analysis import MOST_COLUMNS, SHOWN_RANGE

VIEWS = ("history", "position", "spectrum", "short-time", "wavelet")


def views(recording: Recording) -> dict[str, Axes]:
    """Returns the axes of all views, which contain their lines and texts before the figure is drawn."""
    figure = Figure(figsize=(12.0, 4.0), layout="constrained")
    axes: dict[str, Axes] = figure.subplot_mosaic([list(VIEWS)])  # type: ignore[list-item]
    draw_views(axes, recording, history_of(recording))
    return axes


def drawn(recording: Recording) -> dict[str, Axes]:
    """Returns the axes of all views after the figure was drawn."""
    axes = views(recording)
    axes["history"].figure.draw_without_rendering()
    return axes


def with_time(n: int = 4000, amplitude: float = 2e-3) -> Recording:
    time = 1e-3 * np.arange(n)
    force = amplitude * np.sin(2.0 * np.pi * 30.0 * time)
    return Recording.from_arrays(0.01 * np.sin(time), force, time, units={"position": "m", "force": "N"})


@pytest.fixture(scope="module")
def timed() -> dict[str, Axes]:
    """Returns the views of a recording with time."""
    return drawn(with_time())


def mesh_of(axes: Axes) -> Any:
    (mesh,) = (each for each in axes.collections if isinstance(each, QuadMesh))
    return mesh


def test_labels_state_the_units_of_a_recording_with_time(timed: dict[str, Axes]) -> None:
    assert timed["history"].get_xlabel() == "time [s]"
    assert timed["history"].get_ylabel() == "force [mN]"
    assert timed["position"].get_xlabel() == "position [mm]"
    assert timed["spectrum"].get_xlabel() == "power [mN\u00b2]"
    assert {timed[name].get_ylabel() for name in VIEWS[2:]} == {"frequency [Hz]"}
    bars = [each.get_xlabel() for each in timed["history"].figure.axes if each not in timed.values()]
    assert bars == ["amplitude [mN]", "amplitude [mN]"]


@pytest.mark.parametrize(
    ("unit", "label"),
    [
        ("m", "frequency [1/mm]"),
        pytest.param("rad", "frequency [1/rad]", marks=pytest.mark.full),
        pytest.param("", "frequency", marks=pytest.mark.full),
    ],
)
def test_labels_state_the_units_of_a_recording_without_time(unit: str, label: str) -> None:
    scale = 1e-3 if unit == "m" else 1.0
    x = scale * np.linspace(0.0, 4.0, 500)
    recording = Recording.from_arrays(x, np.sin(9.0 * x / scale), units={"position": unit, "force": "N*m"})
    axes = drawn(recording)
    assert {axes[name].get_ylabel() for name in VIEWS[2:]} == {label}
    assert axes["history"].get_xlabel() == axes["short-time"].get_xlabel() == axes["position"].get_xlabel()
    assert axes["spectrum"].get_xlabel() == "power [(N\u00b7m)\u00b2]"


def test_the_transforms_share_one_frequency_axis(timed: dict[str, Axes]) -> None:
    assert len({timed[name].get_ylim() for name in VIEWS[2:]}) == 1
    assert timed["spectrum"].get_ylim() == pytest.approx((0.25, 500.0), rel=1e-3)


def test_drawn_amplitudes_are_in_the_unit_of_the_colour_bar(timed: dict[str, Axes]) -> None:
    for name in ("short-time", "wavelet"):
        mesh = mesh_of(timed[name])
        assert mesh.norm.vmax == pytest.approx(2.0, rel=0.15)
        assert mesh.norm.vmin == pytest.approx(mesh.norm.vmax / SHOWN_RANGE)
        assert mesh.get_array().shape[1] <= MOST_COLUMNS


def test_a_short_peak_stays_visible_in_few_columns() -> None:
    time = 1e-3 * np.arange(10_000)
    force = np.exp(-0.5 * ((time - 7.0) / 0.003) ** 2)
    mesh = mesh_of(views(Recording.from_arrays(np.sin(time), force, time))["wavelet"])
    amplitude = np.asarray(mesh.get_array())
    level, column = np.unravel_index(np.argmax(amplitude), amplitude.shape)
    corners = mesh.get_coordinates()
    assert corners[level, column, 0] - 0.03 <= 7.0 <= corners[level, column + 1, 0] + 0.03
    assert amplitude.max() > 0.5


@pytest.mark.parametrize(
    ("n", "amplitude"), sampled([(10, 0.0), (10, 1.0), (11, 0.0), (11, 1.0)], (10, 1.0), (11, 0.0))
)
def test_short_and_constant_recordings_are_drawn(n: int, amplitude: float) -> None:
    axes = drawn(with_time(n, amplitude))
    assert all(each.has_data() for each in axes.values())


def test_press_and_release_are_distinguished() -> None:
    x = np.concatenate([np.linspace(0.0, 1.0, 50), np.linspace(1.0, 0.0, 50)])
    direction = np.repeat([1, -1], 50)
    axes = views(Recording.from_arrays(x, x + 0.1 * direction, direction=direction))
    legend = axes["position"].get_legend()
    assert legend is not None
    assert [text.get_text() for text in legend.get_texts()] == ["recorded, press", "recorded, release"]


def test_gaps_in_time_are_grey() -> None:
    recording = with_time()
    assert recording.time is not None
    axes = views(recording.without((recording.time > 1.0) & (recording.time < 2.0)))
    for name in ("history", "short-time", "wavelet"):
        assert len(axes[name].patches) == 1

# SPDX-License-Identifier: Apache-2.0
"""Figures draw what they are given, in its units, so that black and white can tell it apart."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from palpate import Recording, identify, read_recording, verify
from palpate.cli.figures import picture_path, picture_verification
from palpate.plotting import draw_measured_and_modelled, draw_real_against_rendered, draw_structures
from palpate.plotting.look import MOST_POINTS, label, scale_for, strokes, thinned

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


def test_recorded_is_dotted_and_rendered_is_solid() -> None:
    x = np.linspace(0.0, 1.0, 20)
    (one,) = axes(1)
    draw_real_against_rendered(one, (x, x), (x, 2 * x), UNITS, title="driven by the motion")
    recorded, rendered = one.lines
    assert (recorded.get_linestyle(), recorded.get_marker()) == ("None", ".")
    assert (rendered.get_linestyle(), rendered.get_marker()) == ("-", "None")
    np.testing.assert_array_equal(rendered.get_ydata(), 2 * x)
    assert one.get_title() == "driven by the motion"


def test_structures_stand_from_top_to_bottom_with_both_errors() -> None:
    (one,) = axes(1)
    draw_structures(one, ["direct", "implicit, m = 0.001, B_o = 0"], [0.1, 0.2], [0.01, 0.15], "N")
    mean, end = one.lines
    np.testing.assert_array_equal(mean.get_xdata(), [0.1, 0.2])
    np.testing.assert_array_equal(end.get_xdata(), [0.01, 0.15])
    assert mean.get_markerfacecolor() != end.get_markerfacecolor()
    low, high = one.get_ylim()
    assert low > high, "the first structure stands at the top"
    assert one.get_xlabel() == "force error, RMS [N]"


@pytest.mark.parametrize("n", [1, 10, MOST_POINTS, MOST_POINTS + 1, 10 * MOST_POINTS + 7])
def test_no_more_is_drawn_than_a_column_can_show(n: int) -> None:
    x, y = thinned(np.arange(n, dtype=float), np.arange(n, dtype=float))
    assert min(n, MOST_POINTS // 2) <= len(x) <= MOST_POINTS
    np.testing.assert_array_equal(x, y)


def test_pauses_belong_to_no_stroke() -> None:
    direction = np.array([1, 0, -1, 0], dtype=np.int8)
    told_apart = dict(strokes(direction, 4))
    np.testing.assert_array_equal(told_apart["press"], [True, False, False, False])
    np.testing.assert_array_equal(told_apart["release"], [False, False, True, False])
    assert [name for name, _ in strokes(np.array([1, 0], dtype=np.int8), 2)] == [""]


def test_a_unit_that_is_not_known_is_not_invented() -> None:
    assert label("force", "") == "force"


@pytest.mark.parametrize(
    ("unit", "largest", "shown", "factor"),
    [
        ("m", 0.0041, "mm", 1e3),
        ("m", 0.1, "m", 1.0),
        ("m", 0.0999, "mm", 1e3),
        ("m", 5e-5, "\u00b5m", 1e6),
        ("N", 0.5, "N", 1.0),
        ("N", 0.02, "mN", 1e3),
        ("N", 1000.0, "kN", 1e-3),
        ("N*m", 0.005, "mN*m", 1e3),
        ("rad", 0.47, "rad", 1.0),
        ("rad", 0.05, "mrad", 1e3),
        ("rad", 5000.0, "rad", 1.0),
        ("count", 5000.0, "count", 1.0),
        ("", 1e-5, "", 1.0),
        ("N", 0.0, "N", 1.0),
    ],
)
def test_the_prefix_of_a_unit_follows_the_largest_value(
    unit: str, largest: float, shown: str, factor: float
) -> None:
    for values in ([largest, 0.0], [-largest, np.nan]):
        scale = scale_for(unit, values)
        assert scale.unit == shown
        assert scale.factor == pytest.approx(factor)


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


def test_a_legend_hides_nothing_that_is_drawn() -> None:
    recording = press_and_release()
    force, residual = axes(2)
    draw_measured_and_modelled(force, residual, recording, recording.force)
    legend_box = force.get_legend()
    assert legend_box is not None
    force.figure.draw_without_rendering()
    assert legend_box.get_window_extent().y0 >= force.get_window_extent().y1


def test_the_title_of_a_figure_names_source_and_error(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    titles: list[str] = []
    savefig = Figure.savefig

    def looked_at(figure: Figure, *arguments: Any, **options: Any) -> None:
        titles.append(figure.get_suptitle())
        savefig(figure, *arguments, **options)

    monkeypatch.setattr(Figure, "savefig", looked_at)
    source = press_and_release().write(tmp_path / "press.csv")
    recording = read_recording(source)
    model = identify(recording)
    verification = verify(model, recording)
    picture_verification(tmp_path / "a.png", model, [(recording, verification)])
    picture_path(tmp_path / "b.png", model)
    assert titles[0] == f"press.csv\nNRMSE {verification.nrmse:.4g} on {len(recording)} rows"
    assert titles[1].startswith("press.csv\n")
    assert f"NRMSE {model.fit.nrmse:.4g}" in titles[1]

# SPDX-License-Identifier: Apache-2.0
"""Tests of the figures of the frame: drawn bounds, and the grid over a domain."""

import numpy as np
import pytest
from matplotlib.figure import Figure

from palpate import frame_bounds
from palpate.plotting import draw_frame_bounds, draw_frame_grid
from palpate.plotting.frame import STEPS


def test_the_drawn_lines_are_the_frame_bounds() -> None:
    bounds, voices, scales = Figure().subplots(1, 3)
    draw_frame_bounds(bounds, voices, scales, voices=(1, 2), scales=(1.5, 2.0))
    low, high = np.array([frame_bounds(2.0, float(step)) for step in STEPS]).T
    drawn_low, drawn_high = (np.asarray(line.get_ydata()) for line in bounds.lines[:2])
    assert drawn_high == pytest.approx(high)
    assert drawn_low[low > 0.0] == pytest.approx(low[low > 0.0])
    for axes, line in ((voices, 0), (scales, 1)):  # one voice with a0 = 2 in both axes
        ratio = np.asarray(axes.lines[line].get_ydata())
        assert ratio[low > 0.0] == pytest.approx((high / low)[low > 0.0])
        assert np.isnan(ratio[low <= 0.0]).all()
        assert (low <= 0.0).any()
    assert [text.get_text() for text in voices.get_legend().get_texts()] == ["1 voice", "2 voices"]


@pytest.mark.parametrize(("scale", "step"), [(2.0, 0.5), (1.5, 1.0)])
def test_the_grid_has_the_ratio_and_the_step_of_the_frame(scale: float, step: float) -> None:
    axes = Figure().subplots()
    draw_frame_grid(axes, (2e-3, 6e-3), "m", scale=scale, step=step)
    centre, width = (np.asarray(values) for values in axes.lines[0].get_data())
    widths = np.unique(width.round(9))[::-1]
    assert widths[0] == pytest.approx(4.0)  # the widest wavelet has the width of the domain [mm]
    assert widths[:-1] / widths[1:] == pytest.approx(scale)
    for each in widths:
        assert np.diff(np.sort(centre[np.isclose(width, each)])) == pytest.approx(step * each)
    assert axes.get_xlabel() == "position [mm]"
    assert axes.get_ylabel() == "width 1/dilation [mm]"

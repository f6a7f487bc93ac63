# SPDX-License-Identifier: Apache-2.0
"""Charts of a report: number of drawn points, ticks, colours for light and dark, legend."""

import numpy as np
import pytest

from palpate.report.charts import _DOTS, _LINES, MOST_DOTS, Chart, Panel, _logarithmic_ticks
from palpate.report.page import COLOURS


def relative_luminance(colour: str) -> float:
    """Returns the luminance of a colour as in the accessibility guidelines of the web (WCAG 2)."""
    parts = [int(colour[k : k + 2], 16) / 255.0 for k in (1, 3, 5)]
    linear = [c / 12.92 if c <= 0.03928 else ((c + 0.055) / 1.055) ** 2.4 for c in parts]
    return float(np.dot(linear, (0.2126, 0.7152, 0.0722)))


def contrast(one: str, two: str) -> float:
    low, high = sorted((relative_luminance(one), relative_luminance(two)))
    return (high + 0.05) / (low + 0.05)


@pytest.mark.parametrize("scheme", COLOURS)
def test_text_and_lines_are_readable_on_the_paper_of_each_scheme(scheme: str) -> None:
    colours = COLOURS[scheme]
    for use in ("ink", "soft", "first", "second", "alarm", "good"):
        assert contrast(colours[use], colours["paper"]) >= 4.5, use


def test_both_schemes_name_the_same_uses_and_every_mark_uses_them() -> None:
    assert set(COLOURS["light"]) == set(COLOURS["dark"])
    uses = {
        look[part]
        for look in (*_DOTS.values(), *_LINES.values())
        for part in ("fill", "line")
        if part in look
    }
    assert uses <= set(COLOURS["light"])


def test_a_long_series_is_thinned() -> None:
    panel = Panel("position [m]", "force [N]", 200)
    panel.dots(np.arange(100_000.0), np.arange(100_000.0), "dots", "recorded")
    assert len(panel.plot.renderers[0].data_source.data["x"]) <= MOST_DOTS


@pytest.mark.parametrize(
    ("low", "high", "least", "most"), [(0.01, 0.02, 2, 6), (0.003, 0.2, 3, 7), (1.0, 1e6, 5, 9)]
)
def test_a_logarithmic_axis_has_a_readable_number_of_ticks(
    low: float, high: float, least: int, most: int
) -> None:
    ticks = [tick for tick in _logarithmic_ticks(np.array([low, high])) if low <= tick <= high]
    assert least <= len(ticks) <= most
    assert all(len(f"{tick}") <= 9 for tick in ticks)


def test_panels_share_the_horizontal_range_and_one_legend() -> None:
    above = Panel("position [m]", "force [N]", 200)
    above.line(np.arange(3.0), np.arange(3.0), "line", "model")
    below = Panel("position [m]", "residual [N]", 100, above=above)
    below.line(np.arange(3.0), np.zeros(3), "line", "model")
    chart = Chart("Force over position.", above, below)
    assert below.plot.x_range is above.plot.x_range
    assert chart.legend == [("line", "model")]
    assert chart.height == 300


def test_circles_of_a_path_are_joined_only_while_the_size_grows() -> None:
    panel = Panel("wavelets", "RMS error [N]", 200)
    panel.steps(np.array([1.0, 2.0, 3.0, 2.0]), np.array([3.0, 2.0, 1.0, 1.5]), "line", "position")
    line, circles = (each.data_source.data["x"] for each in panel.plot.renderers)
    assert np.isnan(line).tolist() == [False, False, False, True, False]
    assert len(circles) == 4

# SPDX-License-Identifier: Apache-2.0
"""Charts of a report, drawn by Bokeh in the reader's browser with zoom and hover.

Charts contain numbers and fixed words only: names of files and columns are in the HTML, which escapes them.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from .._typing import Float1D
from ..plotting.look import thinned
from .page import COLOURS, bokeh

MOST_DOTS = 2000
"""Largest number of dots of one series, which limits the size of the page."""

_BORDER_PX = 64
"""Width of the space for numbers and label left of every panel, so that panels below each other align."""

_DOTS: dict[str, dict[str, Any]] = {
    "dots": {"size": 4, "fill": "first", "alpha": 0.45},
    "open-dots": {"size": 5, "line": "second", "alpha": 0.55},
    "soft-dots": {"size": 3, "fill": "band", "alpha": 0.6},
    "outside": {"size": 6, "line": "alarm", "alpha": 0.9, "marker": "diamond"},
}
"""Size in pixels, colours and shape of the dots by mark"""

_LINES: dict[str, dict[str, Any]] = {
    "line": {"line": "ink", "width": 1.8},
    "dashed": {"line": "ink", "width": 1.8, "dash": "dashed"},
    "dotted": {"line": "soft", "width": 1.6, "dash": "dotted"},
    "thin": {"line": "first", "width": 1.1},
    "second": {"line": "second", "width": 1.2},
}
"""Width in pixels, colour and pattern of the lines by mark"""

CLASS_MARKS = 8
"""Number of marks for model classes, from class-0 on"""

_LINES |= {
    f"class-{k}": {
        "line": ("ink", "first", "second", "alarm")[k % 4],
        "width": 1.4,
        "dash": ("solid", "dashed", "dotted")[k % 3],
    }
    for k in range(CLASS_MARKS)
}


_STRIPS = {
    "strip-1": ("first", 0.15),
    "strip-2": ("good", 0.22),
    "strip-3": ("second", 0.22),
    "strip-4": ("alarm", 0.25),
}
"""Colour and opacity of shaded intervals by mark"""

_MANTISSAS = ((0.7, (1, 2, 3, 5, 7)), (1.5, (1, 2, 5)), (2.5, (1, 3)), (np.inf, (1,)))
"""First digits of the ticks of a logarithmic axis, by the largest number of decades of its values"""


def _logarithmic_ticks(values: Float1D) -> list[float]:
    """Returns ticks that do not overlap; those of Bokeh do if the values cover less than two decades."""
    decades = float(np.log10(values.max() / values.min()))
    digits = next(digits for most, digits in _MANTISSAS if decades <= most)
    return [float(f"{digit}e{power}") for power in range(-15, 16) for digit in digits]


def _coloured(**uses: str | None) -> dict[str, Any]:
    """Returns the colours of a glyph, and the tags by which the page changes them in the dark."""
    given = {part: use for part, use in uses.items() if use is not None}
    return {
        **{f"{part}_color": COLOURS["light"][given[part]] if part in given else None for part in uses},
        "tags": [f"{part}:{use}" for part, use in given.items()],
    }


class Panel:
    """One pair of axes: series with marks, in the units of the axes.

    Parameters
    ----------
    x, y : str
        Labels of the axes, with units.
    height : int
        Height [px].
    log : (n,) array, optional
        Positive values of a logarithmic vertical axis; None: the axis is linear.
    above : Panel, optional
        Panel whose horizontal range this panel shares.
    """

    def __init__(
        self, x: str, y: str, height: int, *, log: Float1D | None = None, above: Panel | None = None
    ) -> None:
        self.height = height
        self.legend: list[tuple[str, str]] = []
        self._names = x.partition(" [")[0], y.partition(" [")[0]
        shared = {}
        if above is not None:
            shared = {"x_range": above.plot.x_range}
            above.plot.xaxis.axis_label = None
        self.plot: Any = bokeh("plotting").figure(
            height=height,
            sizing_mode="stretch_width",
            min_border_left=_BORDER_PX,
            min_border_right=12,
            x_axis_label=x,
            y_axis_label=y,
            y_axis_type="linear" if log is None else "log",
            background_fill_alpha=0.0,
            border_fill_alpha=0.0,
            outline_line_color=None,
            tools="pan,box_zoom,wheel_zoom,reset,save",
            active_drag=None,
            toolbar_location="above",
            **shared,
        )
        self.plot.toolbar.logo = None
        self.plot.axis.axis_label_text_font_style = "normal"
        self.plot.axis.axis_label_text_font_size = "13px"
        self.plot.axis.major_label_text_font_size = "12px"
        self.plot.axis.minor_tick_line_color = None
        self.plot.xaxis.ticker.desired_num_ticks = 5
        if log is not None:
            models = bokeh("models")
            self.plot.yaxis.ticker = models.FixedTicker(ticks=_logarithmic_ticks(log))
            self.plot.yaxis.formatter = models.PrintfTickFormatter(format="%g")

    def dots(self, x: Float1D, y: Float1D, mark: str, text: str = "", *, hover: bool = False) -> None:
        """Draws at most MOST_DOTS of the points (x, y)."""
        if not len(x):
            return
        look = _DOTS[mark]
        at, value = thinned(x, y, most=MOST_DOTS)
        drawn = self.plot.scatter(
            "x",
            "y",
            source=self._source(x=at, y=value),
            size=look["size"],
            marker=look.get("marker", "circle"),
            fill_alpha=look["alpha"],
            line_alpha=look["alpha"],
            **_coloured(fill=look.get("fill"), line=look.get("line")),
        )
        self._add(drawn, mark, text, "mouse" if hover else "")

    def line(self, x: Float1D, y: Float1D, mark: str, text: str = "", *, hover: bool = True) -> None:
        """Draws a line through the points (x, y)."""
        drawn = self.plot.line("x", "y", source=self._source(x=x, y=y), **self._line(mark))
        self._add(drawn, mark, text, "vline" if hover else "")

    def lines(self, x: Sequence[Float1D], y: Sequence[Float1D], mark: str, text: str) -> None:
        """Draws several lines with one mark."""
        drawn = self.plot.multi_line(
            "x", "y", source=self._source(x=[_small(each) for each in x], y=[_small(each) for each in y]),
            **self._line(mark),
        )  # fmt: skip
        self._add(drawn, mark, text, "")

    def steps(self, x: Float1D, y: Float1D, mark: str, text: str) -> None:
        """Draws circles at the points (x, y) and a line through them that ends where x decreases."""
        ends = np.flatnonzero(np.diff(x) <= 0.0) + 1
        self.line(np.insert(x, ends, np.nan), np.insert(y, ends, np.nan), mark, text, hover=False)
        drawn = self.plot.scatter(
            "x", "y", source=self._source(x=x, y=y), size=6, fill_color=None, tags=[],
            **{name: value for name, value in _coloured(line=_LINES[mark]["line"]).items() if name != "tags"},
        )  # fmt: skip
        drawn.glyph.tags = [f"line:{_LINES[mark]['line']}"]
        self._add(drawn, mark, "", "mouse")

    def band(self, x: Float1D, low: Float1D, high: Float1D, text: str = "") -> None:
        """Draws the area between two curves."""
        drawn = self.plot.varea(
            "x", "low", "high", source=self._source(x=x, low=low, high=high), fill_alpha=0.4,
            **_coloured(fill="band"),
        )  # fmt: skip
        drawn.level = "underlay"
        self._add(drawn, "band", text, "")

    def bars(self, left: Float1D, right: Float1D, top: Float1D, text: str = "") -> None:
        """Draws bars from zero to `top`."""
        source = self._source(left=left, right=right, y=top, x=0.5 * (left + right), zero=np.zeros(len(top)))
        colours = _coloured(fill="first", line="paper")
        drawn = self.plot.quad("left", "right", "y", "zero", source=source, fill_alpha=0.75, **colours)
        self._add(drawn, "bars", text, "mouse")

    def cursor(self, text: str) -> None:
        """Draws one large dot that a script moves; it is named "cursor"."""
        source = self._source(x=np.empty(0), y=np.empty(0))
        drawn = self.plot.scatter("x", "y", source=source, size=16, fill_alpha=0.9, **_coloured(
            fill="alarm", line="paper"
        ))  # fmt: skip
        drawn.name = "cursor"
        self._add(drawn, "cursor", text, "")

    def handles(self, x: Float1D, y: Float1D) -> None:
        """Draws dots that the mouse drags; they are named "handles", and the page receives their places."""
        source = self._source(x=np.asarray(x), y=np.asarray(y))
        source.data = {"x": [float(each) for each in x], "y": [float(each) for each in y]}
        drawn = self.plot.scatter(
            "x", "y", source=source, size=18, fill_alpha=0.85, **_coloured(fill="first", line="paper")
        )
        drawn.name = "handles"
        tool = bokeh("models").PointDrawTool(renderers=[drawn], add=False)
        self.plot.add_tools(tool)
        self.plot.toolbar.active_drag = tool
        self.plot.subscribed_events = {"panend"}
        self._add(drawn, "handles", "drag to edit", "")

    def strips(self, left: Float1D, right: Float1D, mark: str, text: str = "") -> None:
        """Shades the panel between `left` and `right`, over its whole height."""
        if not len(left):
            return
        drawn = self.plot.vstrip(
            "left", "right", source=self._source(left=left, right=right), fill_alpha=_STRIPS[mark][1],
            line_color=None, **_coloured(fill=_STRIPS[mark][0]),
        )  # fmt: skip
        drawn.level = "underlay"
        self._add(drawn, mark, text, "")

    def select(self) -> None:
        """Lets the mouse select an interval of the horizontal axis; the page receives its ends."""
        tool = bokeh("models").BoxSelectTool(dimensions="width", renderers=[], persistent=True)
        self.plot.add_tools(tool)
        self.plot.toolbar.active_drag = tool
        self.plot.subscribed_events = {"selectiongeometry"}

    def level(self, value: float, mark: str, text: str = "") -> None:
        """Draws a horizontal line across the panel."""
        look = _LINES[mark]
        span = bokeh("models").Span(
            location=value,
            dimension="width",
            line_width=0.7 * look["width"],
            line_dash=look.get("dash", "solid"),
            **_coloured(line=look["line"]),
        )
        self.plot.add_layout(span)
        self._add(None, mark, text, "")

    def _add(self, drawn: Any, mark: str, text: str, hover: str) -> None:
        if text:
            self.legend.append((mark, text))
        if hover:
            names = [(name, f"@{key}{{%0.4g}}") for name, key in zip(self._names, "xy", strict=True)]
            self.plot.add_tools(
                bokeh("models").HoverTool(
                    renderers=[drawn],
                    mode=hover,
                    limit=1,
                    tooltips=names,
                    formatters={"@x": "printf", "@y": "printf"},
                    visible=False,
                )
            )

    @staticmethod
    def _line(mark: str) -> dict[str, Any]:
        look = _LINES[mark]
        return {
            "line_width": look["width"],
            "line_dash": look.get("dash", "solid"),
            **_coloured(line=look["line"]),
        }

    @staticmethod
    def _source(**columns: Any) -> Any:
        data = {
            name: _small(each) if isinstance(each, np.ndarray) else each for name, each in columns.items()
        }
        return bokeh("models").ColumnDataSource(data)


def _small(values: Float1D) -> Any:
    """Returns the values in single precision, which is finer than a pixel and half as large in the page."""
    return np.asarray(values, dtype=np.float32)


class Chart:
    """Panels below each other with a common legend, and a description for readers who cannot see them."""

    def __init__(self, description: str, *panels: Panel) -> None:
        self.description = description
        self.panels = panels
        self.number = 0
        self.height = sum(panel.height for panel in panels)
        self.legend = list(dict.fromkeys(entry for panel in panels for entry in panel.legend))

    def layout(self) -> Any:
        """Returns the Bokeh layout of the panels."""
        layout = bokeh("layouts").gridplot(
            [[panel.plot] for panel in self.panels],
            sizing_mode="stretch_width",
            toolbar_location="above",
            toolbar_options={"logo": None},
        )
        layout.toolbar.stylesheets = ["@media print { :host { display: none; } }"]
        return layout

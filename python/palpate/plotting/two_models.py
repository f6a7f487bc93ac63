# SPDX-License-Identifier: Apache-2.0
"""Would a hand tell two models apart? Their forces over position, the difference in the perceptual band."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from matplotlib.axes import Axes

from ..verification import Stroke
from .look import legend_above, scale_for

_LINES = {"press": "solid", "release": (0, (4, 2)), "": "solid"}


def draw_two_models(
    force_axes: Axes,
    difference_axes: Axes,
    strokes: Sequence[Stroke],
    units: Mapping[str, str],
    *,
    names: tuple[str, str],
) -> None:
    """Two models' forces over position; beneath, second minus first within what is just noticeable.

    Parameters
    ----------
    force_axes, difference_axes : matplotlib.axes.Axes
        Where to draw; they should share their position axis.
    strokes : sequence of Stroke
        From :func:`palpate.verification.compare`.
    units : mapping
        Units of position and force.
    names : (str, str)
        What the two models are called.
    """
    x = scale_for(units["position"], *(stroke.position for stroke in strokes))
    y = scale_for(units["force"], *(force for stroke in strokes for force in (stroke.first, stroke.second)))
    z = scale_for(units["force"], *(stroke.perceptible for stroke in strokes))
    for stroke in strokes:
        position = stroke.position * x.factor
        suffix = f", {stroke.name}" if stroke.name else ""
        line = _LINES[stroke.name]
        force_axes.plot(
            position,
            stroke.first * y.factor,
            color="0.7",
            linewidth=3.0,
            linestyle=line,
            label=names[0] + suffix,
        )
        force_axes.plot(
            position,
            stroke.second * y.factor,
            color="black",
            linewidth=1.0,
            linestyle=line,
            label=names[1] + suffix,
        )
        band = stroke.perceptible * z.factor
        difference_axes.fill_between(position, -band, band, color="0.88", linewidth=0.0)
    for stroke in strokes:
        difference_axes.plot(
            stroke.position * x.factor,
            (stroke.second - stroke.first) * z.factor,
            color="black",
            linewidth=1.0,
            linestyle=_LINES[stroke.name],
        )
    force_axes.set_ylabel(y.label("force"))
    legend_above(force_axes)
    difference_axes.set_xlabel(x.label("position"))
    difference_axes.set_ylabel(z.label("difference"))
    difference_axes.set_title("grey: not noticeable", loc="right", color="0.4")

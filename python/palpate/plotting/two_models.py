# SPDX-License-Identifier: Apache-2.0
"""Would a hand tell two models apart? Their forces over position, the difference in the perceptual band."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from matplotlib.axes import Axes

from ..verification import Stroke
from .look import label, label_force, label_position

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
    for stroke in strokes:
        suffix = f", {stroke.name}" if stroke.name else ""
        line = _LINES[stroke.name]
        force_axes.plot(
            stroke.position, stroke.first, color="0.7", linewidth=3.0, linestyle=line, label=names[0] + suffix
        )
        force_axes.plot(
            stroke.position,
            stroke.second,
            color="black",
            linewidth=1.0,
            linestyle=line,
            label=names[1] + suffix,
        )
        difference_axes.fill_between(
            stroke.position, -stroke.perceptible, stroke.perceptible, color="0.88", linewidth=0.0
        )
    for stroke in strokes:
        difference_axes.plot(
            stroke.position,
            stroke.second - stroke.first,
            color="black",
            linewidth=1.0,
            linestyle=_LINES[stroke.name],
        )
    label_force(force_axes, units)
    force_axes.legend(frameon=False)
    label_position(difference_axes, units)
    difference_axes.set_ylabel(label("difference", units["force"]))
    difference_axes.set_title("grey: not noticeable", loc="right", color="0.4")

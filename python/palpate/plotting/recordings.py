# SPDX-License-Identifier: Apache-2.0
"""Figure of a recording."""

from __future__ import annotations

from matplotlib.axes import Axes

from ..recording import Recording
from .look import dots_of, legend_above, of_stroke, scale_on, strokes, thinned


def draw_recording(axes: Axes, recording: Recording) -> None:
    """Draws force over position, press and release with different dots.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
        Target axes.
    recording : Recording
        The recording.
    """
    seen = "simulated" if "simulated" in recording.metadata else "recorded"
    x = scale_on(axes.xaxis, recording.units["position"], recording.position)
    y = scale_on(axes.yaxis, recording.units["force"], recording.force)
    for name, rows in strokes(recording.direction, len(recording)):
        shade = "0.3" if name != "release" else "0.6"
        axes.plot(
            *thinned(recording.position[rows] * x.factor, recording.force[rows] * y.factor),
            **dots_of(name),
            color=shade,
            markersize=2.2,
            label=of_stroke(seen, name),
        )
    axes.set_xlabel(x.label("position"))
    axes.set_ylabel(y.label("force"))
    legend_above(axes)

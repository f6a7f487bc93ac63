# SPDX-License-Identifier: Apache-2.0
"""Figure of a recording."""

from __future__ import annotations

from matplotlib.axes import Axes

from ..recording import Recording
from ..recording.roles import ROLE_NAMES, Role, roles_of
from .look import dots_of, legend_above, of_stroke, scales_of, strokes, thinned


def draw_recording(axes: Axes, recording: Recording) -> None:
    """Draws force over position, press and release with different dots, and rows that are not fitted in
    colour.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
        Target axes.
    recording : Recording
        The recording.
    """
    seen = "simulated" if "simulated" in recording.metadata else "recorded"
    x, y = scales_of(axes, recording, recording.force)
    role = roles_of(recording, float(recording.position.max()))
    drawn = [
        (
            (role == Role.MOVING) & rows,
            of_stroke(seen, name),
            "0.6" if name == "release" else "0.3",
            dots_of(name),
        )
        for name, rows in strokes(recording.direction, len(recording))
    ]
    drawn += [(role == each, ROLE_NAMES[each], f"C{each}", dots_of("")) for each in list(Role)[1:]]
    for rows, name, colour, dots in drawn:
        if rows.any():
            position, force = recording.position[rows] * x.factor, recording.force[rows] * y.factor
            axes.plot(*thinned(position, force), **dots, color=colour, markersize=2.2, label=name)
    axes.set_xlabel(x.label("position"))
    axes.set_ylabel(y.label("force"))
    legend_above(axes)

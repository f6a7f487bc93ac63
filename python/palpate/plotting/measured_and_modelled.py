# SPDX-License-Identifier: Apache-2.0
"""Does the model fit? Force over position, measured and modelled, and what is left."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes

from .._typing import Float1D
from ..recording import Recording
from .look import legend_above, scale_for, strokes, thinned

_LINES = {"press": "solid", "release": (0, (4, 2)), "": "solid"}


def draw_measured_and_modelled(
    force_axes: Axes,
    residual_axes: Axes,
    recording: Recording,
    modelled: Float1D,
    *,
    one_curve: bool = True,
    seen: str = "measured",
    standard_error: Float1D | None = None,
) -> None:
    """Measured and modelled force over position, residuals beneath; press and release told apart.

    Parameters
    ----------
    force_axes, residual_axes : matplotlib.axes.Axes
        Where to draw; they should share their position axis.
    recording : Recording
        What was measured.
    modelled : (n,) array
        The model's force at each row of the recording [N*m or N].
    one_curve : bool
        The model's force is one curve for each stroke, drawn over increasing position; False where it depends
        on the motion before, and is drawn in the order of the recording.
    seen : str
        What the recording's force is called.
    standard_error : (n,) array, optional
        Of the model's force at each row; drawn as a 95 % band about zero residual, in front of the dots.
    """
    residual = recording.force - modelled
    told_apart = strokes(recording.direction, len(recording))
    x = scale_for(recording.units["position"], recording.position)
    y = scale_for(recording.units["force"], recording.force, modelled)
    z = scale_for(recording.units["force"], residual)
    for name, rows in told_apart:
        suffix = f", {name}" if name else ""
        position, force, rest = thinned(recording.position[rows], recording.force[rows], residual[rows])
        dots: dict[str, Any] = {"linestyle": "none", "marker": "o", "markeredgewidth": 0.0}
        if name == "release":
            dots |= {"marker": "o", "markerfacecolor": "none", "markeredgewidth": 0.4}
        force_axes.plot(
            position * x.factor,
            force * y.factor,
            **dots,
            color="0.65",
            markersize=2.2,
            label=f"{seen}{suffix}",
        )
        shade = "0.45" if name != "release" else "0.7"
        residual_axes.plot(position * x.factor, rest * z.factor, **dots, color=shade, markersize=2.0)
    for name, rows in told_apart:
        suffix = f", {name}" if name else ""
        position, curve = recording.position[rows], modelled[rows]
        if one_curve:
            order = np.argsort(position, kind="stable")
            position, curve = position[order], curve[order]
        force_axes.plot(
            *thinned(position * x.factor, curve * y.factor),
            color="black",
            linewidth=1.1,
            linestyle=_LINES[name],
            label=f"model{suffix}",
        )
        if standard_error is not None:
            half = 2.0 * z.factor * standard_error[rows]
            _draw_band(residual_axes, recording.position[rows] * x.factor, half, _LINES[name])
    force_axes.set_ylabel(y.label("force"))
    legend_above(force_axes)
    residual_axes.axhline(0.0, color="black", linewidth=0.6)
    residual_axes.set_xlabel(x.label("position"))
    residual_axes.set_ylabel(z.label("residual"))
    if standard_error is not None:
        residual_axes.set_title("lines: 95 % band of the model", loc="right", color="0.3")


def _draw_band(axes: Axes, position: Float1D, half: Float1D, line: Any) -> None:
    """The edges of a band about zero: lines stay visible in front of dots, in black and white too."""
    order = np.argsort(position, kind="stable")
    at, width = thinned(position[order], half[order])
    for edge in (width, -width):
        axes.plot(at, edge, color="black", linewidth=0.7, linestyle=line)

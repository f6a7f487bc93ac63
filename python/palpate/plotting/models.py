# SPDX-License-Identifier: Apache-2.0
"""Figures of a model: with a recording, with another model, and with the networks that its identification
tested."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from .._typing import Float1D
from ..recording import Recording
from ..verification import Stroke
from .look import grid, legend_above, plain_decades, scale_for, strokes, thinned

_LINES = {"press": "solid", "release": (0, (4, 2)), "": "solid"}
"""Line style of each stroke."""


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
    """Draws measured and modelled force over position, residuals below; press and release are separate.

    Parameters
    ----------
    force_axes, residual_axes : matplotlib.axes.Axes
        Target axes, preferably with a common position axis.
    recording : Recording
        The measured recording.
    modelled : (n,) array
        The model's force at each row of the recording [N*m or N].
    one_curve : bool
        True: the model's force is one curve for each stroke, drawn over increasing position. False: it
        depends on the previous motion and is drawn in the order of the recording.
    seen : str
        Name of the recorded force.
    standard_error : (n,) array, optional
        Standard error of the model's force at each row, drawn as a 95 % band about zero residual, in front of
        the dots.
    """
    residual = recording.force - modelled
    by_stroke = strokes(recording.direction, len(recording))
    x = scale_for(recording.units["position"], recording.position)
    y = scale_for(recording.units["force"], recording.force, modelled)
    z = scale_for(recording.units["force"], residual)
    for name, rows in by_stroke:
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
    for name, rows in by_stroke:
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
    """Draws the edges of a band around zero as lines, which are visible in front of dots, also in black and
    white."""
    order = np.argsort(position, kind="stable")
    at, width = thinned(position[order], half[order])
    for edge in (width, -width):
        axes.plot(at, edge, color="black", linewidth=0.7, linestyle=line)


def draw_two_models(
    force_axes: Axes,
    difference_axes: Axes,
    strokes: Sequence[Stroke],
    units: Mapping[str, str],
    *,
    names: tuple[str, str],
) -> None:
    """Draws the forces of two models over position; below, second minus first and the JND.

    Parameters
    ----------
    force_axes, difference_axes : matplotlib.axes.Axes
        Target axes, preferably with a common position axis.
    strokes : sequence of Stroke
        From :func:`palpate.verification.compare`.
    units : mapping
        Units of position and force.
    names : (str, str)
        Names of the two models.
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


_MARKERS = "os^Dv<>p"
"""Markers of the points of each model class in a figure, in order."""


def draw_path(
    error_axes: Axes, criterion_axes: Axes, path: Sequence[Mapping[str, Any]], force_unit: str
) -> None:
    """Draws error and criterion over the number of wavelets, one line for each model class.

    Parameters
    ----------
    error_axes, criterion_axes : matplotlib.axes.Axes
        Target axes, preferably with a common horizontal axis.
    path : sequence of mapping
        Considered networks in order: model_class, n_wavelets, rmse, criterion.
    force_unit : str
        Unit of rmse.
    """
    y = scale_for(force_unit, [step["rmse"] for step in path])
    classes = dict.fromkeys(step["model_class"] for step in path)
    least = min((step["criterion"] for step in path if step["criterion"] is not None), default=0.0)
    for marker, model_class in zip(_MARKERS, classes, strict=False):
        steps = [step for step in path if step["model_class"] == model_class]
        look: dict[str, Any] = {
            "color": "black",
            "linewidth": 0.6,
            "marker": marker,
            "markersize": 4.0,
            "markerfacecolor": "white",
            "markeredgewidth": 0.7,
        }
        error_axes.plot(
            [step["n_wavelets"] for step in steps],
            [step["rmse"] * y.factor for step in steps],
            **look,
            label=model_class,
        )
        judged = [step for step in steps if step["criterion"] is not None]
        criterion_axes.plot(
            [step["n_wavelets"] for step in judged], [step["criterion"] - least for step in judged], **look
        )
    if all(step["rmse"] > 0.0 for step in path):
        error_axes.set_yscale("log")
        plain_decades(error_axes.yaxis)
    criterion_axes.set_yscale("symlog", linthresh=10.0)
    for axes in (error_axes, criterion_axes):
        grid(axes)
    criterion_axes.set_ylim(bottom=-2.0)
    criterion_axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    criterion_axes.set_xlabel("wavelets")
    error_axes.set_ylabel(y.label("RMS error"))
    criterion_axes.set_ylabel("criterion above least")
    error_axes.legend(frameon=False)

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
from ..model import Model
from ..model.model_display import force_curves
from ..recording import Recording
from ..verification import Stroke
from .look import (
    MOST_POINTS,
    dots_of,
    grid,
    legend_above,
    of_stroke,
    plain_decades,
    scale_for,
    scale_on,
    scales_of,
    strokes,
    thinned,
)

_LINES = {"press": "solid", "release": (0, (4, 2)), "": "solid"}
"""Line style of each stroke."""

_CURVE: dict[str, Any] = {"color": "black", "linewidth": 1.1}
"""Look of a model's curve, except the line style of its stroke."""

_MODEL_DOTS: dict[str, Any] = {
    "color": "black",
    "linestyle": "none",
    "marker": "x",
    "markersize": 2.0,
    "markeredgewidth": 0.4,
}
"""Look of the force of a model that is not a curve over position."""

MOST_DOTS = 600
"""Largest number of rows at which the force of such a model is drawn; more would cover the recording."""

BAND_LABEL = "95 % of a further recording"
"""Name of the band of a model in a legend."""

_INPUT_LINES = ("dotted", "solid", "dashed")
"""Line style of each curve of a model with further inputs."""

_SHARES = (0.0, 0.5, 1.0)
"""Values of the further inputs at which the force of a model is drawn [share of their range]"""

_POSITIONS = 1001
"""Number of positions at which a curve of a model is drawn [-]"""


def draw_measured_and_modelled(
    force_axes: Axes,
    residual_axes: Axes,
    recording: Recording,
    modelled: Float1D,
    *,
    one_curve: bool = True,
    seen: str = "measured",
    standard_error: Float1D | None = None,
    band: Float1D | None = None,
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
        depends on more than the position and is drawn as dots.
    seen : str
        Name of the recorded force.
    standard_error : (n,) array, optional
        Standard error of the model's force at each row, drawn as a 95 % band about zero residual, in front of
        the dots.
    band : (n,) array, optional
        Half width of the band of the model at each row, drawn in grey about zero residual.
    """
    draw_forces(force_axes, recording, modelled, one_curve=one_curve, seen=seen)
    draw_residual(residual_axes, recording, modelled, standard_error=standard_error, band=band)
    force_axes.set_xlabel("")


def draw_forces(
    axes: Axes, recording: Recording, modelled: Float1D, *, one_curve: bool = True, seen: str = "measured"
) -> None:
    """Draws measured force as dots and modelled force as curves over position, one of each for a stroke.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
        Target axes.
    recording, modelled, one_curve, seen
        As in :func:`draw_measured_and_modelled`.
    """
    by_stroke = strokes(recording.direction, len(recording))
    x, y = scales_of(axes, recording, recording.force, modelled)
    for name, rows in by_stroke:
        position, force = thinned(recording.position[rows] * x.factor, recording.force[rows] * y.factor)
        axes.plot(position, force, **dots_of(name), color="0.65", markersize=2.2, label=of_stroke(seen, name))
    for name, rows in by_stroke:
        position, curve = recording.position[rows], modelled[rows]
        if one_curve:
            order = np.argsort(position, kind="stable")
            position, curve = position[order], curve[order]
        look = _CURVE | {"linestyle": _LINES[name]} if one_curve else _MODEL_DOTS
        at, modelled_force = thinned(
            position * x.factor, curve * y.factor, most=MOST_POINTS if one_curve else MOST_DOTS
        )
        axes.plot(at, modelled_force, **look, label=of_stroke("model", name))
    axes.set_xlabel(x.label("position"))
    axes.set_ylabel(y.label("force"))
    legend_above(axes)


def draw_residual(
    axes: Axes,
    recording: Recording,
    modelled: Float1D,
    *,
    standard_error: Float1D | None = None,
    band: Float1D | None = None,
) -> None:
    """Draws measured minus modelled force over position, press and release with different dots.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
        Target axes.
    recording, modelled, standard_error, band
        As in :func:`draw_measured_and_modelled`.
    """
    residual = recording.force - modelled
    by_stroke = strokes(recording.direction, len(recording))
    x, z = scales_of(axes, recording, residual)
    if band is not None:
        order = np.argsort(recording.position, kind="stable")
        at, half = recording.position[order] * x.factor, band[order] * z.factor
        _fill_band(axes, at, np.zeros(len(at)), half)
    for name, rows in by_stroke:
        position, rest = thinned(recording.position[rows] * x.factor, residual[rows] * z.factor)
        shade = "0.45" if name != "release" else "0.7"
        axes.plot(position, rest, **dots_of(name), color=shade, markersize=2.0)
    for name, rows in by_stroke:
        if standard_error is not None:
            half = 2.0 * z.factor * standard_error[rows]
            _draw_band(axes, recording.position[rows] * x.factor, half, _LINES[name])
    axes.axhline(0.0, color="black", linewidth=0.6)
    axes.set_xlabel(x.label("position"))
    axes.set_ylabel(z.label("residual"))
    if standard_error is not None:
        axes.set_title("lines: 95 % band of the model", loc="right", color="0.3")
    elif band is not None:
        axes.set_title(f"grey: {BAND_LABEL}", loc="right", color="0.3")


def _fill_band(axes: Axes, position: Float1D, force: Float1D, half: Float1D) -> None:
    """Fills the band of a model about its force over increasing positions."""
    named = any(each.get_label() == BAND_LABEL for each in axes.collections)
    label = "_" if named else BAND_LABEL
    axes.fill_between(position, force - half, force + half, color="0.85", linewidth=0.0, label=label)


def _draw_band(axes: Axes, position: Float1D, half: Float1D, line: Any) -> None:
    """Draws the edges of a band around zero as lines, which are visible in front of dots, also in black and
    white."""
    order = np.argsort(position, kind="stable")
    at, width = thinned(position[order], half[order])
    for edge in (width, -width):
        axes.plot(at, edge, color="black", linewidth=0.7, linestyle=line)


def draw_model(axes: Axes, model: Model, *, label: str = "model", color: str = "black") -> None:
    """Draws the force of a model over its domain, one curve for each stroke.

    A model with further inputs has a curve for their least, middle and largest values.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
        Target axes.
    model : Model
        The model.
    label, color : str
        Name and colour of the curves.
    """
    curves: dict[str, tuple[Float1D, Any]] = {}
    position = np.linspace(model.lower[0], model.upper[0], _POSITIONS)
    if model.dimension == 1:
        _, forces = force_curves(model, _POSITIONS)
        curves = {of_stroke(label, name): (force, _LINES[name]) for name, force in forces.items()}
    else:
        for share, line in zip(_SHARES, _INPUT_LINES, strict=True):
            further = model.lower[1:] + share * (model.upper[1:] - model.lower[1:])
            inputs = np.column_stack([position, np.broadcast_to(further, (_POSITIONS, len(further)))])
            names = zip(model.inputs[1:], further, strict=True)
            name = ", ".join([label, *(f"{name} {value:.4g}" for name, value in names)])
            curves[name] = (model.predict(inputs), line)
    x = scale_on(axes.xaxis, model.units["position"], position)
    y = scale_on(axes.yaxis, model.units["force"], *(force for force, _ in curves.values()))
    half = model.band_half_width(position) if model.dimension == 1 else None
    for name, (force, line) in curves.items():
        if half is not None:
            _fill_band(axes, position * x.factor, force * y.factor, half * y.factor)
        look = _CURVE | {"color": color, "linestyle": line}
        axes.plot(position * x.factor, force * y.factor, **look, label=name)
    axes.set_xlabel(x.label(model.inputs[0]))
    axes.set_ylabel(y.label("force"))
    if len(axes.lines) > 1:
        legend_above(axes)


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

# SPDX-License-Identifier: Apache-2.0
"""Views of a force history: force over time and position, power spectrum, short-time and wavelet transform
(paper figure 2)."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.collections import QuadMesh
from matplotlib.colors import LogNorm

from .._typing import Float1D, Float2D
from ..recording import Recording
from .look import Scale, grid, plain_decades, scale_for, thinned
from .recordings import draw_recording
from .transforms import History, Plane, power_spectrum, short_time_transform, wavelet_transform

MOST_COLUMNS = 700
"""Largest number of drawn columns of a transform; each shows the largest value of its samples."""

SHOWN_RANGE = 1e3
"""Ratio of the largest to the least drawn amplitude; lower amplitudes are white [-]."""

SHOWN_POWER_RANGE = 1e8
"""Ratio of the largest to the least drawn power [-]."""


def axis_scale(history: History) -> Scale:
    """Returns the unit in which the axis of a history is drawn."""
    if history.axis != "position":
        return Scale(1.0, history.unit)
    return scale_for(history.unit, history.at, of_file=history.file_units.get("position"))


def force_scale(history: History, force_unit: str, *forces: npt.ArrayLike) -> Scale:
    """Returns the unit in which forces or amplitudes of a history are drawn."""
    return scale_for(force_unit, *forces, of_file=history.file_units.get("force"))


def draw_force_history(axes: Axes, history: History, force_unit: str) -> None:
    """Draws the force over time, position or row number; intervals without rows are grey.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
        Target axes.
    history : History
        From :func:`palpate.plotting.history_of`.
    force_unit : str
        SI unit of the force.
    """
    x, y = axis_scale(history), force_scale(history, force_unit, history.force)
    axes.plot(*thinned(history.at * x.factor, history.force * y.factor), color="black", linewidth=0.7)
    _shade_gaps(axes, history, x)
    axes.set_xlim(history.at[0] * x.factor, history.at[-1] * x.factor)
    axes.set_xlabel(x.label(history.axis))
    axes.set_ylabel(y.label("force"))


def draw_spectrum(axes: Axes, history: History, force_unit: str) -> None:
    """Draws the power spectrum with the frequency upwards; a sine of amplitude a has the power a^2/2.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
        Target axes.
    history : History
        From :func:`palpate.plotting.history_of`.
    force_unit : str
        SI unit of the force.
    """
    frequency, power = power_spectrum(history)
    y = force_scale(history, force_unit, np.sqrt(power))
    x = axis_scale(history)
    shown = power[1:] * y.factor**2
    axes.plot(shown, frequency[1:] / x.factor, color="black", linewidth=0.7)
    most = float(shown.max())
    if most > 0.0:
        axes.set_xscale("log")
        axes.set_xlim(most / SHOWN_POWER_RANGE, 3.0 * most)
    axes.set_xlabel(Scale(1.0, _squared(y.unit)).label("power"))
    _frequency_axis(axes, history, x)
    grid(axes)


def draw_transform(axes: Axes, plane: Plane, history: History, force_unit: str) -> QuadMesh:
    """Draws the amplitude of a short-time or wavelet transform over the axis of the history and frequency.

    Above the dashed line of a wavelet transform, the values do not depend on the mirrored ends.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
        Target axes.
    plane : Plane
        From :func:`palpate.plotting.short_time_transform` or :func:`palpate.plotting.wavelet_transform`.
    history : History
        History that was transformed.
    force_unit : str
        SI unit of the force.

    Returns
    -------
    matplotlib.collections.QuadMesh
        The drawn amplitudes, for a colour bar.
    """
    x = axis_scale(history)
    y = force_scale(history, force_unit, plane.value)
    at, value = _fewer_columns(plane.at * x.factor, np.abs(plane.value) * y.factor)
    most = float(value.max())
    short_time = plane.window is not None
    mesh = axes.pcolormesh(
        _edges(at, history.step * x.factor),
        _edges(plane.frequency) / x.factor if short_time else _geometric_edges(plane.frequency) / x.factor,
        value,
        norm=LogNorm(most / SHOWN_RANGE, most) if most > 0.0 else None,
        cmap="Greys",
        rasterized=True,
    )
    if not short_time:
        distance = x.factor / (np.pi * plane.frequency)
        for edge in (at[0] + distance, at[-1] - distance):
            axes.plot(edge, plane.frequency / x.factor, color="black", linewidth=0.6, linestyle="dashed")
    _shade_gaps(axes, history, x)
    axes.set_xlim(history.at[0] * x.factor, history.at[-1] * x.factor)
    axes.set_xlabel(x.label(history.axis))
    _frequency_axis(axes, history, x)
    return mesh


def amplitude_label(plane: Plane, history: History, force_unit: str) -> str:
    """Returns the label of the colour bar of a transform: amplitude and unit."""
    return force_scale(history, force_unit, plane.value).label("amplitude")


def draw_views(axes: Mapping[str, Axes], recording: Recording, history: History) -> None:
    """Draws all views of a recording side by side.

    Parameters
    ----------
    axes : mapping of str to matplotlib.axes.Axes
        Target axes with the names "history", "position", "spectrum", "short-time" and "wavelet".
    recording : Recording
        The recording.
    history : History
        From :func:`palpate.plotting.history_of`.
    """
    unit = recording.units["force"]
    draw_force_history(axes["history"], history, unit)
    draw_recording(axes["position"], recording)
    draw_spectrum(axes["spectrum"], history, unit)
    planes = {"short-time": short_time_transform(history), "wavelet": wavelet_transform(history)}
    for name, plane in planes.items():
        mesh = draw_transform(axes[name], plane, history, unit)
        bar = axes[name].figure.colorbar(mesh, ax=axes[name], location="bottom", aspect=30.0)
        bar.set_label(amplitude_label(plane, history, unit))
        bar.minorticks_off()
    x = axis_scale(history)
    window = planes["short-time"].window or 0.0
    axes["spectrum"].set_title("power spectrum")
    axes["short-time"].set_title(f"short-time, window {window * x.factor:.3g} {x.unit}")
    axes["wavelet"].set_title("wavelet, Mexican hat")


def _frequency_axis(axes: Axes, history: History, x: Scale) -> None:
    """Makes a logarithmic frequency axis that all transforms of a history share."""
    length = (history.at[-1] - history.at[0]) * x.factor
    axes.set_yscale("log")
    axes.set_ylim(1.0 / length, 0.5 / (history.step * x.factor))
    plain_decades(axes.yaxis)
    unit = "Hz" if history.axis == "time" else f"1/{x.unit}" if x.unit else ""
    axes.set_ylabel(Scale(1.0, unit).label("frequency"))


def _shade_gaps(axes: Axes, history: History, x: Scale) -> None:
    """Marks intervals without rows, in which the force is interpolated."""
    for start, stop in history.gaps[:MOST_COLUMNS]:
        axes.axvspan(start * x.factor, stop * x.factor, color="0.8", linewidth=0.0)


def _fewer_columns(at: Float1D, value: Float2D) -> tuple[Float1D, Float2D]:
    """Returns at most MOST_COLUMNS columns: the largest value of each block, which keeps short peaks."""
    block = -(-len(at) // MOST_COLUMNS)
    first = np.arange(0, len(at), block)
    return at[np.minimum(first + block // 2, len(at) - 1)], np.maximum.reduceat(value, first, axis=1)


def _edges(centres: Float1D, width: float = 1.0) -> Float1D:
    """Returns the edges (k + 1,) of cells around centres (k,) in order; one centre has this width."""
    if len(centres) == 1:
        return np.array([centres[0] - 0.5 * width, centres[0] + 0.5 * width])
    middle = 0.5 * (centres[1:] + centres[:-1])
    return np.concatenate([[2 * centres[0] - middle[0]], middle, [2 * centres[-1] - middle[-1]]])


def _geometric_edges(centres: Float1D) -> Float1D:
    """Returns the edges (k + 1,) of cells around centres (k,) on a logarithmic axis."""
    return np.exp(_edges(np.log(centres), width=0.1))


def _squared(unit: str) -> str:
    """Returns the text of a squared unit: "mN" gives "mN²", "N*m" gives "(N*m)²"."""
    if not unit:
        return ""
    return f"({unit})\u00b2" if "*" in unit else f"{unit}\u00b2"

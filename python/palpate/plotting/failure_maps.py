# SPDX-License-Identifier: Apache-2.0
"""Where a method fails: what was measured as markers, what theory says as lines."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.lines import Line2D
from matplotlib.ticker import LogLocator, NullFormatter, StrMethodFormatter

from .._typing import Float1D
from .look import grid

_MARKERS = "os^Dv"
_TWO_COLUMNS = 30
"""Longest name that stands in a legend of two columns [characters]"""
_DASHES = ("solid", (0, (5, 2)), (0, (1.5, 1.5)), (0, (5, 2, 1, 2)), (0, (8, 3)))


@dataclass(frozen=True)
class MeasuredLimit:
    """One method: the limit that was measured and the one that theory gives; arrays (points,), NaN: none."""

    name: str
    at: Float1D
    measured: Float1D
    theory: Float1D


def draw_failure_map(
    axes: Axes,
    along: str,
    limit: str,
    lines: Sequence[MeasuredLimit],
    *,
    searched: float = 0.0,
    linear: bool = False,
) -> None:
    """Measured limits as markers and theory as lines, both axes logarithmic.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
        Where to draw.
    along, limit : str
        What the axes hold, with units.
    lines : sequence of MeasuredLimit
        At most five.
    searched : float
        Up to how many times the theory it was searched where nothing failed: there a filled marker stands.
    linear : bool
        The vertical axis is linear.
    """
    for line, marker, dash in zip(lines, _MARKERS, _DASHES, strict=False):
        axes.plot(line.at, line.theory, color="0.45", linewidth=1.0, linestyle=dash, zorder=1)
        axes.plot(
            line.at,
            line.measured,
            linestyle="none" if np.isfinite(line.theory).any() else dash,
            linewidth=0.6,
            marker=marker,
            markersize=4.5,
            color="black",
            markerfacecolor="white",
            markeredgewidth=0.8,
            label=_in_print(line.name),
        )
        held = np.isnan(line.measured) & np.isfinite(line.theory)
        if searched > 0.0 and held.any():
            axes.plot(
                line.at[held],
                searched * line.theory[held],
                linestyle="none",
                marker=marker,
                markersize=4.5,
                color="black",
                label=f"{_in_print(line.name)}: still holds",
            )
    axes.set_xscale("log")
    _label_decades(axes.xaxis)
    if not linear:
        axes.set_yscale("log")
        _label_decades(axes.yaxis)
    grid(axes)
    axes.set_xlabel(_in_print(along))
    axes.set_ylabel(_in_print(limit))
    handles, _ = axes.get_legend_handles_labels()
    shown = [
        handle for handle in handles if isinstance(handle, Line2D) and np.isfinite(handle.get_ydata()).any()
    ]
    if any(np.isfinite(line.theory).any() for line in lines):
        shown.append(Line2D([], [], color="0.45", linewidth=1.0, label="theory"))
    longest = max(len(str(handle.get_label())) for handle in shown)
    columns = 2 if longest <= _TWO_COLUMNS else 1
    axes.figure.legend(handles=shown, frameon=False, loc="outside lower center", ncols=columns)


def _label_decades(axis: Axis) -> None:
    """Powers of ten; over less than two decades 1, 2 and 5 as well, as plain numbers."""
    low, high = axis.get_view_interval()
    axis.set_minor_formatter(NullFormatter())
    if high < 100.0 * low:
        axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        axis.set_major_formatter(StrMethodFormatter("{x:g}"))


def _in_print(text: str) -> str:
    """Products, squares and indices as they are printed."""
    text = text.replace("*", "·").replace("^2", "²")
    return re.sub(r"\b([A-Za-z])_([a-z])\b", r"$\1_\2$", text)

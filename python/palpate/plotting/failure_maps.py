# SPDX-License-Identifier: Apache-2.0
"""Where a method fails: what was measured as markers, what theory says as lines."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from .._typing import Float1D

_MARKERS = "os^Dv"
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
            label=line.name,
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
                label=f"{line.name}: still holds",
            )
    axes.set_xscale("log")
    if not linear:
        axes.set_yscale("log")
    axes.grid(color="0.88", linewidth=0.5)
    axes.set_axisbelow(True)
    axes.set_xlabel(along.replace("*", "·"))
    axes.set_ylabel(limit.replace("*", "·"))
    handles, _ = axes.get_legend_handles_labels()
    shown = [
        handle for handle in handles if isinstance(handle, Line2D) and np.isfinite(handle.get_ydata()).any()
    ]
    if any(np.isfinite(line.theory).any() for line in lines):
        shown.append(Line2D([], [], color="0.45", linewidth=1.0, label="theory"))
    axes.figure.legend(handles=shown, frameon=False, loc="outside lower center", ncols=2)

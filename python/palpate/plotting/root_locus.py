# SPDX-License-Identifier: Apache-2.0
"""The root locus of the explicit structure, drawn for the choice of its damping."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes

if TYPE_CHECKING:
    from ..planning.root_locus import RootLocus

_LINES = ("-", "--", ":", "-.")


def draw_root_locus(axes: Axes, locus: RootLocus, *, damping: float, slope_unit: str) -> None:
    """Poles over the damping of the object, one line style for each slope; the chosen damping marked.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
        Where to draw.
    locus : RootLocus
        What to draw.
    damping : float
        The chosen damping, for the legend [force*s/position].
    slope_unit : str
        Of the slopes, for the legend.
    """
    turn = np.linspace(0.0, 2.0 * np.pi, 361)
    axes.plot(np.cos(turn), np.sin(turn), color="0.6", linewidth=0.8)
    axes.axhline(0.0, color="0.85", linewidth=0.5)
    for k, slope in enumerate(locus.slopes):
        style = _LINES[k % len(_LINES)]
        for pole in range(2):
            path = locus.poles[k, :, pole]
            name = f"slope {slope:.4g} {slope_unit}" if pole == 0 else None
            axes.plot(path.real, path.imag, style, color="black", linewidth=1.0, label=name)
        axes.plot(
            locus.chosen[k].real,
            locus.chosen[k].imag,
            linestyle="none",
            marker="os^D"[k % 4],
            markersize=4,
            color="black",
            markerfacecolor="white",
            zorder=3,
            label=f"the same, damping {damping:.3g}",
        )
    axes.set_aspect("equal")
    axes.set_xlim(-1.3, 1.3)
    axes.set_ylim(-1.15, 1.15)
    axes.set_xlabel("real part of z")
    axes.set_ylabel("imaginary part of z")
    axes.figure.legend(frameon=False, loc="outside lower center", ncols=2, columnspacing=1.0)

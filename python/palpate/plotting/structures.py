# SPDX-License-Identifier: Apache-2.0
"""What each rendering structure costs: its force error, felt and sampled."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes

from .look import grid, plain_decades, scale_for


def draw_structures(
    axes: Axes, names: Sequence[str], end: Sequence[float], instant: Sequence[float], force_unit: str
) -> None:
    """RMS force error of each structure, at the end of the tick and at its sampling instant, on a log axis.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
        Where to draw.
    names : sequence of str
        The structures, best first; drawn from top to bottom.
    end, instant : sequence of float
        Their force errors [N*m or N].
    force_unit : str
        The unit of both.
    """
    x = scale_for(force_unit, end, instant)
    place = np.arange(len(names), dtype=np.float64)
    axes.plot(
        np.multiply(end, x.factor),
        place - 0.12,
        linestyle="none",
        marker="o",
        color="black",
        label="end of tick",
    )
    axes.plot(
        np.multiply(instant, x.factor),
        place + 0.12,
        linestyle="none",
        marker="o",
        color="black",
        markerfacecolor="white",
        label="sampling instant",
    )
    axes.set_xscale("log")
    plain_decades(axes.xaxis)
    axes.set_yticks(place, [name.replace(", ", ",\n", 1) for name in names])
    axes.set_ylim(len(names) - 0.5, -0.5)
    grid(axes, "x")
    axes.set_xlabel(x.label("force error, RMS"))
    axes.figure.legend(frameon=False, loc="outside lower center", ncols=2)

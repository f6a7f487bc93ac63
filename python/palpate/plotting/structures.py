# SPDX-License-Identifier: Apache-2.0
"""What each rendering structure costs: its force error."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes

from .look import grid, plain_decades, scale_for


def draw_structures(
    axes: Axes, names: Sequence[str], mean: Sequence[float], end: Sequence[float], force_unit: str
) -> None:
    """RMS force error of each structure, of the mean of a tick and at its end, on a log axis.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
        Where to draw.
    names : sequence of str
        The structures, best first; drawn from top to bottom.
    mean, end : sequence of float
        Their force errors [N*m or N].
    force_unit : str
        The unit of both.
    """
    x = scale_for(force_unit, mean, end)
    place = np.arange(len(names), dtype=np.float64)
    axes.plot(
        np.multiply(mean, x.factor),
        place - 0.12,
        linestyle="none",
        marker="o",
        color="black",
        label="mean of a tick",
    )
    axes.plot(
        np.multiply(end, x.factor),
        place + 0.12,
        linestyle="none",
        marker="o",
        color="black",
        markerfacecolor="white",
        label="end of tick",
    )
    axes.set_xscale("log")
    plain_decades(axes.xaxis)
    axes.set_yticks(place, [name.replace(", ", ",\n", 1) for name in names])
    axes.set_ylim(len(names) - 0.5, -0.5)
    grid(axes, "x")
    axes.set_xlabel(x.label("force error, RMS"))
    axes.figure.legend(frameon=False, loc="outside lower center", ncols=2)

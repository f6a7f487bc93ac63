# SPDX-License-Identifier: Apache-2.0
"""Force error against the damping that a prediction needs."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import StrMethodFormatter

from .look import grid


def draw_prediction(
    axes: Axes,
    samples: Sequence[int],
    damping: Sequence[float],
    spreads: Sequence[tuple[str, Sequence[tuple[float, float, float]]]],
) -> None:
    """Force errors relative to no prediction over the certified damping, with their 10 to 90 % range.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
        Where to draw.
    samples : sequence of int
        Samples of each prediction; 0 is none.
    damping : sequence of float
        Certified b / (T M) of each.
    spreads : sequence of (name, sequence of (median, low, high))
        Error without prediction over the error with it, one line for each name, at most two.
    """
    x = np.asarray(damping)
    for (name, spread), marker, filled, shift in zip(
        spreads, "os", ("white", "black"), (-1, 1), strict=False
    ):
        middle, low, high = 1.0 / np.asarray(spread).T
        axes.errorbar(
            x * (1.0 + 0.006 * shift),
            middle,
            yerr=(middle - high, low - middle),
            linestyle="none",
            marker=marker,
            markersize=4.5,
            color="black",
            markerfacecolor=filled,
            elinewidth=0.6,
            capsize=2.0,
            label=name,
        )
    axes.set_yscale("log")
    axes.yaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
    grid(axes)
    axes.set_xlabel("certified damping b / (T M), slopes from −M to M")
    axes.set_ylabel("force error over that without prediction")
    above = axes.secondary_xaxis("top")
    above.set_xticks(x, [str(count) for count in samples])
    above.set_xlabel("samples m of the prediction")
    axes.figure.legend(frameon=False, loc="outside lower center", ncols=2)

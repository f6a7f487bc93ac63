# SPDX-License-Identifier: Apache-2.0
"""Identification against its rivals: error over size and over time, and over the speed of a motion."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from matplotlib.axes import Axes
from matplotlib.ticker import LogLocator, NullLocator

from .._typing import Float1D
from .look import grid

_LOOKS = (
    ("o", "black"),
    ("s", "0.55"),
    ("D", "0.55"),
    *((marker, "white") for marker in "^v<>pP*Xhd8"),
)
"""Marker and its filling: ours first, then our selection alone and by quasi-Newton, then the rivals."""

_DASHES = ("solid", (0, (5, 2)), (0, (1.5, 1.5)), (0, (5, 2, 1, 2)), (0, (8, 3)))


@dataclass(frozen=True)
class Reached:
    """Where one method ended on one problem."""

    method: str
    spent: float
    """Parameters, or seconds."""
    error: float
    """NRMSE against the truth."""


def draw_reached(axes: Axes, title: str, reached: Sequence[Reached], methods: Sequence[str]) -> None:
    """Error over what was spent for it, both logarithmic over whole decades: best is at the lower left.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
        Where to draw.
    title : str
        The problem.
    reached : sequence of Reached
        One point each.
    methods : sequence of str
        All methods of the figure, so that each has one marker throughout.
    """
    for each in reached:
        marker, filling = _LOOKS[methods.index(each.method) % len(_LOOKS)]
        axes.plot(
            each.spent,
            each.error,
            linestyle="none",
            marker=marker,
            markersize=4.5,
            color="black",
            markerfacecolor=filling,
            markeredgewidth=0.7,
            label=each.method,
            clip_on=False,
            # ours stands above the others where they meet
            zorder=3 if filling == "black" else 2,
        )
    for scale, limits, values in (
        (axes.set_xscale, axes.set_xlim, [each.spent for each in reached]),
        (axes.set_yscale, axes.set_ylim, [each.error for each in reached]),
    ):
        scale("log")
        limits(*_decades(values))
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(LogLocator(numticks=9))
        axis.set_minor_locator(NullLocator())
    grid(axes)
    axes.set_title(title, fontsize=7.0)


def draw_legend(panels: Sequence[Axes], methods: Sequence[str]) -> None:
    """One legend below all panels."""
    handles = {
        name: handle
        for axes in panels
        for handle, name in zip(*axes.get_legend_handles_labels(), strict=True)
    }
    panels[0].figure.legend(
        handles=[handles[name] for name in methods if name in handles],
        frameon=False,
        loc="outside lower center",
        ncols=2,
    )


def draw_over_speed(axes: Axes, along: str, ways: Mapping[str, tuple[Float1D, Float1D]]) -> None:
    """Error over the speed of the motion, one line for each way to identify, both axes logarithmic.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
        Where to draw.
    along : str
        The speed, with its unit.
    ways : mapping
        Name to speeds (k,) and NRMSE (k,).
    """
    looks = zip(_LOOKS, _DASHES, (6.5, 5.5, 4.5, 4.0, 3.5), strict=False)
    for (name, (speed, error)), ((marker, filling), dash, size) in zip(ways.items(), looks, strict=False):
        axes.plot(
            speed,
            error,
            color="black",
            linewidth=0.8,
            linestyle=dash,
            marker=marker,
            markersize=size,
            markerfacecolor=filling,
            markeredgewidth=0.7,
            label=name,
        )
    axes.set_xscale("log")
    axes.set_yscale("log")
    places = sorted({float(at) for speed, _ in ways.values() for at in speed})
    axes.set_xticks(places, [f"{at:g}" for at in places])
    axes.xaxis.set_minor_locator(NullLocator())
    axes.set_ylim(*_decades([value for _, error in ways.values() for value in error]))
    grid(axes)
    axes.set_xlabel(along)
    axes.set_ylabel("NRMSE of f against the truth")
    axes.figure.legend(frameon=False, loc="outside lower center", ncols=1)


def _decades(values: Iterable[float]) -> tuple[float, float]:
    """Whole decades that hold all values, two at least where all lie in one."""
    exponents = [math.log10(value) for value in values]
    low, high = math.floor(min(exponents)), math.ceil(max(exponents))
    return 10.0**low, 10.0 ** max(high, low + 1)

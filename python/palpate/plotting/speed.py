# SPDX-License-Identifier: Apache-2.0
"""Speed against accuracy: what a step costs, and what its answer is worth."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from matplotlib.axes import Axes

from .._typing import Float1D
from .look import grid, label

_MARKERS = "os^Dv<>pP*Xhd"
_THIN_LINE: dict[str, Any] = {
    "color": "black",
    "linewidth": 0.5,
    "markersize": 4.0,
    "markerfacecolor": "white",
    "markeredgewidth": 0.7,
}


@dataclass(frozen=True)
class WorkPrecision:
    """What one time step reaches over a range of periods."""

    name: str
    work: Float1D
    """Computing time for a millisecond of motion [ns], shape (k,)."""
    error: Float1D
    """RMS error of the motion [rad or m], shape (k,)."""
    diverges: Float1D
    """Work of the periods at which it diverges [ns]."""


@dataclass(frozen=True)
class RenderedForce:
    """What one structure with one solver costs and leaves."""

    name: str
    nanoseconds: float
    """Computing time of a tick [ns]."""
    error: float
    """RMS of rendered force minus the object's at the handle, at the end of the tick [N*m or N]."""


@dataclass(frozen=True)
class ModelError:
    """One way to model a force, over its settings."""

    name: str
    cost: Float1D
    """Size or time, shape (k,)."""
    error: Float1D
    """NRMSE against the truth, shape (k,)."""
    wavelets: Sequence[int]
    """Wavelets of each; 0 for what has none."""


@dataclass(frozen=True)
class OverWavelets:
    """A quantity over the number of wavelets."""

    name: str
    wavelets: Float1D
    quantity: Float1D


def draw_work_precision(axes: Axes, steps: Sequence[WorkPrecision], position_unit: str) -> None:
    """Error of the motion over computing time, one line for each time step, one marker for each period.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
        Where to draw; both its axes become logarithmic.
    steps : sequence of WorkPrecision
        The time steps.
    position_unit : str
        The unit of their errors.
    """
    ceiling = 3.0 * max(float(step.error.max()) for step in steps)
    for marker, step in zip(_MARKERS, steps, strict=False):
        (line,) = axes.plot(step.work, step.error, marker=marker, label=step.name, **_THIN_LINE)
        axes.plot(
            step.diverges,
            [ceiling] * len(step.diverges),
            linestyle="none",
            marker=marker,
            markersize=4.0,
            color="black",
        )
        line.set_zorder(2)
    if any(len(step.diverges) for step in steps):
        axes.text(0.99, 0.985, "filled, at the top: diverges", transform=axes.transAxes, ha="right", va="top")
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_ylim(top=2.5 * ceiling)
    grid(axes)
    axes.set_xlabel("computing time for 1 ms of motion [ns]")
    axes.set_ylabel(label("error of the motion, RMS", position_unit))
    axes.figure.legend(frameon=False, loc="outside lower center", ncols=2)


def draw_rendered_force(
    axes: Axes,
    rendered: Sequence[RenderedForce],
    limits: Sequence[tuple[str, float]],
    force_unit: str,
) -> None:
    """Force error over the time of a tick, one point for each structure and solver.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
        Where to draw; both its axes become logarithmic.
    rendered : sequence of RenderedForce
        The structures.
    limits : sequence of (str, float)
        Levels that the errors are to be seen against, drawn across: name and force.
    force_unit : str
        The unit of all forces.
    """
    for marker, each in zip(_MARKERS * 3, rendered, strict=False):
        place = rendered.index(each) // len(_MARKERS)
        axes.plot(
            each.nanoseconds,
            each.error,
            linestyle="none",
            marker=marker,
            markersize=4.5,
            color="black",
            markerfacecolor=("white", "black", "0.6")[place % 3],
            markeredgewidth=0.7,
            label=each.name,
        )
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_ylim(bottom=0.5 * min(force for _, force in limits))
    for name, force in limits:
        axes.axhline(force, color="0.4", linewidth=0.7, linestyle=(0, (4, 2)))
        axes.annotate(
            name,
            (1.0, force),
            xycoords=axes.get_yaxis_transform(),
            xytext=(0, 1.5),
            textcoords="offset points",
            ha="right",
            va="bottom",
            fontsize=7.0,
        )
    grid(axes)
    axes.set_xlabel("time of a tick [ns]")
    axes.set_ylabel(label("force error, RMS", force_unit))
    axes.figure.legend(frameon=False, loc="outside lower center", ncols=2)


def draw_model_error(axes: Axes, methods: Sequence[ModelError], cost: str) -> None:
    """Model error over size or time, one line for each method, one marker for each of its settings.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
        Where to draw; both its axes become logarithmic.
    methods : sequence of ModelError
        The methods; the numbers of their wavelets stand beside the markers.
    cost : str
        What is paid: the label of the lower axis.
    """
    for marker, method in zip(_MARKERS, methods, strict=False):
        filled = any(method.wavelets)
        axes.plot(
            method.cost,
            method.error,
            color="black" if filled else "0.55",
            linewidth=1.0 if filled else 0.5,
            marker=marker,
            markersize=4.0,
            markerfacecolor="black" if filled else "white",
            markeredgecolor="black",
            markeredgewidth=0.7,
            label=method.name,
        )
        for count, x, y in zip(method.wavelets, method.cost, method.error, strict=True):
            if count:
                axes.annotate(
                    str(count),
                    (x, y),
                    xytext=(-3, -3),
                    textcoords="offset points",
                    ha="right",
                    va="top",
                    fontsize=6.0,
                )
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.margins(x=0.08, y=0.12)
    grid(axes)
    axes.set_xlabel(cost)
    axes.set_ylabel("NRMSE")


def draw_over_wavelets(axes: Axes, curves: Sequence[OverWavelets], quantity: str) -> None:
    """A quantity over the number of wavelets, one line for each way to have it.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
        Where to draw; both its axes become logarithmic.
    curves : sequence of OverWavelets
        The lines.
    quantity : str
        Label of the vertical axis.
    """
    for marker, curve in zip(_MARKERS, curves, strict=False):
        axes.plot(curve.wavelets, curve.quantity, marker=marker, label=curve.name, **_THIN_LINE)
    axes.set_xscale("log", base=2)
    axes.set_yscale("log")
    axes.xaxis.set_major_formatter("{x:g}")
    grid(axes)
    axes.set_xlabel("wavelets")
    axes.set_ylabel(quantity)

# SPDX-License-Identifier: Apache-2.0
"""Figures of a rendering: with its recording, force errors of the structures, root locus."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from .._core.device import DeviceProfile
from .._core.rendering import Scheme, compensated_share, default_play_radius
from .._core.stability import explicit_scheme, force_bounds
from .._typing import Float1D
from ..planning import Plan
from .look import grid, legend_above, of_stroke, plain_decades, scale_for, scale_on, thinned

_LINES = ("-", "--", ":", "-.")
"""Line styles of the object slopes in a figure of the root locus, in order."""

_LOCUS_DAMPINGS = 801
"""Number of object dampings at which a root locus is computed [-]"""


def draw_real_against_rendered(
    axes: Axes,
    real: tuple[Float1D, Float1D],
    rendered: tuple[Float1D, Float1D],
    units: Mapping[str, str],
    *,
    title: str = "",
    real_name: str = "recorded",
) -> None:
    """Draws recorded force (dotted) and rendered force (solid) over position (paper figure 15).

    Parameters
    ----------
    axes : matplotlib.axes.Axes
        Target axes.
    real : (position (n,), force (n,))
        The recording.
    rendered : (position (n,), force (n,))
        Result of the closed loop: rendered force over recorded position, or recorded force over resulting
        position.
    units : mapping
        {"position": "rad", "force": "N*m"}.
    title : str
        Title, which states how the loop was closed.
    real_name : str
        Name of the recorded curve.
    """
    x = scale_for(units["position"], real[0], rendered[0])
    y = scale_for(units["force"], real[1], rendered[1])
    # The dots of the recorded force are wider than the line of the rendered force, so that both are visible
    # if they agree.
    axes.plot(
        *thinned(real[0] * x.factor, real[1] * y.factor),
        color="0.6",
        linestyle="none",
        marker=".",
        markersize=4.0,
        markeredgewidth=0,
        label=real_name,
    )
    shown = thinned(rendered[0] * x.factor, rendered[1] * y.factor)
    axes.plot(*shown, color="black", linewidth=0.7, label="rendered")
    axes.set_xlabel(x.label("position"))
    axes.set_ylabel(y.label("force"))
    if title:
        axes.set_title(title)


def draw_structures(
    axes: Axes, names: Sequence[str], mean: Sequence[float], end: Sequence[float], force_unit: str
) -> None:
    """Draws the RMS force error of each structure on a log axis: of the mean force of a tick, and at the end
    of a tick.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
        Target axes.
    names : sequence of str
        The structures, best first; drawn from top to bottom.
    mean, end : sequence of float
        Their force errors [N*m or N].
    force_unit : str
        Unit of the force errors.
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


def draw_plan(axes: Axes, plan: Plan) -> None:
    """Draws the identified force, and the force that a hand at rest feels, over the model's domain.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
        Target axes.
    plan : Plan
        The plan; its coupling and its limited network change the felt force.
    """
    position, identified, rendered = plan.forces_at_rest()
    x = scale_on(axes.xaxis, plan.model.units["position"], position)
    y = scale_on(axes.yaxis, plan.model.units["force"], identified, rendered)
    names = ("press", "release") if len(identified) > 1 else ("",)
    # The line of the identified force is wider, so that both are visible if they agree.
    for curves, name, color, width in (
        (identified, "identified", "0.7", 3.0),
        (rendered, f"felt at rest: {plan.description}", "black", 1.0),
    ):
        for stroke, force, line in zip(names, curves, _LINES, strict=False):
            axes.plot(
                position * x.factor,
                force * y.factor,
                color=color,
                linewidth=width,
                linestyle=line,
                label=of_stroke(name, stroke),
            )
    axes.set_xlabel(x.label("position"))
    axes.set_ylabel(y.label("force"))
    legend_above(axes)


@dataclass(frozen=True)
class RootLocus:
    """Poles of the linearised explicit structure (paper figure 14) at a held device, over its damping.

    z^2 + (T^2 K/m - 2 + T B/m) z + 1 - T B/m = 0, K = slope + K_c, B = sum of both dampings.
    """

    slopes: Float1D
    """(k,) slopes of the object [force/position]"""
    dampings: Float1D
    """(n,) object damping [force*s/position]"""
    poles: NDArray[np.complex128]
    """(k, n, 2)"""
    chosen: NDArray[np.complex128]
    """(k, 2) poles with the object damping of the scheme"""


def root_locus(scheme: Scheme, slopes: Float1D, period_s: float) -> RootLocus:
    """Computes poles for a damping from 0 to the limit of the step, B T = 2 m.

    Parameters
    ----------
    scheme : Scheme
        Mass, coupling and the marked damping.
    slopes : (k,) array
        Slopes of the object [force/position].
    period_s : float
        T [s].
    """
    slopes = np.asarray(slopes, dtype=np.float64)
    largest = max(2.0 * scheme.mass / period_s - scheme.coupling_damping, scheme.object_damping)
    # A sample where two poles meet, T B/m = 2 sqrt(c) - c with c = T^2 K/m: their path has a corner there.
    c = np.maximum(period_s**2 * (slopes + scheme.coupling_stiffness) / scheme.mass, 0.0)
    meeting = scheme.mass / period_s * (2.0 * np.sqrt(c) - c) - scheme.coupling_damping
    dampings = np.union1d(
        np.linspace(0.0, largest, _LOCUS_DAMPINGS), meeting[(meeting > 0.0) & (meeting < largest)]
    )
    return RootLocus(
        slopes=slopes,
        dampings=dampings,
        poles=_poles(scheme, slopes[:, None], dampings[None, :], period_s),
        chosen=_poles(scheme, slopes, np.full_like(slopes, scheme.object_damping), period_s),
    )


def _poles(scheme: Scheme, slope: Float1D, damping: Float1D, period_s: float) -> NDArray[np.complex128]:
    drag = period_s * (damping + scheme.coupling_damping) / scheme.mass
    middle = period_s**2 * (slope + scheme.coupling_stiffness) / scheme.mass - 2.0 + drag
    root = np.sqrt((middle**2 - 4.0 * (1.0 - drag)).astype(np.complex128))
    return np.stack([(-middle + root) / 2.0, (-middle - root) / 2.0], axis=-1)


def draw_root_locus(axes: Axes, plan: Plan, device: DeviceProfile) -> None:
    """Draws the poles of a plan's explicit structure over its damping, one line style for each slope.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
        Target axes.
    plan : Plan
        If its structure is not explicit, the explicit one that suits the device is drawn.
    device : DeviceProfile
        The device of the plan.
    """
    radius = default_play_radius(plan.model, device.encoder_step)
    bounds = force_bounds(plan.rendered, radius)
    scheme = plan.scheme
    if plan.structure != "explicit":
        scheme = explicit_scheme(bounds, device, mass=plan.model.mass, play_radius=radius)
    slopes = np.unique(
        [max(bounds.slope_min, -compensated_share * scheme.coupling_stiffness), bounds.slope_max]
    )
    units = plan.model.units
    unit = f"{units['force']}/{units['position']}".replace("*", "\u00b7") if units["force"] else ""
    locus = root_locus(scheme, slopes, device.period_s)
    turn = np.linspace(0.0, 2.0 * np.pi, 361)
    axes.plot(np.cos(turn), np.sin(turn), color="0.6", linewidth=0.8)
    axes.axhline(0.0, color="0.85", linewidth=0.5)
    for k, slope in enumerate(locus.slopes):
        style = _LINES[k % len(_LINES)]
        for pole in range(2):
            path = locus.poles[k, :, pole]
            name = f"slope {slope:.4g} {unit}" if pole == 0 else None
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
            label=f"the same, damping {scheme.object_damping:.3g}",
        )
    axes.set_aspect("equal")
    axes.set_xlim(-1.3, 1.3)
    axes.set_ylim(-1.15, 1.15)
    axes.set_xlabel("real part of z")
    axes.set_ylabel("imaginary part of z")
    axes.figure.legend(frameon=False, loc="outside lower center", ncols=2, columnspacing=1.0)

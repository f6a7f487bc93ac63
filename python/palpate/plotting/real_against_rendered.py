# SPDX-License-Identifier: Apache-2.0
"""Does what is rendered feel like what was recorded? Force over position, as in the paper's figure 15."""

from __future__ import annotations

from collections.abc import Mapping

from matplotlib.axes import Axes

from .._typing import Float1D
from .look import scale_for, thinned


def draw_real_against_rendered(
    axes: Axes,
    real: tuple[Float1D, Float1D],
    rendered: tuple[Float1D, Float1D],
    units: Mapping[str, str],
    *,
    title: str = "",
    real_name: str = "recorded",
) -> None:
    """Recorded force over position, dotted, and rendered force over position, solid (paper figure 15).

    Parameters
    ----------
    axes : matplotlib.axes.Axes
        Where to draw.
    real : (position (n,), force (n,))
        What was recorded.
    rendered : (position (n,), force (n,))
        What the closed loop made of the recorded motion (the rendered force over the recorded position) or
        of the recorded force (the recorded force over the resulting position).
    units : mapping
        {"position": "rad", "force": "N*m"}.
    title : str
        Which way the loop was closed.
    real_name : str
        What the recorded curve is called.
    """
    x = scale_for(units["position"], real[0], rendered[0])
    y = scale_for(units["force"], real[1], rendered[1])
    # The dots are wider than the line in front of them: both are seen where the two agree.
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

# SPDX-License-Identifier: Apache-2.0
"""Figures of the frame of candidate wavelets: its bounds (paper section 2.4), and its grid over a domain."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes

from .._typing import Float1D
from ..errors import InputError
from ..identification import SearchOptions, frame_bounds
from ..identification.network.basis import COARSEST_CANDIDATE, truncated_frame
from .look import grid, plain_decades, scale_for

STEPS = np.geomspace(0.25, 2.0, 22)
"""Translation steps b0 at which the bounds are drawn [-]"""

_MARKED_STEPS = (0.25, 0.5, 1.0, 2.0)
_DEFAULT = SearchOptions()
_LINES = ("solid", "dashed", "dotted", "dashdot")
_LEVELS = 5
"""Number of dilations of the drawn grid [-]"""


def draw_frame_bounds(
    bounds_axes: Axes,
    voices_axes: Axes,
    scales_axes: Axes,
    *,
    scale: float = _DEFAULT.frame_scale,
    step: float = _DEFAULT.frame_step,
    voices: Sequence[int] = (1, 2, 4),
    scales: Sequence[float] = (1.5, 2.0, 2.5, 3.0),
) -> None:
    """Draws A and B over the translation step, and B/A over the step for several voices and ratios a0.

    A ratio is drawn only for A > 0: otherwise the estimate does not prove that the wavelets form a frame.
    A vertical line marks the translation step b0.

    Parameters
    ----------
    bounds_axes, voices_axes, scales_axes : matplotlib.axes.Axes
        Target axes: A and B; B/A for each number of voices; B/A for each a0 with one voice.
    scale : float
        a0 of the first two axes, the ratio of neighbouring dilations.
    step : float
        Marked translation step b0.
    voices : sequence of int
        Numbers of voices of the first two axes, at most four.
    scales : sequence of float
        Ratios a0 of the third axes, at most four.

    Raises
    ------
    palpate.InputError
        There are more curves than line styles, or a value is out of range; the message names the argument.
    """
    for argument, values in (("voices", voices), ("scales", scales)):
        if not 1 <= len(values) <= len(_LINES):
            raise InputError(f"{argument} has {len(values)} values: must have 1 to {len(_LINES)}")
    frame_bounds(scale, step)  # refuses values out of range
    for style, count in zip(_LINES, voices, strict=False):
        low, high = _bounds(scale, count)
        name = f"{count} voice{'s' * (count > 1)}"
        bounds_axes.plot(STEPS, np.where(low > 0.0, low, np.nan), "0.6", linestyle=style, linewidth=1.0)
        bounds_axes.plot(STEPS, high, "black", linestyle=style, linewidth=1.0, label=name)
        voices_axes.plot(STEPS, _ratio(low, high), "black", linestyle=style, linewidth=1.0, label=name)
    for style, each in zip(_LINES, scales, strict=False):
        scales_axes.plot(
            STEPS, _ratio(*_bounds(each, 1)), "black", linestyle=style, linewidth=1.0, label=f"a0 = {each:g}"
        )
    bounds_axes.set_title(f"bounds, a0 = {scale:g}: A grey, B black")
    bounds_axes.set_ylabel("A, B [-]")
    voices_axes.set_title(f"B/A, a0 = {scale:g}")
    scales_axes.set_title("B/A, 1 voice")
    bounds_axes.set_yscale("log")
    for axes in (bounds_axes, voices_axes, scales_axes):
        axes.set_xscale("log")
        axes.axvline(step, color="0.8", linewidth=2.0, zorder=0)
        axes.set_xlabel("translation step b0 [-]")
        axes.legend(frameon=False)
        axes.set_xticks(_MARKED_STEPS, [f"{step:g}" for step in _MARKED_STEPS])
        axes.minorticks_off()
        grid(axes)
    for axes in (voices_axes, scales_axes):
        axes.set_ylabel("B/A [-]")
        axes.set_ylim(0.9, 3.0)
    plain_decades(bounds_axes.yaxis)


def draw_frame_grid(
    axes: Axes,
    domain: tuple[float, float],
    position_unit: str,
    *,
    scale: float = _DEFAULT.frame_scale,
    step: float = _DEFAULT.frame_step,
) -> None:
    """Draws centre and width of each candidate wavelet over a domain, whose limits are dashed lines.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
        Target axes.
    domain : (lower, upper)
        Least and largest position [position].
    position_unit : str
        SI unit of the position.
    scale, step : float
        a0, ratio of neighbouring dilations, and b0, translation step.
    """
    travel = domain[1] - domain[0]
    basis = truncated_frame(
        np.linspace(0.0, 1.0, 1000)[:, None],
        coarsest=COARSEST_CANDIDATE,
        finest=COARSEST_CANDIDATE * scale ** (_LEVELS - 0.5),
        frame_scale=scale,
        frame_step=step,
        max_candidates=_DEFAULT.max_candidates,
    )
    x = scale_for(position_unit, np.array(domain))
    width = travel * x.factor / basis.alpha[:, 0]
    centre = (domain[0] + travel * basis.beta[:, 0]) * x.factor
    axes.plot(centre, width, "k.", markersize=3.0)
    axes.set_yscale("log")
    axes.set_yticks(np.unique(width), [f"{each:.2g}" for each in np.unique(width)])
    axes.minorticks_off()
    grid(axes)
    axes.set_xlim((domain[0] - 0.1 * travel) * x.factor, (domain[1] + 0.1 * travel) * x.factor)
    for edge in domain:
        axes.axvline(edge * x.factor, color="black", linewidth=0.6, linestyle="dashed")
    axes.set_title(f"grid, a0 = {scale:g}, b0 = {step:g}: {len(basis)} wavelets in {_LEVELS} levels")
    axes.set_xlabel(x.label("position"))
    axes.set_ylabel(x.label("width 1/dilation"))


def _bounds(scale: float, voices: int) -> tuple[Float1D, Float1D]:
    """Returns A and B at each translation step of the figure."""
    low, high = zip(*(frame_bounds(scale, float(step), voices) for step in STEPS), strict=True)
    return np.array(low), np.array(high)


def _ratio(low: Float1D, high: Float1D) -> Float1D:
    """Returns B/A, and NaN where A is not positive."""
    return np.divide(high, low, out=np.full_like(high, np.nan), where=low > 0.0)

# SPDX-License-Identifier: Apache-2.0
"""How a model was found: error and criterion of every network that was considered."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from .look import grid, plain_decades, scale_for

_MARKERS = "os^Dv<>p"


def draw_path(
    error_axes: Axes, criterion_axes: Axes, path: Sequence[Mapping[str, Any]], force_unit: str
) -> None:
    """Error and criterion over the number of wavelets, one line for each model class.

    Parameters
    ----------
    error_axes, criterion_axes : matplotlib.axes.Axes
        Where to draw; they should share their horizontal axis.
    path : sequence of mapping
        Networks in the order in which they were considered: model_class, n_wavelets, rmse, criterion.
    force_unit : str
        Of rmse.
    """
    y = scale_for(force_unit, [step["rmse"] for step in path])
    classes = dict.fromkeys(step["model_class"] for step in path)
    least = min((step["criterion"] for step in path if step["criterion"] is not None), default=0.0)
    for marker, model_class in zip(_MARKERS, classes, strict=False):
        steps = [step for step in path if step["model_class"] == model_class]
        look: dict[str, Any] = {
            "color": "black",
            "linewidth": 0.6,
            "marker": marker,
            "markersize": 4.0,
            "markerfacecolor": "white",
            "markeredgewidth": 0.7,
        }
        error_axes.plot(
            [step["n_wavelets"] for step in steps],
            [step["rmse"] * y.factor for step in steps],
            **look,
            label=model_class,
        )
        judged = [step for step in steps if step["criterion"] is not None]
        criterion_axes.plot(
            [step["n_wavelets"] for step in judged], [step["criterion"] - least for step in judged], **look
        )
    if all(step["rmse"] > 0.0 for step in path):
        error_axes.set_yscale("log")
        plain_decades(error_axes.yaxis)
    criterion_axes.set_yscale("symlog", linthresh=10.0)
    for axes in (error_axes, criterion_axes):
        grid(axes)
    criterion_axes.set_ylim(bottom=-2.0)
    criterion_axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    criterion_axes.set_xlabel("wavelets")
    error_axes.set_ylabel(y.label("RMS error"))
    criterion_axes.set_ylabel("criterion above least")
    error_axes.legend(frameon=False)

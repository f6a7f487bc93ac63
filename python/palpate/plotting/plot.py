# SPDX-License-Identifier: Apache-2.0
"""One function that draws a recording, a model, a verification or a plan."""

from __future__ import annotations

from functools import singledispatch
from typing import Any

from matplotlib.axes import Axes

from ..errors import InputError
from ..model.model import Model
from ..planning.plan import Plan
from ..recording.recording import Recording
from ..verification.verification import Verification
from .look import axes_or_new
from .models import draw_forces, draw_model, draw_residual
from .recordings import draw_recording
from .rendering import draw_plan


@singledispatch
def plot(shown: Any, ax: Axes | None = None, **look: Any) -> Axes:
    """Draws a recording, model, verification or plan over position and returns the axes.

    Parameters
    ----------
    shown : palpate.Recording, palpate.Model, palpate.Verification or palpate.Plan
        A recording has its force at each row. A model has its force over the domain: one curve for press and
        one for release with hysteresis, and with further inputs one for their least, middle and largest
        values. A verification has recorded and modelled force. A plan has the identified force and that which
        a hand at rest feels.
    ax : matplotlib.axes.Axes, optional
        Axes to draw on; by default those of a new figure.
    **look
        Of a model: ``label`` and ``color`` of its curves, to draw several models on the same axes. Of a
        verification: ``residual=True`` draws recorded minus modelled force.

    Raises
    ------
    InputError
        The first argument is of another type, or `ax` is not Axes of matplotlib.
    """
    raise InputError(
        f"shown is of type {type(shown).__name__}; give a palpate.Recording, Model, Verification or Plan"
    )


@plot.register
def _(shown: Recording, ax: Axes | None = None) -> Axes:
    axes = axes_or_new(ax)
    draw_recording(axes, shown)
    return axes


@plot.register
def _(shown: Model, ax: Axes | None = None, *, label: str = "model", color: str = "black") -> Axes:
    axes = axes_or_new(ax)
    draw_model(axes, shown, label=label, color=color)
    return axes


@plot.register
def _(shown: Verification, ax: Axes | None = None, *, residual: bool = False) -> Axes:
    axes, recording = axes_or_new(ax), shown.compared
    if residual:
        draw_residual(axes, recording, shown.force, band=shown.band)
    else:
        one_curve = not shown.prediction.over_time
        one_curve &= shown.prediction.side is None or recording.direction is not None
        draw_forces(axes, recording, shown.force, one_curve=one_curve)
    return axes


@plot.register
def _(shown: Plan, ax: Axes | None = None) -> Axes:
    axes = axes_or_new(ax)
    draw_plan(axes, shown)
    return axes

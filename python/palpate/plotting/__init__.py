# SPDX-License-Identifier: Apache-2.0
"""Figures: each function draws on axes of the caller. The command line and the methods `plot` use them."""

from .look import axes_or_new
from .models import (
    draw_forces,
    draw_measured_and_modelled,
    draw_model,
    draw_path,
    draw_residual,
    draw_two_models,
)
from .recordings import draw_recording
from .rendering import draw_plan, draw_real_against_rendered, draw_root_locus, draw_structures

__all__ = [
    "axes_or_new",
    "draw_forces",
    "draw_measured_and_modelled",
    "draw_model",
    "draw_path",
    "draw_plan",
    "draw_real_against_rendered",
    "draw_recording",
    "draw_residual",
    "draw_root_locus",
    "draw_structures",
    "draw_two_models",
]

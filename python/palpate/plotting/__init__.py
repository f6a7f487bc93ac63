# SPDX-License-Identifier: Apache-2.0
"""Figures: each function draws on axes of the caller. `plot` chooses one by the type of its argument."""

from .analysis import draw_force_history, draw_spectrum, draw_transform, draw_views
from .frame import draw_frame_bounds, draw_frame_grid
from .look import axes_or_new
from .models import (
    draw_forces,
    draw_measured_and_modelled,
    draw_model,
    draw_path,
    draw_residual,
    draw_two_models,
)
from .plot import plot
from .recordings import draw_recording
from .rendering import draw_plan, draw_real_against_rendered, draw_root_locus, draw_structures
from .transforms import History, Plane, history_of, power_spectrum, short_time_transform, wavelet_transform

__all__ = [
    "History",
    "Plane",
    "axes_or_new",
    "draw_force_history",
    "draw_forces",
    "draw_frame_bounds",
    "draw_frame_grid",
    "draw_measured_and_modelled",
    "draw_model",
    "draw_path",
    "draw_plan",
    "draw_real_against_rendered",
    "draw_recording",
    "draw_residual",
    "draw_root_locus",
    "draw_spectrum",
    "draw_structures",
    "draw_transform",
    "draw_two_models",
    "draw_views",
    "history_of",
    "plot",
    "power_spectrum",
    "short_time_transform",
    "wavelet_transform",
]

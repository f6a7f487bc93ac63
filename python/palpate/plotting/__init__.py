# SPDX-License-Identifier: Apache-2.0
"""Figures: each function draws on axes of the caller. Only the command line needs them."""

from .analysis import (
    draw_force_history,
    draw_force_over_position,
    draw_spectrum,
    draw_transform,
    draw_views,
)
from .frame import draw_frame_bounds, draw_frame_grid
from .models import draw_measured_and_modelled, draw_path, draw_two_models
from .rendering import draw_real_against_rendered, draw_root_locus, draw_structures
from .transforms import History, Plane, history_of, power_spectrum, short_time_transform, wavelet_transform

__all__ = [
    "History",
    "Plane",
    "draw_force_history",
    "draw_force_over_position",
    "draw_frame_bounds",
    "draw_frame_grid",
    "draw_measured_and_modelled",
    "draw_path",
    "draw_real_against_rendered",
    "draw_root_locus",
    "draw_spectrum",
    "draw_structures",
    "draw_transform",
    "draw_two_models",
    "draw_views",
    "history_of",
    "power_spectrum",
    "short_time_transform",
    "wavelet_transform",
]

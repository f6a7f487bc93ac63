# SPDX-License-Identifier: Apache-2.0
"""Figures: each function draws on axes of the caller. Only the command line needs them."""

from .models import draw_measured_and_modelled, draw_path, draw_two_models
from .rendering import draw_real_against_rendered, draw_root_locus, draw_structures

__all__ = [
    "draw_measured_and_modelled",
    "draw_path",
    "draw_real_against_rendered",
    "draw_root_locus",
    "draw_structures",
    "draw_two_models",
]

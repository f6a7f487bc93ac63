# SPDX-License-Identifier: Apache-2.0
"""Figures: one function each, drawing on axes that the caller made. Only the command line needs them."""

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

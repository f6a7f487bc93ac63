# SPDX-License-Identifier: Apache-2.0
"""Figures: one function each, drawing on axes that the caller made. Only the command line needs them."""

from .measured_and_modelled import draw_measured_and_modelled
from .path import draw_path
from .real_against_rendered import draw_real_against_rendered
from .root_locus import draw_root_locus
from .structures import draw_structures
from .two_models import draw_two_models

__all__ = [
    "draw_measured_and_modelled",
    "draw_path",
    "draw_real_against_rendered",
    "draw_root_locus",
    "draw_structures",
    "draw_two_models",
]

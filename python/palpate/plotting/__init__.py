# SPDX-License-Identifier: Apache-2.0
"""Figures: one function each, drawing on axes that the caller made. Only the command line needs them."""

from .failure_maps import MeasuredLimit, draw_failure_map
from .identification import Reached, draw_legend, draw_over_speed, draw_reached
from .measured_and_modelled import draw_measured_and_modelled
from .path import draw_path
from .prediction import draw_prediction
from .real_against_rendered import draw_real_against_rendered
from .root_locus import draw_root_locus
from .speed import (
    ModelError,
    OverWavelets,
    RenderedForce,
    WorkPrecision,
    draw_model_error,
    draw_over_wavelets,
    draw_rendered_force,
    draw_work_precision,
)
from .structures import draw_structures
from .two_models import draw_two_models

__all__ = [
    "MeasuredLimit",
    "ModelError",
    "OverWavelets",
    "Reached",
    "RenderedForce",
    "WorkPrecision",
    "draw_failure_map",
    "draw_legend",
    "draw_measured_and_modelled",
    "draw_model_error",
    "draw_over_speed",
    "draw_over_wavelets",
    "draw_path",
    "draw_prediction",
    "draw_reached",
    "draw_real_against_rendered",
    "draw_rendered_force",
    "draw_root_locus",
    "draw_structures",
    "draw_two_models",
    "draw_work_precision",
]

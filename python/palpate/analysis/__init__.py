# SPDX-License-Identifier: Apache-2.0
"""Views of methods and models that no rendering needs; only the command line does."""

from .failure_maps import (
    FailureLine,
    FailureMap,
    GuardEffect,
    failure_map_names,
    measure_failure_map,
    measure_guard_effects,
)
from .prediction import PREDICTIONS, PredictionGain, measure_prediction

__all__ = [
    "PREDICTIONS",
    "FailureLine",
    "FailureMap",
    "GuardEffect",
    "PredictionGain",
    "failure_map_names",
    "measure_failure_map",
    "measure_guard_effects",
    "measure_prediction",
]

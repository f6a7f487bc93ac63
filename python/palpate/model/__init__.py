# SPDX-License-Identifier: Apache-2.0
"""Models in memory and in model files: JSON with a published schema, numbers exact to the last bit."""

from .model import Model, load_model
from .model_file import Fit, PathStep

__all__ = ["Fit", "Model", "PathStep", "load_model"]

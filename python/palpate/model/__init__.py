# SPDX-License-Identifier: Apache-2.0
"""Models on disk and in memory: JSON with a published schema, numbers to the last bit."""

from .fit import Fit, PathStep
from .model import Model, load_model

__all__ = ["Fit", "Model", "PathStep", "load_model"]

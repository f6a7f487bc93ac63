# SPDX-License-Identifier: Apache-2.0
"""Identification of a wavelet network from recorded force over position (paper section 3)."""

from .fit import fit_environment
from .identify import identify
from .network.basis import frame_bounds
from .network.fitted import FittedNetwork
from .options import IdentifyOptions, SearchOptions

__all__ = ["FittedNetwork", "IdentifyOptions", "SearchOptions", "fit_environment", "frame_bounds", "identify"]

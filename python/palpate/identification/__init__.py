# SPDX-License-Identifier: Apache-2.0
"""Identification of a wavelet network from recorded force over position (paper section 3)."""

from .environment import fit_environment
from .frame import frame_bounds
from .identified import IdentifiedNetwork
from .identify import identify
from .options import IdentifyOptions

__all__ = ["IdentifiedNetwork", "IdentifyOptions", "fit_environment", "frame_bounds", "identify"]

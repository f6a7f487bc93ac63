# SPDX-License-Identifier: Apache-2.0
"""Names of the array shapes that functions take and return."""

from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

Float1D: TypeAlias = NDArray[np.float64]
"""(n,) float64"""

Float2D: TypeAlias = NDArray[np.float64]
"""(n, d) float64"""

Int8Vector: TypeAlias = NDArray[np.int8]
"""(n,) int8"""

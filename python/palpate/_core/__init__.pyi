# SPDX-License-Identifier: Apache-2.0
"""
The C++ core of palpate, one submodule for each folder of its headers.
"""
from __future__ import annotations
from . import status
from . import model
from . import dynamics
from . import device
from . import rendering
from . import stability
from . import portable
from . import io
from . import simulation
from . import run
__all__: list[str] = ['device', 'dynamics', 'io', 'model', 'portable', 'rendering', 'run', 'simulation', 'stability', 'status']
__version__: str = '0.1.0'

# SPDX-License-Identifier: Apache-2.0
"""Export: a model as a file for programs without palpate.

Each format is one module with the function ``write(request) -> Written``; `cli/export.py` lists the formats.
"""

from .exported import Exported
from .request import Request, Written

__all__ = ["Exported", "Request", "Written"]

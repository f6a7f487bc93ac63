# SPDX-License-Identifier: Apache-2.0
"""Writes the JSON schema of model files, for programs that read or write them."""

from __future__ import annotations

from importlib.resources import files

from ..verdict import GOOD
from .request import Request, Written


def write(request: Request) -> Written:
    """Writes model.schema.json; no model is needed."""
    text = files("palpate.model").joinpath("model.schema.json").read_text(encoding="utf-8")
    request.write_text(text)
    return Written(GOOD, {"schema": f"{request.output}: JSON schema of model files"}, {"bytes": len(text)})

# SPDX-License-Identifier: Apache-2.0
"""Parts of a model file beside the network: the history of the fit, the certificate, the layout of the text.

The core reads and checks model files; `model.schema.json` describes them.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypedDict

from .._core.stability import Certificate
from ..recording.files import replacing

_OPENED = ("network", "fit", "plan", "certificate")
"""Objects whose fields get a line each, as those of the file do."""


class PathStep(TypedDict):
    """One model that identification considered."""

    n_wavelets: int
    rmse: float
    criterion: float | None
    """Value of the stopping rule, the smaller the better; None where the rule gives none"""
    model_class: str


@dataclass(frozen=True)
class Fit:
    """How an identification ended."""

    model_class: str
    """The simplest model class that was accepted: constant, linear, position, hysteresis, ..."""
    stop_reason: str
    nrmse: float
    """RMSE over the population standard deviation of the force, on the rows it was identified on"""
    n_wavelets: int
    n_parameters: int
    """Every fitted real number, dilations and translations included"""
    path: Sequence[PathStep] = ()

    def record(self) -> dict[str, Any]:
        """The fit in a model file, with numbers of NumPy as those of Python."""
        return {
            "model_class": self.model_class,
            "stop_reason": self.stop_reason,
            "nrmse": float(self.nrmse),
            "n_wavelets": int(self.n_wavelets),
            "n_parameters": int(self.n_parameters),
            "path": [
                {
                    "n_wavelets": int(step["n_wavelets"]),
                    "rmse": float(step["rmse"]),
                    "criterion": None if step["criterion"] is None else float(step["criterion"]),
                    "model_class": step["model_class"],
                }
                for step in self.path
            ],
        }


def certificate_record(certificate: Certificate) -> dict[str, Any]:
    """The certificate in a model file. Its scheme stands in the plan."""
    record = certificate.to_dict()
    del record["scheme"]
    return {
        **record,
        "structure": certificate.scheme.structure,
        "device": certificate.device.to_dict(),
        "bounds": certificate.bounds.to_dict(),
        "inequalities": [line.to_dict() for line in certificate.inequalities],
    }


def write_json(path: Path, content: dict[str, Any]) -> Path:
    """Writes `content` so that a person can read it; the file appears when it is complete."""
    with replacing(path) as temporary:
        temporary.write_text(f"{_lines(content, '')}\n", encoding="utf-8")
    return path


def _lines(content: dict[str, Any], indent: str) -> str:
    inner = indent + "  "
    fields = []
    for key, value in content.items():
        opened = key in _OPENED and not indent and value is not None
        text = _lines(value, inner) if opened else json.dumps(value, allow_nan=False)
        fields.append(f"{inner}{json.dumps(key)}: {text}")
    return "{\n" + ",\n".join(fields) + f"\n{indent}}}"

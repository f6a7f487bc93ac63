# SPDX-License-Identifier: Apache-2.0
"""Request and result of an export, the same for all formats."""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from ..errors import InputError
from ..model import Model, load_model
from ..recording import Recording
from ..recording.files import replacing
from ..verdict import Verdict

_IDENTIFIER = re.compile(r"[A-Za-z][A-Za-z0-9_]*")

_RESERVED = frozenset(
    word
    for line in (
        "auto break case char const continue default do double else enum extern float for goto if inline",
        "int long register restrict return short signed sizeof static struct switch typedef union unsigned",
        "void volatile while and bool class delete false new not operator or private protected public",
        "template this true using virtual PALPATE",
    )
    for word in line.split()
)
"""Words that cannot be the name of a model: those of C and C++, and the prefix of the macros of a program."""


COGGING_TABLES = ("moteus", "openffboard", "odrive", "table")
"""Controllers whose table against cogging can be exported, and a plain table."""


@dataclass(frozen=True)
class Request:
    """Options of one export."""

    output: Path
    model_file: Path | None = None
    precision: str = "single"
    """"single" or "double": number type of the exported program"""
    name: str | None = None
    """Name of the model in the program; None: the name of the output file"""
    uncertified: bool = False
    """True if a model without certificate is exported too"""
    encoder_step: float | None = None
    """Position for each count, for a model without the profile of a device"""
    force_limit: float | None = None
    """Largest force of the device, for a model without the profile of a device"""
    accept_model: bool = False
    """True if a model with the verdict "no" is exported too"""
    recording: Recording | None = None
    """Recording to export in place of a model"""
    cogging: str | None = None
    """Controller whose table against cogging is written, one of `COGGING_TABLES`"""
    unit_force: float | None = None
    """Force for one unit of that table; None: the table has the unit of the model"""
    encoder_zero: float = 0.0
    """Position of the model at zero of the controller's encoder [rad]"""
    scale: float = 1.0
    """Share of the cogging that the table cancels"""
    knots: int | None = None
    """Number of knots of the curve of a pedal"""

    @cached_property
    def model(self) -> Model:
        """Model to export.

        Raises
        ------
        InputError
            The file is not a model file, or its verdict is "no".
        """
        if self.model_file is None:
            raise InputError("no model is given: palpate export MODEL.json -o OUT")
        return load_model(self.model_file).require_use(self.model_file, accepted=self.accept_model)

    @property
    def is_for_display(self) -> bool:
        """True if the plan of the model is for an admittance display."""
        certificate = self.model.certificate
        return certificate is not None and "admittance" in certificate["device"]

    def identifier(self) -> str:
        """Returns the name of the model, which is a C identifier.

        Without `name` it is that of the output file; a reserved word gets a prefix.

        Raises
        ------
        InputError
            `name` is not an identifier.
        """
        if self.name is not None:
            if _IDENTIFIER.fullmatch(self.name) is None or self.name in _RESERVED:
                raise InputError(
                    f"the name is {self.name!r}: must be an identifier of C and no reserved word, such as "
                    "knob"
                )
            return self.name
        name = re.sub(r"\W+", "_", self.output.name.split(".")[0], flags=re.ASCII).strip("_")
        is_valid = _IDENTIFIER.fullmatch(name) is not None and name not in _RESERVED
        return name if is_valid else f"model_{name}"

    def write_text(self, text: str) -> None:
        """Writes the output; the file gets its name only when it is completely written."""
        with replacing(self.output) as temporary:
            temporary.write_text(text, encoding="utf-8")


@dataclass(frozen=True)
class Written:
    """Result of one export."""

    verdict: Verdict
    numbers: dict[str, str]
    """Main numbers for display, by name"""
    record: dict[str, Any]
    """The same numbers for --json"""

# SPDX-License-Identifier: Apache-2.0
"""Write a recording as CSV that states which column plays which part, so that it is read back with no option.

A record of what was rendered names one more role than the reader has options for: "status", the column that
says of every row whether its force was the model's alone.
"""

from __future__ import annotations

import json
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pandas as pd

from ..errors import InputError
from .files import replacing
from .table import Cells

_KEY = "palpate-columns"
"""The metadata key: ``# palpate-columns: {"position": "position_rad", ...}``."""


@dataclass(frozen=True)
class Layout:
    """Role to column name; empty for a file that does not say."""

    roles: dict[str, str] = field(default_factory=dict)
    inputs: tuple[str, ...] = ()

    @staticmethod
    def taken_from(file: str, metadata: dict[str, str]) -> Layout:
        """Take the layout out of a file's metadata."""
        text = metadata.pop(_KEY, None)
        if text is None:
            return Layout()
        try:
            found: dict[str, Any] = json.loads(text)
            inputs = tuple(map(str, found.pop("inputs", ())))
            return Layout({role: str(name) for role, name in found.items()}, inputs)
        except (ValueError, AttributeError, TypeError):
            raise InputError(
                f"{file}: the line '# {_KEY}:' holds {text!r}, not a JSON object of roles and columns"
            ) from None


def free_name(stem: str, suffix: str, taken: Collection[str]) -> str:
    """`stem` + `suffix`, numbered where another column of the recording already has that name."""
    name, number = stem + suffix, 2
    while name in taken:
        name, number = f"{stem}_{number}{suffix}", number + 1
    return name


def write_csv(
    path: Path, layout: Layout, columns: Mapping[str, Cells], metadata: Mapping[str, str], *, replace: bool
) -> None:
    """Write columns and metadata; without `replace`, an existing file is refused.

    Raises
    ------
    InputError
        The folder does not exist or cannot be written, or the metadata cannot stand on one line.
    """
    stated = json.dumps({**layout.roles, "inputs": list(layout.inputs)})
    with (
        replacing(path, replace=replace) as temporary,
        temporary.open("w", encoding="utf-8", newline="") as stream,
    ):
        for key, value in (*metadata.items(), (_KEY, stated)):
            line = f"# {key}: {value}"
            if len(line.splitlines()) != 1 or ":" in key:
                raise InputError(
                    f"{path} cannot be written: metadata {key!r} does not fit on one line, key: value"
                )
            stream.write(line + "\n")
        pd.DataFrame(dict(columns)).to_csv(stream, index=False, lineterminator="\n")

# SPDX-License-Identifier: Apache-2.0
"""How a written recording says which column plays which part, so that it is read back with no option.

A record of what was rendered names one more role than the reader has options for: "status", the column that
says of every row whether its force was the model's alone.
"""

from __future__ import annotations

import json
from collections.abc import Collection
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from ..errors import InputError
from .units import COLUMN_SUFFIX

if TYPE_CHECKING:
    from .recording import Recording

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

    def metadata_line(self) -> tuple[str, str]:
        """Key and value that say this layout."""
        return _KEY, json.dumps({**self.roles, "inputs": list(self.inputs)})


def layout_for_writing(recording: Recording) -> Layout:
    """Name the columns of a recording: the stem is the role, the suffix the SI unit (none where unstated)."""
    taken = {*recording.columns, *recording.input_names}
    roles: dict[str, str] = {}
    if recording.time is not None:
        roles["time"] = _free_name("time", "_s", taken)
    for role in ("position", "force"):
        unit = recording.units[role]
        roles[role] = _free_name(role, f"_{COLUMN_SUFFIX[unit]}" if unit else "", taken)
    if recording.direction is not None:
        roles["direction"] = _free_name("direction", "", taken)
    return Layout(roles, recording.input_names)


def _free_name(stem: str, suffix: str, taken: Collection[str]) -> str:
    """`stem` + `suffix`, numbered where another column of the recording already has that name."""
    name, number = stem + suffix, 2
    while name in taken:
        name, number = f"{stem}_{number}{suffix}", number + 1
    return name

# SPDX-License-Identifier: Apache-2.0
"""One thing that was looked at on a device."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Finding:
    """What was seen, and whether that is right, wrong, or (None) not to be judged."""

    name: str
    told: str
    right: bool | None = None
    advice: str = ""
    forbids_force: bool = False
    """Whether no force may follow where this is wrong."""

# SPDX-License-Identifier: Apache-2.0
"""The verdict of a live session, which the core makes, as every verb prints it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ..verdict import Verdict
from .printing import talk


def session_verdict(summary: Mapping[str, Any]) -> Verdict:
    """Return the verdict in a summary of `render` or `measure`; say on standard error how a bad run ended."""
    if not summary["orderly"]:
        talk(f"error: {summary['ended']}; zero force sent, device closed")
    return Verdict.from_record(summary["findings"])

# SPDX-License-Identifier: Apache-2.0
"""Checks of a recording before it is used: each finding names the rows, the likely cause and the cure.

`CHECKS` lists all of them with their thresholds. Wrong readings are single rows, which are dropped first.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from ..._typing import Float1D
from ...verdict import Finding, usable
from ..conversion import MIN_ROWS
from .cells import Checked
from .gaps import position_gaps
from .ranges import implausible_range
from .recordings import scale_findings
from .sensors import clipped_force
from .signs import force_without_contact, mirrored_stroke, moved_zero, reversed_sign

if TYPE_CHECKING:
    from ..recording import Recording


@dataclass(frozen=True)
class Check:
    """Search for one defect of a recording."""

    defect: str
    findings: Callable[..., list[Finding]]
    """Function of a :class:`Checked` and the thresholds, which its docstring describes"""
    seen: str
    """Kind of file that has the defect"""
    thresholds: Mapping[str, Any]


def unread_time(checked: Checked) -> list[Finding]:
    """Returns a finding if the file has a column of times that was not read."""
    sentence = checked.recording.unread_time
    return [usable(sentence)] if sentence else []


CHECKS = (
    Check(
        "time that is not read",
        unread_time,
        "a unit of time that is not known, a clock without fractions of a second",
        {},
    ),
    Check(
        "wrong unit",
        implausible_range,
        "depths in mm or um in a column of m",
        {
            "travels": {"m": (1e-7, 0.5), "rad": (1e-3, 100.0 * math.pi)},
            "microscope_travel": 1e-4,
            "microscope_force": 0.1,
        },
    ),
    Check(
        "reversed sign",
        reversed_sign,
        "a position that grows out of the object, a force of the object's side, a late force",
        {"same_sign_share": 0.8},
    ),
    Check(
        "stroke with the wrong sign",
        mirrored_stroke,
        "a release whose force was stored as its absolute value",
        {"agreement": 0.9, "correlation": 0.5, "range_share": 0.2},
    ),
    Check(
        "moved zero",
        moved_zero,
        "a tare between press and release; no release of 56 measured switches and domes ends so low",
        {"shift_share": 0.02, "range_share": 0.2, "rows": 5},
    ),
    Check(
        "force without contact",
        force_without_contact,
        "a sensor that was not set to zero",
        {},
    ),
    Check(
        "clipped force",
        clipped_force,
        "a force sensor or converter at the end of its range; rounding alone repeats a value at most 3 times",
        {"positions": 3, "ratio": 5.0, "near_share": 0.1, "contact_share": 0.2},
    ),
    Check(
        "positions without rows",
        position_gaps,
        "lost rows, a stroke that ends early, one wrong position in a table without order",
        {"gap_share": 0.02, "gap_ratio": 8.0, "stroke_share": 0.05, "named": 2},
    ),
)
"""All checks, in the order of their findings. Each threshold is described in its function."""


def quality_findings(recording: Recording, attracts: bool = False) -> list[Finding]:
    """Returns findings on a recording as it was read; empty without defects. `attracts` is True if the object
    is stated to attract the tool."""
    if len(recording) < MIN_ROWS:
        return []
    checked = Checked(recording, attracts)
    found = [finding for check in CHECKS for finding in check.findings(checked, **check.thresholds)]
    # The cause of a result that must not be used explains the other findings.
    return [each for each in found if each.level == "no"] or found


def findings_of(
    recordings: Sequence[Recording],
    side: Float1D | None = None,
    attracts: bool = False,
    explained: bool = False,
) -> list[Finding]:
    """Returns findings on each recording, with its name if there are several, and on all of them together.

    `side` (n,) is the direction of the rows of all recordings if they do not state it; `explained` is True if
    one model explains the forces of all recordings by more than position and direction.
    """
    if len(recordings) == 1:
        return quality_findings(recordings[0], attracts)
    names = [
        each.source.files[0] if each.source.files else f"recording {number}"
        for number, each in enumerate(recordings, 1)
    ]
    found = [
        Finding(finding.level, f"{name}: {finding.sentence}")
        for name, recording in zip(names, recordings, strict=True)
        for finding in quality_findings(recording, attracts)
    ]
    return found if explained else found + scale_findings(recordings, side)

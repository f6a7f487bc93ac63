# SPDX-License-Identifier: Apache-2.0
"""Checks of a recording before it is used: each finding names the rows, the likely cause and the cure."""

from __future__ import annotations

from collections.abc import Sequence

from .._typing import Float1D
from ..verdict import Finding
from .branches import merged_findings
from .cells import Travel, cell_rows
from .coverage import gap_findings
from .holds import hold_findings
from .magnitudes import magnitude_findings
from .recording import Recording
from .saturation import saturation_findings
from .scales import scale_findings
from .signs import sign_findings

LEAST_ROWS = 10
"""Rows below which a recording is not checked."""


def findings_of(recordings: Sequence[Recording], side: Float1D | None = None) -> list[Finding]:
    """Findings on each recording, named where there are several, and on all of them together.

    `side` (n,) is the direction of the rows of all recordings, where they do not state it.
    """
    if len(recordings) == 1:
        return quality_findings(recordings[0])
    found = [
        Finding(finding.level, f"{recording.source.files[0]}: {finding.sentence}")
        if recording.source.files
        else Finding(finding.level, f"recording {number}: {finding.sentence}")
        for number, recording in enumerate(recordings, 1)
        for finding in quality_findings(recording)
    ]
    return [*found, *scale_findings(recordings, side)]


def quality_findings(recording: Recording) -> list[Finding]:
    """Findings on a recording as it was read, none where nothing looks wrong."""
    if len(recording) < LEAST_ROWS:
        return []
    travel = Travel.of(recording.position)
    cells = None if recording.input_names else cell_rows(recording, travel)
    return [
        *magnitude_findings(recording, travel),
        *sign_findings(recording, travel, cells),
        *saturation_findings(recording, travel),
        *hold_findings(recording),
        *gap_findings(recording, travel),
        *merged_findings(recording, cells),
    ]

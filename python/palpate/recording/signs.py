# SPDX-License-Identifier: Apache-2.0
"""Signs of position, force and direction that contradict each other."""

from __future__ import annotations

import numpy as np

from ..verdict import Finding, usable
from .cells import CellRows, Travel, amount
from .notes import FALLING
from .recording import Recording

CELLS_IN_LINE = 0.8
"""Share of the positions at which a loop has the sign of its mean."""

LOOP = 0.02
"""Mean of press minus release force, as a share of the force's spread, from which there is a loop."""

STANDARD_ERRORS = 5.0
"""The same mean over its standard error."""


def sign_findings(recording: Recording, travel: Travel, cells: CellRows | None) -> list[Finding]:
    """Findings on a turned direction, a loop that gives out energy, and a force that falls with position."""
    words = recording.direction
    if words is not None and len(words) > 1:
        # a spike goes both ways, so it does not count
        step = np.where(travel.inside[1:] & travel.inside[:-1], np.diff(recording.position) * words[1:], 0.0)
        if step.sum() < 0:
            against = float(np.mean(step[step != 0.0] < 0))
            return [
                usable(
                    f"the position falls in rows whose direction goes into the object ({against:.0%} of the "
                    "moving rows): position or direction is probably turned; if the position grows out of "
                    "the object give --negate position, else swap the words of the direction column"
                )
            ]
    if recording.input_names:
        return []
    mean, is_loop = _loop(recording, cells)
    if is_loop and mean < 0.0:
        late = "" if recording.time is None else "if the force was recorded late --force-late-s SECONDS, "
        return [
            usable(
                f"the force on release is {amount(-mean, recording.units['force'])} above that on press on "
                "average: the loop gives out energy, as no passive object does; if a sign is turned give "
                f"--negate force or --negate position, {late}for a latch or a stored spring "
                "--no-hysteresis-nonnegative"
            )
        ]
    x, f = recording.position[travel.inside], recording.force[travel.inside]
    if is_loop or not (np.ptp(f) > 0.0 and np.ptp(x) > 0.0):
        return []
    if (correlation := float(np.corrcoef(x, f)[0, 1])) < FALLING:
        return [
            usable(
                f"the force falls with position over the whole file (correlation {correlation:.2f}): if the "
                "position grows out of the object give --negate position, if the force is positive when "
                "pulling give --negate force"
            )
        ]
    return []


def _loop(recording: Recording, cells: CellRows | None) -> tuple[float, bool]:
    """Mean of press minus release force, and whether it is clearly not zero."""
    if cells is None or len(cells.loop) < 4:
        return 0.0, False
    mean = float(np.mean(cells.loop))
    error = float(np.sqrt(np.mean(cells.loop_error**2) / len(cells.loop)))
    in_line = float(np.mean(np.sign(cells.loop) == np.sign(mean)))
    large = abs(mean) > max(STANDARD_ERRORS * error, LOOP * float(np.std(recording.force)))
    return mean, large and in_line >= CELLS_IN_LINE

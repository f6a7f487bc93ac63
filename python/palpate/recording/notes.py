# SPDX-License-Identifier: Apache-2.0
"""What a person should know of a recording that was just read: what was chosen, and what looks mirrored."""

from __future__ import annotations

import numpy as np

from .._typing import Float1D, Int8Vector
from .columns import Choice

FALLING = -0.3
"""Correlation of force and position below which the force counts as falling over the whole file. A mirrored
axis gives about -0.3 to -0.9 on indentation curves; humps, detents and friction stay between -0.3 and 0.2."""


def chosen(choice: Choice, stroke: str | None, torque_constant: float | None) -> str:
    """Which column plays which part, in one sentence."""
    parts = [f"position is {choice.position.name}", f"force is {choice.force.name}"]
    if torque_constant is not None:
        parts[-1] += f" times {torque_constant:g} N*m/A"
    elif choice.force.unit is not None and choice.force.unit.si == "A":
        parts[-1] += " (a current; it stays in A)"
    parts.append(f"time is {choice.time.name}" if choice.time else "there is no time")
    parts.append(f"direction is {stroke}" if stroke else "there is no direction")
    if choice.inputs:
        parts.append(f"inputs are {', '.join(column.name for column in choice.inputs)}")
    return ", ".join(parts)


def noticed(x: Float1D, f: Float1D, words: Int8Vector | None) -> list[str]:
    """Say once what looks mirrored; nothing is ever flipped silently."""
    signs = []
    if np.ptp(f) > 0 and (correlation := float(np.corrcoef(x, f)[0, 1])) < FALLING:
        signs.append(f"the force falls with position over the whole file (correlation {correlation:.2f})")
    if words is not None and len(x) > 1:
        step = np.diff(x) * words[1:]
        if step.sum() < 0:
            signs.append("the position falls where the direction goes into the object")
    if not signs:
        return []
    return [
        f"{' and '.join(signs)}: if the position grows out of the object give --negate position, "
        "if the force is positive when pulling give --negate force"
    ]

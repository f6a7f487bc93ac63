# SPDX-License-Identifier: Apache-2.0
"""What a person should know of a recording that was just read: what was chosen, and what looks mirrored."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .._typing import Float1D, Int8Vector
from .columns import Choice

FALLING = -0.3
"""Correlation of force and position below which the force counts as falling over the whole file. A mirrored
axis gives about -0.3 to -0.9 on indentation curves; humps, detents and friction stay between -0.3 and 0.2."""


def chosen(
    choice: Choice, stroke: str | None, torque_constant: float | None, dialect: Sequence[str] = ()
) -> str:
    """The column of each role, and how the file was read, in one sentence."""
    parts = [f"position is {choice.position.name}", f"force is {choice.force.name}"]
    if torque_constant is not None:
        parts[-1] += f" times {torque_constant:g} N*m/A"
    elif choice.force.unit is not None and choice.force.unit.si == "A":
        parts[-1] += " (a current; it stays in A)"
    parts.append(f"time is {choice.time.name}" if choice.time else "there is no time")
    parts.append(f"direction is {stroke}" if stroke else "there is no direction")
    if choice.inputs:
        parts.append(f"inputs are {', '.join(column.name for column in choice.inputs)}")
    read = f"; read as: {', '.join(dialect)}" if dialect else ""
    return ", ".join(parts) + read


def noticed(x: Float1D, f: Float1D, words: Int8Vector | None) -> list[str]:
    """Report once what looks mirrored; no sign is turned without an option."""
    x, f = _scaled(x), _scaled(f)
    correlation = float(np.corrcoef(x, f)[0, 1]) if np.ptp(f) > 0 else 0.0
    against = words is not None and len(x) > 1 and float((np.diff(x) * words[1:]).sum()) < 0
    return mirrored(correlation, against)


def _scaled(values: Float1D) -> Float1D:
    """The values divided by a power of two, so that no square overflows and no digit changes."""
    _, exponent = np.frexp(np.abs(values).max(initial=0.0))
    return np.asarray(np.ldexp(values, -exponent))


def mirrored(correlation: float, against: bool = False) -> list[str]:
    """The note on a force that falls with position, or on a position that moves against its direction."""
    signs = []
    if correlation < FALLING:
        signs.append(f"the force falls with position over the whole file (correlation {correlation:.2f})")
    if against:
        signs.append("the position falls where the direction goes into the object")
    if not signs:
        return []
    return [
        f"{' and '.join(signs)}: if the position grows out of the object give --negate position, "
        "if the force is positive when pulling give --negate force"
    ]

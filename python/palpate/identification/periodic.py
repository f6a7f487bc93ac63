# SPDX-License-Identifier: Apache-2.0
"""Positions of an environment that repeats, such as a knob: taken modulo its period."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from .._typing import Float1D
from ..errors import InputError
from ..verdict import Finding, no, usable
from .compression import Compressed

USABLE_GAP = 0.05
"""Share of the period without a position above which the model is usable with a reservation [-]."""

UNFIT_GAP = 0.5
"""Share of the period without a position above which the model is unfit [-]."""


SEAM = 0.02
"""Share of the period at each end whose rows are repeated beyond the other end for the fit [-]."""


@dataclass(frozen=True)
class Turns:
    """How positions lie on a period."""

    note: str
    findings: tuple[Finding, ...]


def require_one_input(names: tuple[str, ...]) -> None:
    """Refuse a period for a force over several inputs."""
    if len(names) > 1:
        raise InputError(f"period is for a force over position alone, not over {', '.join(names)}")


def turns_of(position: Float1D, period: float) -> Turns:
    """The note and the findings on positions (n,) and a period."""
    lower, travel = float(position.min()), float(np.ptp(position))
    note = (
        f"the positions span {travel / period:.4g} periods of {period:.6g}: they are taken modulo the period"
    )
    if travel <= period:
        gap = period - travel
        note = (
            f"the gap of {gap:.4g} between the last and the first position, {100 * gap / period:.2g} % of "
            f"the period of {period:.6g}, is closed"
        )
    box = np.sort(modulo((position - lower) / period))
    steps = np.diff(np.append(box, box[0] + 1.0))
    widest = int(np.argmax(steps))
    share = float(steps[widest])
    if share <= USABLE_GAP:
        return Turns(note, ())
    start = lower + period * float(box[widest])
    judge = no if share > UNFIT_GAP else usable
    sentence = (
        f"no position lies between {start:.6g} and {start + share * period:.6g}, {100 * share:.3g} % of the "
        f"period of {period:.6g}; record a whole period, or check the unit of --period"
    )
    return Turns(note, (judge(sentence),))


def modulo(box: Float1D) -> Float1D:
    """Positions in periods (n,), each in [0, 1)."""
    return np.asarray(box - np.floor(box))


def around_seam(rows: Compressed) -> Compressed:
    """The rows with those near each end repeated one period further on.

    A row and its copy share the weight. Wavelets near one end are then fitted to the rows of both ends.
    """
    x = rows.positions[:, 0]
    first, last = np.flatnonzero(x < SEAM), np.flatnonzero(x >= 1.0 - SEAM)
    index = np.concatenate([last, np.arange(len(x)), first])
    shift = np.repeat([-1.0, 0.0, 1.0], [len(last), len(x), len(first)])
    shared = np.zeros(len(x), dtype=np.bool_)
    shared[first] = shared[last] = True
    return replace(
        rows,
        positions=rows.positions[index] + shift[:, None],
        force=rows.force[index],
        weight=np.where(shared, 0.5, 1.0)[index] * rows.weight[index],
        side=None if rows.side is None else rows.side[index],
        spread=rows.spread[index],
    )

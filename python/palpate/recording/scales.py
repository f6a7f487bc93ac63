# SPDX-License-Identifier: Apache-2.0
"""Several recordings of one object side by side: wrong units, other zeros, other objects."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .._typing import Float1D
from ..verdict import Finding, no, usable
from .cells import Travel
from .recording import Recording
from .units import GRAVITY

CELLS = 64
"""Points of a curve at most."""

ROWS_A_CELL = 4
"""Rows that a point of a curve is the mean of, on average."""

UNIT_RATIOS = {
    10.0: "mm and cm",
    25.4: "mm and in",
    1e3: "a unit and its thousandth, such as mm and m or mN and N",
    1e6: "a unit and its millionth, such as um and m",
    GRAVITY: "N and kgf",
    1e3 / GRAVITY: "gf and N",
    4.4482216: "N and lbf",
    180.0 / np.pi: "deg and rad",
}
"""Ratios of units that files mix up."""

SHARED = 0.3
"""Share of the travel that two recordings need in common to be compared."""

DIFFERENT = 0.25
"""RMS difference of two curves, as a share of the force's spread, above which they differ."""

SAME = 0.1
"""The same difference up to which a ratio explains it."""

MOST_RECORDINGS = 20
"""Recordings among which the one is sought that agrees best with the others."""

Curve = tuple[Float1D, Float1D]
"""Mean positions in rising order, and mean forces."""


def scale_findings(recordings: Sequence[Recording]) -> list[Finding]:
    """Findings on recordings of one object whose forces differ at the same positions."""
    if len(recordings) < 2 or any(recording.input_names for recording in recordings):
        return []
    curves = [_curve(recording) for recording in recordings]
    apart = [
        [min(_difference(one, other), 1.0) for other in curves[:MOST_RECORDINGS]]
        for one in curves[:MOST_RECORDINGS]
    ]
    reference = int(np.argmin(np.sum(apart, axis=1)))
    found = []
    for index, curve in enumerate(curves):
        if index == reference:
            continue
        difference = _difference(curves[reference], curve)
        if difference <= DIFFERENT:
            continue
        name, other = _name(recordings, index), _name(recordings, reference)
        if (explained := _ratio(curves[reference], curve)) is not None:
            role, ratio, units = explained
            found.append(
                no(
                    f"{name} agrees with {other} only if its {role} is multiplied by {ratio:.4g}: one of "
                    f"them is probably in another unit ({units}); name the unit of the {role} column with "
                    "--units"
                )
            )
        elif np.isfinite(difference):
            found.append(
                usable(
                    f"{name} and {other} differ by {difference:.0%} of the force's spread at the same "
                    "positions: they are probably of two objects or have two zeros; identify them one by one"
                )
            )
    return found


def _name(recordings: Sequence[Recording], index: int) -> str:
    files = recordings[index].source.files
    return files[0] if files else f"recording {index + 1}"


def _curve(recording: Recording) -> Curve:
    """Mean force over position, strokes together."""
    travel = Travel.of(recording.position)
    x, f = recording.position[travel.inside], recording.force[travel.inside]
    if not travel.length > 0.0:
        return x[:1], f[:1]
    cells = int(np.clip(len(x) // ROWS_A_CELL, 2, CELLS))
    cell = np.minimum((cells * ((x - travel.lower) / travel.length)).astype(np.intp), cells - 1)
    count = np.bincount(cell, minlength=cells)
    known = count > 0
    return (
        np.bincount(cell, x, cells)[known] / count[known],
        np.bincount(cell, f, cells)[known] / count[known],
    )


def _difference(one: Curve, other: Curve) -> float:
    """RMS difference over the spread of the first force; infinite where the positions do not overlap."""
    (x, f), (at, force) = one, other
    shared = (at >= x[0]) & (at <= x[-1])
    reach = min(x[-1], at[-1]) - max(x[0], at[0])
    spread = float(np.std(f))
    if reach < SHARED * max(x[-1] - x[0], at[-1] - at[0]) or np.count_nonzero(shared) < 3 or spread == 0.0:
        return float("inf")
    apart = force[shared] - np.interp(at[shared], x, f)
    return float(np.sqrt(np.mean(apart**2))) / spread


def _ratio(one: Curve, other: Curve) -> tuple[str, float, str] | None:
    """The role and the ratio of two units that explain the difference best; None where none does."""
    x, f = other
    tried = []
    for ratio, units in UNIT_RATIOS.items():
        for by in (ratio, 1.0 / ratio):
            tried.append((_difference(one, (by * x, f)), "position", by, units))
            tried.append((_difference(one, (x, by * f)), "force", by, units))
    best = min(tried, key=lambda each: each[0])
    return best[1:] if best[0] <= SAME else None

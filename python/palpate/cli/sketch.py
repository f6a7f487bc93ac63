# SPDX-License-Identifier: Apache-2.0
"""Sketch of a force curve as text, in Braille patterns or in ASCII."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from .._typing import Float1D
from ..model import Model
from ..model.model_display import force_curves
from ..recording.units import Unit

WIDEST, NARROWEST, HEIGHT = 60, 30, 12
"""Largest and least width, and height of the area of the curves [characters]"""

_AXIS = 10
"""Columns to the left of the curves, for the numbers of the force and the axis."""

_DOTS = np.array([[0x01, 0x08], [0x02, 0x10], [0x04, 0x20], [0x40, 0x80]])
"""Bit of each of the 4 x 2 dots of a Braille pattern (Unicode 2800 to 28FF)."""

_BLANK = chr(0x2800)
"""Braille pattern without dots; some fonts draw circles for it."""

_GAP = 3
"""The curve of release has one dot in this number of columns, so that it differs from press."""

_ASCII = {"": "*", "press": "*", "release": "o"}
"""Characters of each stroke without Unicode."""

_TICKS = (0, HEIGHT // 2, HEIGHT - 1)
"""Lines with a number of the force, counted from the top."""

Rows = NDArray[np.intp]
"""(n,) row of a curve in each column, counted from the top"""


def sketch_of(
    model: Model, position_unit: Unit, force_unit: Unit, *, columns: int, unicode: bool
) -> list[str]:
    """Returns the lines of a sketch of force over position.

    There are no lines if the model has several inputs or the terminal is too narrow.

    Parameters
    ----------
    model : Model
    position_unit, force_unit : Unit
        Units of the numbers at the axes.
    columns : int
        Columns of the terminal; the sketch is at most 70 columns wide.
    unicode : bool
        True: Braille patterns, 2 x 4 dots for each character. False: ASCII.
    """
    width = min(WIDEST, columns - _AXIS)
    if model.dimension > 1 or width < NARROWEST:
        return []
    across, down = (2 * width, 4 * HEIGHT) if unicode else (width, HEIGHT)
    position, curves = force_curves(model, across)
    both = np.concatenate(list(curves.values()))
    low, high = float(both.min()), float(both.max())
    rows = {name: _rows(force, low, high, down) for name, force in curves.items()}
    area = _braille(rows, width) if unicode else _characters(rows, width)
    lines = _with_force_axis(area, low, high, force_unit, unicode=unicode)
    lines += _position_axis(model.inputs[0], position, position_unit, width, unicode=unicode)
    if len(curves) > 1:
        text = "solid: press, dotted: release" if unicode else "*: press, o: release"
        lines.append(f"{'':{_AXIS}}{text:^{width}}")
    return [line.rstrip() for line in lines]


def _rows(force: Float1D, low: float, high: float, height: int) -> Rows:
    """Returns the row of each force; a constant force is in the middle."""
    share = (force - low) / (high - low) if high > low else np.full(len(force), 0.5)
    return np.rint((1.0 - share) * (height - 1)).astype(np.intp)


def _filled(rows: Rows, height: int) -> NDArray[np.bool_]:
    """Returns the cells (height, n) of a curve; a steep curve fills the rows between adjacent columns."""
    before = np.concatenate([rows[:1], rows[:-1]])
    row = np.arange(height)[:, None]
    first = np.where(before < rows, before + 1, rows)
    last = np.where(before > rows, before - 1, rows)
    return (row >= np.minimum(first, rows)) & (row <= np.maximum(last, rows))


def _braille(curves: Mapping[str, Rows], width: int) -> list[str]:
    """Returns curves as Braille patterns: press as a solid line, release as a dotted line."""
    dots = np.zeros((4 * HEIGHT, 2 * width), dtype=np.bool_)
    for name, rows in curves.items():
        if name == "release":
            columns = np.arange(0, 2 * width, _GAP)
            dots[rows[columns], columns] = True
        else:
            dots |= _filled(rows, 4 * HEIGHT)
    cells = dots.reshape(HEIGHT, 4, width, 2).transpose(0, 2, 1, 3)
    codes = 0x2800 + (cells * _DOTS).sum(axis=(2, 3))
    return ["".join(map(chr, line)).replace(_BLANK, " ") for line in codes]


def _characters(curves: Mapping[str, Rows], width: int) -> list[str]:
    """Returns curves in ASCII; press is in front of release."""
    area = np.full((HEIGHT, width), " ")
    for name, rows in reversed(list(curves.items())):
        area[_filled(rows, HEIGHT)] = _ASCII[name]
    return ["".join(line) for line in area]


def _with_force_axis(area: list[str], low: float, high: float, unit: Unit, *, unicode: bool) -> list[str]:
    """Returns the lines of the curves with the axis of the force, its numbers and its unit."""
    side = chr(0x2502) if unicode else "|"
    ticks = _TICKS if high > low else _TICKS[1:2]
    numbers = {row: f"{(high - (high - low) * row / (HEIGHT - 1)) / unit.factor:.3g}" for row in ticks}
    title = _titled("force", unit)
    return [f"{title:>{_AXIS}}"] + [
        f"{numbers.get(row, ''):>{_AXIS - 2}} {side}{line}" for row, line in enumerate(area)
    ]


def _position_axis(name: str, position: Float1D, unit: Unit, width: int, *, unicode: bool) -> list[str]:
    """Returns the axis of the position, and its numbers and unit below."""
    corner, floor = (chr(0x2514), chr(0x2500)) if unicode else ("+", "-")
    first, last = (f"{value / unit.factor:.3g}" for value in (position[0], position[-1]))
    middle = _titled(name, unit)
    text = f"{first}{middle:^{width - len(first) - len(last)}}{last}"
    return [f"{corner:>{_AXIS}}{floor * width}", f"{'':{_AXIS}}{text}"]


def _titled(name: str, unit: Unit) -> str:
    return f"{name} [{unit.shown}]" if unit.shown else name

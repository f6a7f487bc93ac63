# SPDX-License-Identifier: Apache-2.0
"""What all figures share: labels with units, and a number of points that a printed column can show."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.ticker import FuncFormatter, NullFormatter
from numpy.typing import NDArray

from .._typing import Float1D

MOST_POINTS = 6000
"""Drawn of a cloud: more cannot be told apart at the width of a column."""

_UNIT_TEXT = {"count": "counts"}


def label(name: str, unit: str) -> str:
    """ "force [N·m]"; the name alone where the unit is not known."""
    return f"{name} [{_UNIT_TEXT.get(unit, unit).replace('*', chr(0xB7))}]" if unit else name


_PREFIXES = ((1e3, "k"), (1.0, ""), (1e-3, "m"), (1e-6, "\u00b5"), (1e-9, "n"))
"""SI prefixes, the largest first."""

_PREFIXED = ("m", "N", "N*m", "A")
"""Units that take every prefix; an angle takes none above 1, and the others none at all."""


@dataclass(frozen=True)
class Scale:
    """The unit in which a quantity is drawn, and the factor from SI to it."""

    factor: float
    unit: str

    def label(self, name: str) -> str:
        """Returns the label of an axis: name and unit."""
        return label(name, self.unit)


def scale_for(unit: str, *values: npt.ArrayLike) -> Scale:
    """Chooses the SI prefix with which the largest of the values is at least 0.1 and less than 1000.

    Parameters
    ----------
    unit : str
        SI unit of the values. Counts, and values whose unit is not known, are drawn as they are.
    *values : array_like
        Everything that is drawn along one axis.
    """
    flat = np.concatenate([np.ravel(np.asarray(each, dtype=np.float64)) for each in values])
    finite = np.abs(flat[np.isfinite(flat)])
    largest = float(finite.max()) if len(finite) else 0.0
    if largest == 0.0 or unit not in (*_PREFIXED, "rad"):
        return Scale(1.0, unit)
    prefixes = _PREFIXES if unit in _PREFIXED else _PREFIXES[1:]
    size, prefix = next((each for each in prefixes if largest >= _least(each[0])), prefixes[-1])
    return Scale(1.0 / size, prefix + unit)


def _least(size: float) -> float:
    """Smallest value that is drawn with a prefix of this size."""
    return size if size > 1.0 else 0.1 * size


def legend_above(axes: Axes) -> None:
    """Returns a legend above the axes, where it hides nothing that is drawn."""
    axes.legend(frameon=False, loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2, borderaxespad=0.2)


def plain_decades(axis: Axis) -> None:
    """Label a logarithmic axis with plain numbers, and a short one between the powers of ten as well."""
    low, high = sorted(axis.get_view_interval())
    plain = FuncFormatter(lambda value, _: f"{value:g}")
    axis.set_major_formatter(plain)
    axis.set_minor_formatter(plain if high < 10.0 * low else NullFormatter())


def grid(axes: Axes, axis: Literal["both", "x", "y"] = "both") -> None:
    """Thin lines behind what is drawn."""
    axes.grid(axis=axis, color="0.88", linewidth=0.5)
    axes.set_axisbelow(True)


def thinned(*arrays: Float1D, most: int = MOST_POINTS) -> list[Float1D]:
    """Every k-th sample of each array, so that at most `most` are drawn."""
    step = max(1, -(-len(arrays[0]) // most))
    return [array[::step] for array in arrays]


def strokes(direction: NDArray[np.int8] | None, n: int) -> list[tuple[str, NDArray[np.bool_]]]:
    """Returns the strokes that are told apart: press and release where a recording has both, else all rows at
    once.

    Pauses belong to no stroke and are left out beside strokes.
    """
    if direction is not None and (direction > 0).any() and (direction < 0).any():
        return [("press", direction > 0), ("release", direction < 0)]
    return [("", np.ones(n, dtype=np.bool_))]

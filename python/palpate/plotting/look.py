# SPDX-License-Identifier: Apache-2.0
"""Common style of all figures: labels with units, and a number of points that suits a printed column."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal
from weakref import WeakKeyDictionary

import matplotlib.pyplot as plt
import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.ticker import FuncFormatter, NullFormatter
from numpy.typing import NDArray

from .._typing import Float1D
from ..arguments import instance_of
from ..errors import InputError
from ..recording import Recording
from ..recording.units import Unit

MOST_POINTS = 6000
"""Largest number of drawn points; more are indistinguishable at the width of a column."""

_UNIT_TEXT = {"count": "counts"}
"""Units whose name in a figure differs from their symbol."""


def axes_or_new(ax: Axes | None) -> Axes:
    """Returns the given axes, or those of a new figure of pyplot.

    Raises
    ------
    InputError
        The argument is not Axes of matplotlib.
    """
    if ax is None:
        _, ax = plt.subplots(layout="constrained")
    instance_of("ax", ax, Axes, "leave it out to draw in a new figure")
    return ax


def label(name: str, unit: str) -> str:
    """Returns "force [N·m]", or the name alone if the unit is not known."""
    return f"{name} [{_UNIT_TEXT.get(unit, unit).replace('*', chr(0xB7))}]" if unit else name


_PREFIXES = ((1e3, "k"), (1.0, ""), (1e-3, "m"), (1e-6, "\u00b5"), (1e-9, "n"))
"""SI prefixes, the largest first."""

_PREFIXED = ("m", "N", "N*m", "A", "J")
"""Units that can have every SI prefix. An angle has no prefix above 1, other units have no prefix."""


@dataclass(frozen=True)
class Scale:
    """Unit in which a quantity is drawn, and the factor from SI to it."""

    factor: float
    unit: str

    def label(self, name: str) -> str:
        """Returns the label of an axis: name and unit."""
        return label(name, self.unit)


def scale_for(unit: str, *values: npt.ArrayLike, of_file: Unit | None = None) -> Scale:
    """Chooses the unit of the file, or else the SI prefix with which the largest of the values is at least
    0.1 and less than 1000.

    Parameters
    ----------
    unit : str
        SI unit of the values. Counts, and values without a known unit, are not scaled.
    *values : array_like
        All values on one axis.
    of_file : Unit, optional
        Unit of the values in their file.
    """
    if of_file is not None and of_file.factor != 1.0:
        return Scale(1.0 / of_file.factor, of_file.symbol)
    flat = np.concatenate([np.ravel(np.asarray(each, dtype=np.float64)) for each in values])
    finite = np.abs(flat[np.isfinite(flat)])
    largest = float(finite.max()) if len(finite) else 0.0
    if largest == 0.0 or unit not in (*_PREFIXED, "rad"):
        return Scale(1.0, unit)
    prefixes = _PREFIXES if unit in _PREFIXED else _PREFIXES[1:]
    size, prefix = next((each for each in prefixes if largest >= _least(each[0])), prefixes[-1])
    return Scale(1.0 / size, prefix + unit)


def _least(size: float) -> float:
    """Returns the smallest value that is drawn with an SI prefix of this size."""
    return size if size > 1.0 else 0.1 * size


_SCALES: WeakKeyDictionary[Axis, tuple[str, Scale]] = WeakKeyDictionary()
"""SI unit and scale of the curves on each axis on which something was drawn."""


def scale_on(axis: Axis, unit: str, *values: npt.ArrayLike, of_file: Unit | None = None) -> Scale:
    """Returns the scale of the curves that are already on an axis; for an empty axis as `scale_for` does.

    Raises
    ------
    InputError
        The curves that are already on the axis have another unit.
    """
    drawn, scale = _SCALES.setdefault(axis, (unit, scale_for(unit, *values, of_file=of_file)))
    if unit and drawn and unit != drawn:
        raise InputError(f"ax already shows values in {drawn}, and these are in {unit}: use other axes")
    return scale


def scales_of(axes: Axes, recording: Recording, *forces: npt.ArrayLike) -> tuple[Scale, Scale]:
    """Returns the scales of position and of forces of a recording, in the units of its file."""
    units, of_file = recording.units, recording.file_units
    return (
        scale_on(axes.xaxis, units["position"], recording.position, of_file=of_file.get("position")),
        scale_on(axes.yaxis, units["force"], *forces, of_file=of_file.get("force")),
    )


def legend_above(axes: Axes) -> None:
    """Places a legend above the axes, so that it hides no data."""
    axes.legend(frameon=False, loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2, borderaxespad=0.2)


def plain_decades(axis: Axis) -> None:
    """Labels a logarithmic axis with plain numbers, also between powers of ten if it is short."""
    low, high = sorted(axis.get_view_interval())
    plain = FuncFormatter(lambda value, _: f"{value:g}")
    axis.set_major_formatter(plain)
    axis.set_minor_formatter(plain if high < 10.0 * low else NullFormatter())


def grid(axes: Axes, axis: Literal["both", "x", "y"] = "both") -> None:
    """Draws thin grid lines behind the data."""
    axes.grid(axis=axis, color="0.88", linewidth=0.5)
    axes.set_axisbelow(True)


def thinned(*arrays: Float1D, most: int = MOST_POINTS) -> list[Float1D]:
    """Returns every k-th sample of each array, at most `most` samples."""
    step = max(1, -(-len(arrays[0]) // most))
    return [array[::step] for array in arrays]


def strokes(direction: NDArray[np.int8] | None, n: int) -> list[tuple[str, NDArray[np.bool_]]]:
    """Returns press and release if a recording has both, else all rows as one stroke.

    Pauses belong to no stroke and are left out if there are strokes.
    """
    if direction is not None and (direction > 0).any() and (direction < 0).any():
        return [("press", direction > 0), ("release", direction < 0)]
    return [("", np.ones(n, dtype=np.bool_))]


def dots_of(stroke: str) -> dict[str, Any]:
    """Returns the look of the dots of a stroke: filled, or hollow for release."""
    dots: dict[str, Any] = {"linestyle": "none", "marker": "o", "markeredgewidth": 0.0}
    return dots | ({"markerfacecolor": "none", "markeredgewidth": 0.4} if stroke == "release" else {})


def of_stroke(name: str, stroke: str) -> str:
    """Returns the name of a curve with its stroke, if it has one."""
    return f"{name}, {stroke}" if stroke else name

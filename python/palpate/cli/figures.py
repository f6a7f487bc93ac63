# SPDX-License-Identifier: Apache-2.0
"""Figure files: axes as wide as a printed column for the functions of `plotting`, drawn without a screen."""

from __future__ import annotations

import textwrap
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..errors import InputError
from ..recording.files import replacing
from .printing import visible

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_COLUMN_INCHES = 3.5
"""Width of one column of a journal page."""

_DOTS_PER_INCH = 200

_TITLE_COLUMNS = 60
"""Characters of a title that fit the width of a figure."""

_STYLE: Any = {
    "font.size": 8.0,
    "axes.titlesize": 8.0,
    "legend.fontsize": 7.0,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "hatch.linewidth": 0.5,
}

_FORMATS = (".png", ".pdf", ".svg")


def require_figure_name(path: Path) -> None:
    """Refuse a name whose ending is no figure format, before the work begins."""
    if path.suffix.lower() not in _FORMATS:
        raise InputError(f"{path} is no figure file; its name must end in {', '.join(_FORMATS)}")


@contextmanager
def figure_file(
    path: Path, *, height_inches: float, rows: Sequence[float] = (1.0,), columns: int = 1, title: str = ""
) -> Iterator[list[Axes]]:
    """Give axes one below the other, of the given shares of the height; the file is complete or not there.

    Several axes share their position axis; in several columns, row by row, each has its own. The title stands
    above them, wrapped to the width of the figure.
    """
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib.figure import Figure

    with matplotlib.rc_context(_STYLE):
        figure = Figure(figsize=(_COLUMN_INCHES, height_inches), dpi=_DOTS_PER_INCH, layout="constrained")
        axes = figure.subplots(
            len(rows), columns, squeeze=False, sharex=columns == 1, gridspec_kw={"height_ratios": rows}
        ).ravel()
        if title:
            lines = [
                part for line in title.split("\n") for part in textwrap.wrap(visible(line), _TITLE_COLUMNS)
            ]
            figure.suptitle("\n".join(lines).replace("$", r"\$"), fontsize=_STYLE["axes.titlesize"])
        yield list(axes)
        if columns == 1:
            for each in axes:
                each.label_outer()
        with replacing(path) as temporary:
            figure.savefig(temporary, format=path.suffix.lower().removeprefix("."))

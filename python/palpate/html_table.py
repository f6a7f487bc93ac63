# SPDX-License-Identifier: Apache-2.0
"""HTML of a result for notebooks: verdict, table of values and sketch of the force; no script and no
colours."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from html import escape
from typing import Literal

import numpy as np

from ._typing import Float1D
from .verdict import Verdict

MOST_POINTS = 400
"""Largest number of points that a sketch draws for one curve [-]"""

_WIDTH, _HEIGHT, _MARGIN = 280, 140, 6
"""Size of a sketch and the margin around its curves [px]"""

_LOOKS = {
    "line": 'stroke-width="1.5"',
    "dashed": 'stroke-width="1.5" stroke-dasharray="5 3"',
    "dots": 'stroke-width="2.5" stroke-linecap="round" opacity="0.4"',
}
"""SVG attributes of each kind of curve."""

_LEFT = 'style="text-align:left"'


@dataclass(frozen=True)
class Curve:
    """Force over position in a sketch."""

    position: Float1D
    """(n,)"""
    force: Float1D
    """(n,)"""
    look: Literal["line", "dashed", "dots"] = "line"


def html_table(
    title: str, verdict: Verdict | None, rows: Mapping[str, str], curves: Sequence[Curve] = ()
) -> str:
    """Returns title, verdict with its reasons, a table and a sketch as HTML.

    All text is escaped. Text and curves have the colour of the page, so that they are readable on a light and
    on a dark page.

    Parameters
    ----------
    title : str
        Kind of the result.
    verdict : Verdict, optional
        None if the result has no verdict.
    rows : mapping of str to str
        Names and values of the table.
    curves : sequence of Curve
        Curves of the sketch; without curves there is no sketch.
    """
    lines = {} if verdict is None else {"verdict": verdict.level}
    reasons = () if verdict is None else verdict.reasons
    body = [_row(name, f"<b>{escape(level)}</b>") for name, level in lines.items()]
    body += [_row("", escape(reason)) for reason in reasons]
    body += [_row(name, escape(value)) for name, value in rows.items()]
    caption = f"<caption {_LEFT}>{escape(title)}</caption>"
    table = f'<table style="color:inherit">{caption}<tbody>{"".join(body)}</tbody></table>'
    return f"<div>{table}{_sketch(curves)}</div>"


def _row(name: str, cell: str) -> str:
    return f'<tr><th scope="row" {_LEFT}>{escape(name)}</th><td {_LEFT}>{cell}</td></tr>'


def _sketch(curves: Sequence[Curve]) -> str:
    """Returns the curves as an SVG without axes; the table states the ranges."""
    if not curves:
        return ""
    x_range, y_range = (
        (float(values.min()), float(values.max()) - float(values.min()) or 1.0)
        for values in (
            np.concatenate([getattr(curve, name) for curve in curves]) for name in ("position", "force")
        )
    )
    paths = []
    for curve in curves:
        step = max(1, -(-len(curve.position) // MOST_POINTS))
        x = _MARGIN + (curve.position[::step] - x_range[0]) / x_range[1] * (_WIDTH - 2 * _MARGIN)
        y = _HEIGHT - _MARGIN - (curve.force[::step] - y_range[0]) / y_range[1] * (_HEIGHT - 2 * _MARGIN)
        points = [f"{a:.1f} {b:.1f}" for a, b in zip(x, y, strict=True)]
        data = "".join(f"M{point}h0" for point in points) if curve.look == "dots" else f"M{'L'.join(points)}"
        paths.append(f'<path d="{data}" {_LOOKS[curve.look]}/>')
    return (
        f'<svg role="img" viewBox="0 0 {_WIDTH} {_HEIGHT}" width="{_WIDTH}" height="{_HEIGHT}" fill="none" '
        f'stroke="currentColor"><title>force over position</title>{"".join(paths)}</svg>'
    )

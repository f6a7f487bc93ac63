# SPDX-License-Identifier: Apache-2.0
"""Measures where each method fails and draws the measured and the theoretical limits.

python bench/limits/failure_maps.py --to docs [--points 9]      needs build/release/bench/failure_maps

Every point is a bisection over closed loops with simulated devices and hands. Writes one figure for each map
and failure-maps.json to FOLDER/figures. Writes the tables of FOLDER/where-each-method-fails.md if it exists.
"""

from __future__ import annotations

import argparse
import json
import re
import subprocess
import sys
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.lines import Line2D
from matplotlib.ticker import LogLocator, NullFormatter, StrMethodFormatter
from numpy.typing import NDArray

from palpate.cli.figures import figure_file
from palpate.cli.printing import number

sys.path.insert(0, str(Path(__file__).parents[2]))

from bench.studies import fill_tables, markdown_table, program, where, write_json

from palpate.plotting.look import grid

PAGE = "where-each-method-fails.md"

MARKERS = "os^Dv"
DASHES = ("solid", (0, (5, 2)), (0, (1.5, 1.5)), (0, (5, 2, 1, 2)), (0, (8, 3)))
LONGEST_NAME_IN_TWO_COLUMNS = 30
"""The legend of a failure map has two columns if no name of a line is longer [characters]"""

Map = Mapping[str, Any]
"""A failure map (figure of limits) as JSON object; null means NaN."""


def values(line: Map, key: str) -> NDArray[np.float64]:
    """Returns the array (points,) called `at`, `measured` or `theory` of one line of a failure map."""
    return np.array(line[key], dtype=np.float64)


def draw_map(axes: Axes, failure_map: Map) -> None:
    """Draws measured limits as markers and theory as lines, both axes logarithmic unless the map is linear.

    A filled marker shows the largest tried value if no value failed.
    """
    lines, largest_tried = failure_map["lines"], failure_map["searched"]
    for line, marker, dash in zip(lines, MARKERS, DASHES, strict=False):
        at, measured, theory = (values(line, key) for key in ("at", "measured", "theory"))
        marker_style = {"marker": marker, "markersize": 4.5, "color": "black"}
        axes.plot(at, theory, color="0.45", linewidth=1.0, linestyle=dash, zorder=1)
        axes.plot(
            at,
            measured,
            linestyle="none" if np.isfinite(theory).any() else dash,
            linewidth=0.6,
            markerfacecolor="white",
            markeredgewidth=0.8,
            label=printed_form(line["name"]),
            **marker_style,
        )
        still_stable = np.isnan(measured) & np.isfinite(theory)
        if largest_tried > 0.0 and still_stable.any():
            name = f"{printed_form(line['name'])}: still holds"
            axes.plot(
                at[still_stable],
                largest_tried * theory[still_stable],
                linestyle="none",
                label=name,
                **marker_style,
            )
    axes.set_xscale("log")
    label_decades(axes.xaxis)
    if not failure_map["linear"]:
        axes.set_yscale("log")
        label_decades(axes.yaxis)
    grid(axes)
    axes.set_xlabel(printed_form(failure_map["along"]))
    axes.set_ylabel(printed_form(failure_map["limit"]))
    handles, _ = axes.get_legend_handles_labels()
    drawn_handles = [
        handle for handle in handles if isinstance(handle, Line2D) and np.isfinite(handle.get_ydata()).any()
    ]
    if any(np.isfinite(values(line, "theory")).any() for line in lines):
        drawn_handles.append(Line2D([], [], color="0.45", linewidth=1.0, label="theory"))
    longest = max(len(str(handle.get_label())) for handle in drawn_handles)
    columns = 2 if longest <= LONGEST_NAME_IN_TWO_COLUMNS else 1
    axes.figure.legend(handles=drawn_handles, frameon=False, loc="outside lower center", ncols=columns)


def label_decades(axis: Axis) -> None:
    """Labels powers of ten on an axis; on an axis of less than two decades also 2 and 5 times them."""
    lower, upper = axis.get_view_interval()
    axis.set_minor_formatter(NullFormatter())
    if upper < 100.0 * lower:
        axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        axis.set_major_formatter(StrMethodFormatter("{x:g}"))


def printed_form(text: str) -> str:
    """Replaces * by a dot, ^2 by a raised 2, and x_y by x with the index y, as in print."""
    text = text.replace("*", "·").replace("^2", "²")
    return re.sub(r"\b([A-Za-z])_([a-z])\b", r"$\1_\2$", text)


def map_table(failure_map: Map) -> str:
    """Returns a table of measured limits, divided by the theoretical limits if a theory exists."""
    lines = failure_map["lines"]
    if not failure_map["linear"] and any(np.isfinite(values(line, "theory")).any() for line in lines):
        return markdown_table(
            ("", "measured over theory"),
            [(line["name"], spread(line, failure_map["searched"])) for line in lines],
        )
    positions = lines[0]["at"]
    columns = np.unique(np.linspace(0, len(positions) - 1, 5).round().astype(int))
    return markdown_table(
        (failure_map["along"], *(number(positions[k]) for k in columns)),
        [(line["name"], *(number(values(line, "measured")[k]) for k in columns)) for line in lines],
    )


def spread(line: Map, largest_tried: float) -> str:
    """Returns least and largest ratio of measured to theoretical limit; if nothing failed, the tried one."""
    measured, theory = values(line, "measured"), values(line, "theory")
    comparable = np.isfinite(measured) & np.isfinite(theory) & (theory != 0.0)
    ratio, without_failure = (
        measured[comparable] / theory[comparable],
        f"nothing failed up to {number(largest_tried)}",
    )
    if not ratio.size:
        return without_failure
    text = f"{ratio.min():.4f} to {ratio.max():.4f}"
    return f"{text}; elsewhere {without_failure}" if np.isnan(measured).any() else text


def guard_table(guards: Sequence[Mapping[str, Any]]) -> str:
    return markdown_table(
        ("guard", "cost without a fault", "fault: measured quantity", "without guard", "with guard"),
        [
            (
                row["guard"],
                f"{100.0 * row['cost']:.2g} %",
                row["wrong"],
                number(row["without"]),
                number(row["with"]),
            )
            for row in guards
        ],
        text_columns=(0, 2),
    )


def write(program_output: Mapping[str, Any], to: Path, seconds: float) -> None:
    """Draws the failure maps, writes their numbers to a file, and fills the tables of the page."""
    measured = {
        **where(),
        "seconds": round(seconds, 1),
        "simulated": "device and hands are simulated; no number was measured on hardware",
        **program_output,
    }
    for each in program_output["maps"]:
        path = to / "figures" / f"failure-{each['name']}.png"
        path.parent.mkdir(parents=True, exist_ok=True)
        with figure_file(path, height_inches=3.2) as (axes,):
            draw_map(axes, each)
    write_json(to / "figures" / "failure-maps.json", measured)
    tables = {each["name"]: map_table(each) for each in program_output["maps"]}
    tables["guards"] = guard_table(program_output["guards"])
    tables["where"] = (
        f"Measured by `python bench/limits/failure_maps.py --to docs`: palpate {measured['palpate']}, "
        f"{measured['date']}, {measured['machine']}, {measured['seconds']} s.\n"
    )
    fill_tables(to / PAGE, tables)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--to", type=Path, required=True, help="folder of figures/ and of the page")
    parser.add_argument("--points", type=int, default=9, help="values along each axis")
    options = parser.parse_args()
    start = time.perf_counter()
    completed = subprocess.run(
        [program("failure_maps"), str(options.points)], stdout=subprocess.PIPE, check=True
    )
    write(json.loads(completed.stdout), options.to, time.perf_counter() - start)


if __name__ == "__main__":
    main()

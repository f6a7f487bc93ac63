# SPDX-License-Identifier: Apache-2.0
"""Draws error over computing time from the JSON files of `make bench`.

python bench/solvers/speed.py build/bench --to docs/figures

Draws each comparison, and writes its numbers, machine, compiler, commit and date to speed.md.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from palpate.cli.figures import figure_file
from palpate.cli.printing import number

sys.path.insert(0, str(Path(__file__).parents[2]))

from bench.solvers.ratios import measured_claims
from bench.solvers.results import BenchmarkResults, Row, arguments, nanoseconds
from bench.studies import markdown_table, write_text

from palpate.plotting.look import grid
from palpate.verdict import FORCE_JND

PERIOD_S = 1e-3
"""Duration of the simulated motion for which computing times are compared [s]"""

MARKERS = "os^Dv<>pP*Xhd"
THIN_LINE: dict[str, Any] = {
    "color": "black",
    "linewidth": 0.5,
    "markersize": 4.0,
    "markerfacecolor": "white",
    "markeredgewidth": 0.7,
}


def readable_name(name: object) -> str:
    return str(name).replace("_", " ")


def finish_axes(axes: Axes, x: str, y: str) -> None:
    """Makes both axes of a figure logarithmic, with a grid and labels."""
    axes.set_xscale("log")
    axes.set_yscale("log")
    grid(axes)
    axes.set_xlabel(x)
    axes.set_ylabel(y)


def legend_below(axes: Axes) -> None:
    handles = axes.get_legend_handles_labels()
    axes.figure.legend(*handles, frameon=False, loc="outside lower center", ncols=2)


def work_precision(results: BenchmarkResults, path: Path) -> str:
    """Draws the error of the motion over computing time, one line per time step, one marker per period."""
    points = [
        (
            readable_name(str(row["name"]).split("/")[0]),
            results.number(row, "period_s"),
            nanoseconds(row),
            results.number(row, "motion_error_rad"),
            results.number(row, "diverges") > 0.0,
        )
        for row in results.rows
    ]
    names = list(dict.fromkeys(name for name, *_ in points))
    top_error = 3.0 * max(error for *_, error, diverges in points if not diverges)
    with figure_file(path, height_inches=3.9) as (axes,):
        for marker, name in zip(MARKERS, names, strict=False):
            points_of_name = [
                (time * PERIOD_S / period, error, diverged)
                for each, period, time, error, diverged in points
                if each == name
            ]
            finite = [(work, error) for work, error, diverged in points_of_name if not diverged]
            axes.plot(*zip(*finite, strict=True), marker=marker, label=name, **THIN_LINE)
            diverged = [work for work, _, diverged in points_of_name if diverged]
            axes.plot(diverged, [top_error] * len(diverged), marker, markersize=4.0, color="black")
        if any(diverges for *_, diverges in points):
            axes.text(
                0.99,
                0.985,
                "filled markers at the top: diverges",
                transform=axes.transAxes,
                ha="right",
                va="top",
            )
        finish_axes(axes, "computing time for 1 ms of motion [ns]", "error of the motion, RMS [rad]")
        axes.set_ylim(top=2.5 * top_error)
        legend_below(axes)
    return markdown_table(
        ("time step", "period [ms]", "a step [ns]", "1 ms of motion [ns]", "error, RMS [rad]"),
        [
            (
                name,
                f"{1e3 * period:g}",
                number(time),
                number(time * PERIOD_S / period),
                "diverges" if diverges else number(error),
            )
            for name, period, time, error, diverges in points
        ],
    )


def rendered_force(results: BenchmarkResults, path: Path) -> str:
    """Draws force error (y axis) and time of a tick (x axis), one point for each structure and solver."""
    keys = ("evaluations", "force_error_end_Nm", "force_error_instant_Nm", "force_rms_Nm")
    points = [
        (readable_name(row["name"]), nanoseconds(row), *(results.number(row, key) for key in keys))
        for row in results.rows
    ]
    direct = next((each for each in points if each[0].startswith("direct")), None)
    if direct is None:
        raise SystemExit(
            f"{results.path} contains no direct rendering for the comparison; run make bench again"
        )
    _, _, _, hold_error, encoder_error, force = direct
    limits = {
        f"JND: {100 * FORCE_JND:g} % of the force": FORCE_JND * force,
        "hold over a tick": hold_error,
        "encoder step": encoder_error,
    }
    with figure_file(path, height_inches=4.3) as (axes,):
        for k, (name, time, _, error, *_) in enumerate(points):
            axes.plot(
                time,
                error,
                linestyle="none",
                marker=MARKERS[k % len(MARKERS)],
                markersize=4.5,
                color="black",
                markerfacecolor=("white", "black", "0.6")[k // len(MARKERS) % 3],
                markeredgewidth=0.7,
                label=name,
            )
        finish_axes(axes, "time of a tick [ns]", "force error, RMS [N·m]")
        axes.set_ylim(bottom=0.5 * min(limits.values()))
        for name, limit in limits.items():
            axes.axhline(limit, color="0.4", linewidth=0.7, linestyle=(0, (4, 2)))
            axes.annotate(
                name,
                (1.0, limit),
                xycoords=axes.get_yaxis_transform(),
                xytext=(0, 1.5),
                textcoords="offset points",
                ha="right",
                va="bottom",
                fontsize=7.0,
            )
        legend_below(axes)
    header = (
        "structure and solver",
        "a tick [ns]",
        "evaluations",
        "error at the end of a tick [N·m]",
        "at its sampling instant [N·m]",
    )
    return markdown_table(
        header,
        [
            (name, number(time), f"{evaluations:.3g}", number(end), number(instant))
            for name, time, evaluations, end, instant, _ in points
        ],
    )


def ticks(results: BenchmarkResults) -> str:
    return markdown_table(
        ("structure", "mean [ns]", "median [ns]", "99.9th percentile [ns]"),
        [
            (
                readable_name(str(row["name"]).removeprefix("tick/")),
                number(nanoseconds(row)),
                number(results.number(row, "p50_ns")),
                number(results.number(row, "p999_ns")),
            )
            for row in results.of("tick")
        ],
    )


def model_error(results: BenchmarkResults, by_size: Path, by_time: Path) -> str:
    """Draws model error against parameters and against computing time, one line for each method."""
    points = [
        (
            *str(row["name"]).split("/")[:2],
            int(results.number(row, "n_wavelets")),
            results.number(row, "n_parameters"),
            nanoseconds(row),
            results.number(row, "nrmse"),
        )
        for row in results.rows
    ]
    problems = list(dict.fromkeys(point[0] for point in points))
    for path, column, cost in (
        (by_size, 3, "fitted parameters"),
        (by_time, 4, "time of an evaluation in an array [ns]"),
    ):
        with figure_file(path, height_inches=4.6, rows=(1.0,) * len(problems)) as panels:
            for axes, problem in zip(panels, problems, strict=True):
                points_of_problem = [point for point in points if point[0] == problem]
                methods = list(dict.fromkeys(point[1] for point in points_of_problem))
                for marker, method in zip(MARKERS, methods, strict=False):
                    draw_method(
                        axes,
                        method,
                        marker,
                        [point for point in points_of_problem if point[1] == method],
                        column,
                    )
                finish_axes(axes, cost, "NRMSE")
                axes.margins(x=0.08, y=0.12)
                axes.set_title(problem, loc="right")
            legend_below(panels[0])
    return markdown_table(
        ("problem and method", "wavelets", "parameters", "evaluation [ns]", "NRMSE"),
        [
            (f"{problem}, {method}", str(wavelets or ""), f"{size:g}", number(time), number(error))
            for problem, method, wavelets, size, time, error in points
        ],
    )


def draw_method(axes: Axes, method: str, marker: str, points: Sequence[Any], column: int) -> None:
    is_network = any(point[2] for point in points)
    axes.plot(
        [point[column] for point in points],
        [point[5] for point in points],
        color="black" if is_network else "0.55",
        linewidth=1.0 if is_network else 0.5,
        marker=marker,
        markersize=4.0,
        markerfacecolor="black" if is_network else "white",
        markeredgecolor="black",
        markeredgewidth=0.7,
        label=method,
    )
    for point in points:
        if point[2]:
            axes.annotate(
                str(point[2]),
                (point[column], point[5]),
                xytext=(-3, -3),
                textcoords="offset points",
                ha="right",
                va="top",
                fontsize=6.0,
            )


EVALUATIONS = {
    "latency<ExpLoop>": "loop over std::exp",
    "latency<Network>": "network",
    "latency<Compiled>": "compiled network",
    "latency<Table>": "lookup table, linear",
    "latency<CubicSpline>": "cubic spline",
}

BOUNDS = {
    "slope_bound": "one input",
    "slope_bound_cancelling": "one input, weights cancel",
    "gradient_bound_two_inputs": "two inputs",
    "gradient_bound_two_inputs_cancelling": "two inputs, weights cancel",
}


def over_wavelets(
    results: BenchmarkResults,
    names: Mapping[str, str],
    path: Path,
    quantities: Sequence[tuple[str, Callable[[Row], float]]],
) -> str:
    """Draws measured quantities (y axes) against the number of wavelets (x axis), in separate panels."""
    rows_by_name = {name: results.of(benchmark) for benchmark, name in names.items()}
    height = 2.6 + 1.4 * (len(quantities) - 1)
    with figure_file(path, height_inches=height, rows=(1.0,) * len(quantities)) as panels:
        for axes, (quantity, value) in zip(panels, quantities, strict=True):
            for marker, (name, rows) in zip(MARKERS, rows_by_name.items(), strict=False):
                wavelets = np.array([arguments(row)["wavelets"] for row in rows])
                axes.plot(wavelets, [value(row) for row in rows], marker=marker, label=name, **THIN_LINE)
            finish_axes(axes, "wavelets", quantity)
            axes.set_xscale("log", base=2)
            axes.xaxis.set_major_formatter("{x:g}")
        legend_below(panels[0])
    return markdown_table(
        ("", "wavelets", *(quantity for quantity, _ in quantities)),
        [
            (name, f"{arguments(row)['wavelets']:g}", *(number(value(row)) for _, value in quantities))
            for name, rows in rows_by_name.items()
            for row in rows
        ],
    )


def claims(folder: Path) -> str:
    return markdown_table(
        ("ratio or number", "measured", "required, at most"),
        [
            (text, number(measured), number(required))
            for text, measured, required in measured_claims(folder)
            if measured is not None
        ],
    )


def sections(folder: Path, to: Path) -> Iterable[str]:
    """Draws the figures of the speed page and yields the Markdown text of its sections."""
    steps, forces, tick, models, evaluations, bounds = (
        BenchmarkResults(folder, f"bench_{name}")
        for name in ("work_precision", "rendered_force", "controller", "model_error", "evaluation", "bounds")
    )
    to.mkdir(parents=True, exist_ok=True)
    yield (
        "# Speed against accuracy\n\n"
        "Drawn by `python bench/solvers/speed.py` from the results of `make bench`. Each number is the "
        "median over interleaved repetitions of one run.\n"
    )
    yield f"## Required and measured values\n\n{claims(folder)}\n{steps.where()}\n"
    yield (
        "## Time steps: work against precision\n\n"
        "The object is a mass of 0.001 kg·m² with a damping of 0.5 N·m·s/rad and the force of a spring with "
        "a wall. The coupling has 100 N·m/rad and 0.02 N·m·s/rad. A hand moves for 2 s. The error is the "
        "difference to the exact solution.\n\n"
        "![Error of the motion over computing time](work-precision.png)\n\n"
        f"{work_precision(steps, to / 'work-precision.png')}\n{steps.where()}\n"
    )
    yield (
        "## Structures and solvers: rendered force\n\n"
        "A hand presses through a click and a wall on a simulated knob for 4 s at 1 kHz. The error is the "
        "rendered force minus the force of the object at the handle.\n\n"
        "![Force error over the time of a tick](rendered-force.png)\n\n"
        f"{rendered_force(forces, to / 'rendered-force.png')}\n{forces.where()}\n"
    )
    yield (
        "## A whole tick without its device\n\n"
        "A tick checks the reading, renders the force with the default solver, and applies the force and "
        f"slew limits. The percentiles are those of single ticks.\n\n{ticks(tick)}\n{tick.where()}\n"
    )
    yield (
        "## Models: error against size and time\n\n"
        "The methods fit a spring with a wall and a tactile switch, each from 10⁴ noisy rows. The NRMSE is "
        "relative to the exact force. Each label is the number of wavelets, which BIC chooses. An "
        "evaluation is one of 10⁴ positions in a NumPy array.\n\n"
        "![Model error over fitted parameters](model-error-size.png)\n\n"
        "![Model error over the time of an evaluation](model-error-time.png)\n\n"
        f"{model_error(models, to / 'model-error-size.png', to / 'model-error-time.png')}\n{models.where()}\n"
    )
    evaluation_table = over_wavelets(
        evaluations, EVALUATIONS, to / "evaluation.png", [("value and slope [ns]", nanoseconds)]
    )
    yield (
        "## Evaluation: value and slope on a dependent chain\n\n"
        "The object is a spring with a wall. The error of the compiled network is at most 10⁻¹² of the "
        "largest force. Table and spline have 4096 cells.\n\n"
        f"![Time of an evaluation over the number of wavelets](evaluation.png)\n\n{evaluation_table}\n"
        f"{evaluations.where()}\n"
    )
    excess = ("excess [%]", lambda row: 100.0 * bounds.number(row, "excess"))
    bounds_table = over_wavelets(
        bounds, BOUNDS, to / "bounds.png", [("time of a bound [ns]", nanoseconds), excess]
    )
    yield (
        "## Proved bounds of the slope\n\n"
        "The excess is the proved bound minus the slope found by a dense search, relative to the steepest "
        "slope. The networks are random.\n\n"
        f"![Time and excess of proved bounds over the number of wavelets](bounds.png)\n\n{bounds_table}\n"
        f"{bounds.where()}\n"
    )


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path, help="folder of the JSON files of make bench")
    parser.add_argument("--to", type=Path, required=True, help="folder of the figures and of speed.md")
    options = parser.parse_args(arguments)
    write_text(options.to / "speed.md", "\n".join(sections(options.folder, options.to)))
    print(f"wrote {options.to / 'speed.md'} and its figures")


if __name__ == "__main__":
    main()

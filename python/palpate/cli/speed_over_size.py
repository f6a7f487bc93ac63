# SPDX-License-Identifier: Apache-2.0
"""Figures and tables of models and bounds over their size, from what the benchmarks printed."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from .benchmark_results import BenchmarkResults, arguments
from .figures import figure_file
from .output import number
from .pages import markdown_table


def model_error(results: BenchmarkResults, by_size: Path, by_time: Path) -> str:
    from ..plotting import ModelError, draw_model_error

    problems: dict[str, dict[str, list[tuple[float, float, float, int]]]] = {}
    for row in results.rows:
        problem, method, _ = str(row["name"]).split("/")
        problems.setdefault(problem, {}).setdefault(method, []).append(
            (
                results.number(row, "n_parameters"),
                results.nanoseconds(row),
                results.number(row, "nrmse"),
                int(results.number(row, "n_wavelets")),
            )
        )
    for path, column, name in (
        (by_size, 0, "fitted parameters"),
        (by_time, 1, "time of an evaluation in an array [ns]"),
    ):
        with figure_file(path, height_inches=4.6, rows=(1.0,) * len(problems)) as panels:
            for axes, (problem, methods) in zip(panels, problems.items(), strict=True):
                curves = [
                    ModelError(
                        method,
                        np.array([point[column] for point in points], dtype=np.float64),
                        np.array([point[2] for point in points]),
                        [point[3] for point in points],
                    )
                    for method, points in methods.items()
                ]
                draw_model_error(axes, curves, name)
                axes.set_title(problem, loc="right")
            panels[0].figure.legend(
                *panels[0].get_legend_handles_labels(), frameon=False, loc="outside lower center", ncols=2
            )
    rows = [
        (
            f"{problem}, {method}",
            str(wavelets) if wavelets else "",
            f"{parameters:g}",
            number(time),
            number(error),
        )
        for problem, methods in problems.items()
        for method, points in methods.items()
        for parameters, time, error, wavelets in points
    ]
    return markdown_table(("problem and method", "wavelets", "parameters", "evaluation [ns]", "NRMSE"), rows)


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
    names: dict[str, str],
    path: Path,
    quantities: Sequence[tuple[str, Callable[[Mapping[str, Any]], float]]],
) -> str:
    """Quantities of benchmarks over the number of wavelets, one panel each."""
    from ..plotting import OverWavelets, draw_over_wavelets

    found = {said: results.of(name) for name, said in names.items()}
    height = 2.6 + 1.4 * (len(quantities) - 1)
    with figure_file(path, height_inches=height, rows=(1.0,) * len(quantities)) as panels:
        for axes, (quantity, value) in zip(panels, quantities, strict=True):
            curves = [
                OverWavelets(
                    said,
                    np.array([arguments(row)["wavelets"] for row in rows]),
                    np.array([value(row) for row in rows]),
                )
                for said, rows in found.items()
            ]
            draw_over_wavelets(axes, curves, quantity)
        panels[0].figure.legend(
            *panels[0].get_legend_handles_labels(), frameon=False, loc="outside lower center", ncols=2
        )
    table = [
        (said, f"{arguments(row)['wavelets']:g}", *(number(value(row)) for _, value in quantities))
        for said, rows in found.items()
        for row in rows
    ]
    return markdown_table(("", "wavelets", *(quantity for quantity, _ in quantities)), table)

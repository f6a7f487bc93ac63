# SPDX-License-Identifier: Apache-2.0
"""Draws error over size and over time for all methods, from the JSON files of `make bench`.

python bench/identification/figures.py build/bench --to docs

Draws identification-parameters.png, -time.png, -filters.png, -several.png and -repeats.png to FOLDER/figures.
Writes the tables of FOLDER/identification.md if that page exists. A study that did not run keeps its table.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from statistics import median
from typing import Any

from matplotlib.axes import Axes
from matplotlib.ticker import LogLocator, NullLocator

from palpate.cli.figures import figure_file
from palpate.cli.printing import number

sys.path.insert(0, str(Path(__file__).parents[2]))

from bench.identification import repeats, several_inputs
from bench.studies import fill_tables, markdown_table

from palpate.plotting.look import grid

ANY_SIGN, EARLIER = "_h_of_any_sign", "_force_25_ms_earlier"
"""A set NAME + suffix has the files of the set NAME, fitted with h of any sign or with earlier force."""

WORST_SPLINE_RATIO = 1.3
"""Files for which the error of the model divided by the error of the splines is larger are counted."""

METHOD_STYLES = (
    ("o", "black"),
    ("s", "0.55"),
    ("D", "0.55"),
    *((marker, "white") for marker in "^v<>pP*Xhd8"),
)
"""Marker and its color: palpate, the paper's selection alone and with quasi-Newton, other methods."""

DASHES = ("solid", (0, (5, 2)), (0, (1.5, 1.5)), (0, (5, 2, 1, 2)), (0, (8, 3)))

Row = Mapping[str, Any]


def results_of(folder: Path, name: str) -> tuple[Any, str] | None:
    """Returns the results of the study NAME.py with machine and date; None if the study did not run."""
    path = folder / f"{name}.json"
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
        machine = content["where"]
        source = (
            f"{machine['date']}, {machine['machine']}, load {machine['load']:g}, Python {machine['python']}, "
            f"commit {machine['commit']}"
        )
        if machine["scale"] < 1.0:
            source += f", scale {machine['scale']:g}: not for comparison"
        return content["results"], source
    except FileNotFoundError:
        return None
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise SystemExit(
            f"{path} is not from bench/identification/{name}.py ({error!r}); make bench writes it"
        ) from None


def problems(rows: Sequence[Row]) -> str:
    """Returns a table: median and range of NRMSE, parameters and time in all draws, by problem and method."""
    return markdown_table(
        (
            "problem, method",
            "NRMSE",
            "wavelets",
            "parameters",
            "fit [s]",
            "tuning [s]",
            "time / palpate",
            "draws",
        ),
        [
            (
                f"{row['problem']}, {row['method']}",
                with_range(row, "nrmse", ".2e"),
                with_range(row, "n_wavelets", "d"),
                with_range(row, "n_parameters", "d"),
                number(row["fit_s"]),
                number(row["tuning_s"]),
                f"{row['time_over_palpate']:.3g}",
                str(row["draws"]),
            )
            for row in rows
            if "nrmse" in row
        ],
    )


def with_range(row: Row, key: str, form: str) -> str:
    """Returns median, least and largest value of a result as text; empty if the method has no such result."""
    if row[key] is None:
        return ""
    low, high = row[f"{key}_range"]
    return f"{row[key]:{form}} ({low:{form}} to {high:{form}})"


def measured_objects(sets: Mapping[str, Sequence[Row]]) -> str:
    """Returns a table by set of files and method: median of NRMSE, parameters and time of all files."""
    lines = []
    for name, files in sets.items():
        measured_rows = [row for row in files if "nrmse" in row]
        if not measured_rows:
            continue
        ratios = worst_ratio(measured_rows, "splines"), worst_ratio(measured_rows, "passive_splines")
        lines.append(row_of_set(f"{name} ({len(measured_rows)} files), palpate", measured_rows, ratios))
        for baseline in dict.fromkeys(key for row in measured_rows for key in row["baselines"]):
            baseline_rows = [
                row["baselines"][baseline] for row in measured_rows if baseline in row["baselines"]
            ]
            finite_results = [
                each for each in baseline_rows if each["nrmse"] is not None and math.isfinite(each["nrmse"])
            ]
            of = "" if len(finite_results) == len(measured_rows) else f" ({len(finite_results)} files)"
            if finite_results:
                lines.append(row_of_set(f"{name}, {baseline}{of}", finite_results, ("", "")))
    ratio_columns = "worst file over its splines", "over splines with h >= 0"
    return markdown_table(("recordings, method", "NRMSE", "parameters", "s per file", *ratio_columns), lines)


def crossings(sets: Mapping[str, Sequence[Row]]) -> str:
    """Returns a table row for each file that was also fitted with h of any sign and with earlier force."""
    lines = []
    for name, files in sets.items():
        variants = [
            {row["file"]: row for row in sets[other]}
            for other in (name + ANY_SIGN, name + EARLIER)
            if other in sets
        ]
        if len(variants) == 2:
            lines += [
                row_of_crossing(row, *(each.get(row["file"], {}) for each in variants)) for row in files
            ]
    header = (
        "file",
        "palpate",
        "h of any sign",
        "splines",
        "splines, h >= 0",
        "floor",
        "at the turn",
        "25 ms earlier: palpate",
        "splines",
    )
    return markdown_table(header, lines)


def row_of_crossing(row: Row, any_sign: Row, earlier: Row) -> tuple[str, ...]:
    def error(of: Row | None) -> str:
        return f"{of['nrmse']:.4f}" if of and "nrmse" in of else ""

    return (
        row["file"],
        error(row),
        error(any_sign),
        error(row.get("splines")),
        error(row.get("passive_splines")),
        f"{row['floor']:.4f}" if "floor" in row else "",
        f"{100 * row['share_at_turn']:.0f} %" if "share_at_turn" in row else "",
        error(earlier),
        error(earlier.get("splines")),
    )


def worst_ratio(files: Sequence[Row], splines: str) -> str:
    """Returns the largest ratio of model to spline error, and how many files exceed WORST_SPLINE_RATIO."""
    errors = [(row["nrmse"], row[splines]["nrmse"]) for row in files if row[splines]]
    ratios = [
        error / splines_error
        for error, splines_error in errors
        if splines_error is not None and splines_error > 0
    ]
    if not ratios:
        return ""
    n_above = sum(ratio > WORST_SPLINE_RATIO for ratio in ratios)
    return f"{max(ratios):.2f}" + (f" ({n_above} above {WORST_SPLINE_RATIO:g})" if n_above else "")


def row_of_set(name: str, each: Sequence[Row], ratios: tuple[str, str]) -> tuple[str, ...]:
    return (
        name,
        f"{median(row['nrmse'] for row in each):.4f}",
        f"{median(row['n_parameters'] for row in each):.0f}",
        number(median(row["seconds"] for row in each)),
        *ratios,
    )


def counts(rows: Sequence[Row]) -> str:
    return markdown_table(
        ("claim", "correct", "of"), [(row["claim"], str(row["right"]), str(row["draws"])) for row in rows]
    )


def dynamic(rows: Sequence[Row]) -> str:
    return markdown_table(
        ("benchmark, test set, form", "parameters", "one step", "free run", "unit", "published, free run"),
        [
            (
                f"{row['benchmark']}, {row['test_set']}, {row['form']}",
                str(row["n_parameters"]),
                number(row["one_step"]),
                "diverges" if math.isnan(row["free_run"]) else number(row["free_run"]),
                row["unit"],
                row["published"] or ("" if row["comparable"] else "not the same rows"),
            )
            for row in rows
        ],
    )


def speeds(rows: Sequence[Row]) -> str:
    return markdown_table(
        ("NRMSE of f, the hand up to", *(f"{hz:g} Hz" for hz in rows[0]["fastest_hz"])),
        [(row["way"], *(f"{error:.2e}" for error in row["nrmse"])) for row in rows],
    )


def noise(rows: Sequence[Row]) -> str:
    keys = ("no_wavelet", "no_hysteresis", "no_velocity", "draws")
    return markdown_table(
        ("straight line with", "no wavelet", "no hysteresis", "no mass, damping, velocity", "of"),
        [(row["case"], *(str(row[key]) for key in keys)) for row in rows],
    )


TABLES: Mapping[str, Callable[[Any], str]] = {
    "real_data": measured_objects,
    "crossing": crossings,
    "parsimony": counts,
    "dynamic": dynamic,
    "filters": speeds,
    "repeats": repeats.table,
    "published": repeats.published_table,
    "several_inputs": several_inputs.table,
    "noise": noise,
}
"""Names of the tables whose studies may not have run"""

SECOND_TABLES = {"crossing": "real_data", "published": "repeats"}
"""Names of the tables that show further results of a study, and the study of each"""


def draw_error_over(path: Path, rows: Sequence[Row], label: str, cost: Callable[[Row], float]) -> None:
    """Draws model error (y axis) and size or time (x axis) of each method, one panel for each problem."""
    measured_rows = [row for row in rows if "nrmse" in row]
    methods = list(dict.fromkeys(row["method"] for row in measured_rows))
    problems = list(dict.fromkeys(row["problem"] for row in measured_rows))
    lines = math.ceil(len(problems) / 2)
    with figure_file(path, height_inches=1.0 + 1.2 * lines, rows=[1.0] * lines, columns=2) as panels:
        for axes, problem in zip(panels, problems, strict=False):
            problem_rows = [row for row in measured_rows if row["problem"] == problem]
            for row in problem_rows:
                marker, face_color = METHOD_STYLES[methods.index(row["method"]) % len(METHOD_STYLES)]
                axes.plot(
                    cost(row),
                    row["nrmse"],
                    linestyle="none",
                    marker=marker,
                    markersize=4.5,
                    color="black",
                    markerfacecolor=face_color,
                    markeredgewidth=0.7,
                    label=row["method"],
                    clip_on=False,
                    # above the others
                    zorder=3 if face_color == "black" else 2,
                )
            axes.set_xscale("log")
            axes.set_yscale("log")
            axes.set_xlim(*decades(cost(row) for row in problem_rows))
            axes.set_ylim(*decades(row["nrmse"] for row in problem_rows))
            for axis in (axes.xaxis, axes.yaxis):
                axis.set_major_locator(LogLocator(numticks=9))
                axis.set_minor_locator(NullLocator())
            grid(axes)
            axes.set_title(problem, fontsize=7.0)
        for axes in panels[len(problems) :]:
            axes.set_visible(False)
        for axes in panels[max(0, len(problems) - 2) : len(problems)]:
            axes.set_xlabel(label)
        panels[0].figure.supylabel("NRMSE", fontsize=8.0)
        draw_legend(panels, methods)


def draw_legend(panels: Sequence[Axes], methods: Sequence[str]) -> None:
    """Draws one legend below all panels of a figure."""
    handles = {
        name: handle
        for axes in panels
        for handle, name in zip(*axes.get_legend_handles_labels(), strict=True)
    }
    panels[0].figure.legend(
        handles=[handles[name] for name in methods], frameon=False, loc="outside lower center", ncols=2
    )


def draw_over_speed(path: Path, rows: Sequence[Row]) -> None:
    """Draws model error (y axis) and highest motion frequency (x axis), a line for each identification."""
    with figure_file(path, height_inches=3.4) as (axes,):
        styles = zip(METHOD_STYLES, DASHES, (6.5, 5.5, 4.5, 4.0, 3.5), strict=False)
        for row, ((marker, face_color), dash, size) in zip(rows, styles, strict=False):
            axes.plot(
                row["fastest_hz"],
                row["nrmse"],
                color="black",
                linewidth=0.8,
                linestyle=dash,
                marker=marker,
                markersize=size,
                markerfacecolor=face_color,
                markeredgewidth=0.7,
                label=row["way"],
            )
        axes.set_xscale("log")
        axes.set_yscale("log")
        frequencies = sorted({float(at) for row in rows for at in row["fastest_hz"]})
        axes.set_xticks(frequencies, [f"{at:g}" for at in frequencies])
        axes.xaxis.set_minor_locator(NullLocator())
        axes.set_ylim(*decades(error for row in rows for error in row["nrmse"]))
        grid(axes)
        axes.set_xlabel("highest frequency of the hand [Hz]")
        axes.set_ylabel("NRMSE of f")
        axes.figure.legend(frameon=False, loc="outside lower center", ncols=1)


def decades(values: Iterable[float]) -> tuple[float, float]:
    """Returns the limits of an axis: the nearest powers of ten below and above all drawn values."""
    exponents = [math.log10(value) for value in values]
    low, high = math.floor(min(exponents)), math.ceil(max(exponents))
    return 10.0**low, 10.0 ** max(high, low + 1)


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path, help="folder of the JSON files of make bench")
    parser.add_argument("--to", type=Path, required=True, help="folder of figures/ and of the page")
    options = parser.parse_args(arguments)
    methods = results_of(options.folder, "compare_methods")
    if methods is None:
        raise SystemExit(f"{options.folder / 'compare_methods.json'} does not exist; make bench writes it")
    figures = options.to / "figures"
    figures.mkdir(parents=True, exist_ok=True)
    rows, source = methods
    draw_error_over(
        figures / "identification-parameters.png", rows, "parameters", lambda row: float(row["n_parameters"])
    )
    draw_error_over(
        figures / "identification-time.png",
        rows,
        "fit and tuning [s]",
        lambda row: float(row["fit_s"] + row["tuning_s"]),
    )
    draws = max(row["draws"] for row in rows if "nrmse" in row)
    caption = f"median (least to largest) of up to {draws} draws"
    tables = {"compare_methods": f"{problems(rows)}\n{source}; {caption}\n"}
    for name, table in TABLES.items():
        study = results_of(options.folder, SECOND_TABLES.get(name, name))
        if study is not None:
            tables[name] = f"{table(study[0])}\n{study[1]}\n"
            if name == "filters":
                draw_over_speed(figures / "identification-filters.png", study[0])
            if name == "several_inputs":
                several_inputs.draw(figures / "identification-several.png", study[0])
            if name == "repeats":
                repeats.draw(figures / "identification-repeats.png", study[0])
    print(f"wrote the figures of identification to {figures}")
    fill_tables(options.to / "identification.md", tables)


if __name__ == "__main__":
    main()

# SPDX-License-Identifier: Apache-2.0
"""palpate chart identification: error over size and over time beside the rivals, from the benchmarks."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from statistics import median
from typing import Any

import click
import numpy as np

from ..errors import InputError
from .arguments import PATH
from .figures import figure_file
from .output import number, talk
from .pages import markdown_table, with_tables, write_text
from .verb import Verb

_PAGE = "identification.md"
_OURS = "palpate"

_ANY_SIGN, _EARLIER = "_h_of_any_sign", "_force_25_ms_earlier"
"""Ends of the names of sets that are another one, fitted or read otherwise."""

LIMIT = 1.3
"""Files whose error is more than this many times that of their splines are counted."""

Row = Mapping[str, Any]


def _results(folder: Path, name: str) -> tuple[Any, str] | None:
    """What bench/NAME.py left, and where it was measured; None where it did not run."""
    path = folder / f"{name}.json"
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
        where = content["where"]
        told = (
            f"{where['date']}, {where['machine']}, load {where['load']:g}, Python {where['python']}, "
            f"commit {where['commit']}"
        )
        if where["scale"] < 1.0:
            told += f", scale {where['scale']:g}: not for comparison"
        return content["results"], told
    except FileNotFoundError:
        return None
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise InputError(
            f"{path} is no output of bench/{name}.py ({error!r}); make bench writes it"
        ) from None


def _problems(rows: Sequence[Row]) -> str:
    """One row for each problem and method: medians, and the range over the draws in parentheses."""
    return markdown_table(
        (
            "problem, method",
            "NRMSE",
            "wavelets",
            "parameters",
            "fit [s]",
            "tuning [s]",
            "time over ours",
            "draws",
        ),
        [
            (
                f"{row['problem']}, {row['method']}",
                _with_range(row, "nrmse", ".2e"),
                _with_range(row, "n_wavelets", "d"),
                _with_range(row, "n_parameters", "d"),
                number(row["fit_s"]),
                number(row["tuning_s"]),
                f"{row['over_ours']:.3g}",
                str(row["draws"]),
            )
            for row in rows
            if "nrmse" in row
        ],
    )


def _with_range(row: Row, key: str, form: str) -> str:
    """Median and range of a value; empty for a method that has none."""
    if row[key] is None:
        return ""
    low, high = row[f"{key}_range"]
    return f"{row[key]:{form}} ({low:{form}} to {high:{form}})"


def _measured_objects(sets: Mapping[str, Sequence[Row]]) -> str:
    """One row for each set of recordings and method: medians over its files."""
    told = []
    for name, files in sets.items():
        good = [row for row in files if "nrmse" in row]
        if not good:
            continue
        worst = _worst(good, "splines"), _worst(good, "passive_splines")
        told.append(_set_row(f"{name} ({len(good)} files), palpate", good, worst))
        for baseline in dict.fromkeys(key for row in good for key in row["baselines"]):
            theirs = [row["baselines"][baseline] for row in good if baseline in row["baselines"]]
            finite = [each for each in theirs if each["nrmse"] is not None and math.isfinite(each["nrmse"])]
            of = "" if len(finite) == len(good) else f" ({len(finite)} files)"
            if finite:
                told.append(_set_row(f"{name}, {baseline}{of}", finite, ("", "")))
    over = "worst file over its splines", "over splines with h >= 0"
    return markdown_table(("recordings, method", "NRMSE", "parameters", "s a file", *over), told)


def _crossings(sets: Mapping[str, Sequence[Row]]) -> str:
    """One row for each file of the sets that were fitted with h of any sign, or with forces earlier, too."""
    told = []
    for name, files in sets.items():
        variants = [
            {row["file"]: row for row in sets[other]}
            for other in (name + _ANY_SIGN, name + _EARLIER)
            if other in sets
        ]
        if len(variants) == 2:
            told += [_crossing_row(row, *(each.get(row["file"], {}) for each in variants)) for row in files]
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
    return markdown_table(header, told)


def _crossing_row(row: Row, any_sign: Row, earlier: Row) -> tuple[str, ...]:
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


def _worst(files: Sequence[Row], splines: str) -> str:
    """The largest ratio of a model's error and its splines', and how many are above the limit, if any."""
    pairs = [(row["nrmse"], row[splines]["nrmse"]) for row in files if row[splines]]
    ratios = [own / theirs for own, theirs in pairs if theirs is not None and theirs > 0]
    if not ratios:
        return ""
    over = sum(ratio > LIMIT for ratio in ratios)
    return f"{max(ratios):.2f}" + (f" ({over} above {LIMIT:g})" if over else "")


def _set_row(name: str, each: Sequence[Row], worst: tuple[str, str]) -> tuple[str, ...]:
    return (
        name,
        f"{median(row['nrmse'] for row in each):.4f}",
        f"{median(row['n_parameters'] for row in each):.0f}",
        number(median(row["seconds"] for row in each)),
        *worst,
    )


def _counts(rows: Sequence[Row]) -> str:
    return markdown_table(
        ("claim", "right", "of"), [(row["claim"], str(row["right"]), str(row["draws"])) for row in rows]
    )


def _dynamic(rows: Sequence[Row]) -> str:
    return markdown_table(
        ("benchmark, test set, form", "parameters", "one step", "free run", "unit", "published, free run"),
        [
            (
                f"{row['benchmark']}, {row['test_set']}, {row['form']}",
                str(row["n_parameters"]),
                number(row["one_step"]),
                "diverges" if math.isnan(row["free_run"]) else number(row["free_run"]),
                row["unit"],
                row["published"] or ("" if row["comparable"] else "other rows than ours"),
            )
            for row in rows
        ],
    )


def _speeds(rows: Sequence[Row]) -> str:
    return markdown_table(
        ("NRMSE of f, the hand up to", *(f"{hz:g} Hz" for hz in rows[0]["fastest_hz"])),
        [(row["way"], *(f"{error:.2e}" for error in row["nrmse"])) for row in rows],
    )


_TABLES: Mapping[str, Callable[[Any], str]] = {
    "real_data": _measured_objects,
    "parsimony": _counts,
    "dynamic": _dynamic,
    "filters": _speeds,
}
"""Benchmarks that may be missing: their tables stay as they are."""


def _draw_reached(path: Path, rows: Sequence[Row], label: str, spent: str) -> None:
    from ..plotting import Reached, draw_legend, draw_reached

    good = [row for row in rows if "nrmse" in row]
    methods = list(dict.fromkeys(row["method"] for row in good))
    problems = list(dict.fromkeys(row["problem"] for row in good))
    height = 1.2 * math.ceil(len(problems) / 2)
    with figure_file(
        path, height_inches=1.0 + height, rows=[1.0] * math.ceil(len(problems) / 2), columns=2
    ) as panels:
        for axes, problem in zip(panels, problems, strict=False):
            reached = [
                Reached(row["method"], _spent(row, spent), row["nrmse"])
                for row in good
                if row["problem"] == problem
            ]
            draw_reached(axes, problem, reached, methods)
        for axes in panels[len(problems) :]:
            axes.set_visible(False)
        for axes in panels[max(0, len(problems) - 2) : len(problems)]:
            axes.set_xlabel(label)
        panels[0].figure.supylabel("NRMSE against the truth", fontsize=8.0)
        draw_legend(panels, methods)


def _spent(row: Row, what: str) -> float:
    return float(row["n_parameters"] if what == "parameters" else row["fit_s"] + row["tuning_s"])


@click.command(
    cls=Verb, no_args_is_help=True, epilog="Example: palpate chart identification build/bench --to docs"
)
@click.argument("folder", metavar="FOLDER", type=PATH)
@click.option(
    "--to", metavar="FOLDER", type=PATH, required=True, help="Where figures/ goes, and the page is found."
)
def chart_identification(folder: Path, to: Path) -> None:
    """Identification beside its rivals, from the JSON files that `make bench` leaves in a folder.

    Draws identification-parameters.png, identification-time.png and identification-filters.png to
    FOLDER/figures; where FOLDER holds identification.md, its tables follow.
    """
    found = {name: _results(folder, name) for name in ("identification", *_TABLES)}
    if found["identification"] is None:
        raise InputError(f"{folder / 'identification.json'} does not exist; make bench writes it")
    page, figures = to / _PAGE, to / "figures"
    text = page.read_text(encoding="utf-8") if page.exists() else None
    figures.mkdir(parents=True, exist_ok=True)
    rows, where = found["identification"]
    _draw_reached(figures / "identification-parameters.png", rows, "parameters", "parameters")
    _draw_reached(figures / "identification-time.png", rows, "fit and tuning [s]", "seconds")
    draws = max(row["draws"] for row in rows if "nrmse" in row)
    drawn = f"median (least to largest) of up to {draws} draws"
    tables = {"identification": f"{_problems(rows)}\n{where}; {drawn}\n"}
    for name, table in _TABLES.items():
        if (results := found[name]) is not None:
            tables[name] = f"{table(results[0])}\n{results[1]}\n"
            if name == "real_data":
                tables["crossing"] = f"{_crossings(results[0])}\n{results[1]}\n"
    if (filters := found["filters"]) is not None:
        _draw_filters(figures / "identification-filters.png", filters[0])
    talk(f"wrote the figures of identification to {figures}")
    if text is not None:
        write_text(page, with_tables(text, page, tables))
        talk(f"wrote the tables of {page}")


def _draw_filters(path: Path, rows: Sequence[Row]) -> None:
    from ..plotting import draw_over_speed

    with figure_file(path, height_inches=3.4) as (axes,):
        draw_over_speed(
            axes,
            "highest frequency of the hand [Hz]",
            {row["way"]: (np.array(row["fastest_hz"]), np.array(row["nrmse"])) for row in rows},
        )

# SPDX-License-Identifier: Apache-2.0
"""palpate chart failures: where each method fails, measured and drawn beside its theory."""

from __future__ import annotations

import dataclasses
import datetime
import json
import os
import platform
import time
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
import numpy as np

from .arguments import PATH
from .figures import figure_file
from .output import number, talk
from .pages import with_tables, write_text
from .verb import Verb

if TYPE_CHECKING:
    from ..analysis import FailureLine, FailureMap, GuardEffect

_PAGE = "where-each-method-fails.md"


@click.command(cls=Verb, no_args_is_help=True, epilog="Example: palpate chart failures --to docs")
@click.option(
    "--to", metavar="FOLDER", type=PATH, required=True, help="Where figures/ goes, and the page is found."
)
@click.option("--points", type=click.IntRange(2, 100), default=9, help="Measured along each axis.")
def chart_failures(to: Path, points: int) -> None:
    """Measure where each method fails, and draw it beside its theory.

    Every point is a bisection over closed loops with simulated devices and hands. Writes one picture for each
    map and failure-maps.json, with all numbers, machine and date, to FOLDER/figures; where FOLDER holds
    where-each-method-fails.md, its tables follow. Takes a few minutes.
    """
    from ..analysis import failure_map_names, measure_failure_map, measure_guard_effects

    page = to / _PAGE
    text = page.read_text(encoding="utf-8") if page.exists() else None
    figures = to / "figures"
    figures.mkdir(parents=True, exist_ok=True)
    start = time.perf_counter()
    maps = []
    for name in failure_map_names:
        before = time.perf_counter()
        maps.append(measure_failure_map(name, points))
        talk(f"{name}: measured in {time.perf_counter() - before:.1f} s")
        _draw(figures / f"failure-{name}.png", maps[-1])
    guards = measure_guard_effects()
    where = _where(time.perf_counter() - start)
    written = where | {
        "maps": [each.as_json() for each in maps],
        "guards": [dataclasses.asdict(each) for each in guards],
    }
    write_text(figures / "failure-maps.json", json.dumps(written, indent=1) + "\n")
    talk(f"wrote {len(maps)} figures and failure-maps.json to {figures}")
    if text is not None:
        write_text(page, with_tables(text, page, _tables(maps, guards, where)))
        talk(f"wrote the tables of {page}")


def _where(seconds: float) -> dict[str, Any]:
    """Machine, date and version."""
    from .._core import __version__

    return {
        "machine": f"{platform.machine()}, {os.cpu_count()} cores, {platform.system()}",
        "date": datetime.datetime.now(datetime.timezone.utc).date().isoformat(),
        "palpate": __version__,
        "seconds": round(seconds, 1),
        "simulated": "device and hands are simulated; nothing here was measured on hardware",
    }


def _draw(path: Path, drawn: FailureMap) -> None:
    from ..plotting import MeasuredLimit, draw_failure_map

    lines = [MeasuredLimit(line.name, line.at, line.measured, line.theory) for line in drawn.lines]
    with figure_file(path, height_inches=3.2) as (axes,):
        draw_failure_map(axes, drawn.along, drawn.limit, lines, searched=drawn.searched, linear=drawn.linear)


def _tables(maps: list[FailureMap], guards: Sequence[GuardEffect], where: dict[str, Any]) -> dict[str, str]:
    """The tables of the page, by their marks."""
    tables = {each.name: _table(each) for each in maps}
    tables["guards"] = _guard_table(guards)
    tables["where"] = (
        f"Measured by `palpate chart failures --to docs`: palpate {where['palpate']}, {where['date']}, "
        f"{where['machine']}, {where['seconds']} s.\n"
    )
    return tables


def _table(shown: FailureMap) -> str:
    """Of each line, measured over theory; without theory, what was measured."""
    if not shown.linear and any(np.isfinite(line.theory).any() for line in shown.lines):
        rows = ["| | measured over theory |\n| --- | ---: |\n"]
        rows += [f"| {line.name} | {_spread(line, shown.searched)} |\n" for line in shown.lines]
        return "".join(rows)
    places = shown.lines[0].at
    chosen = np.unique(np.linspace(0, len(places) - 1, 5).round().astype(int))
    rows = [
        "| " + " | ".join([shown.along, *(number(places[k]) for k in chosen)]) + " |\n",
        "| --- |" + " ---: |" * len(chosen) + "\n",
    ]
    for line in shown.lines:
        rows.append("| " + " | ".join([line.name, *(number(line.measured[k]) for k in chosen)]) + " |\n")
    return "".join(rows)


def _spread(line: FailureLine, searched: float) -> str:
    """Least and largest ratio, and where there is none."""
    ratio, none = line.ratio, f"nothing failed up to {number(searched)}"
    if not ratio.size:
        return none
    found = f"{ratio.min():.4f} to {ratio.max():.4f}"
    return f"{found}; elsewhere {none}" if np.isnan(line.measured).any() else found


def _guard_table(guards: Sequence[GuardEffect]) -> str:
    rows = [
        "| guard | cost when nothing is wrong | what is wrong | without | with |\n",
        "| --- | ---: | --- | ---: | ---: |\n",
    ]
    for row in guards:
        rows.append(
            f"| {row.guard} | {100.0 * row.cost:.2g} % | {row.wrong} | {number(row.without)} "
            f"| {number(row.with_guard)} |\n"
        )
    return "".join(rows)

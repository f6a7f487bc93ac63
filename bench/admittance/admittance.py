# SPDX-License-Identifier: Apache-2.0
"""Draws the limits of admittance displays and fills the tables of the pages about them.

    python bench/admittance/admittance.py --to docs [search|limits|map|precision|clutch ...]

Needs the programs of the target `benchmarks` in build/release/bench. Takes about five minutes; each part can
run alone. Writes FOLDER/figures/admittance-*.png and admittance.json, and the tables of FOLDER/certificate.md
and FOLDER/how-to/pedal.md if these pages exist.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2]))

from bench import studies
from bench.limits.failure_maps import draw_map, map_table
from bench.solvers.results import BenchmarkResults
from bench.solvers.speed import work_precision
from bench.studies import ROOT, SCALE, count, fill_tables, write_text

from palpate.cli.figures import figure_file
from palpate.plotting.look import grid, legend_above


def output(program: str, *arguments: str) -> str:
    """Returns what a program of this study prints."""
    command = [studies.program(program), *arguments]
    return subprocess.run(command, stdout=subprocess.PIPE, text=True, check=True).stdout


def search(to: Path) -> None:
    """Searches for muscles that take energy out of certified displays."""
    violations, measured = output("admittance_search", str(count(10_000))).split("\n\n")
    fill_tables(
        to / "certificate.md",
        {"admittance-search": violations + "\n", "admittance-measured": measured},
    )


def limits(to: Path) -> None:
    """Compares certified and exact linear damping."""
    fill_tables(to / "certificate.md", {"admittance-line": output("admittance_displays", "line")})


def maps(to: Path) -> None:
    """Draws simulated and exact limits over stiffness, mass and damping."""
    found = json.loads(output("admittance_displays", "map", str(max(2, count(9)))))
    tables = {}
    for each in found:
        with figure_file(to / "figures" / f"admittance-{each['name']}.png", height_inches=3.2) as (axes,):
            draw_map(axes, each)
        tables[f"admittance-{each['name']}"] = map_table(each)
    write_text(to / "figures" / "admittance.json", json.dumps(found, indent=1) + "\n")
    fill_tables(to / "certificate.md", tables)


def precision(to: Path) -> None:
    """Draws the error of the motion over the computing time of each step."""
    folder = ROOT / "build" / "bench"
    folder.mkdir(parents=True, exist_ok=True)
    output(
        "bench_precision",
        f"--benchmark_min_time={0.1 * min(SCALE, 1.0)}",
        f"--benchmark_out={folder / 'bench_precision.json'}",
        "--benchmark_out_format=json",
    )
    results = BenchmarkResults(folder, "bench_precision")
    table = work_precision(results, to / "figures" / "admittance-precision.png")
    fill_tables(to / "certificate.md", {"admittance-precision": table})


def clutch(to: Path) -> None:
    """Draws the motion of a clutch pedal on the drop of its force."""
    motion = np.genfromtxt(output("admittance_displays", "motion").splitlines(), delimiter=",", names=True)
    curves = {
        "certified_mm": ("certified damping", "-", "black"),
        "nine_tenths_mm": ("0.9 of it", (0, (5, 2)), "black"),
        "inverse_mm": ("position over force", "-", "0.6"),
    }
    with figure_file(to / "figures" / "admittance-clutch.png", height_inches=2.8) as (axes,):
        for name, (label, dash, color) in curves.items():
            axes.plot(motion["time_s"], motion[name], color=color, linestyle=dash, linewidth=0.8, label=label)
        axes.set_xlabel("time [s]")
        axes.set_ylabel("position of the pedal [mm]")
        legend_above(axes)
        grid(axes)
    table = output("admittance_displays", "clutch").split("\n\n")[1]
    fill_tables(to / "how-to" / "pedal.md", {"clutch": table})


PARTS: dict[str, Callable[[Path], None]] = {
    "search": search,
    "limits": limits,
    "map": maps,
    "precision": precision,
    "clutch": clutch,
}


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--to", type=Path, required=True, help="folder of figures/ and of the pages")
    parser.add_argument("parts", nargs="*", help="parts of the study; default: all")
    options = parser.parse_args()
    if unknown := set(options.parts) - set(PARTS):
        parser.error(f"part is '{min(unknown)}', must be {', '.join(PARTS)}")
    (options.to / "figures").mkdir(parents=True, exist_ok=True)
    for name in options.parts or PARTS:
        PARTS[name](options.to)


if __name__ == "__main__":
    main()

# SPDX-License-Identifier: Apache-2.0
"""Compares every method that keeps a rendering stable on the same simulated devices, objects and hands.

python bench/rivals/rivals.py --to docs      needs build/release/bench/rivals

Writes both figures and rivals.json, with every case, to FOLDER/figures. Writes the tables of
FOLDER/rivals.md if it exists.
"""

from __future__ import annotations

import argparse
import json
import resource
import subprocess
import sys
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import NullFormatter

from palpate.cli.figures import figure_file
from palpate.cli.printing import number

sys.path.insert(0, str(Path(__file__).parents[2]))

from bench.studies import SCALE, count, fill_tables, markdown_table, program, where, write_text

from palpate.plotting.look import grid

PAGE = "rivals.md"

DRAWS = 20
"""Number of random scenes of each case in a full run."""
EVERY = 1 if SCALE >= 0.1 else 61
"""A short run measures each n-th case only."""

Case = Mapping[str, Any]
"""Measurements of a method on a device, object and delay; [10 %, 50 %, 90 %] quantiles of the draws."""

DELAYS = 3
"""Tried delays: 0, 1 and 2 samples."""

MIDDLE, HIGH = 1, 2
"""Indices of the median and the 90 % quantile of the draws."""

DIVERGED = 1000.0
"""Energy given over the budget above which a rendering counts as diverged."""

LEFT = 0.01
"""Position of a case without a stable stiffness in the figure [2b/T]."""

LETTERS = "abcdefghijklmnopqrstuvwxyz"
"""Marks of the methods in the figures."""


def values(cases: Iterable[Case], quantity: str) -> list[float]:
    """Returns the median of a quantity over the draws, for each case that has the quantity."""
    return [float(case[quantity][MIDDLE]) for case in cases if case[quantity] is not None]


def keeps_budget(case: Case) -> bool:
    """Returns True if no hand obtained more than the budget, in at least nine of ten draws."""
    return bool(case["energy"][HIGH] <= 1.0)


def of(cases: Sequence[Case], **wanted: Any) -> list[Case]:
    """Returns the cases with these properties."""
    return [case for case in cases if all(case[key] == value for key, value in wanted.items())]


def cell(numbers: Sequence[float], form: Callable[[float], str] = number) -> str:
    return form(median(numbers)) if numbers else "–"


def name_of(method: Mapping[str, Any]) -> str:
    """Returns the name with * for a method of the package, + for a further one of this project."""
    return str(method["name"]) + (" *" if method["in_package"] else " +" if method["ours"] else "")


def percent(share: float) -> str:
    return f"{100.0 * share:.2g} %"


def most_energy(cases: Sequence[Case]) -> str:
    """Returns the largest energy given, over the budget."""
    most = max(case["energy"][HIGH] for case in cases)
    return f"{most:.2g}" if most <= DIVERGED else f"> {DIVERGED:.0f}"


def method_table(output: Mapping[str, Any]) -> str:
    """Returns a row for each method: medians over devices and objects."""
    cases, rows = output["cases"], []
    for method in output["methods"]:
        own = of(cases, method=method["name"])
        over = values(own, "over_bound")
        rows.append(
            [
                name_of(method),
                *(cell(values(of(own, delay=delay), "stiffness")) for delay in range(DELAYS)),
                f"{cell(over)} ({number(min(over))})" if over else "–",
                f"{sum(not keeps_budget(case) for case in own)} of {len(own)} ({most_energy(own)})",
                *(cell(values(of(own, delay=delay), "force_error"), percent) for delay in range(DELAYS)),
                cell(values(own, "acts"), percent),
                cell([case["nanoseconds"] for case in own]),
            ]
        )
    header = ["method", "stiffness, delay 0", "1", "2", "found / bound (least)", "over budget (most)"]
    header += ["force error, delay 0", "1", "2", "acts", "ns a tick"]
    return markdown_table(header, rows)


def claim_table(output: Mapping[str, Any]) -> str:
    return markdown_table(
        ("method", "source", "proved for", "needs to know"),
        [(name_of(each), each["source"], each["proved"], each["knows"]) for each in output["methods"]],
        text_columns=(0, 1, 2, 3),
    )


@dataclass(frozen=True)
class Contest:
    """The best method of two groups in one device, object and delay."""

    case: Case
    """the best case of the first group"""
    rival: Case
    """the best case of the second group"""
    quantity: str

    @property
    def factor(self) -> float:
        """Ratio of the rival's value to the value of the first group; above 1, the rival is better."""
        own, other = self.case[self.quantity][MIDDLE], self.rival[self.quantity][MIDDLE]
        better, worse = (other, own) if self.quantity == "stiffness" else (own, other)
        return float(better / worse) if worse > 0.0 else float("inf")

    @property
    def lost(self) -> bool:
        """True if the rival is better by more than 2 %."""
        return self.factor > 1.02


def contests(output: Mapping[str, Any], names: Collection[str], quantity: str, delay: int) -> list[Contest]:
    """Returns the best of these methods against the best of all rivals, for each device and object.

    Rivals are the methods that neither the package uses nor this project developed. A method in which a hand
    obtains more than the budget has no force error.
    """
    rivals = {each["name"] for each in output["methods"] if not each["in_package"] and not each["ours"]}
    groups: dict[tuple[str, str], list[Case]] = {}
    for case in of(output["cases"], delay=delay):
        if quantity == "stiffness" or keeps_budget(case):
            groups.setdefault((case["device"], case["object"]), []).append(case)
    choose = max if quantity == "stiffness" else min

    def best(own: Sequence[Case]) -> Case:
        return choose(own, key=lambda case: case[quantity][MIDDLE])

    found = []
    for cases in groups.values():
        own, other = ([case for case in cases if case["method"] in group] for group in (names, rivals))
        if own and other:
            found.append(Contest(best(own), best(other), quantity))
    return found


def loss_table(output: Mapping[str, Any]) -> str:
    """Returns a row for each quantity and delay with the cases lost, those with most losses first."""
    package = {each["name"] for each in output["methods"] if each["in_package"]}
    project = package | {each["name"] for each in output["methods"] if each["ours"]}
    rows = []
    for quantity, text, form in (
        ("stiffness", "stiffness [2b/T]", number),
        ("force_error", "force error", percent),
    ):
        for delay in range(DELAYS):
            found = contests(output, package, quantity, delay)
            lost = [contest for contest in found if contest.lost]
            all_lost = [contest for contest in contests(output, project, quantity, delay) if contest.lost]
            row = [f"{text}, delay {delay}", f"{len(lost)} of {len(found)}", f"{len(all_lost)}"]
            if lost:
                worst = max(lost, key=lambda contest: contest.factor)
                row += [f"{worst.case['object']}, {worst.case['device']}"]
                row += [
                    f"{each['method']}: {form(each[quantity][MIDDLE])}" for each in (worst.case, worst.rival)
                ]
            rows.append((len(lost), row + ["–"] * (6 - len(row))))
    rows.sort(key=lambda row: -row[0])
    header = ["", "lost by the package", "with + methods", "largest loss", "package", "rival"]
    return markdown_table(header, [row for _, row in rows], text_columns=(0, 3, 4, 5))


def published_table(output: Mapping[str, Any]) -> str:
    return markdown_table(
        ("limit", "source", "formula", "published", "found", "found / published"),
        [
            (
                each["limit"],
                each["source"],
                each["formula"].replace("*", "·"),
                number(each["published"]),
                number(each["found"]),
                f"{each['found'] / each['published']:.4f}",
            )
            for each in output["published"]
        ],
        text_columns=(0, 1, 2),
    )


def device_table(output: Mapping[str, Any]) -> str:
    rows = []
    for each in output["devices"]:
        force, length = ("N·m", "rad") if each["unit"] == "rad" else ("N", "m")
        steps = each["controller_steps"]
        rows.append(
            (
                each["name"],
                f"{number(each['damping'])} {force}·s/{length}",
                f"{number(each['friction'])} {force}",
                f"{each['encoder_step']:.2g} {each['unit']}",
                f"{number(1e3 * each['period_s'])} ms",
                f"{number(1e-3 * steps / each['period_s'])} kHz" if steps > 1 else "holds the force",
                f"{number(each['speed'])} {length}/s",
            )
        )
    header = ("device", "damping b", "friction f_c", "encoder step", "period T", "controller", "hands up to")
    return markdown_table(header, rows, text_columns=(0, 5))


def draw_points(
    axes: Axes, output: Mapping[str, Any], along: Callable[[Case], float], delays: Collection[int]
) -> None:
    """Draws a letter for each method at its median, with bars from 25 % to 75 % of devices and objects.

    The letter is grey if hands obtained more than the budget in a case.
    """
    for letter, method in zip(LETTERS, output["methods"], strict=False):
        own = [case for case in of(output["cases"], method=method["name"]) if case["delay"] in delays]
        if not own:
            continue
        x = np.quantile([max(LEFT, along(case)) for case in own], (0.25, 0.5, 0.75))
        y = 100.0 * np.quantile(values(own, "force_error"), (0.25, 0.5, 0.75))
        axes.plot(x, [y[1]] * 3, color="0.75", linewidth=0.5, zorder=1)
        axes.plot([x[1]] * 3, y, color="0.75", linewidth=0.5, zorder=1)
        colour = "black" if all(keeps_budget(case) for case in own) else "0.55"
        axes.text(x[1], y[1], letter, color=colour, weight="bold", ha="center", va="center")
        axes.plot([], [], linestyle="none", label=f"{letter}  {name_of(method)}")
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.yaxis.set_minor_formatter(NullFormatter())
    axes.set_ylabel("force error [% of range]")
    grid(axes)


def legend(axes: Axes) -> None:
    handles, labels = axes.get_legend_handles_labels()
    axes.figure.legend(
        handles,
        labels,
        frameon=False,
        loc="outside lower center",
        ncols=2,
        handlelength=0.0,
        handletextpad=0.0,
    )


def draw(output: Mapping[str, Any], folder: Path) -> None:
    """Draws the force error over the stiffness, one panel for each delay, and over the time of a tick."""
    folder.mkdir(parents=True, exist_ok=True)
    with figure_file(folder / "rivals-stiffness.png", rows=(1, 1, 1), height_inches=7.5) as panels:
        for delay, axes in enumerate(panels):
            draw_points(axes, output, lambda case: float(case["stiffness"][MIDDLE]), [delay])
            axes.set_title(f"delay {delay} T")
            axes.set_xlabel("largest stable stiffness [2b/T]")
        legend(panels[0])
    with figure_file(folder / "rivals-time.png", height_inches=3.6) as (axes,):
        draw_points(axes, output, lambda case: float(case["nanoseconds"]), range(DELAYS))
        axes.set_xlabel("time of a tick [ns]")
        legend(axes)


def write(output: Mapping[str, Any], to: Path, processor_s: float) -> None:
    """Draws both figures, writes every case to rivals.json and fills the tables of the page."""
    measured = {
        **where(),
        "processor_s": round(processor_s),
        "simulated": "devices and hands are simulated; no number was measured on hardware",
        **output,
    }
    draw(output, to / "figures")
    cases = ",\n".join(json.dumps(case) for case in output["cases"])
    head = json.dumps({**measured, "cases": []}, indent=1).removesuffix("[]\n}")
    write_text(to / "figures" / "rivals.json", f"{head}[\n{cases}\n]}}\n")
    measured_by = (
        f"Measured by `python bench/rivals/rivals.py --to docs`: palpate {measured['palpate']}, commit "
        f"{measured['commit']}, {measured['date']}, {measured['machine']}, {output['draws']} draws of "
        f"{len(output['cases'])} cases in {measured['processor_s']} s of processor time.\n"
    )
    tables = {
        "losses": loss_table(output),
        "methods": method_table(output),
        "claims": claim_table(output),
        "published": published_table(output),
        "devices": device_table(output),
        "where": measured_by,
    }
    fill_tables(to / PAGE, tables)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--to", type=Path, required=True, help="folder of figures/ and of the page")
    options = parser.parse_args()
    command = [str(program("rivals")), str(count(DRAWS)), str(EVERY)]
    completed = subprocess.run(command, stdout=subprocess.PIPE, check=True)
    write(json.loads(completed.stdout), options.to, resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime)


if __name__ == "__main__":
    main()

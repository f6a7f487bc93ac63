# SPDX-License-Identifier: Apache-2.0
"""palpate chart speed: error against computing time, from what the benchmarks printed."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import click
import numpy as np

from ..errors import InputError
from .arguments import PATH
from .figures import figure_file
from .output import number, talk
from .pages import markdown_table, write_text
from .verb import Verb

_STEPS = "bench_work_precision"
_FORCES = "bench_rendered_force"
_PERIOD_S = 1e-3
"""The computing time of different periods is compared over this much motion."""


class _Results:
    """One file of Google Benchmark."""

    def __init__(self, folder: Path, name: str) -> None:
        self.path = folder / f"{name}.json"
        try:
            content = json.loads(self.path.read_text(encoding="utf-8"))
            self.context: Mapping[str, Any] = content["context"]
            self.rows: list[Mapping[str, Any]] = content["benchmarks"]
        except FileNotFoundError:
            raise InputError(f"{self.path} does not exist; make bench writes it") from None
        except (OSError, ValueError, KeyError, TypeError) as error:
            raise InputError(
                f"{self.path} is no output of Google Benchmark in JSON ({error}); make bench writes it"
            ) from None
        for row in self.rows:
            if row.get("error_occurred"):
                raise InputError(
                    f"{self.path}: {row['name']} gave a wrong answer ({row.get('error_message')}); "
                    "only right ones are drawn"
                )

    def number(self, row: Mapping[str, Any], key: str) -> float:
        value = row.get(key)
        if not isinstance(value, (int, float)):
            raise InputError(f"{self.path}: {row.get('name')} has no number {key}; run make bench again")
        return float(value)

    def where(self) -> str:
        """Machine, date, compiler and commit."""
        context = self.context
        cache = ", ".join(
            f"L{each['level']} {each['size'] // 1024} KiB"
            for each in context.get("caches", ())
            if each.get("type") != "Instruction"
        )
        said = [
            f"{context.get('num_cpus')} cores at {context.get('mhz_per_cpu')} MHz ({cache})",
            str(context.get("date", ""))[:10],
            *(f"{key} {context[key]}".replace("_", " ") for key in ("compiler", "flags") if key in context),
            f"commit {context.get('commit', 'unknown')}",
        ]
        return "; ".join(said)


def _spoken(name: str) -> str:
    return name.replace("_", " ")


def _work_precision(results: _Results, path: Path) -> str:
    from ..plotting import WorkPrecision, draw_work_precision

    families: dict[str, list[tuple[float, float, float, bool]]] = {}
    for row in results.rows:
        period_s = results.number(row, "period_s")
        nanoseconds = results.number(row, "cpu_time")
        families.setdefault(str(row["name"]).split("/")[0], []).append(
            (
                period_s,
                nanoseconds,
                results.number(row, "motion_error_rad"),
                results.number(row, "diverges") > 0.0,
            )
        )
    steps = [
        WorkPrecision(
            _spoken(name),
            np.array([time * _PERIOD_S / period for period, time, _, diverges in points if not diverges]),
            np.array([error for _, _, error, diverges in points if not diverges]),
            np.array([time * _PERIOD_S / period for period, time, _, diverges in points if diverges]),
        )
        for name, points in families.items()
    ]
    with figure_file(path, height_inches=3.9) as (axes,):
        draw_work_precision(axes, steps, "rad")
    rows = [
        (
            _spoken(name),
            f"{1e3 * period:g}",
            number(time),
            number(time * _PERIOD_S / period),
            "diverges" if diverges else number(error),
        )
        for name, points in families.items()
        for period, time, error, diverges in points
    ]
    return markdown_table(
        ("time step", "period [ms]", "a step [ns]", "1 ms of motion [ns]", "error, RMS [rad]"), rows
    )


def _rendered_force(results: _Results, path: Path) -> str:
    from ..plotting import RenderedForce, draw_rendered_force
    from ..verification.perception import FORCE_JND

    shown = [
        (
            RenderedForce(
                _spoken(str(row["name"])),
                results.number(row, "cpu_time"),
                results.number(row, "force_error_end_Nm"),
            ),
            results.number(row, "force_error_instant_Nm"),
            results.number(row, "evaluations"),
            results.number(row, "force_rms_Nm"),
        )
        for row in results.rows
    ]
    direct = next((each for each in shown if each[0].name.startswith("direct")), None)
    if direct is None:
        raise InputError(f"{results.path} has no direct rendering to compare with; run make bench again")
    limits = [
        (f"felt: {100 * FORCE_JND:g} % of the force", FORCE_JND * direct[3]),
        ("the hold over a tick", direct[0].error),
        ("the encoder's step", direct[1]),
    ]
    with figure_file(path, height_inches=4.3) as (axes,):
        draw_rendered_force(axes, [each for each, *_ in shown], limits, "N*m")
    rows = [
        (each.name, number(each.nanoseconds), f"{evaluations:.3g}", number(each.error), number(instant))
        for each, instant, evaluations, _ in shown
    ]
    return markdown_table(
        (
            "structure and solver",
            "a tick [ns]",
            "evaluations",
            "error at the end of a tick [N·m]",
            "at its sampling instant [N·m]",
        ),
        rows,
    )


@click.command(
    cls=Verb, no_args_is_help=True, epilog="Example: palpate chart speed build/bench --to docs/figures"
)
@click.argument("folder", metavar="FOLDER", type=PATH)
@click.option(
    "--to", metavar="FOLDER", type=PATH, required=True, help="Where the figures and their table go."
)
def chart_speed(folder: Path, to: Path) -> None:
    """Error against computing time, from the JSON files that `make bench` leaves in a folder.

    Draws work-precision.png and rendered-force.png, and writes their numbers, machine and date to speed.md.
    """
    steps, forces = _Results(folder, _STEPS), _Results(folder, _FORCES)
    to.mkdir(parents=True, exist_ok=True)
    text = "\n".join(
        [
            "# Speed against accuracy\n",
            "Drawn by `palpate chart speed`; the numbers are those of `make bench`.\n",
            "## Time steps: work against precision\n",
            "A mass of 0.001 kg·m² with 0.5 N·m·s/rad behind a coupling of 100 N·m/rad and 0.02 N·m·s/rad, "
            "in a spring that meets a wall; a hand's motion of 2 s. The truth is the exact solution.\n",
            "![Error of the motion over computing time](work-precision.png)\n",
            _work_precision(steps, to / "work-precision.png"),
            f"{steps.where()}\n",
            "## Structures and solvers: rendered force\n",
            "A click and a wall on a simulated knob at 1 kHz, a hand that presses through both for 4 s. The "
            "error is the rendered force less the object's own at the handle.\n",
            "![Force error over the time of a tick](rendered-force.png)\n",
            _rendered_force(forces, to / "rendered-force.png"),
            f"{forces.where()}\n",
        ]
    )
    write_text(to / "speed.md", text)
    talk(f"wrote {to / 'work-precision.png'}, {to / 'rendered-force.png'} and {to / 'speed.md'}")

# SPDX-License-Identifier: Apache-2.0
"""palpate chart speed: error against computing time, from what the benchmarks printed."""

from __future__ import annotations

from pathlib import Path

import click
import numpy as np

from ..errors import InputError
from .arguments import PATH
from .benchmark_results import BenchmarkResults
from .figures import figure_file
from .output import number, talk
from .pages import markdown_table, write_text
from .speed_over_size import BOUNDS, EVALUATIONS, model_error, over_wavelets
from .verb import Verb

_PERIOD_S = 1e-3
"""The computing time of different periods is compared over this much motion."""


def _spoken(name: str) -> str:
    return name.replace("_", " ")


def _work_precision(results: BenchmarkResults, path: Path) -> str:
    from ..plotting import WorkPrecision, draw_work_precision

    families: dict[str, list[tuple[float, float, float, bool]]] = {}
    for row in results.rows:
        families.setdefault(str(row["name"]).split("/")[0], []).append(
            (
                results.number(row, "period_s"),
                results.nanoseconds(row),
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


def _rendered_force(results: BenchmarkResults, path: Path) -> str:
    from ..plotting import RenderedForce, draw_rendered_force
    from ..verification.perception import FORCE_JND

    shown = [
        (
            RenderedForce(
                _spoken(str(row["name"])),
                results.nanoseconds(row),
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


def _ticks(results: BenchmarkResults) -> str:
    rows = [
        (
            _spoken(str(row["name"]).removeprefix("tick/")),
            number(results.nanoseconds(row)),
            number(results.number(row, "p50_ns")),
            number(results.number(row, "p999_ns")),
        )
        for row in results.of("tick")
    ]
    return markdown_table(("structure", "mean [ns]", "median [ns]", "99.9th percentile [ns]"), rows)


def _claims(results: BenchmarkResults) -> str:
    rows = [
        (
            str(row["name"]),
            number(results.number(row, "measured")),
            number(results.number(row, "most")),
        )
        for row in results.rows
    ]
    return markdown_table(("ratio or number", "measured", "asked for, at most"), rows)


@click.command(
    cls=Verb, no_args_is_help=True, epilog="Example: palpate chart speed build/bench --to docs/figures"
)
@click.argument("folder", metavar="FOLDER", type=PATH)
@click.option(
    "--to", metavar="FOLDER", type=PATH, required=True, help="Where the figures and their table go."
)
def chart_speed(folder: Path, to: Path) -> None:
    """Error against computing time, from the JSON files that `make bench` leaves in a folder.

    Draws each comparison and writes its numbers, machine, compiler, commit and date to speed.md.
    """
    steps, forces, ticks, models, evaluations, bounds, claims = (
        BenchmarkResults(folder, name)
        for name in (
            "bench_work_precision",
            "bench_rendered_force",
            "bench_controller",
            "bench_model_error",
            "bench_evaluation",
            "bench_bounds",
            "ratios",
        )
    )
    to.mkdir(parents=True, exist_ok=True)
    text = "\n".join(
        [
            "# Speed against accuracy\n",
            "Drawn by `palpate chart speed`; the numbers are those of `make bench`, medians over interleaved "
            "repetitions of one run.\n",
            "## What was asked for\n",
            _claims(claims),
            f"{steps.where()}\n",
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
            "## A whole tick without its device\n",
            "Reading judged, force rendered as the loop does by default, limited and slewed; single ticks "
            "are timed for the percentiles.\n",
            _ticks(ticks),
            f"{ticks.where()}\n",
            "## Models: error against size and time\n",
            "A spring and a wall, and a tactile switch, each from 10⁴ noisy rows; NRMSE against the truth. "
            "The number of wavelets stands beside its network. Networks stop growing by themselves (BIC). An "
            "evaluation is one of 10⁴ positions in a NumPy array.\n",
            "![Model error over fitted parameters](model-error-size.png)\n",
            "![Model error over the time of an evaluation](model-error-time.png)\n",
            model_error(models, to / "model-error-size.png", to / "model-error-time.png"),
            f"{models.where()}\n",
            "## Evaluation: value and slope on a dependent chain\n",
            "Spring and wall. The compiled network is right to 10⁻¹² of the largest force; table and spline "
            "have 4096 cells.\n",
            "![Time of an evaluation over the number of wavelets](evaluation.png)\n",
            over_wavelets(
                evaluations,
                EVALUATIONS,
                to / "evaluation.png",
                [("value and slope [ns]", evaluations.nanoseconds)],
            ),
            f"{evaluations.where()}\n",
            "## Proved bounds of the slope\n",
            "How much wider than what a dense search finds, of the steepest slope; random networks.\n",
            "![Time and excess of proved bounds over the number of wavelets](bounds.png)\n",
            over_wavelets(
                bounds,
                BOUNDS,
                to / "bounds.png",
                [
                    ("time of a bound [ns]", bounds.nanoseconds),
                    ("excess [%]", lambda row: 100.0 * bounds.number(row, "excess")),
                ],
            ),
            f"{bounds.where()}\n",
        ]
    )
    write_text(to / "speed.md", text)
    talk(f"wrote {to / 'speed.md'} and its figures")

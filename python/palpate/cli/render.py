# SPDX-License-Identifier: Apache-2.0
"""palpate render: a model rendered live, by the loop of palpate-control."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from .._core.run import LoopSettings, usual_telemetry_hz
from .._core.run import render as render_live
from ..model import load_model
from ..planning import rig_for
from ..recording.files import require_absent
from .exit_status import end_with
from .live_line import live_line
from .printing import number, print_json, print_numbers, print_verdict, require_writable, talk
from .scheme_options import chosen_plan, scheme_options
from .session_verdict import session_verdict
from .verb import PATH, json_option, verb

_LOOP = LoopSettings()


@verb("palpate render press.json --duration-s 10 --record felt.csv", ends_at_once=False)
@click.argument("model_file", metavar="MODEL.json", type=PATH)
@click.option("--rate-hz", type=float, default=_LOOP.rate_hz, help="Ticks a second.")
@click.option("--duration-s", type=float, default=_LOOP.duration_s, help="How long; inf: until Ctrl-C.")
@click.option(
    "--record",
    type=PATH,
    metavar="OUT.csv",
    default=None,
    help="Write every tick to this recording; it grows as OUT.csv.part.",
)
@click.option("--force", is_flag=True, help="Replace an existing recording.")
@click.option(
    "--telemetry-port",
    type=click.IntRange(1, 65535),
    default=None,
    help="Send JSON lines over UDP to this port of this machine (PlotJuggler: 9870).",
)
@click.option(
    "--telemetry-hz", type=click.FloatRange(0.1, 10000), default=usual_telemetry_hz, help="Lines a second."
)
@click.option(
    "--lowest-rate-share",
    type=click.FloatRange(0, 1),
    default=_LOOP.lowest_rate_share,
    help="Of the rate: less for half a second ends the run, 0: never.",
)
@json_option
@scheme_options
def render(
    model_file: Path,
    rate_hz: float,
    duration_s: float,
    record: Path | None,
    force: bool,
    telemetry_port: int | None,
    telemetry_hz: float,
    lowest_rate_share: float,
    as_json: bool,
    **scheme: Any,
) -> None:
    """Render a model live on a simulated device, tick by tick.

    The loop is that of palpate-control, with real-time priority where the system allows it. Ctrl-C ends it in
    an orderly way: zero force first, then the recording is closed, then the summary is printed.
    """

    if record is not None:
        require_writable(record, inputs=(model_file,))
        if not force:
            require_absent(record)
    model = load_model(model_file)
    rig = rig_for(model)
    plan = chosen_plan(model, rig, scheme)
    talk(f"read {model_file}: {model!r}; rendering on a {rig.device.id}, which is simulated: nothing moves")
    with live_line(rate_hz, (model.units["position"], model.units["force"])) as line:
        summary = render_live(
            plan.rendered,
            plan.scheme,
            position_unit=model.units["position"],
            force_unit=model.units["force"],
            rate_hz=rate_hz,
            duration_s=duration_s,
            record="" if record is None else str(record),
            force=force,
            model_name=str(model_file),
            telemetry_port=telemetry_port,
            telemetry_hz=telemetry_hz,
            lowest_rate_share=lowest_rate_share,
            progress=line.show,
        )
    for note in summary["notes"]:
        talk(f"  {note}")
    verdict = session_verdict(summary)
    if as_json:
        print_json(summary)
        end_with(verdict)
        return
    print_verdict(verdict)
    rows = {
        "ended": summary["ended"],
        "rate": f"{number(summary['rate_hz'])} Hz of {number(rate_hz)} Hz, "
        f"{summary['missed_deadlines']} deadlines missed",
        "period": _percentiles(summary["period"]),
        "late by": _percentiles(summary["lateness"]),
        "energy": summary["energy"]["sentence"],
        "ticks": ", ".join(f"{count} {word}" for word, count in summary["ticks_by_status"].items()),
    }
    if record is not None:
        rows["recorded"] = f"{summary['record']}: {summary['recorded']} rows, {summary['lost_records']} lost"
    print_numbers(rows)
    end_with(verdict)


def _percentiles(durations: dict[str, float]) -> str:
    names = {"p50_us": "p50", "p99_us": "p99", "p999_us": "p99.9", "max_us": "max"}
    return ", ".join(f"{name} {number(durations[key])} us" for key, name in names.items())

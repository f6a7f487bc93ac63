# SPDX-License-Identifier: Apache-2.0
"""palpate render: renders a model live with the loop of palpate-control."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from .._core.run import LoopSettings, device_help, device_waits, usual_telemetry_hz
from .._core.run import render as render_live
from ..errors import InputError
from ..model import load_model
from ..planning import Plan, example_profiles
from .exit_status import end_with
from .live import device_option, live_line, session_verdict
from .printing import print_json, print_numbers, print_verdict, talk
from .verb import PATH, accept_model_option, json_option, require_writable, scheme_options, sized, verb

_LOOP = LoopSettings()


@verb("palpate render press.json --duration-s 10 --record felt.csv", ends_at_once=False)
@click.argument("model_file", metavar="MODEL.json", type=PATH)
@device_option(device_help)
@click.option(
    "--uncertified",
    is_flag=True,
    help="Render without a valid certificate; a real device can become unstable.",
)
@click.option(
    "--wait-ms",
    type=click.FloatRange(0.1, 10000),
    show_default=device_waits,
    help="Longest wait for an answer of the device [ms].",
)
@click.option("--rate-hz", type=float, show_default=f"{_LOOP.rate_hz:g}", help="Rate of the loop [Hz].")
@click.option("--duration-s", type=float, default=_LOOP.duration_s, help="Duration [s]; inf: until Ctrl-C.")
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
    "--telemetry-hz",
    type=click.FloatRange(0.1, 10000),
    default=usual_telemetry_hz,
    help="Rate of the JSON lines [Hz].",
)
@click.option(
    "--lowest-rate-share",
    type=click.FloatRange(0, 1),
    default=_LOOP.lowest_rate_share,
    help="A rate below this share of --rate-hz for half a second ends the run; 0: never.",
)
@accept_model_option
@json_option
@scheme_options
def render(
    model_file: Path,
    device: str,
    wait_ms: float | None,
    record: Path | None,
    force: bool,
    accept_model: bool,
    as_json: bool,
    **options: Any,
) -> None:
    """Render a model live on a device, tick by tick.

    The loop is that of palpate-control, with real-time priority where the system allows it. A real device
    requires a plan with a certificate for it. A plan of palpate plan --on-device is rendered by the USB
    device that contains it; this program then watches and records. Ctrl-C stops the loop: it sends zero
    force, closes the device and the recording, and prints the summary.
    """
    require_writable(recording=record, force=force, inputs=(model_file,))
    if Path(device).suffix == ".toml" or device in example_profiles():
        raise InputError(
            f"--device {device} is a profile: give it to palpate plan, which writes it into the model file; "
            "here --device names the connection, such as usb"
        )
    model = load_model(model_file).require_use(model_file, accepted=accept_model)
    plan = None if model.plan is None else Plan.of(model)
    units = (model.units["position"], model.units["force"])
    nothing_moves = ", which is simulated: nothing moves" if device == "simulated" else ""
    talk(f"read {model_file}: {sized(model)}; rendering on {device}{nothing_moves}")
    with live_line(options["rate_hz"] or _LOOP.rate_hz, units) as line:
        summary = render_live(
            model,
            None if plan is None else plan.scheme,
            limited=None if plan is None else plan.limited,
            certificate=None if plan is None else plan.certificate,
            position_unit=units[0],
            force_unit=units[1],
            model_name=str(model_file),
            findings=list(model.verdict.reasons),
            progress=line.show,
            device=device,
            wait_s=None if wait_ms is None else 1e-3 * wait_ms,
            record="" if record is None else str(record),
            force=force,
            **options,
        )
    lines = summary.pop("lines")
    for note in summary["notes"]:
        talk(f"  {note}")
    verdict = session_verdict(summary)
    if as_json:
        print_json(summary)
    else:
        print_verdict(verdict)
        print_numbers(dict(lines))
    end_with(verdict)

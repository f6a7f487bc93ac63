# SPDX-License-Identifier: Apache-2.0
"""palpate record: records a real object."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from ..devices import record as record_object
from ..errors import InputError
from ..model import load_model
from .exit_status import end_with
from .live import device_options, live_line, session_verdict
from .printing import number, print_json, print_numbers, print_verdict, talk
from .verb import PATH, json_option, require_writable, verb


@verb("palpate record press.csv --device simulated --object press.json --probe", ends_at_once=False)
@click.argument("recording", metavar="OUT.csv", type=PATH)
@device_options
@click.option("--force", is_flag=True, help="Replace an existing recording.")
@click.option("--rate-hz", type=float, default=1000.0, help="Sampling rate [Hz].")
@click.option("--duration-s", type=float, default=10.0, help="Duration [s]; inf: until Ctrl-C.")
@click.option("--probe", is_flag=True, help="The device moves the handle slowly forward and back.")
@click.option(
    "--device-renders",
    is_flag=True,
    help="The USB device renders the model of its firmware; the recorded force is that of the motor.",
)
@click.option("--lower", type=float, help="Least position of the probe's motion, in the device's unit.")
@click.option("--upper", type=float, help="Largest position of the probe's motion.")
@click.option(
    "--speed",
    type=float,
    show_default="0.2 rad/s, scaled",
    help="Speed at which the device moves the handle in a probe, in rad/s or m/s.",
)
@click.option(
    "--stiffness",
    type=float,
    show_default="50 N*m/rad, scaled",
    help="Stiffness of the virtual spring that moves the handle.",
)
@click.option(
    "--force-limit",
    type=float,
    show_default="the device's",
    help="Force at which the probe's motion reverses.",
)
@click.option(
    "--lowest-rate-share",
    type=click.FloatRange(0, 1),
    show_default="the loop's",
    help="A rate below this share of --rate-hz for half a second ends a probe; 0: never.",
)
@json_option
def record(
    recording: Path,
    force: bool,
    device: str,
    object_file: Path | None,
    wait_ms: float | None,
    transducer: bool,
    rate_hz: float,
    duration_s: float,
    probe: bool,
    device_renders: bool,
    lowest_rate_share: float | None,
    as_json: bool,
    **sweep: Any,
) -> None:
    """Record position and force of a real object.

    You move the free handle. With --probe the device moves it, and reverses where the object holds the force
    limit. The force is that of the transducer; without one it is the motor's force, which includes the
    friction of the device. Ctrl-C ends the recording and keeps it.
    """
    require_writable(recording=recording, force=force, inputs=(object_file,))
    if device == "simulated" and object_file is None:
        raise InputError("the simulated device has no object; add --object MODEL.json, a model of one")
    given = [name for name, value in sweep.items() if value is not None]
    if given and not probe:
        raise InputError(f"--{given[0].replace('_', '-')} needs --probe")
    mounted = None if object_file is None else load_model(object_file)
    units = ("rad", "Nm") if mounted is None else (mounted.units["position"], mounted.units["force"])
    motion = "the device moves the handle" if probe else "move the handle over the whole object, slowly"
    talk(f"{device}: recording to {recording} for {number(duration_s)} s; {motion}; Ctrl-C ends it")
    with live_line(rate_hz, units) as line:
        summary = record_object(
            recording,
            force=force,
            device=device,
            object=mounted,
            transducer=transducer,
            probe=probe,
            device_renders=device_renders,
            duration_s=duration_s,
            rate_hz=rate_hz,
            wait_s=None if wait_ms is None else 1e-3 * wait_ms,
            lowest_rate_share=lowest_rate_share,
            progress=line.show,
            **sweep,
        )
    for note in summary["notes"]:
        talk(f"  {note}")
    verdict = session_verdict(summary)
    if as_json:
        print_json(summary)
        end_with(verdict)
        return
    print_verdict(verdict)
    reached = {
        name: f"{number(summary[f'{name}_range'][0])} to {number(summary[f'{name}_range'][1])} {unit}"
        for name, unit in zip(("position", "force"), units, strict=True)
    }
    print_numbers(
        {
            "ended": summary["ended"],
            "recorded": f"{summary['record']}: {summary['recorded']} rows, {summary['lost_records']} lost",
            **reached,
            "rate": f"{number(summary['rate_hz'])} Hz of {number(rate_hz)} Hz, "
            f"{summary['lost_samples']} samples lost, {summary['repeated_samples']} repeated",
        }
    )
    end_with(verdict)

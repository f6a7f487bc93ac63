# SPDX-License-Identifier: Apache-2.0
"""palpate check-device: measures a device for ten seconds and prints a verdict for a bug report."""

from __future__ import annotations

import os
import platform
import sys
from pathlib import Path

import click

from .._core import __version__
from ..devices import check_device as check
from ..errors import InputError
from ..model import load_model
from ..planning import DeviceProfile
from ..verdict import Verdict, no
from .exit_status import end_with
from .live import device_options, live_line
from .printing import number, print_details, print_json, print_numbers, print_verdict, talk
from .verb import PATH, json_option, require_writable, verb, verbose_option

_MARKS = {True: "ok", False: "WRONG", None: "-"}


@verb("palpate check-device --device usb --push", ends_at_once=False, no_args_is_help=False)
@device_options
@click.option("--rate-hz", type=float, default=1000.0, help="Sampling rate [Hz].")
@click.option("--duration-s", type=float, default=10.0, help="Total duration [s].")
@click.option(
    "--push",
    is_flag=True,
    help="Let the device push the handle a little, to measure sign, delay and mechanics.",
)
@click.option("--profile", type=PATH, metavar="DEVICE.toml", help="Profile to compare with the device.")
@click.option(
    "--model",
    "model_file",
    type=PATH,
    metavar="MODEL.json",
    help="Model whose certificate is compared with the device.",
)
@click.option(
    "--write-profile",
    type=PATH,
    metavar="OUT.toml",
    help="Write the measured profile; needs --push.",
)
@click.option(
    "--coulomb-friction",
    type=float,
    metavar="F",
    help="Friction of the device in N or N*m, if the pushes cannot show it; not above the true friction.",
)
@click.option("--yes", is_flag=True, help="Push the handle without a question on the terminal.")
@json_option
@verbose_option
def check_device(
    device: str,
    object_file: Path | None,
    wait_ms: float | None,
    transducer: bool,
    rate_hz: float,
    duration_s: float,
    push: bool,
    profile: Path | None,
    model_file: Path | None,
    write_profile: Path | None,
    coulomb_friction: float | None,
    yes: bool,
    as_json: bool,
    verbose: bool,
) -> None:
    """Measure a device and judge if it can render force.

    The device stays disabled while its rate, period, lost samples and encoder are measured. Move the handle
    against an object to show the signs of its velocity and transducer. A reversed motor cannot be detected
    while the drive is disabled. Do not render before this check. With the profile of an admittance display,
    a chirp of commands measures delay and lag of its servo. Exit code 1: not suitable.
    """
    if write_profile is not None:
        if not push:
            raise InputError("--write-profile needs --push, because the mechanics are measured in motion")
        require_writable(write_profile, inputs=(object_file, profile, model_file))
    mounted = None if object_file is None else load_model(object_file)
    expected = None if profile is None else DeviceProfile.load(profile)
    certified = None if model_file is None else load_model(model_file)
    if push and not yes and device != "simulated":
        if not sys.stdin.isatty():
            raise InputError("--push moves the handle; without a terminal it needs --yes")
        click.confirm(
            "The device will push the handle a little to both sides. Is the handle free?",
            abort=True,
            err=True,
        )
    talk(f"checking {device} for {number(duration_s)} s; move the handle, and hold it still for a second")
    with live_line(rate_hz, ("rad", "Nm")) as line:
        found = check(
            device,
            object=mounted,
            transducer=transducer,
            rate_hz=rate_hz,
            duration_s=duration_s,
            push=push,
            profile=expected,
            model=certified,
            coulomb_friction=coulomb_friction,
            wait_s=None if wait_ms is None else 1e-3 * wait_ms,
            progress=line.show,
        )
    verdict = found.verdict
    written: Path | None = None
    if write_profile is not None:
        try:
            written = found.profile().save(write_profile, notes=found.profile_notes())
        except InputError as error:
            verdict += Verdict((no(f"{write_profile} is not written: {error}"),))
    if as_json:
        print_json(
            {
                "device": found.device,
                "suitable": found.suitable,
                "verdict": str(verdict),
                "written": None if written is None else str(written),
                "findings": [
                    {"name": each.name, "text": each.text, "right": each.right} for each in found.observations
                ],
                **found.numbers,
            }
        )
    else:
        print_verdict(verdict)
        print_numbers(
            {
                "device": found.device,
                **{
                    each.name: f"{_MARKS[each.right]:5} {each.text}"
                    for each in found.observations
                    if verbose or not each.detail or each.right is False
                },
            }
        )
        if verbose:
            python = f"palpate {__version__}, Python {platform.python_version()}"
            print_details([f"{python}, {platform.platform()}, {os.cpu_count()} cores"])
    if written is not None:
        talk(f"wrote {written}")
    end_with(verdict)

# SPDX-License-Identifier: Apache-2.0
"""palpate devices: which devices there are, and the rule that lets a user at them."""

from __future__ import annotations

from dataclasses import asdict

import click

from ..devices import DeviceError, find_devices, install_rule
from .arguments import json_option
from .ending import WorkError
from .output import number, print_json, talk
from .verb import Verb


@click.command(cls=Verb, epilog="Example: palpate devices")
@click.option(
    "--install-udev-rule",
    is_flag=True,
    help="Let users of this machine at USB devices; needs root, says what it does.",
)
@json_option
def devices(install_udev_rule: bool, as_json: bool) -> None:
    """List haptic devices: what they say of themselves, or why they cannot be used."""
    try:
        if install_udev_rule:
            install_rule(talk)
            return
        found = find_devices()
    except DeviceError as error:
        raise WorkError(str(error)) from None
    if as_json:
        print_json({"devices": [asdict(device) for device in found]})
        return
    for device in found:
        name = " ".join(part for part in (device.product, device.serial) if part) or "without a name"
        click.echo(f"{name} ({device.place})")
        if device.info is None:
            click.echo(f"  {device.problem}")
            continue
        info = device.info
        click.echo(
            f"  --device usb:{device.serial}\n"
            f"  encoder {info.counts_per_rev} counts a turn ({number(info.encoder_step)} rad), "
            f"torque up to {number(info.max_torque)} N*m, {info.rate_hz} Hz, watchdog {info.watchdog_ms} ms\n"
            f"  force transducer: {'yes' if info.transducer else 'no'}; "
            f"velocity: {'measured' if info.measures_velocity else 'not measured'}; "
            f"firmware {info.firmware >> 8}.{info.firmware & 0xFF}, uid {info.uid:016x}"
        )
    if not found:
        click.echo("no haptic USB device is plugged in; --device simulated needs none")

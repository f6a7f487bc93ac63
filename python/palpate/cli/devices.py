# SPDX-License-Identifier: Apache-2.0
"""palpate devices: lists USB devices and wheels, sets up a USB device, and installs the udev rule."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict

import click

from .._core.device import longest_watchdog_ms, shortest_watchdog_ms
from .._core.run import device_help
from ..devices import DeviceError, Found, Wheel, find_devices, find_wheels, install_rule, open_usb
from ..errors import InputError
from ..verdict import GOOD, Verdict, no, usable
from .exit_status import WorkError, end_with
from .printing import number, print_json, print_line, print_verdict, talk
from .verb import json_option, verb


@verb("palpate devices", no_args_is_help=False)
@click.option(
    "--install-udev-rule",
    is_flag=True,
    help="Let users of this machine use USB devices; needs root and reports each step.",
)
@click.option("--device", default="usb", metavar="usb[:SERIAL]", help="The device for the next four options.")
@click.option("--disable", is_flag=True, help="End its force.")
@click.option("--clear", is_flag=True, help="Clear the faults of the device; needed after an emergency stop.")
@click.option("--zero", is_flag=True, help="Make the device's present position 0.")
@click.option(
    "--watchdog-ms",
    type=click.IntRange(shortest_watchdog_ms, longest_watchdog_ms),
    help="Time for which the device holds its force without a new command.",
)
@json_option
def devices(
    install_udev_rule: bool,
    device: str,
    disable: bool,
    clear: bool,
    zero: bool,
    watchdog_ms: int | None,
    as_json: bool,
) -> None:
    """List haptic devices with their identity, or the reason why they cannot be used; or set one up.

    No device moves and no force is enabled. Exit code 1: devices are plugged in, and none can be used.
    """
    try:
        if install_udev_rule:
            install_rule(talk)
            if as_json:
                print_json({"verdict": str(GOOD)})
            else:
                print_verdict(GOOD)
            return
        if disable or clear or zero or watchdog_ms is not None:
            _set_up(device, disable=disable, clear=clear, zero=zero, watchdog_ms=watchdog_ms)
        wheels = find_wheels()
        found = _on_usb(wheels)
    except DeviceError as error:
        raise WorkError(str(error)) from None
    verdict = _verdict(found, wheels)
    if as_json:
        listed = [asdict(wheel) | {"device": wheel.device} for wheel in wheels]
        print_json({"verdict": str(verdict), "devices": [asdict(one) for one in found], "wheels": listed})
        end_with(verdict)
        return
    print_verdict(verdict)
    talk(f"devices of other kinds are not searched; --device is {device_help}")
    for one in found:
        name = " ".join(part for part in (one.product, one.serial) if part) or "without a name"
        print_line(f"{name} ({one.place})")
        if one.info is None:
            print_line(f"  {one.problem}")
            continue
        info = one.info
        print_line(f"  --device usb:{one.serial}")
        print_line(
            f"  encoder {info['counts_per_rev']} counts a turn ({number(info['encoder_step'])} rad), "
            f"torque up to {number(info['max_torque'])} N*m, {info['rate_hz']} Hz, "
            f"watchdog {info['watchdog_ms']} ms"
        )
        print_line(
            f"  force transducer: {'yes' if info['transducer'] else 'no'}; "
            f"velocity: {'measured' if info['measures_velocity'] else 'not measured'}; "
            f"firmware {info['firmware'] >> 8}.{info['firmware'] & 0xFF}, uid {info['uid']:016x}"
        )
        if one.model is not None:
            print_line(
                f"  model on the device: fingerprint {one.model['fingerprint']}, "
                f"certificate {one.model['certificate']}, certified for "
                f"{one.model['rate_hz']} Hz{', rendered now' if one.model['is_rendered'] else ''}"
            )
    for wheel in wheels:
        print_line(f"{wheel.name or 'without a name'} ({wheel.node})")
        print_line(f"  {wheel.problem}" if wheel.problem else f"  --device {wheel.device}")
        print_line(f"  force-feedback wheel; springs: {'yes' if wheel.springs else 'no'}")
    end_with(verdict)


def _on_usb(wheels: Sequence[Wheel]) -> list[Found]:
    """Returns the USB devices; a wheel needs neither pyusb nor libusb."""
    try:
        return find_devices()
    except DeviceError as error:
        if not wheels:
            raise
        talk(str(error))
        return []


def _verdict(found: Sequence[Found], wheels: Sequence[Wheel]) -> Verdict:
    """Returns a verdict: good if all found devices can be used, no if none can; usable if none is found."""
    problems = [f"{one.serial or one.place}: {one.problem}" for one in found if one.info is None]
    problems += [f"{wheel.name or wheel.node}: {wheel.problem}" for wheel in wheels if wheel.problem]
    if not found and not wheels:
        none_found = "no haptic USB device is plugged in; record and render need none with --device simulated"
        return Verdict((usable(none_found),))
    judge = no if len(problems) == len(found) + len(wheels) else usable
    return Verdict(tuple(judge(problem) for problem in problems))


def _set_up(device: str, *, disable: bool, clear: bool, zero: bool, watchdog_ms: int | None) -> None:
    kind, _, serial = device.partition(":")
    if kind != "usb" or device == "usb:":
        raise InputError(f"--device is '{device}', must be usb[:SERIAL]: the simulated one needs no set-up")
    with open_usb(serial) as opened:
        if disable:
            opened.disable()
        if clear:
            opened.clear()
        if zero:
            opened.zero()
        if watchdog_ms is not None:
            opened.set_watchdog(watchdog_ms)
        done = {"disabled": disable, "faults cleared": clear, "zeroed": zero, "watchdog set": watchdog_ms}
        talk(f"{opened.name}: {', '.join(word for word, wanted in done.items() if wanted)}")

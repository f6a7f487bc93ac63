# SPDX-License-Identifier: Apache-2.0
"""Sets up the emulated device through pyusb and libusb, and prints the results as one JSON object.

tests/usb/run_emulated.py -- python tests/usb/set_up_over_pyusb.py
"""

from __future__ import annotations

import json
import os
import socket
import struct
import time
from collections.abc import Callable
from dataclasses import asdict
from typing import Any

import usb.core

from palpate import InputError
from palpate.devices import DeviceError, find_devices, open_usb

STREAM_IN = 0x81


def order(words: str) -> str:
    """Sends an order to the emulator through a socket, not over USB, and returns the answer."""
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as orders:
        orders.bind("")
        orders.sendto(words.encode(), os.environ["PALPATE_EMULATOR"])
        return orders.recv(4096).decode()


def state() -> dict[str, Any]:
    reported: dict[str, Any] = json.loads(order("state"))
    return reported


def refusal(action: Callable[[], Any]) -> str:
    try:
        action()
    except (DeviceError, InputError) as error:
        return str(error)
    return ""


def wait_until(condition: Callable[[], Any]) -> None:
    deadline = time.monotonic() + 10.0
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.005)


def raw() -> usb.core.Device:
    return usb.core.find(idVendor=0x1209, idProduct=0x0001)


def packet() -> tuple[int, int]:
    """Returns count and status of one packet that pyusb reads."""
    device = raw()
    fields = struct.unpack("<BBHIiiiHHHHi", bytes(device.read(STREAM_IN, 64, timeout=1000)))
    usb.util.dispose_resources(device)
    return fields[4], fields[7]


def main() -> dict[str, Any]:
    reported: dict[str, Any] = {"found": [asdict(device) for device in find_devices()]}
    reported["another serial"] = refusal(lambda: open_usb("OTHER"))

    with open_usb() as device:
        reported["name"] = device.name
        reported["watchdog before"] = device.identify()["watchdog_ms"]
        device.set_watchdog(137)
        reported["watchdog after"] = device.identify()["watchdog_ms"]
        reported["watchdog out of range"] = refusal(lambda: device.set_watchdog(1))

        wait_until(lambda: state()["position_rad"] > 0.2)
        reported["count before"] = packet()[0]
        device.zero()
        reported["count after"] = packet()[0]

        device.enable()
        reported["enabled"] = state()["enabled"], packet()[1]
        device.disable()
        reported["disabled"] = state()["enabled"], packet()[1]

        order("fault emergency-stop 1")
        wait_until(lambda: packet()[1] & 64)
        reported["enabled after an emergency stop"] = refusal(device.enable)
        packet()  # the cause of the stop is over in the next frame
        device.clear()
        device.enable()
        reported["enabled after it was cleared"] = state()["enabled"]
        device.disable()

    # The endpoint of the packet stream halts, and each read reports the halt until the host clears it.
    order("fault stall-in 1")
    handle = raw()
    stalls = []
    for _ in range(2):
        try:
            handle.read(STREAM_IN, 64, timeout=200)
        except usb.core.USBError as error:
            stalls.append(error.errno)
    handle.clear_halt(STREAM_IN)
    reported["stalls"] = stalls
    reported["bytes after the stall"] = len(handle.read(STREAM_IN, 64, timeout=1000))
    usb.util.dispose_resources(handle)

    with open_usb() as device:
        order("fault unplug 1")
        wait_until(lambda: raw() is None)
        reported["unplugged"] = refusal(device.identify)
    reported["found without it"] = len(find_devices())
    reported["opened without it"] = refusal(open_usb)
    order("plug")
    wait_until(raw)
    with open_usb() as device:
        reported["found again"] = device.serial
    return reported


if __name__ == "__main__":
    print(json.dumps(main()))

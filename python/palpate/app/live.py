# SPDX-License-Identifier: Apache-2.0
"""Live rendering: the page starts and stops palpate-control, which has loop, guards and device."""

from __future__ import annotations

import json
import shutil
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

from ..devices import DeviceError, find_devices
from ..errors import InputError

PROGRAM = "palpate-control"

TELEMETRY_HZ = 20
"""Rate at which the program sends position and force to the page [Hz]"""

DESERTED_S = 5.0
"""Time without a request after which the device is stopped [s]; an open page sends ten requests a second."""

RUN_S = 600.0
"""Longest duration of a run, so that it also ends if this program is killed [s]"""

STOP_S = 10.0
"""Longest time that the program may need to send zero force and close the device [s]"""


def program() -> str:
    """Returns the file of palpate-control: in the folder of this Python, else on the path.

    Raises
    ------
    InputError
        It is not installed.
    """
    found = shutil.which(PROGRAM, path=str(Path(sys.executable).parent)) or shutil.which(PROGRAM)
    if found is None:
        raise InputError(
            f"{PROGRAM} is not installed, so no device can be started: install palpate with CLI11, or run "
            "make control"
        )
    return found


def connections() -> list[str]:
    """Returns the devices that palpate-control can open: a simulated one, those on USB, an Inverse3."""
    try:
        usb = [f"usb:{each.serial}" for each in find_devices()]
    except (DeviceError, InputError):  # without pyusb, libusb or the right to look
        usb = ["usb"]
    return ["simulated", *usb, "inverse3"]


class Live:
    """The program that renders, if it runs. Only one runs at a time."""

    def __init__(self) -> None:
        self.ended = ""
        """Last line of a program that has ended, as a sentence for the page"""
        self.endings = 0
        """Number of runs that have ended; a short one begins and ends between two requests of the page"""
        self._process: subprocess.Popen[str] | None = None
        self._socket: socket.socket | None = None
        self._seen_s = 0.0
        self._latest: dict[str, Any] = {}
        self._lock = threading.Lock()

    @property
    def is_running(self) -> bool:
        """True from the start of the program until its ending is known."""
        return self._process is not None and not self.ended

    def start(self, command: Sequence[str]) -> None:
        """Starts the program with this command line; its telemetry is added.

        Raises
        ------
        InputError
            It already runs, or it is not installed.
        """
        with self._lock:
            if self.is_running:
                raise InputError("a device is running: stop it first")
            file = program()
            listening = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
            listening.bind(("127.0.0.1", 0))
            listening.setblocking(False)
            port = listening.getsockname()[1]
            telemetry = ["--telemetry-port", str(port), "--telemetry-hz", str(TELEMETRY_HZ)]
            self._process = subprocess.Popen(
                [file, *command[1:], *telemetry],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT,
                text=True,
                start_new_session=True,  # Ctrl-C in the terminal must not reach it before it is stopped here
            )
            self._socket, self._latest, self.ended, self._seen_s = listening, {}, "", time.monotonic()
            threading.Thread(target=self._watch, args=(self._process, listening), daemon=True).start()

    def stop(self) -> None:
        """Makes the program send zero force and close the device, and waits until it has ended.

        Raises
        ------
        InputError
            It does not end.
        """
        process = self._process
        if process is None or process.poll() is not None:
            return
        process.send_signal(signal.SIGINT)
        try:
            process.wait(STOP_S)
        except subprocess.TimeoutExpired:
            raise InputError(
                f"{PROGRAM} has not ended {STOP_S:g} s after Stop: switch the device off"
            ) from None

    def latest(self) -> dict[str, Any]:
        """Returns the newest tick that the program sent; empty before the first one. Counts as a request."""
        self._seen_s = time.monotonic()
        try:
            while self._socket is not None:
                self._latest = json.loads(self._socket.recv(65536))
        except (OSError, ValueError):  # no further tick yet
            pass
        return self._latest

    def _watch(self, process: subprocess.Popen[str], listening: socket.socket) -> None:
        """Stops the program when no page is open, and keeps what it printed last."""
        while process.poll() is None:
            if time.monotonic() - self._seen_s > DESERTED_S:
                with suppress(InputError):  # the page is closed, so no user reads the message
                    self.stop()
            time.sleep(0.1)
        output, _ = process.communicate()
        lines = [" ".join(line.split()) for line in output.splitlines()]
        ending = [line.removeprefix("ended ") for line in lines if line.startswith(("ended ", "error: "))]
        self._socket = None
        listening.close()
        self.ended = (ending or lines or ["the program has ended"])[0]
        self.endings += 1

# SPDX-License-Identifier: Apache-2.0
"""Commands that run with the emulated USB device."""

from __future__ import annotations

import csv
import shutil
import subprocess
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from conftest import ROOT
from run_emulated import emulator

RUNNER = ROOT / "tests" / "usb" / "run_emulated.py"

MISSING = next(
    (
        f"needs {package}"
        for tool, package in {"umockdev-run": "umockdev"}.items()
        if shutil.which(tool) is None
    ),
    "needs libumockdev-dev" if not Path("/usr/include/umockdev-1.0/umockdev.h").exists() else "",
)
needs_emulation = pytest.mark.skipif(bool(MISSING), reason=MISSING or "emulation available")


def emulated(*command: Any, device: Sequence[str] = ()) -> subprocess.CompletedProcess[str]:
    """Runs a command with the emulated USB device; `device` are options of tests/usb/run_emulated.py.

    The clock of the command shows the time of the device, so a busy machine has no effect.
    """
    words = [emulator(), "--lock-step", *device, "--", *command]
    return subprocess.run(list(map(str, words)), capture_output=True, text=True, check=False)


@dataclass
class Frame:
    """True state of the emulated device in one millisecond."""

    started: int
    """Number of frames (milliseconds) since the first command"""
    sequence: int
    """Sequence number of the sample that the device sent, modulo 65536"""
    position: float
    torque: float
    status: int
    unplugged: bool

    @property
    def enabled(self) -> bool:
        return bool(self.status & 1)


def frames(trace: Path) -> list[Frame]:
    with trace.open(encoding="utf-8") as file:
        return [
            Frame(
                int(row["started"]),
                int(row["sequence"]),
                float(row["position_rad"]),
                float(row["torque_Nm"]),
                int(row["status"]),
                row["unplugged"] == "1",
            )
            for row in csv.DictReader(file)
        ]

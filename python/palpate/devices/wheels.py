# SPDX-License-Identifier: Apache-2.0
"""Force-feedback wheels at the hidraw nodes of Linux, found without opening a node."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

from .._core.device import wheel_has_springs
from .._core.run import transports
from ..errors import escaped


@dataclass(frozen=True)
class Wheel:
    """Force-feedback wheel that the adapter accepts: its node, or the reason why it cannot be opened."""

    node: str
    name: str
    springs: bool
    """True if the wheel has springs, so that it can hold a line"""
    problem: str = ""

    @property
    def device(self) -> str:
        """Name of the device for `--device`; a wheel does not report the numbers in capital letters."""
        form: str = next(form for name, form, _ in transports if name == "wheel")
        return form.replace("NODE", self.node).replace("" if self.springs else "[:STIFFNESS]", "")


def find_wheels(classes: Path = Path("/sys/class/hidraw"), nodes: Path = Path("/dev")) -> list[Wheel]:
    """Finds the wheels whose report descriptor has all reports that the adapter needs.

    Parameters
    ----------
    classes, nodes : Path
        Folders in which Linux lists the hidraw devices and their nodes. Other systems have none.
    """
    found = []
    for entry in sorted(classes.glob("hidraw*"), key=lambda entry: (len(entry.name), entry.name)):
        try:
            springs = wheel_has_springs((entry / "device" / "report_descriptor").read_bytes())
            words = (entry / "device" / "uevent").read_text(encoding="utf-8", errors="replace").splitlines()
        except OSError:
            continue  # unplugged
        if springs is None:
            continue
        node = nodes / entry.name
        names = [line.removeprefix("HID_NAME=") for line in words if line.startswith("HID_NAME=")]
        cure = f'{node} cannot be opened: allow your user with a udev rule for SUBSYSTEM=="hidraw"'
        problem = "" if os.access(node, os.R_OK | os.W_OK) else cure
        found.append(Wheel(str(node), escaped(" ".join(names)), springs, problem))
    return found

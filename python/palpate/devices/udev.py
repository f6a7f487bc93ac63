# SPDX-License-Identifier: Apache-2.0
"""Installs the udev rule with which users other than root can use a device."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from importlib.resources import files
from pathlib import Path

from ..recording.files import replacing
from .usb import DeviceError

RULE = "60-palpate.rules"
FOLDER = Path("/etc/udev/rules.d")

_RELOAD = (("udevadm", "control", "--reload-rules"), ("udevadm", "trigger", "--subsystem-match=usb"))


def install_rule(tell: Callable[[str], None], *, folder: Path = FOLDER) -> None:
    """Writes the rule and makes udev read it.

    Parameters
    ----------
    tell : callable
        Called with a sentence for each step.
    folder : Path
        Folder of the rules of this machine.

    Raises
    ------
    DeviceError
        Without root, or if the system refuses; the message states the cure.
    """
    target = folder / RULE
    if not folder.is_dir():
        raise DeviceError(
            f"this machine has no folder {folder}: udev, which gives users their rights, is not here"
        )
    if not os.access(folder, os.W_OK):
        again = f"sudo {sys.executable} -m palpate devices --install-udev-rule"
        raise DeviceError(f"writing {target} needs root; run: {again}")
    text = files(__package__).joinpath(RULE).read_text(encoding="utf-8")
    with replacing(target) as temporary:
        temporary.write_text(text, encoding="utf-8")
    tell(f"wrote {target}:")
    tell(text.splitlines()[-1])
    for command in _RELOAD:
        if shutil.which(command[0]) is None:
            tell(f"there is no {command[0]} here: plug the device in again, or restart the machine")
            return
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        if done.returncode != 0:
            tell(f"{' '.join(command)}: {done.stderr.strip() or 'failed'}; restart the machine instead")
            return
        tell(f"ran {' '.join(command)}")
    tell("plug the device in again")

#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Runs a command with the emulated USB device.

    tests/usb/run_emulated.py [OPTIONS] -- COMMAND...

CMake builds the emulator with the C++ tests (preset dev); otherwise this script builds it. By default the
clock paces the frames; with `--lock-step` the transfers of the host pace them. `--help` lists all options.
The exit code is that of the command, or 77 if a package is missing.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
MISSING_PACKAGE_EXIT = 77
BUILDS = ("dev", "release", "asan", "tsan", "control")
SOURCES = ROOT / "tests" / "usb"


def emulator() -> Path | str:
    """Returns the path of the emulator, built if necessary, or the reason why it cannot be built."""
    given = os.environ.get("PALPATE_USB_EMULATOR")
    if given:
        return Path(given)
    newest = max(path.stat().st_mtime for path in SOURCES.glob("*.?pp"))
    programs = [ROOT / "build" / build / "tests" / "usb" / "umockdev_emulator" for build in BUILDS]
    programs.append(ROOT / "build" / "umockdev_emulator")
    for program in programs:
        if program.exists() and program.stat().st_mtime >= newest:
            return program
    if shutil.which("pkg-config") is None:
        return "needs pkg-config"
    compiler_flags = subprocess.run(
        ["pkg-config", "--cflags", "--libs", "umockdev-1.0"], capture_output=True, text=True, check=False
    )
    if compiler_flags.returncode:
        return "needs umockdev (Debian: umockdev libumockdev-dev)"
    program = programs[-1]
    program.parent.mkdir(exist_ok=True)
    temporary = program.with_suffix(f".{os.getpid()}")
    compiler = os.environ.get("CXX", "g++")
    command = [compiler, "-std=c++20", "-O1", str(SOURCES / "umockdev_emulator.cpp"), "-o", str(temporary)]
    subprocess.run([*command, *compiler_flags.stdout.split(), "-lpthread"], check=True)
    temporary.rename(program)
    return program


if __name__ == "__main__":
    found = emulator()
    if isinstance(found, str):
        print(f"skipped: {found}", file=sys.stderr)
        sys.exit(MISSING_PACKAGE_EXIT)
    # This process becomes the emulator, which forwards signals to the command
    os.execv(found, [str(found), *sys.argv[1:]])

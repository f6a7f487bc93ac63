#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Runs a command with the emulated USB device.

    tests/usb/run_emulated.py [OPTIONS] -- COMMAND...

CMake builds the emulator with the C++ tests (preset dev); otherwise this script builds it. By default frames
begin in real time. With `--lock-step` the clock of the command shows the time of the device, so every result
is the same on a computer of any speed. `--help` lists all options. The exit code is that of the command, or
77 if a package is missing.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests" / "clock"))

from host_clock import host_clock  # noqa: E402

MISSING_PACKAGE_EXIT = 77
BUILDS = ("dev", "release", "asan", "tsan", "control")
SOURCES = ROOT / "tests" / "usb"
FIRMWARE = ROOT / "cpp" / "firmware"
C_FOLDERS = ["-I", str(FIRMWARE), "-I", str(ROOT / "tests" / "firmware")]


def emulator() -> Path | str:
    """Returns the path of the emulator, built if necessary, or the reason why it cannot be built."""
    given = os.environ.get("PALPATE_USB_EMULATOR")
    if given:
        return Path(given)
    sources = [*SOURCES.glob("*.?pp"), *FIRMWARE.glob("*.[ch]")]
    newest = max(path.stat().st_mtime for path in sources)
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
    clock = f'-DPALPATE_HOST_CLOCK_FOLDER="{host_clock().parent}"'
    build_emulator("umockdev_emulator.cpp", temporary, clock, *compiler_flags.stdout.split())
    temporary.rename(program)
    return program


def build_emulator(source: str, program: Path, *flags: str) -> None:
    """Compiles a program of this folder with the device side in C."""
    objects = [f"{program}.{name}.o" for name in ("device", "locks")]
    files = [FIRMWARE / "palpate_device.c", SOURCES / "no_locks.c"]
    for file, made in zip(files, objects, strict=True):
        compiler = os.environ.get("CC", "cc")
        subprocess.run([compiler, "-std=c99", "-O1", *C_FOLDERS, "-c", str(file), "-o", made], check=True)
    command = [os.environ.get("CXX", "g++"), "-std=c++20", "-O1", *C_FOLDERS, str(SOURCES / source), *objects]
    subprocess.run([*command, "-o", str(program), *flags, "-lpthread"], check=True)
    for made in objects:
        Path(made).unlink()


if __name__ == "__main__":
    found = emulator()
    if isinstance(found, str):
        print(f"skipped: {found}", file=sys.stderr)
        sys.exit(MISSING_PACKAGE_EXIT)
    # This process becomes the emulator, which forwards signals to the command
    os.execv(found, [str(found), *sys.argv[1:]])

# SPDX-License-Identifier: Apache-2.0
"""Compiles C programs for this computer and for Cortex-M, runs them, and counts instructions in QEMU."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

FOLDER = Path(__file__).parent

WARNINGS = ("-Wall", "-Wextra", "-Wconversion", "-Wpedantic", "-Werror")

BOARDS = {"cortex-m4": "mps2-an386", "cortex-m7": "mps2-an500"}
"""Processor -> board of QEMU."""

_FPU = {"cortex-m4": "fpv4-sp-d16", "cortex-m7": "fpv5-d16"}

NEEDED = ("arm-none-eabi-gcc", "qemu-system-arm", "gcc")
"""Programs without which nothing runs on a Cortex-M."""


def missing() -> list[str]:
    """Returns the missing programs; Debian: gcc-arm-none-eabi, libnewlib-arm-none-eabi, qemu-system-arm."""
    return [name for name in NEEDED if shutil.which(name) is None]


class Count(NamedTuple):
    """Instructions of the calls of one function."""

    calls: int
    fewest: int
    most: int


def _run(command: Sequence[str]) -> subprocess.CompletedProcess[str]:
    done = subprocess.run(command, capture_output=True, text=True, timeout=300, check=False)
    if done.returncode != 0:
        raise RuntimeError(f"{' '.join(command)}\n{done.stdout}{done.stderr}")
    return done


def run_here(
    source: Path, folder: Path, flags: Sequence[str], *, compiler: str = "gcc", standard: str = "c99"
) -> str:
    """Compiles a program for this computer without warnings, runs it and returns its output."""
    program = folder / f"{source.stem}-{compiler}"
    language = ("-x", "c++") if standard.startswith("c++") else ()
    flags = [f"-std={standard}", "-O2", "-ffp-contract=off", *WARNINGS, f"-I{folder}", f"-I{FOLDER}", *flags]
    _run([compiler, *flags, *language, str(source), "-o", str(program)])
    return _run([str(program)]).stdout


def compile_arm(
    source: Path, folder: Path, flags: Sequence[str], *, processor: str = "cortex-m4", compiler: str = "gcc"
) -> Path:
    """Compiles a program for a Cortex-M and returns its file."""
    program = folder / f"{source.stem}-{processor}-{compiler}.elf"
    target = [f"-mcpu={processor}", f"-mfpu={_FPU[processor]}", "-mfloat-abi=hard", "-mthumb"]
    common = [
        "-std=c99",
        "-O2",
        "-ffp-contract=off",
        "-ffunction-sections",
        f"-I{folder}",
        f"-I{FOLDER}",
        *flags,
    ]
    linked = ["-nostartfiles", "-Wl,--gc-sections", "-T", str(FOLDER / "mps2.ld"), "-o", str(program)]
    libraries = ["-lm", "-lc", "-lgcc"]
    if compiler == "gcc":
        _run(["arm-none-eabi-gcc", *target, *common, str(source), *linked, *libraries])
        return program
    part = program.with_suffix(".o")
    headers = ["--target=arm-none-eabi", "-isystem", "/usr/include/newlib"]
    _run(["clang", *headers, *target, *common, "-c", str(source), "-o", str(part)])
    _run(["arm-none-eabi-gcc", *target, str(part), *linked, *libraries])
    return program


def plugin(folder: Path) -> Path:
    """Compiles the plugin that counts instructions and returns its file."""
    library = folder / "count_instructions.so"
    if not library.exists():
        source = FOLDER / "count_instructions.c"
        _run(["gcc", "-O2", "-shared", "-fPIC", "-fvisibility=hidden", str(source), "-o", str(library)])
    return library


def run_arm(
    program: Path, *, processor: str = "cortex-m4", counted_in: Path | None = None
) -> tuple[str, dict[str, Count]]:
    """Runs a program on a Cortex-M of QEMU; returns its output, and counts if the plugin has a folder."""
    command = ["qemu-system-arm", "-M", BOARDS[processor], "-display", "none", "-monitor", "none"]
    command += ["-serial", "none", "-semihosting-config", "enable=on,target=native", "-kernel", str(program)]
    if counted_in is not None:
        command += ["-plugin", str(plugin(counted_in))]
    lines = _run(command).stderr.splitlines()
    counts = {}
    for line in lines:
        if line.startswith("count measure_"):
            name, *numbers = line.split()[1:]
            counts[name.removeprefix("measure_")] = Count(*map(int, numbers))
    return "\n".join(line for line in lines if not line.startswith("count ")), counts


def code_bytes(program: Path, function: str) -> int:
    """Returns the size of a function in a program [bytes]."""
    for line in _run(["arm-none-eabi-nm", "-S", str(program)]).stdout.splitlines():
        words = line.split()
        if len(words) == 4 and words[3] == function:
            return int(words[1], 16)
    return 0

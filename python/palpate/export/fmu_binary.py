# SPDX-License-Identifier: Apache-2.0
"""Compiles the C sources of an FMU for this machine, and compares the binary with the model."""

from __future__ import annotations

import ctypes
import os
import platform
import shutil
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from .._typing import Float1D
from ..errors import InputError
from ..model import Model
from ..verdict import Finding, no

LARGEST_FORCE_ERROR = 1e-9
"""Largest accepted difference of the force of binary and model, divided by the largest force."""

LARGEST_SLOPE_ERROR = 1e-6
"""Largest accepted difference of the derivative, divided by the largest slope."""

POSITIONS = 1001
"""Positions at which binary and model are compared, on the way through the domain and on the way back."""

TIME, POSITION, FORCE, SLOPE, ENERGY = range(5)
"""Value references of the variables, as in fmu.c."""

_FLAGS = ("-std=c99", "-O2", "-ffp-contract=off", "-shared", "-fPIC", "-fvisibility=hidden")


def platform_of_binary() -> str:
    """Returns the folder of the binary in an FMU, such as x86_64-linux."""
    machine = platform.machine().lower()
    known = {"amd64": "x86_64", "arm64": "aarch64"}
    return f"{known.get(machine, machine)}-{sys.platform}"


def compile_sources(source: Path, binary: Path) -> None:
    """Compiles a C source file to a shared library.

    Raises
    ------
    InputError
        There is no C compiler, or it fails; the message contains its first line.
    """
    named = os.environ.get("CC", "cc")
    command = shutil.which(named) or shutil.which("gcc") or shutil.which("clang")
    if command is None:
        raise InputError(f"an FMU needs a C compiler, and {named} was not found: apt install gcc, or set CC")
    done = subprocess.run(
        [command, *_FLAGS, source.name, "-o", str(binary)],
        cwd=source.parent,
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode != 0:
        reason = (done.stderr.strip().splitlines() or [f"exit code {done.returncode}"])[0]
        raise InputError(f"the C compiler {command} refused the sources of the FMU: {reason}")


@dataclass(frozen=True)
class BinaryErrors:
    """Largest differences between binary and model, divided by the largest force and slope of the model."""

    force: float
    slope: float

    def findings(self) -> Iterator[Finding]:
        """Yields a sentence for each difference that is too large."""
        for name, error, largest in (
            ("force", self.force, LARGEST_FORCE_ERROR),
            ("derivative", self.slope, LARGEST_SLOPE_ERROR),
        ):
            if not error <= largest:
                yield no(
                    f"the {name} of the compiled FMU differs from the model by {error:.2g} of its largest "
                    f"value, must be at most {largest:g}; nothing was written. Please report this with the "
                    "model file"
                )


def errors_of_binary(binary: Path, token: str, model: Model) -> BinaryErrors:
    """Loads a binary and moves it through the domain and back; returns its differences to the model."""
    lower, upper = float(model.lower[0]), float(model.upper[0])
    there = np.linspace(lower, upper, POSITIONS)
    positions = np.concatenate([there, there[::-1]])
    force, slope = _simulated(binary, token, positions)
    # Force and slope at a position are those of a motion from the last one, where the play operator was.
    play = None
    if model.play_radius is not None:
        play = model.play(np.concatenate([positions[:1], positions[:-1]]))
    expected = np.asarray(model.force(positions, play=play))
    stiffness = np.asarray(model.slope(positions, play=play))
    return BinaryErrors(
        float(np.max(np.abs(force - expected)) / np.max(np.abs(expected))),
        float(np.max(np.abs(slope - stiffness)) / np.max(np.abs(stiffness))),
    )


def _simulated(binary: Path, token: str, positions: Float1D) -> tuple[Float1D, Float1D]:
    """Returns force and directional derivative of a binary (n,) at positions (n,), a step after each."""
    library = ctypes.CDLL(str(binary))
    double, size, boolean = ctypes.c_double, ctypes.c_size_t, ctypes.c_bool
    library.fmi3InstantiateCoSimulation.restype = ctypes.c_void_p
    instance = ctypes.c_void_p(
        library.fmi3InstantiateCoSimulation(
            b"check", token.encode(), None, False, False, False, False, None, size(0), None, None, None
        )
    )
    position, force = (ctypes.c_uint32 * 1)(POSITION), (ctypes.c_uint32 * 1)(FORCE)
    value, seed, flag, time = (double * 1)(), (double * 1)(1.0), boolean(), double()
    one = size(1)
    found = np.empty((2, len(positions)))

    def require(status: int) -> None:
        if status != 0:
            raise RuntimeError(f"a function of the FMU returned the status {status}")

    def set_position(x: float) -> None:
        require(library.fmi3SetFloat64(instance, position, one, (double * 1)(x), one))

    require(library.fmi3EnterInitializationMode(instance, False, double(0), double(0), False, double(0)))
    set_position(float(positions[0]))
    require(library.fmi3ExitInitializationMode(instance))
    flags = [ctypes.byref(flag)] * 3
    for k, x in enumerate(positions):
        set_position(float(x))
        require(library.fmi3GetFloat64(instance, force, one, value, one))
        found[0, k] = value[0]
        derivative = (instance, force, one, position, one, seed, one, value, one)
        require(library.fmi3GetDirectionalDerivative(*derivative))
        found[1, k] = value[0]
        require(library.fmi3DoStep(instance, double(k), double(1), True, *flags, ctypes.byref(time)))
    library.fmi3FreeInstance(instance)
    return found[0], found[1]

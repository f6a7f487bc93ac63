# SPDX-License-Identifier: Apache-2.0
"""Virtual time for a program under test: a library that replaces its clock (host_clock.cpp)."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
SOURCE = Path(__file__).with_name("host_clock.cpp")
BUILDS = ("dev", "release", "asan", "tsan")


def host_clock() -> Path:
    """Returns the path of the library. CMake builds it with the C++ tests; otherwise this function does."""
    libraries = [ROOT / "build" / build / "tests" / "clock" / "libhost_clock.so" for build in BUILDS]
    libraries.append(ROOT / "build" / "libhost_clock.so")
    newest = SOURCE.stat().st_mtime
    for library in libraries:
        if library.exists() and library.stat().st_mtime >= newest:
            return library
    library = libraries[-1]
    library.parent.mkdir(exist_ok=True)
    temporary = library.with_suffix(f".{os.getpid()}")
    compiler = [os.environ.get("CXX", "g++"), "-std=c++20", "-O1", "-shared", "-fPIC"]
    subprocess.run([*compiler, str(SOURCE), "-o", str(temporary)], check=True)
    temporary.rename(library)
    return library

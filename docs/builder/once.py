# SPDX-License-Identifier: Apache-2.0
"""Keeps results of code that takes long, so that the tests and the build of the site run it once.

A kept result is used until the code, a program of the project or an installed package changes.
"""

from __future__ import annotations

import hashlib
import json
import os
import sys
from collections.abc import Callable, Iterator
from functools import cache
from importlib.metadata import distributions
from pathlib import Path
from typing import Any

import palpate._core

ROOT = Path(__file__).parents[2]
SOURCES = (
    "python/palpate",
    "cpp",
    "examples",
    "bench",
    "docs/builder",
    "tests/usb",
    "build/control/palpate-control",
)
"""Folders and files of the repository that the code of the site uses"""


def kept(file: Path, code: str, run: Callable[[], Any]) -> Any:
    """Returns the result of `run` for `code` from `file`, or runs it and writes the result to `file`.

    Parameters
    ----------
    file : Path
        JSON file of the result.
    code : str
        Text whose change makes the result invalid.
    run : callable
        Returns a result that JSON can store.
    """
    valid_for = hashlib.sha256(f"{programs()}\n{code}".encode()).hexdigest()
    if file.is_file():
        stored = json.loads(file.read_text(encoding="utf-8"))
        if stored["valid_for"] == valid_for:
            return stored["result"]
    result = run()
    file.parent.mkdir(parents=True, exist_ok=True)
    temporary = file.with_suffix(f".{os.getpid()}")
    temporary.write_text(json.dumps({"valid_for": valid_for, "result": result}), encoding="utf-8")
    temporary.replace(file)
    return result


@cache
def programs() -> str:
    """Returns a digest of the sources, the compiled module, and the names and versions of all packages."""
    digest = hashlib.sha256(sys.version.encode())
    for name in sorted(f"{each.name} {each.version}" for each in distributions()):
        digest.update(name.encode())
    for file in files():
        digest.update(f"{file} {file.stat().st_size}".encode())
        digest.update(file.read_bytes())
    return digest.hexdigest()


def files() -> Iterator[Path]:
    """Yields the files that the code of the site uses."""
    yield Path(palpate._core.__file__)
    for name in SOURCES:
        source = ROOT / name
        files = [source] if source.is_file() else sorted(source.rglob("*"))
        yield from (each for each in files if each.is_file() and "__pycache__" not in each.parts)

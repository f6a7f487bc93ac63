# SPDX-License-Identifier: Apache-2.0
"""Workbooks of Excel and LibreOffice: their sheets, read in another process."""

from __future__ import annotations

import marshal
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

from . import files
from .files import TooLargeError, readable, zip_members
from .grid import Grid
from .memory_table import import_library
from .workbook_process import MEMORY_STATUS

SUFFIXES = (".xlsx", ".xlsm", ".xls", ".ods")
"""Endings of the names of workbooks."""

_ZIP_START = b"PK\3\4"
"""First bytes of .xlsx, .xlsm and .ods, which are archives."""

_OLE_START = b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1"
"""First bytes of .xls, and of an encrypted .xlsx."""

_PROGRAM = Path(__file__).with_name("workbook_process.py")

_MEMORY_MESSAGES = ("memory allocation of", "Cell limit exceeded")
"""Parts of the messages of the library on a workbook that needs too much memory."""


def is_workbook(path: Path) -> bool:
    """Returns True for a workbook. Some machines give text files the ending .xls: their content decides."""
    if path.suffix.lower() not in SUFFIXES:
        return False
    if path.suffix.lower() != ".xls":
        return True
    return _starts_with(path, _ZIP_START, _OLE_START)


def _starts_with(path: Path, *starts: bytes) -> bool:
    with path.open("rb") as stream:
        return stream.read(max(map(len, starts))).startswith(starts)


def read_sheets(path: Path) -> list[Grid]:
    """Returns the cells of the sheets of a workbook that hold cells.

    Raises
    ------
    InputError
        The file is not a workbook, needs too much memory, or python-calamine is not installed.
    """
    library = import_library("python_calamine", path, "a workbook", "excel")
    folder = str(Path(library.__file__).parents[1])
    command = [sys.executable, "-I", "-S", str(_PROGRAM), folder, str(path), str(files.MEMORY_LIMIT)]
    with readable(path, "a workbook"):
        if _starts_with(path, _ZIP_START):
            for _ in zip_members(path):  # checks the checksums
                pass
        # A trace of the stack allocates memory: after the limit is reached, the process would wait forever.
        environment = {**os.environ, "RUST_BACKTRACE": "0"}
        done = subprocess.run(command, capture_output=True, check=False, env=environment)
        if done.returncode == 0:
            sheets: list[tuple[str, bool, dict[int, list[Any]]]] = marshal.loads(done.stdout)
            return [Grid(name, rows, visible=visible) for name, visible, rows in sheets if rows]
        message = done.stderr.decode(errors="replace")
        if done.returncode == MEMORY_STATUS or any(each in message for each in _MEMORY_MESSAGES):
            raise TooLargeError(
                f"{path} needs more than {files.MEMORY_LIMIT / 2**30:.3g} GiB of memory: it is damaged, or "
                "it has cells far below or right of the table; delete these cells"
            )
        raise ValueError(message if done.returncode == 1 else "the library that reads it crashed")

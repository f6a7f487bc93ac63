# SPDX-License-Identifier: Apache-2.0
"""Runs command lines, one after the other, without the functions and modules that only Linux has."""

import importlib.abc
import os
import shlex
import sys
from typing import Any

for name in ("O_NOFOLLOW", "O_CLOEXEC", "fchown", "fchmod", "geteuid", "getuid", "sched_getaffinity"):
    if hasattr(os, name):
        delattr(os, name)


class Absent(importlib.abc.MetaPathFinder):
    """Finder that finds no module of Linux."""

    def find_spec(self, name: str, path: Any, target: Any = None) -> None:
        if name in ("resource", "fcntl", "pwd", "palpate._core.run"):
            raise ImportError(name)


sys.meta_path.insert(0, Absent())

from palpate.cli.main import main  # noqa: E402

for line in sys.argv[1:]:
    if code := main(shlex.split(line)):
        sys.exit(f"exit code {code}: {line}")

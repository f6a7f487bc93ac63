# SPDX-License-Identifier: Apache-2.0
"""Runs verbs and palpate-control while a library watches each call that changes a file; see file_faults.c."""

from __future__ import annotations

import json
import os
import re
import shlex
import subprocess
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from types import TracebackType
from typing import Any

ROOT = Path(__file__).parents[2]


def compiled_library(folder: Path) -> Path:
    """Compiles file_faults.c; returns the library."""
    library = folder / "file_faults.so"
    command = [os.environ.get("CC", "cc"), "-shared", "-fPIC", "-O1", "-Wall", "-Wextra", "-Werror"]
    source = ROOT / "tests" / "python" / "file_faults.c"
    subprocess.run([*command, source, "-o", library, "-ldl"], check=True)
    return library


@dataclass(frozen=True)
class Call:
    """A call that changed a file, which is named from the watched folder."""

    name: str
    file: str


@dataclass(frozen=True)
class Ended:
    """Exit code of a program (negative: the signal that ended it), its messages and its calls."""

    code: int
    messages: str
    calls: tuple[Call, ...]


@dataclass(frozen=True)
class Fault:
    """Faults at calls of a program. Calls are counted from 1; 0 means none and -1 means every call."""

    kill_at: int = 0
    fail_at: int = 0
    error: int = 0
    only: str = ""
    """Name of the calls that fail; empty: any"""
    states: Path | None = None
    """Folder for a copy of the watched folder before each call"""
    umask: int = 0o022


@dataclass
class Programs:
    """Starts verbs and palpate-control in a folder and watches their calls.

    Parameters
    ----------
    workplace : Path
        Folder for the library, the messages and the lists of calls.
    """

    workplace: Path
    library: Path = field(init=False)

    def __enter__(self) -> Programs:
        self.library = compiled_library(self.workplace)
        environment = os.environ | {"LD_PRELOAD": str(self.library), "OPENBLAS_NUM_THREADS": "1"}
        self._server = subprocess.Popen(
            [sys.executable, ROOT / "tests" / "python" / "file_faults_server.py"],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, env=environment,
        )  # fmt: skip
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._server.communicate()

    def verb(self, command: str, folder: Path, fault: Fault | None = None) -> Ended:
        """Runs a verb until it ends."""
        return self.verbs([command], folder, fault)[0]

    def verbs(self, commands: Sequence[str], folder: Path, fault: Fault | None = None) -> list[Ended]:
        """Runs several verbs at the same time."""
        requests = [
            self._settings(folder, fault or Fault(), f"{k}") | {"arguments": shlex.split(command)}
            for k, command in enumerate(commands)
        ]
        assert self._server.stdin is not None
        assert self._server.stdout is not None
        self._server.stdin.write(json.dumps(requests) + "\n")
        self._server.stdin.flush()
        codes = json.loads(self._server.stdout.readline())
        return [
            self._ended(code, Path(request["messages"]).read_text(encoding="utf-8"), request)
            for code, request in zip(codes, requests, strict=True)
        ]

    def program(self, command: Sequence[Any], folder: Path, fault: Fault | None = None) -> Ended:
        """Runs another program until it ends."""
        settings = self._settings(folder, fault or Fault(), "program")
        completed = subprocess.run(
            list(map(str, command)),
            cwd=folder, umask=settings["umask"], env=self.environment(settings),
            stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False,
        )  # fmt: skip
        return self._ended(completed.returncode, completed.stdout, settings)

    def environment(self, settings: Mapping[str, Any]) -> dict[str, str]:
        """Returns an environment in which a program loads the library with these settings."""
        named = {f"FILE_FAULTS_{name.upper()}": str(value) for name, value in settings.items()}
        return os.environ | {"LD_PRELOAD": str(self.library)} | named

    def _settings(self, folder: Path, fault: Fault, name: str) -> dict[str, Any]:
        log = self.workplace / f"{name}.calls"
        log.unlink(missing_ok=True)
        if fault.states is not None:
            fault.states.mkdir()
        return {
            "folder": str(folder),
            "log": str(log),
            "messages": str(self.workplace / f"{name}.messages"),
            "states": str(fault.states or ""),
            "only": fault.only,
            "kill_at": fault.kill_at,
            "fail_at": fault.fail_at,
            "error": fault.error,
            "umask": fault.umask,
        }

    def _ended(self, code: int, messages: str, settings: Mapping[str, Any]) -> Ended:
        log = Path(settings["log"])
        lines = log.read_text(encoding="utf-8").splitlines() if log.exists() else []
        calls = tuple(Call(*re.fullmatch(r"(\S+) /?(.*)", line).groups()) for line in lines)  # type: ignore[union-attr]
        return Ended(code, messages, calls)

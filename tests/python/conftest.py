# SPDX-License-Identifier: Apache-2.0
"""Test fixtures: the folder of measured recordings, small recording files, a terminal; samples of cases."""

import ast
import gc
import os
import pty
import signal
import sys
import threading
from collections.abc import Callable, Iterable
from functools import cache
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parents[2]
sys.path[:0] = [str(ROOT / "tests" / "clock"), str(ROOT / "tests" / "usb")]

# A shell that starts the tests in the background makes the tests and their child processes ignore Ctrl-C.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)


def pytest_collection_finish() -> None:
    """Excludes the objects of the imported modules from the searches of the garbage collector."""
    gc.freeze()


def sampled(cases: Iterable[Any], *kept: Any) -> list[Any]:
    """Returns the cases of a parametrized test: `make test` runs those to keep, `make test-full` all."""

    def of_the_full_run(case: Any) -> Any:
        values = case if isinstance(case, tuple) else (case,)
        return pytest.param(*values, marks=pytest.mark.full)

    return [case if case in kept else of_the_full_run(case) for case in cases]


@cache
def nodes_of(path: Path) -> tuple[ast.AST, ...]:
    """Returns all nodes of the syntax tree of a Python file, the module first."""
    return tuple(ast.walk(ast.parse(path.read_text(encoding="utf-8"))))


def measured_data() -> Path | None:
    """Returns the folder of measured recordings, which are not part of the project; None if missing."""
    folder = Path(os.environ.get("PALPATE_DATA", ROOT.parent / "shared" / "data"))
    return folder if folder.is_dir() else None


@pytest.fixture(scope="session")
def data() -> Path:
    """Returns the folder of measured recordings; skips the test if the folder is missing."""
    folder = measured_data()
    if folder is None:
        pytest.skip("needs measured data, set PALPATE_DATA")
    return folder


@pytest.fixture
def csv_file(tmp_path: Path) -> Callable[..., Path]:
    """Writes a CSV file from a header and rows, or from its whole text."""

    def write(header: str, rows: list[str] | None = None, name: str = "press.csv") -> Path:
        path = tmp_path / name
        path.write_text("\n".join([header, *rows, ""]) if rows is not None else header, encoding="utf-8")
        return path

    return write


@pytest.fixture
def terminal(monkeypatch: pytest.MonkeyPatch) -> Callable[..., str]:
    """Runs a function whose standard output and error are a terminal of this width; returns its output."""

    def run(work: Callable[[], object], columns: int = 80) -> str:
        reading_end, terminal_end = pty.openpty()
        output = bytearray()

        def read_output() -> None:
            while True:
                try:
                    received = os.read(reading_end, 65536)
                except OSError:  # reading fails when the program has closed the terminal
                    return
                output.extend(received)

        reader = threading.Thread(target=read_output)
        reader.start()
        with os.fdopen(terminal_end, "w") as stream, monkeypatch.context() as context:
            context.setenv("COLUMNS", str(columns))
            context.setattr(sys, "stdout", stream)
            context.setattr(sys, "stderr", stream)
            work()
        reader.join()
        os.close(reading_end)
        return output.decode().replace("\r\n", "\n")

    return run

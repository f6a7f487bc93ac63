# SPDX-License-Identifier: Apache-2.0
"""Test fixtures: the folder of measured recordings, and small recording files."""

import os
import signal
from collections.abc import Callable
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]

# A shell that starts the tests in the background makes the tests and their child processes ignore Ctrl-C.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)


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

# SPDX-License-Identifier: Apache-2.0
"""Where measured data is found, and small files to read."""

import os
import signal
from collections.abc import Callable
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]

# A shell that starts the tests in the background lets them ignore Ctrl-C, and they what they start.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)


def measured_data() -> Path | None:
    """The folder of measured recordings, or None: they are no part of the project."""
    folder = Path(os.environ.get("PALPATE_DATA", ROOT.parent / "shared" / "data"))
    return folder if folder.is_dir() else None


@pytest.fixture(scope="session")
def data() -> Path:
    """The folder of measured recordings; the test is skipped without it."""
    folder = measured_data()
    if folder is None:
        pytest.skip("needs measured data, set PALPATE_DATA")
    return folder


@pytest.fixture
def csv_file(tmp_path: Path) -> Callable[..., Path]:
    """Write a CSV file from a header and rows (or its whole text)."""

    def write(header: str, rows: list[str] | None = None, name: str = "press.csv") -> Path:
        path = tmp_path / name
        path.write_text("\n".join([header, *rows, ""]) if rows is not None else header, encoding="utf-8")
        return path

    return write

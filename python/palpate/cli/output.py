# SPDX-License-Identifier: Apache-2.0
"""Prints results on standard output and talk on standard error, and checks output files before the work."""

from __future__ import annotations

import json
import math
import signal
import tempfile
import threading
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import click

from ..errors import InputError
from ..verdict import Verdict
from .ending import FAILED
from .printing import WIDEST, echo, print_line, print_value, terminal_width, visible


def talk(sentence: str) -> None:
    """Print a sentence for a person, on standard error."""
    print_line(sentence, err=True)


def print_json(result: Mapping[str, Any]) -> None:
    """Print one object on standard output, in ASCII; a number that is not finite becomes null."""
    echo(json.dumps(_finite(result), allow_nan=False))


def _finite(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {key: _finite(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_finite(item) for item in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


def number(value: float) -> str:
    """Four significant digits: what a person compares."""
    return f"{value:.4g}"


def print_numbers(rows: Mapping[str, str]) -> None:
    """Print one line for each number: its name, aligned, and its value."""
    width = max(map(len, rows))
    for name, value in rows.items():
        print_value(name, value, width)


def print_verdict(verdict: Verdict) -> None:
    """Print the verdict on standard output, before any number: its level, then a line for each reason."""
    print_line(f"verdict: {verdict.level}")
    for reason in verdict.reasons:
        print_paragraph(reason, indent="  ")


def end_with(verdict: Verdict) -> None:
    """End the verb with the exit code of its verdict.

    Raises
    ------
    click.exceptions.Exit
        The verdict is no: exit code 1.
    """
    if verdict.level == "no":
        raise click.exceptions.Exit(FAILED)


def print_table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    """Print a table whose first column is text and whose others are numbers, aligned right.

    On a terminal that is too narrow the numbers stand on a line of their own, below the text.
    """
    lines = [[visible(cell) for cell in line] for line in (header, *rows)]
    widths = [max(len(line[k]) for line in lines) for k in range(len(header))]
    terminal = terminal_width()
    apart = terminal is not None and sum(widths) + 2 * (len(widths) - 1) > terminal
    if terminal is not None and sum(widths[1:]) + 2 * len(widths) > terminal:
        widths = [0] * len(widths)
    for line in lines:
        numbers = "  ".join(cell.rjust(width) for cell, width in zip(line[1:], widths[1:], strict=True))
        if apart:
            print_line(line[0])
            print_line(f"  {numbers}".rstrip())
        else:
            print_line(f"{line[0]:<{widths[0]}}  {numbers}".rstrip())


def print_paragraph(text: str, *, indent: str = "") -> None:
    """Print text wrapped to 80 columns or a narrower terminal, with a hanging indent of two columns."""
    print_line(indent + text, elsewhere=WIDEST)


def require_writable(target: Path, *, inputs: Sequence[Path] = ()) -> None:
    """Refuse a file that could not be written at the end, before the work begins.

    Raises
    ------
    InputError
        Its folder does not exist or cannot be written, it is a folder, or it is one of the inputs.
    """
    if not target.parent.is_dir():
        raise InputError(f"{target} cannot be written: there is no folder {target.parent}")
    if target.is_dir():
        raise InputError(f"{target} cannot be written: it is a folder")
    for given in inputs:
        if given.exists() and target.exists() and target.samefile(given):
            raise InputError(f"{target} is an input as well; writing the result there would destroy it")
    try:
        with tempfile.TemporaryFile(dir=target.parent):
            pass
    except OSError as error:
        raise InputError(
            f"{target} cannot be written: its folder takes no new file ({error.strerror})"
        ) from None


def require_distinct(*targets: Path | None) -> None:
    """Refuse two results that would be written to one file."""
    given = [target.absolute() for target in targets if target is not None]
    for target in given:
        if given.count(target) > 1:
            raise InputError(f"two results would both be written to {target}")


@contextmanager
def finishing() -> Iterator[None]:
    """While results are written and printed Ctrl-C is ignored: it comes before all of them, or too late."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)

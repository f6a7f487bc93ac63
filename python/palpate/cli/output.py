# SPDX-License-Identifier: Apache-2.0
"""What a verb says and writes: numbers on standard output, talk on standard error, files checked first."""

from __future__ import annotations

import json
import math
import signal
import tempfile
import textwrap
import threading
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import click

from ..errors import InputError


def talk(sentence: str) -> None:
    """Tell a person, on standard error."""
    click.echo(sentence, err=True)


def print_json(result: Mapping[str, Any]) -> None:
    """One object on standard output; a number that is not finite becomes null, which JSON can say."""
    click.echo(json.dumps(_finite(result), ensure_ascii=False, allow_nan=False))


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
    """One line for each number: its name, aligned, and its value."""
    width = max(map(len, rows))
    for name, value in rows.items():
        click.echo(f"{name:<{width}}  {value}")


def print_table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    """A table whose first column is text and whose others are numbers, aligned right."""
    lines = [list(header), *map(list, rows)]
    widths = [max(len(line[k]) for line in lines) for k in range(len(header))]
    for line in lines:
        cells = [
            line[0].ljust(widths[0]),
            *(cell.rjust(width) for cell, width in zip(line[1:], widths[1:], strict=True)),
        ]
        click.echo("  ".join(cells).rstrip())


def print_paragraph(text: str, *, indent: str = "") -> None:
    """Text broken to 80 columns; what follows its first line stands two columns further in."""
    click.echo(textwrap.fill(text, 80, initial_indent=indent, subsequent_indent=indent + "  "))


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

# SPDX-License-Identifier: Apache-2.0
"""The only place that writes text to standard output and standard error.

Control characters are escaped here, so that no column name, file name or model can control a terminal. Lines
are wrapped between words on a terminal only: files and programs get one line for each item. Paragraphs are
wrapped everywhere.
"""

from __future__ import annotations

import io
import os
import shutil
import sys
import textwrap
from contextlib import suppress

import click

WIDEST = 80
"""Text wider than this is hard to read on any screen."""

_NARROWEST_VALUE = 24
"""Columns beside a name below which its value continues under the name instead."""


class OutputError(Exception):
    """Standard output could not be written: one sentence."""


def prepare_streams() -> None:
    """Make the three standard streams safe to use, whatever the caller did with them.

    A closed descriptor is taken, so that no file which is opened later gets its number. Writing to a closed
    standard output fails like writing to a full disk does. A character that the encoding does not have is
    written as its escape.
    """
    for number in (0, 1, 2):
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, os.O_WRONLY if number == 2 else os.O_RDONLY)
    if sys.stdin is None:
        sys.stdin = os.fdopen(0, closefd=False)
    if sys.stdout is None:
        sys.stdout = os.fdopen(1, "w", closefd=False)
    if sys.stderr is None:
        sys.stderr = os.fdopen(2, "w", closefd=False)
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors="backslashreplace")


def visible(text: str) -> str:
    """The text with every character that does not print as itself written as its escape."""
    if text.isprintable():
        return text
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode("ascii") for c in text)


def terminal_width(*, err: bool = False) -> int | None:
    """Columns to use on the terminal behind a stream, at most 80; None if the stream is not a terminal."""
    stream = sys.stderr if err else sys.stdout
    try:
        on_terminal = stream.isatty()
    except (AttributeError, ValueError):  # closed
        return None
    return min(shutil.get_terminal_size().columns, WIDEST) if on_terminal else None


def print_line(text: str = "", *, err: bool = False, hanging: int = 2, elsewhere: int | None = None) -> None:
    """Print one item: a line, wrapped on a terminal with a hanging indent beyond its own.

    `elsewhere` is the width where there is no terminal; None leaves the line as it is.

    Raises
    ------
    OutputError
        Standard output cannot be written. A standard error that cannot be written is ignored.
    BrokenPipeError
        The reader of standard output has left.
    """
    shown = visible(text)
    width = terminal_width(err=err) or elsewhere
    if width is not None and len(shown) > width:
        indent = len(shown) - len(shown.lstrip())
        shown = textwrap.fill(
            shown.lstrip(),
            width,
            initial_indent=" " * indent,
            subsequent_indent=" " * (indent + hanging),
            break_long_words=False,
            break_on_hyphens=False,
        )
    echo(shown, err=err)


def print_value(name: str, value: str, name_width: int) -> None:
    """Print a name, padded, and its value; a long value continues below itself on a terminal."""
    width = terminal_width()
    hanging = name_width + 2
    if width is not None and width - hanging < _NARROWEST_VALUE:
        hanging, name_width = 4, len(name)
    print_line(f"{name:<{name_width}}  {value}", hanging=hanging)


def echo(text: str, *, err: bool = False, nl: bool = True) -> None:
    """Write text as it is: for text that is known to hold no control character from outside."""
    if err:
        with suppress(OSError):
            click.echo(text, err=True, nl=nl)
        return
    try:
        click.echo(text, nl=nl)
    except BrokenPipeError:
        raise
    except OSError as error:
        raise OutputError(f"standard output cannot be written: {error.strerror}") from None


def end_line_on_terminal() -> None:
    """Leave a line that is being overwritten on standard error."""
    if terminal_width(err=True) is not None:
        echo("", err=True)


def drop_what_cannot_be_written() -> None:
    """Leave the interpreter nothing to flush at exit: a full disk or a closed pipe was reported before."""
    for stream, number in ((sys.stdout, 1), (sys.stderr, 2)):
        try:
            stream.flush()
        except OSError:
            os.dup2(os.open(os.devnull, os.O_WRONLY), number)

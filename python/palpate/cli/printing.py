# SPDX-License-Identifier: Apache-2.0
"""Output of text: results on standard output, notes and progress on standard error.

No other module writes to these streams. Control characters are escaped here, so that no column name, file
name or model can control a terminal. On a terminal, lines are wrapped between words; files and programs get
one line for each item. Paragraphs are always wrapped.
"""

from __future__ import annotations

import io
import json
import math
import os
import shutil
import sys
import textwrap
import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from typing import Any

import click

from ..verdict import Verdict

TERMS = "Terms: palpate --glossary"
"""Last line of the help of each verb; it names the command that explains the terms."""

WIDEST = 80
"""Largest width to which printed text is wrapped [columns]."""

_NARROWEST_VALUE = 24
"""Least width for a value to the right of its name; else the value is on the next line [columns]."""

_EVERY_S = 10.0
"""Time between two lines of progress if standard error is not a terminal [s]."""

_REFRESH_S = 0.1
"""Time between two updates of the line of progress on a terminal [s]."""

_NARROWEST_HELP = 30
"""Least width to which a help text is wrapped [columns]."""


_COLOURS = {"good": "green", "usable": "yellow", "no": "red"}
"""Colour of each level of a verdict."""

_QUIET = "palpate.quiet"
"""Key in the context of a verb whose value is True if only the verdict is printed."""


class OutputError(Exception):
    """Standard output cannot be written; the message is one sentence with the reason."""


def prepare_streams() -> None:
    """Makes standard input, output and error usable, even if the program is started with one of them closed.

    A closed stream is replaced by /dev/null, so that no file that is opened later gets the stream's number.
    Writing to a closed standard output then fails like writing to a full disk. A character outside the
    encoding is escaped.
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
    """Returns the text with non-printing characters escaped."""
    if text.isprintable():
        return text
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode("ascii") for c in text)


def terminal_width(*, err: bool = False) -> int | None:
    """Returns the columns to use on the terminal of a stream, at most 80; None if it is not a terminal."""
    stream = sys.stderr if err else sys.stdout
    try:
        on_terminal = stream.isatty()
    except (AttributeError, ValueError):  # a closed output stream is not a terminal
        return None
    return min(shutil.get_terminal_size().columns, WIDEST) if on_terminal else None


def is_quiet() -> bool:
    """Returns True if the running verb prints only its verdict and errors (--quiet)."""
    context = click.get_current_context(silent=True)
    return context is not None and bool(context.meta.get(_QUIET))


def set_quiet(ctx: click.Context, quiet: bool) -> None:
    """States for the running verb if only its verdict and errors are printed."""
    ctx.meta[_QUIET] = quiet


def prints_unicode() -> bool:
    """Returns True if the encoding of standard output is UTF-8."""
    return (getattr(sys.stdout, "encoding", None) or "").lower().replace("-", "") == "utf8"


def print_line(text: str = "", *, err: bool = False, hanging: int = 2, elsewhere: int | None = None) -> None:
    """Prints one item: a line, wrapped on a terminal with an additional hanging indent.

    `elsewhere` is the width without a terminal; None does not wrap. With --quiet nothing is printed on
    standard output.

    Raises
    ------
    OutputError
        Standard output cannot be written. A standard error that cannot be written is ignored.
    BrokenPipeError
        The reader of standard output has ended.
    """
    if is_quiet() and not err:
        return
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
    """Prints a padded name and its value; on a terminal a long value is wrapped and stays indented."""
    width = terminal_width()
    hanging = name_width + 2
    if width is not None and width - hanging < _NARROWEST_VALUE:
        hanging, name_width = 4, len(name)
    print_line(f"{name:<{name_width}}  {value}", hanging=hanging)


def echo(text: str, *, err: bool = False, nl: bool = True) -> None:
    """Writes text unchanged. The text must not contain control characters from files or arguments."""
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
    """Prints a line break on standard error."""
    if terminal_width(err=True) is not None:
        echo("", err=True)


def drop_what_cannot_be_written() -> None:
    """Discards buffered output that cannot be written: a full disk or a closed pipe was already reported."""
    for stream, number in ((sys.stdout, 1), (sys.stderr, 2)):
        try:
            stream.flush()
        except OSError:
            os.dup2(os.open(os.devnull, os.O_WRONLY), number)


def talk(sentence: str) -> None:
    """Prints a sentence for the user on standard error, unless the verb is quiet."""
    if not is_quiet():
        print_line(sentence, err=True)


def print_json(result: Mapping[str, Any]) -> None:
    """Prints one object on standard output, in ASCII. NaN and infinity become null."""
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
    """Returns a number as text with four significant digits."""
    return f"{value:.4g}"


def print_numbers(rows: Mapping[str, str]) -> None:
    """Prints one line for each number: aligned name and value."""
    width = max(map(len, rows))
    for name, value in rows.items():
        print_value(name, value, width)


def print_verdict(verdict: Verdict) -> None:
    """Prints the verdict on standard output, before any number: its level, then a line for each reason."""
    echo(f"verdict: {_coloured(verdict.level)}")
    for reason in verdict.reasons:
        print_paragraph(reason, indent="  ")


def _coloured(level: str) -> str:
    """Returns the level of a verdict in its colour if standard output is a terminal that shows colours.

    No colours are used if the variable NO_COLOR is not empty (https://no-color.org) or TERM is dumb.
    """
    if terminal_width() is None or os.environ.get("NO_COLOR") or os.environ.get("TERM") == "dumb":
        return level
    return click.style(level, fg=_COLOURS[level], bold=True)


def print_details(details: Iterable[str]) -> None:
    """Prints the sentences that the option --verbose adds to the summary, under a heading."""
    print_line()
    print_line("details")
    for sentence in details:
        print_paragraph(sentence, indent="  ")


def print_table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    """Prints a table whose first column is text and whose others are numbers, aligned right.

    On a terminal that is too narrow the numbers are on a separate line below the text.
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
    """Prints text wrapped to 80 columns or a narrower terminal, with a hanging indent of two columns."""
    print_line(indent + text, elsewhere=WIDEST)


class OverwrittenLine:
    """Line on a terminal that each new text replaces. Without a terminal it prints nothing."""

    def __init__(self) -> None:
        self.on_terminal = sys.stderr.isatty() and not is_quiet()
        self._used = False

    def show(self, text: str) -> None:
        """Shows a text in place of the previous text of the line, cut to the width of the terminal."""
        if self.on_terminal:
            width = shutil.get_terminal_size().columns - 1
            echo(f"\r{visible(text):<{width}.{width}}", err=True, nl=False)
            self._used = True

    def clear(self) -> None:
        """Removes the line from the terminal."""
        if self._used:
            self.show("")
            echo("\r", err=True, nl=False)
            self._used = False

    def end(self) -> None:
        """Ends the line with a line break, so that its text stays on the terminal."""
        if self._used:
            echo("", err=True)
            self._used = False


class Progress:
    """Prints how far some work is, and the seconds since the work began."""

    def __init__(self, work: str) -> None:
        self._work = work
        self._line = OverwrittenLine()
        self._start = self._shown = time.monotonic()

    def __call__(self, state: str) -> None:
        """Prints how far the work is, if enough time has passed since the previous line of progress."""
        now = time.monotonic()
        if now - self._shown >= (_REFRESH_S if self._line.on_terminal else _EVERY_S):
            self._shown = now
            text = f"{self._work}: {state}, {now - self._start:.0f} s"
            if self._line.on_terminal:
                self._line.show(text)
            else:
                talk(text)

    def clear(self) -> None:
        """Removes the line of progress from a terminal."""
        self._line.clear()


@contextmanager
def progress(work: str) -> Iterator[Progress]:
    """Yields a `Progress` and removes its line from the terminal at the end, also after an error."""
    shown = Progress(work)
    try:
        yield shown
    finally:
        shown.clear()


class _Formatter(click.HelpFormatter):
    """Help formatter of click that also wraps to a terminal of less than 50 columns."""

    def __init__(
        self, indent_increment: int = 2, width: int | None = None, max_width: int | None = None
    ) -> None:
        terminal = shutil.get_terminal_size().columns
        super().__init__(indent_increment, max(_NARROWEST_HELP, min(terminal, WIDEST)))

    def write_dl(self, rows: Iterable[tuple[str, str]], col_max: int = 30, col_spacing: int = 2) -> None:
        super().write_dl(list(rows), min(col_max, self.width // 3 + 1), col_spacing)


class _Context(click.Context):
    formatter_class = _Formatter


GROUPS = ("Input", "Model", "Constraints", "Output", "Expert")
"""Headings of the options of a long verb, in the order of the help."""


class Option(click.Option):
    """Option that the help of a long verb lists under one of the headings in `GROUPS`."""

    def __init__(self, *args: Any, group: str = "Output", **settings: Any) -> None:
        super().__init__(*args, **settings)
        self.group = group


class Verb(click.Command):
    """Command with the help format of palpate."""

    context_class = _Context

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Writes the options of each group under its heading; without expert options, under one heading."""
        options = [
            (getattr(each, "group", "Output"), each)
            for each in self.get_params(ctx)
            if isinstance(each, click.Option)
        ]
        if "Expert" not in dict(options):
            super().format_options(ctx, formatter)
            return
        for group in GROUPS:
            rows = [each.get_help_record(ctx) for name, each in options if name == group]
            if shown := [row for row in rows if row is not None]:
                with formatter.section(group):
                    formatter.write_dl(shown)


class Verbs(click.Group):
    """Group of commands with the help format of palpate."""

    context_class = _Context

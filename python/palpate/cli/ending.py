# SPDX-License-Identifier: Apache-2.0
"""How a run ends when it does not end well: an exit code and one sentence."""

from __future__ import annotations

import json
import os
import signal
import sys
import traceback
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass

import click

FAILED = 1
"""The work failed, or the verdict is no."""
BAD_INPUT = 2
"""Bad usage or bad input."""
INTERRUPTED = 130
"""Ctrl-C; the output does not exist."""


class WorkError(Exception):
    """The input was right, and the work still did not come to a result: one sentence."""


@dataclass(frozen=True)
class Ending:
    """An exit code, and the sentence that goes with it: empty where nobody needs or is there to be told."""

    code: int
    sentence: str = ""
    help: str = ""

    def tell(self, *, as_json: bool) -> None:
        """To a machine as one object on standard output, to a person as one line on standard error.

        Where nobody can be told, the exit code has to do.
        """
        with suppress(OSError):
            if as_json and self.sentence:
                click.echo(json.dumps({"error": self.sentence}, ensure_ascii=False))
                return
        with suppress(OSError):
            if self.help or self.sentence:
                click.echo(self.help or f"error: {self.sentence}", err=True)


@contextmanager
def terminated_as_interrupted() -> Iterator[None]:
    """A request to terminate ends what runs here as Ctrl-C does."""
    before = signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


def drop_what_cannot_be_written() -> None:
    """Leave the interpreter nothing to flush at exit: a full disk or a closed pipe was told before."""
    try:
        sys.stdout.flush()
    except OSError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def ending_of(error: BaseException) -> Ending:
    """The ending that belongs to an exception which left a verb."""
    if isinstance(error, click.exceptions.Exit):
        return Ending(error.exit_code)
    if isinstance(error, click.exceptions.NoArgsIsHelpError):
        return Ending(BAD_INPUT, help=error.format_message())
    if isinstance(error, click.ClickException):
        return Ending(BAD_INPUT, _usage_sentence(error))
    if isinstance(error, (KeyboardInterrupt, click.Abort)):
        return Ending(INTERRUPTED, "interrupted; nothing was written")
    if isinstance(error, BrokenPipeError):
        return Ending(FAILED)
    if isinstance(error, ValueError):
        return Ending(BAD_INPUT, _one_line(str(error)))
    if isinstance(error, WorkError):
        return Ending(FAILED, _one_line(str(error)))
    if isinstance(error, MemoryError):
        return Ending(FAILED, "there is not enough memory for this recording")
    if isinstance(error, OSError):
        where = f" {error.filename}" if error.filename else ""
        return Ending(FAILED, f"the operating system refuses{where}: {error.strerror or error}")
    if isinstance(error, Exception):
        place = traceback.extract_tb(error.__traceback__)[-1]
        what = f"{type(error).__name__}: {error} ({os.path.basename(place.filename)}, line {place.lineno})"
        return Ending(FAILED, _one_line(f"this is a defect of palpate, please report it: {what}"))
    raise error


def _usage_sentence(error: click.ClickException) -> str:
    sentence = _one_line(error.format_message()).rstrip(".")
    context = error.ctx if isinstance(error, click.UsageError) else None
    return f"{sentence} (see {context.command_path} --help)" if context else sentence


def _one_line(text: str) -> str:
    return " ".join(text.split())

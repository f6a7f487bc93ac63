# SPDX-License-Identifier: Apache-2.0
"""Exit status of every verb, and the message of a failure."""

from __future__ import annotations

import json
import multiprocessing
import os
import signal
import sys
import threading
import traceback
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass

import click

from ..verdict import Verdict
from .printing import OutputError, echo, end_line_on_terminal, print_line

FAILED = 1
"""Exit code of a verb that failed although its input is valid, or whose verdict is no."""
BAD_INPUT = 2
"""Exit code for bad usage or bad input."""
INTERRUPTED = 130
"""Exit code after Ctrl-C; no output file was written."""


_GRACE_S = 0.05
"""Time between Ctrl-C and the forced end of the process, so that Python can raise KeyboardInterrupt [s]."""


class WorkError(Exception):
    """Failure of a verb although its input is valid: one sentence."""


@dataclass(frozen=True)
class ExitStatus:
    """Exit code of a verb, and its error message, which may be empty."""

    code: int
    sentence: str = ""
    help: str = ""

    def report(self, *, as_json: bool) -> None:
        """Prints the message: with --json as a JSON object on standard output, else on standard error.

        A stream that cannot be written does not change the exit code.
        """
        if as_json and self.sentence:
            with suppress(OutputError, BrokenPipeError):
                echo(json.dumps({"error": self.sentence}))
                return
        if self.help:
            echo(self.help, err=True)
        elif self.sentence:
            print_line(f"error: {self.sentence}", err=True)


@contextmanager
def terminated_as_interrupted() -> Iterator[None]:
    """Context in which a termination signal (SIGTERM) acts like Ctrl-C."""
    before = signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


@contextmanager
def interrupted_at_once() -> Iterator[None]:
    """Ends the process soon after Ctrl-C, also while a library computes.

    Python raises KeyboardInterrupt between two of its instructions, but one matrix or one file can take
    seconds. If it is not raised soon, a thread ends the process. In a finalizer or a callback of a weak
    reference it cannot be raised: Python prints it instead, which is suppressed here. Results must be written
    inside `finishing`, which ignores Ctrl-C.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    context = click.get_current_context(silent=True)
    as_json = context is not None and bool(context.params.get("as_json"))
    reader, writer = os.pipe()
    os.set_blocking(writer, False)
    over = threading.Event()

    def watch() -> None:
        while (number := os.read(reader, 1)) != b"\0":
            if number[0] == signal.SIGINT and not over.wait(_GRACE_S):
                for worker in multiprocessing.active_children():
                    worker.terminate()
                end_line_on_terminal()
                status = exit_status_of(KeyboardInterrupt())
                status.report(as_json=as_json)
                os._exit(status.code)

    printing = sys.unraisablehook

    def unraisable(args: sys.UnraisableHookArgs) -> None:
        if args.exc_type is not KeyboardInterrupt:
            printing(args)

    watching = threading.Thread(target=watch, daemon=True)
    watching.start()
    before = signal.set_wakeup_fd(writer, warn_on_full_buffer=False)
    sys.unraisablehook = unraisable
    try:
        yield
    finally:
        over.set()
        sys.unraisablehook = printing
        signal.set_wakeup_fd(before)
        os.write(writer, b"\0")
        watching.join()
        os.close(reader)
        os.close(writer)


def exit_status_of(error: BaseException) -> ExitStatus:
    """Returns the exit status for an exception from a verb."""
    if isinstance(error, click.exceptions.Exit):
        return ExitStatus(error.exit_code)
    if isinstance(error, click.exceptions.NoArgsIsHelpError):
        return ExitStatus(BAD_INPUT, help=error.format_message())
    if isinstance(error, click.ClickException):
        return ExitStatus(BAD_INPUT, _usage_sentence(error))
    if isinstance(error, (KeyboardInterrupt, click.Abort)):
        return ExitStatus(INTERRUPTED, "interrupted; nothing was written")
    if isinstance(error, BrokenPipeError):
        return ExitStatus(FAILED)
    if isinstance(error, ValueError):
        return ExitStatus(BAD_INPUT, _one_line(str(error)))
    if isinstance(error, (WorkError, OutputError)):
        return ExitStatus(FAILED, _one_line(str(error)))
    if isinstance(error, MemoryError):
        return ExitStatus(FAILED, "there is not enough memory for this recording")
    if isinstance(error, OSError):
        where = f" {error.filename}" if error.filename else ""
        return ExitStatus(FAILED, f"the operating system refuses{where}: {error.strerror or error}")
    if isinstance(error, Exception):
        place = traceback.extract_tb(error.__traceback__)[-1]
        fault = f"{type(error).__name__}: {error} ({os.path.basename(place.filename)}, line {place.lineno})"
        return ExitStatus(FAILED, _one_line(f"this is a defect of palpate, please report it: {fault}"))
    raise error


def _usage_sentence(error: click.ClickException) -> str:
    sentence = _one_line(error.format_message()).rstrip(".")
    if isinstance(error, click.MissingParameter) and isinstance(error.param, click.Option) and error.ctx:
        sentence += f"; add {error.param.opts[0]} {error.param.make_metavar(error.ctx)}"
    context = error.ctx if isinstance(error, click.UsageError) else None
    return f"{sentence} (see {context.command_path} --help)" if context else sentence


def _one_line(text: str) -> str:
    return " ".join(text.split())


def end_with(verdict: Verdict) -> None:
    """Ends the verb with the exit code of its verdict.

    Raises
    ------
    click.exceptions.Exit
        The verdict is no: exit code 1.
    """
    if verdict.level == "no":
        raise click.exceptions.Exit(FAILED)


@contextmanager
def finishing() -> Iterator[None]:
    """Ignores Ctrl-C while results are written and printed, so that no result is partial."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)

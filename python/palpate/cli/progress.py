# SPDX-License-Identifier: Apache-2.0
"""Progress on standard error: one line, overwritten, on a terminal; else a line every ten seconds."""

from __future__ import annotations

import shutil
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager

from .output import talk
from .printing import echo, visible

_EVERY_S = 10.0
"""Seconds between two lines where standard error is no terminal."""

_REFRESH_S = 0.1
"""Seconds between two states of the line on a terminal."""


class OverwrittenLine:
    """One line on a terminal that each new text replaces. Nothing is printed where there is no terminal."""

    def __init__(self) -> None:
        self.on_terminal = sys.stderr.isatty()
        self._used = False

    def show(self, text: str) -> None:
        """Replace the line, cut to the width of the terminal."""
        if self.on_terminal:
            width = shutil.get_terminal_size().columns - 1
            echo(f"\r{visible(text):<{width}.{width}}", err=True, nl=False)
            self._used = True

    def clear(self) -> None:
        """Remove the line."""
        if self._used:
            self.show("")
            echo("\r", err=True, nl=False)
            self._used = False

    def end(self) -> None:
        """Leave the line as it is and begin the next one."""
        if self._used:
            echo("", err=True)
            self._used = False


class Progress:
    """Prints how far some work is, with the seconds since it began."""

    def __init__(self, work: str) -> None:
        self._work = work
        self._line = OverwrittenLine()
        self._start = self._shown = time.monotonic()

    def __call__(self, state: str) -> None:
        """Report a state; it is printed if the last one was long enough ago."""
        now = time.monotonic()
        if now - self._shown >= (_REFRESH_S if self._line.on_terminal else _EVERY_S):
            self._shown = now
            text = f"{self._work}: {state}, {now - self._start:.0f} s"
            if self._line.on_terminal:
                self._line.show(text)
            else:
                talk(text)

    def clear(self) -> None:
        """Remove the line from a terminal."""
        self._line.clear()


@contextmanager
def progress(work: str) -> Iterator[Progress]:
    """Give a `Progress` whose line is removed at the end, also when the work fails."""
    shown = Progress(work)
    try:
        yield shown
    finally:
        shown.clear()

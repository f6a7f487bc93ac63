# SPDX-License-Identifier: Apache-2.0
"""Live line of palpate-control: shown in a terminal, also in a narrow one, and nowhere else."""

from __future__ import annotations

import fcntl
import json
import os
import re
import select
import struct
import subprocess
import termios
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import pytest

from control_program import MODEL, PATIENT, PROGRAM, control, needs_program

pytestmark = needs_program

AGAIN = "\r\x1b[K"
"""Returns to the start of the line and clears it."""

WHOLE = re.compile(r"[\d.]+ s  -?[\d.e-]+ rad  -?[\d.e-]+ Nm  [\d.]+ Hz  missed \d+")


class Terminal:
    """Terminal of some columns that runs the program; the summary goes to a pipe."""

    def __init__(self, columns: int, *words: Any) -> None:
        self._ours, theirs = os.openpty()
        fcntl.ioctl(theirs, termios.TIOCSWINSZ, struct.pack("HHHH", 24, columns, 0, 0))

        def take_over() -> None:
            os.setsid()
            fcntl.ioctl(0, termios.TIOCSCTTY, 0)

        self.process = subprocess.Popen(
            [PROGRAM, *map(str, words), "--json", *PATIENT],
            stdin=theirs,
            stdout=subprocess.PIPE,
            stderr=theirs,
            preexec_fn=take_over,
        )
        os.close(theirs)
        self.shown = ""

    def close(self) -> None:
        self.process.kill()
        self.process.communicate()
        os.close(self._ours)

    def watch(self, until_lines: int | None = None) -> None:
        """Reads the output until it has some number of live lines, or until the program has ended."""
        limit = time.monotonic() + 30.0
        while until_lines is None or self.shown.count(AGAIN) < until_lines:
            assert time.monotonic() < limit
            if select.select([self._ours], [], [], 0.1)[0]:
                try:
                    self.shown += os.read(self._ours, 4096).decode()
                except OSError:  # the other side is closed
                    return

    def press(self, key: bytes) -> None:
        os.write(self._ours, key)

    def summary(self) -> dict[str, Any]:
        assert self.process.stdout is not None
        return dict(json.loads(self.process.stdout.readline()))

    @property
    def lines(self) -> list[str]:
        """Live lines in order; each replaces the previous one."""
        shown = self.shown.split(AGAIN)[1:]
        return [line for line in shown if line and not line.endswith("\n")]


@contextmanager
def terminal(columns: int, *words: Any) -> Iterator[Terminal]:
    opened = Terminal(columns, *words)
    try:
        yield opened
    finally:
        opened.close()


def test_a_terminal_shows_one_line_that_is_alive_and_gone_at_the_end() -> None:
    with terminal(80, MODEL, "--duration-s", 1.2) as screen:
        screen.watch()
        assert screen.process.wait() == 0
        assert len(screen.lines) >= 3
        for line in screen.lines:
            assert WHOLE.fullmatch(line), line
        seconds = [float(line.split()[0]) for line in screen.lines]
        assert seconds == sorted(seconds)
        ticking = [second for second in seconds if second > 0.0]  # a busy machine starts late
        assert len(set(ticking)) == len(ticking) >= 3
        assert screen.shown.endswith(AGAIN)


@pytest.mark.parametrize("columns", [40, 12, 5])
def test_in_a_narrow_terminal_the_line_stays_one_line(columns: int) -> None:
    """One character above the width of the terminal would leave a part of the old line."""
    with terminal(columns, MODEL, "--duration-s", 0.8) as screen:
        screen.watch()
        assert screen.process.wait() == 0
        lines = screen.lines
        assert all(len(line) < columns for line in lines)
        if columns > 5:  # too narrow for any content
            assert len(lines) >= 2
            assert all(re.match(r"[\d.]+ s", line) for line in lines)


def test_ctrl_c_in_a_terminal_is_an_orderly_end() -> None:
    with terminal(80, MODEL, "--duration-s", "inf") as screen:
        screen.watch(until_lines=2)
        screen.press(b"\x03")
        screen.watch()
        assert screen.process.wait() == 0
        assert screen.summary()["ended"] == "stopped on request"
        last = screen.shown.rpartition(AGAIN)[2]
        assert last == "", "what the terminal echoed of the key is wiped away with the line"


def test_what_is_said_during_a_run_has_a_line_of_its_own() -> None:
    with terminal(80, MODEL, "--duration-s", 3, "--fault", "gone@0.5") as screen:
        screen.watch()
        assert screen.process.wait() == 1
        said = screen.shown.partition("error: stopped by a fault of the device: Fault")
        assert said[1]
        # on a busy machine a warning may follow the live line
        assert said[0].endswith((AGAIN, "\n"))


def test_without_a_terminal_there_is_no_live_line() -> None:
    answer = control(MODEL, "--duration-s", 0.5, *PATIENT)
    assert answer.returncode == 0
    for control_character in ("\r", "\x1b"):
        assert control_character not in answer.stderr + answer.stdout

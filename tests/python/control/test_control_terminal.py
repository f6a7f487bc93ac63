# SPDX-License-Identifier: Apache-2.0
"""The live line (progress) of palpate-control is shown in terminals, also narrow ones, nowhere else."""

from __future__ import annotations

import fcntl
import json
import os
import re
import signal
import struct
import subprocess
import termios
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from control_program import MODEL, PROGRAM, control, in_virtual_time, needs_program

pytestmark = needs_program

CLEAR_LINE = "\r\x1b[K"
"""Characters that move the cursor to the start of a terminal line and clear the line."""

WRITES_TO_TERMINAL = ("1 0x2 ", "64 0x2 ")
"""Begin of /proc/PID/syscall during a write to standard error on x86-64 and ARM64."""

LIVE_LINE = re.compile(r"[\d.]+ s  -?[\d.e-]+ rad  -?[\d.e-]+ Nm  [\d.]+ Hz  missed \d+")


class Terminal:
    """Runs palpate-control in a terminal with this number of columns; the summary goes to a pipe."""

    def __init__(self, columns: int, *arguments: Any) -> None:
        self._reading_end, program_end = os.openpty()
        fcntl.ioctl(program_end, termios.TIOCSWINSZ, struct.pack("HHHH", 24, columns, 0, 0))

        def set_controlling_terminal() -> None:
            os.setsid()
            fcntl.ioctl(0, termios.TIOCSCTTY, 0)

        self.process = subprocess.Popen(
            [PROGRAM, *map(str, arguments), "--json"],
            stdin=program_end,
            stdout=subprocess.PIPE,
            stderr=program_end,
            preexec_fn=set_controlling_terminal,
            env=in_virtual_time(),
        )
        os.close(program_end)
        self.output = ""

    def close(self) -> None:
        self.process.kill()
        self.process.communicate()
        os.close(self._reading_end)

    def watch(self, until_lines: int | None = None) -> None:
        """Reads the terminal until it has shown `until_lines` live lines, or until the program has ended."""
        while until_lines is None or self.output.count(CLEAR_LINE) < until_lines:
            try:
                self.output += os.read(self._reading_end, 4096).decode()
            except OSError:  # reading fails when the program has closed the terminal
                return

    def press(self, key: bytes) -> None:
        os.write(self._reading_end, key)

    def summary(self) -> dict[str, Any]:
        assert self.process.stdout is not None
        return dict(json.loads(self.process.stdout.readline()))

    @property
    def lines(self) -> list[str]:
        """All live lines that the terminal has shown, in order."""
        lines = self.output.split(CLEAR_LINE)[1:]
        return [line for line in lines if line and not line.endswith("\n")]


@contextmanager
def terminal(columns: int, *arguments: Any) -> Iterator[Terminal]:
    session = Terminal(columns, *arguments)
    try:
        yield session
    finally:
        session.close()


def test_a_terminal_shows_one_live_line_that_is_removed_at_the_end() -> None:
    with terminal(80, MODEL, "--duration-s", 1.2) as session:
        session.watch()
        assert session.process.wait() == 0
        assert len(session.lines) >= 3
        for line in session.lines:
            assert LIVE_LINE.fullmatch(line), line
        seconds = [float(line.split()[0]) for line in session.lines]
        assert seconds == sorted(seconds)
        ticking = [second for second in seconds if second > 0.0]  # 0 s may be shown repeatedly
        assert len(set(ticking)) == len(ticking) >= 3
        assert session.output.endswith(CLEAR_LINE)


@pytest.mark.parametrize("columns", [40, 12, 5])
def test_the_live_line_is_not_wrapped_in_a_narrow_terminal(columns: int) -> None:
    """If a live line is wider than the terminal, a part of it stays when the next live line replaces it."""
    with terminal(columns, MODEL, "--duration-s", 0.8) as session:
        session.watch()
        assert session.process.wait() == 0
        lines = session.lines
        assert all(len(line) < columns for line in lines)
        if columns > 5:  # a terminal of 5 columns is too narrow for the first value of the live line
            assert len(lines) >= 2
            assert all(re.match(r"[\d.]+ s", line) for line in lines)


def test_a_terminal_without_a_known_width_has_80_columns() -> None:
    with terminal(0, MODEL, "--duration-s", 0.8) as session:
        session.watch()
        assert session.process.wait() == 0
        assert len(session.lines) >= 2
        assert all(LIVE_LINE.fullmatch(line) and len(line) < 80 for line in session.lines)


def test_ctrl_c_during_a_write_to_the_terminal_loses_no_later_text() -> None:
    """The terminal shows nothing for a while (Ctrl-S); a signal then interrupts the write."""
    with terminal(80, MODEL, "--duration-s", "inf") as session:
        session.watch(until_lines=2)
        session.press(b"\x13")
        tasks = Path(f"/proc/{session.process.pid}/task")
        while not any(
            (task / "syscall").read_text().startswith(WRITES_TO_TERMINAL) for task in tasks.iterdir()
        ):
            time.sleep(0.01)
        session.process.send_signal(signal.SIGINT)
        pending = f"ShdPnd:\t{1 << (signal.SIGINT - 1):016x}"
        while pending in (tasks.parent / "status").read_text():
            time.sleep(0.01)
        session.press(b"\x11")
        session.watch()
        assert session.process.wait() == 0
        assert session.output.endswith(CLEAR_LINE)


def test_ctrl_c_in_a_terminal_exits_with_code_0_and_a_summary() -> None:
    with terminal(80, MODEL, "--duration-s", "inf") as session:
        session.watch(until_lines=2)
        session.press(b"\x03")
        session.watch()
        assert session.process.wait() == 0
        assert session.summary()["ended"] == "stopped on request"
        last = session.output.rpartition(CLEAR_LINE)[2]
        assert last == "", "the echo of the key is cleared with the line"


def test_a_message_during_a_run_is_printed_on_a_separate_line() -> None:
    with terminal(80, MODEL, "--duration-s", 3, "--fault", "gone@0.5") as session:
        session.watch()
        assert session.process.wait() == 1
        reported = session.output.partition("error: stopped by a fault of the device: Fault")
        assert reported[1]
        assert reported[0].endswith(CLEAR_LINE)


def test_without_a_terminal_there_is_no_live_line() -> None:
    completed = control(MODEL, "--duration-s", 0.5)
    assert completed.returncode == 0
    for control_character in ("\r", "\x1b"):
        assert control_character not in completed.stderr + completed.stdout

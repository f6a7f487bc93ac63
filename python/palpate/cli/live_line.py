# SPDX-License-Identifier: Apache-2.0
"""One line that shows rows, position and force while a recording grows, on a terminal only."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager

from ..devices import DeviceError
from ..errors import InputError
from .exit_status import terminated_as_interrupted
from .printing import OverwrittenLine, number


@contextmanager
def live_line(rate_hz: float, units: tuple[str, str]) -> Iterator[LiveLine]:
    """A `LiveLine` while a device is at work, which a request to terminate ends as Ctrl-C does.

    What the device refuses is an InputError of one sentence.
    """
    line = LiveLine(rate_hz, units)
    try:
        with terminated_as_interrupted():
            yield line
    except DeviceError as error:
        raise InputError(str(error)) from None
    finally:
        line.end()


class LiveLine:
    """Rows, position and force as they come, samples lost, and where the handle has been.

    Parameters
    ----------
    rate_hz : float
        Rows a second.
    units : tuple of str
        Of position and force.
    """

    def __init__(self, rate_hz: float, units: tuple[str, str]) -> None:
        self._rate_hz = rate_hz
        self._units = units
        self._line = OverwrittenLine()
        self._lower, self._upper = math.inf, -math.inf

    def show(self, rows: int, position: float, force: float, lost: int) -> None:
        """Take what is true now."""
        self._lower, self._upper = min(self._lower, position), max(self._upper, position)
        self._line.show(
            f"{rows / self._rate_hz:6.1f} s  {rows} rows, {lost} lost  "
            f"position {number(position)} {self._units[0]} "
            f"(so far {number(self._lower)} to {number(self._upper)})  "
            f"force {number(force)} {self._units[1]}"
        )

    def end(self) -> None:
        """Leave the line as it is."""
        self._line.end()

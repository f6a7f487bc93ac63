# SPDX-License-Identifier: Apache-2.0
"""Parts for verbs with a live device: options, live line, verdict of the session."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any

import click
from click.shell_completion import CompletionItem

from .._core.run import device_waits, measured_device_help, transports
from ..devices import DeviceError
from ..errors import InputError
from ..verdict import Verdict
from .exit_status import terminated_as_interrupted
from .printing import OverwrittenLine, number, print_line
from .verb import PATH, options


class DeviceName(click.types.StringParamType):
    """Name of a device; a shell completes its first word."""

    def shell_complete(
        self, ctx: click.Context, param: click.Parameter, incomplete: str
    ) -> list[CompletionItem[str]]:
        """Returns the kinds of devices that the user may mean."""
        return [CompletionItem(name) for name, _, _ in transports if name.startswith(incomplete)]


def device_option(text: str) -> Callable[[Any], Any]:
    """Returns the option that chooses a device."""
    return click.option("--device", type=DeviceName(), default="simulated", metavar="NAME", help=f"{text}.")


device_options = options(
    device_option(measured_device_help),
    click.option(
        "--object",
        "object_file",
        type=PATH,
        metavar="MODEL.json",
        help="The object mounted on the simulated device.",
    ),
    click.option(
        "--wait-ms",
        type=click.FloatRange(0.1, 10000),
        show_default=device_waits,
        help="Longest wait for an answer of the device [ms].",
    ),
    click.option(
        "--transducer/--no-transducer",
        default=True,
        help="The simulated device has a force transducer.",
    ),
)
"""Options that choose the device, and the object that is mounted on a simulated device."""


@contextmanager
def live_line(rate_hz: float, units: tuple[str, str]) -> Iterator[LiveLine]:
    """Yields a `LiveLine` that shows a running device. A termination signal (SIGTERM) acts like Ctrl-C.

    A refusal of the device is raised as InputError.
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
    """Line on a terminal with the rows so far, position, least and largest position, force and lost samples.

    Parameters
    ----------
    rate_hz : float
        Rows of the recording per second [Hz].
    units : tuple of str
        Units of position and force.
    """

    def __init__(self, rate_hz: float, units: tuple[str, str]) -> None:
        self._rate_hz = rate_hz
        self._units = units
        self._line = OverwrittenLine()
        self._lower, self._upper = math.inf, -math.inf

    def show(self, rows: int, position: float, force: float, lost: int) -> None:
        """Shows duration, number of rows, lost samples, position and force in place of the previous live
        line."""
        self._lower, self._upper = min(self._lower, position), max(self._upper, position)
        self._line.show(
            f"{rows / self._rate_hz:6.1f} s  {rows} rows, {lost} lost  "
            f"position {number(position)} {self._units[0]} "
            f"(so far {number(self._lower)} to {number(self._upper)})  "
            f"force {number(force)} {self._units[1]}"
        )

    def end(self) -> None:
        """Ends the live line, so that the last position and force stay on the terminal."""
        self._line.end()


def session_verdict(summary: Mapping[str, Any]) -> Verdict:
    """Returns the verdict in the summary of a run; prints on standard error why the run ended early."""
    if not summary["orderly"]:
        print_line(f"error: {summary['ended']}; {summary['zero_force']}", err=True)
    return Verdict.from_record(summary["findings"])

# SPDX-License-Identifier: Apache-2.0
"""Which device, as options that `record` and `check-device` share."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar, cast

import click

from .verb import PATH

F = TypeVar("F", bound=Callable[..., Any])


def device_options(command: F) -> F:
    """Give a verb `device`, and what is mounted on the simulated one."""
    described: Any = command
    for option in reversed(
        (
            click.option("--device", default="simulated", help="simulated, or usb[:SERIAL]."),
            click.option(
                "--object",
                "object_file",
                type=PATH,
                metavar="MODEL.json",
                help="What is mounted on the simulated device.",
            ),
            click.option(
                "--wait-ms",
                type=click.FloatRange(0.1, 10000),
                show_default="5",
                help="How long to wait for a packet of a USB device.",
            ),
            click.option(
                "--transducer/--no-transducer",
                default=True,
                help="Whether the simulated device has a force transducer.",
            ),
        )
    ):
        described = option(described)
    return cast(F, described)

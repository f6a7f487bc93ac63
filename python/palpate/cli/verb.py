# SPDX-License-Identifier: Apache-2.0
"""What verbs share: the command itself, how a recording is read, where a figure goes, JSON."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import wraps
from pathlib import Path
from typing import Any, TypeVar, cast

import click

from ..recording import Recording, read_recording
from .exit_status import interrupted_at_once
from .printing import Verb, talk

F = TypeVar("F", bound=Callable[..., Any])

PATH = click.Path(path_type=Path)


def verb(
    example: str, *, cls: type[click.Command] = Verb, ends_at_once: bool = True, **settings: Any
) -> Callable[[Callable[..., Any]], click.Command]:
    """Make a function a verb: a command whose help ends with an example.

    Parameters
    ----------
    example : str
        Command line.
    cls : type
        Class of the command.
    ends_at_once : bool
        Ctrl-C ends the process also while a library computes; False where a device must be closed first.
    settings
        Further arguments of `click.command`.
    """

    def command(function: Callable[..., Any]) -> click.Command:
        given = {"no_args_is_help": True, "epilog": f"Example: {example}", **settings}
        return click.command(cls=cls, **given)(interrupted_at_once()(function) if ends_at_once else function)

    return command


def _names_and_units(
    ctx: click.Context, param: click.Parameter, values: tuple[str, ...]
) -> dict[str, str] | None:
    """NAME=UNIT, as often as it was given."""
    units = {}
    for value in values:
        column, equals, unit = value.rpartition("=")
        if not (column and equals and unit):
            raise click.BadParameter(f"{value!r} must be NAME=UNIT, such as depth=mm", ctx, param)
        units[column] = unit
    return units or None


def _row_range(
    ctx: click.Context, param: click.Parameter, value: str | None
) -> tuple[int | None, int | None] | None:
    """START:STOP, either of which may be missing."""
    if value is None:
        return None
    start, colon, stop = value.partition(":")
    try:
        if not colon:
            raise ValueError
        return (int(start) if start else None, int(stop) if stop else None)
    except ValueError:
        message = f"{value!r} must be START:STOP, such as 100:5000, counted from 0"
        raise click.BadParameter(message, ctx, param) from None


@dataclass(frozen=True)
class ReadingOptions:
    """How the recordings of one run are read."""

    options: dict[str, Any] = field(default_factory=dict)

    def read(self, path: Path, inputs: Sequence[str] = ()) -> Recording:
        """Read a recording with further inputs, and say first what was read and which columns were chosen."""
        recording = read_recording(path, inputs=inputs, **self.options)
        chosen, *others = recording.notes
        talk(f"read {path}: {len(recording)} rows; {chosen}")
        for note in others:
            talk(f"  {note}")
        return recording


def reading_options(command: F) -> F:
    """Give a verb the options of `read_recording`, as one argument `reading`."""

    @wraps(command)
    def invoke(
        *args: Any,
        position: str | None,
        force: str | None,
        time: str | None,
        direction: str | None,
        units: dict[str, str] | None,
        negate: tuple[str, ...],
        torque_constant: float | None,
        rows: tuple[int | None, int | None] | None,
        zero: tuple[int | None, int | None] | None,
        force_late_s: float,
        invalid: str,
        **others: Any,
    ) -> Any:
        reading = ReadingOptions(
            {
                "position": position,
                "force": force,
                "time": time,
                "direction": direction,
                "units": units,
                "negate": negate,
                "torque_constant": torque_constant,
                "rows": rows,
                "zero": zero,
                "force_late_s": force_late_s,
                "invalid": invalid,
            }
        )
        return command(*args, reading=reading, **others)

    column: dict[str, Any] = {"metavar": "COLUMN", "default": None}
    described: Any = invoke
    for option in reversed(
        (
            click.option(
                "--position", **column, help="Column of the position; else chosen by name and unit."
            ),
            click.option("--force", **column, help="Column of the force; else chosen by name and unit."),
            click.option("--time", **column, help="Column of the time; else chosen by name and unit."),
            click.option("--direction", **column, help="Column of the stroke's direction (press, release)."),
            click.option(
                "--units",
                metavar="NAME=UNIT",
                callback=_names_and_units,
                multiple=True,
                help="Unit of a column whose name has none. Repeat for several.",
            ),
            click.option(
                "--negate",
                metavar="COLUMN",
                multiple=True,
                help="Turn the sign of position, force or a column. Repeat for several.",
            ),
            click.option(
                "--torque-constant-Nm-per-A",
                "torque_constant",
                type=float,
                default=None,
                help="Turns a force column in A into N*m.",
            ),
            click.option(
                "--rows",
                metavar="START:STOP",
                callback=_row_range,
                default=None,
                help="Use these rows only, counted from 0.",
            ),
            click.option(
                "--zero",
                metavar="START:STOP",
                callback=_row_range,
                default=None,
                help="Rows in which the tool touches nothing: their mean force is taken off.",
            ),
            click.option(
                "--force-late-s",
                type=float,
                default=0.0,
                help="How long after its position each force was recorded [s]; needs time.",
            ),
            click.option(
                "--invalid",
                type=click.Choice(["refuse", "drop"]),
                default="refuse",
                help="What to do with rows without a number.",
            ),
        )
    ):
        described = option(described)
    return cast(F, described)


def json_option(command: F) -> F:
    """--json: one object on standard output."""
    return click.option("--json", "as_json", is_flag=True, help="Print one JSON object.")(command)


def plot_option(shows: str, name: str = "--plot") -> Callable[[F], F]:
    """--plot PNG: draw a figure."""
    return click.option(name, type=PATH, metavar="PNG", default=None, help=f"Draw {shows}.")

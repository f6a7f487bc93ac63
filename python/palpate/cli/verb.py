# SPDX-License-Identifier: Apache-2.0
"""Parts that verbs share: the command, its options, reading of recordings, checks of outputs."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial, wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar, cast

import click

from .._core.rendering import Scheme, most_prediction_taps, structure_names
from ..arguments import first_sentence, parameter_texts
from ..errors import InputError
from ..recording import Recording, read_recording
from ..recording.files import require_absent
from .completion import FIGURES, RECORDINGS, FileName
from .exit_status import interrupted_at_once
from .printing import TERMS, Option, Verb, set_quiet, talk

if TYPE_CHECKING:
    from ..model import Model

F = TypeVar("F", bound=Callable[..., Any])

PATH = FileName(path_type=Path)

READING_NAMES = ("position", "force", "time", "direction", "units", "negate", "torque_constant", "rows",
                 "leave_out", "zero", "force_late_s", "invalid", "columns", "decimal", "part")  # fmt: skip
"""Arguments of `read_recording` that are also options of the command line."""

_SCHEME = Scheme()


def verb(
    example: str, *, cls: type[click.Command] = Verb, ends_at_once: bool = True, **settings: Any
) -> Callable[[Callable[..., Any]], click.Command]:
    """Converts a function to a verb: a command with --quiet whose help ends with an example.

    Parameters
    ----------
    example : str
        Command line that the help shows as the example.
    cls : type
        Class of the click command.
    ends_at_once : bool
        Ctrl-C ends the process also while a library computes; False if a device must be closed first.
    settings
        Further arguments of `click.command`.
    """

    def command(function: Callable[..., Any]) -> click.Command:
        epilog = f"Example: {example}\n\n{TERMS}"
        given = {"no_args_is_help": True, "epilog": epilog, **settings}
        made = click.command(cls=cls, **given)(interrupted_at_once()(function) if ends_at_once else function)
        if not any("--quiet" in param.secondary_opts for param in made.params):
            made.params.append(_quiet_option())
        return made

    return command


def options(*each: Callable[[Any], Any]) -> Callable[[F], F]:
    """Adds several options to a verb. The help lists the options in the given order."""

    def decorate(command: F) -> F:
        for option in reversed(each):
            command = option(command)
        return command

    return decorate


def _names_and_units(
    ctx: click.Context, param: click.Parameter, values: tuple[str, ...]
) -> dict[str, str] | None:
    """Parses NAME=UNIT, which may be repeated."""
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
    """Parses START:STOP; both numbers are optional."""
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


def _row_ranges(
    ctx: click.Context, param: click.Parameter, values: tuple[str, ...]
) -> tuple[tuple[int | None, int | None], ...]:
    """Parses several START:STOP."""
    ranges = (_row_range(ctx, param, value) for value in values)
    return tuple(each for each in ranges if each is not None)


def _zero(
    ctx: click.Context, param: click.Parameter, value: str | None
) -> tuple[int | None, int | None] | str | None:
    """Parses START:STOP, or the word air."""
    return value if value == "air" else _row_range(ctx, param, value)


@dataclass(frozen=True)
class ReadingOptions:
    """Options for reading the recordings of one run."""

    options: dict[str, Any] = field(default_factory=dict)

    def read(self, path: Path, inputs: Sequence[str] = ()) -> Recording:
        """Reads a recording whose force also depends on `inputs`; prints file, number of rows and columns."""
        recording = read_recording(path, inputs=inputs, **self.options)
        chosen, *others = recording.notes
        talk(f"read {path}: {len(recording)} rows; {chosen}")
        for note in others:
            talk(f"  {note}")
        return recording


_TEXTS = parameter_texts(read_recording)


def _about(argument: str) -> str:
    """Returns the help of an option that is an argument of `read_recording`: the start of its text there."""
    return first_sentence(_TEXTS.get(argument, ""))


def sized(model: Model) -> str:
    """Returns kind and size of a model as text: "hysteresis, 28 wavelets, 116 parameters"."""
    return f"{model.kind}, {model.terms}, {model.n_parameters} parameters"


expert_option = partial(click.option, cls=Option, group="Expert")
"""Option of a verb with many options; the help lists it under "Expert" unless `group` names a heading."""

_column = partial(expert_option, metavar="COLUMN", default=None)
_rows = partial(expert_option, metavar="START:STOP", callback=_row_range, default=None)

_READING = options(
    _column("--position", group="Input", help=_about("position")),
    _column("--force", group="Input", help=_about("force")),
    expert_option(
        "--units",
        group="Input",
        metavar="NAME=UNIT",
        callback=_names_and_units,
        multiple=True,
        help=_about("units"),
    ),
    expert_option(
        "--part",
        metavar="NAME",
        multiple=True,
        callback=lambda ctx, param, names: names or None,
        help=f"{_about('part')} Repeatable.",
    ),
    expert_option("--force-late-s", metavar="SECONDS", type=float, default=0.0, help=_about("force_late_s")),
    expert_option(
        "--columns",
        metavar="NAME,NAME,...",
        default="",
        callback=lambda ctx, param, value: tuple(filter(None, value.split(","))),
        help=_about("columns"),
    ),
    expert_option("--decimal", type=click.Choice([".", ","]), default=None, help=_about("decimal")),
    _column("--time", help=_about("time")),
    _column("--direction", help=_about("direction")),
    expert_option("--negate", metavar="COLUMN", multiple=True, help=f"{_about('negate')} Repeatable."),
    expert_option(
        "--torque-constant-Nm-per-A",
        "torque_constant",
        type=float,
        default=None,
        help=_about("torque_constant"),
    ),
    _rows("--rows", help=_about("rows")),
    expert_option(
        "--leave-out",
        metavar="START:STOP",
        callback=_row_ranges,
        multiple=True,
        help=f"{_about('leave_out')} Repeatable.",
    ),
    _rows("--zero", metavar="START:STOP|air", callback=_zero, help=_about("zero")),
    expert_option(
        "--invalid", type=click.Choice(["refuse", "drop"]), default="refuse", help=_about("invalid")
    ),
)


def reading_options(command: F) -> F:
    """Adds the options of `read_recording` to a verb as one argument `reading`."""

    @wraps(command)
    def invoke(*args: Any, **given: Any) -> Any:
        reading = ReadingOptions({name: given.pop(name) for name in READING_NAMES})
        return command(*args, reading=reading, **given)

    return cast(F, _READING(invoke))


accept_model_option = click.option(
    "--accept-model", is_flag=True, help="Use the model although its verdict is no; the result says so."
)

scheme_options = options(
    click.option(
        "--structure",
        type=click.Choice(structure_names),
        default=None,
        show_default=f"the model's plan, else {_SCHEME.structure}",
        help="Structure that computes the force.",
    ),
    click.option(
        "--compensated",
        is_flag=True,
        help="Make the model stiffer, so that model and coupling in series give the recorded force.",
    ),
    click.option(
        "--coupling-stiffness",
        type=float,
        show_default=f"{_SCHEME.coupling_stiffness:g} N*m/rad, scaled to the model",
        help="Coupling stiffness K_c, in force per position of the model's units.",
    ),
    click.option(
        "--coupling-damping",
        type=float,
        show_default=f"{_SCHEME.coupling_damping:g} N*m*s/rad, scaled",
        help="Coupling damping B_c, in force per velocity.",
    ),
    click.option(
        "--mass",
        type=float,
        show_default=f"{_SCHEME.mass:g} kg*m^2, scaled",
        help="Mass of an object with mass, in force per acceleration.",
    ),
    click.option(
        "--object-damping",
        type=float,
        show_default=f"{_SCHEME.object_damping:g} N*m*s/rad, scaled",
        help="Damping of an object with mass, in force per velocity.",
    ),
    click.option(
        "--play-radius",
        type=float,
        show_default="the model's, or 1 % of its travel",
        help="Play radius r of a model with hysteresis, in its position unit.",
    ),
    click.option(
        "--predict",
        type=click.IntRange(0, most_prediction_taps),
        metavar="M",
        show_default=f"{_SCHEME.predict}",
        help="Samples used to predict the position half a sample ahead, direct only; 0 = none.",
    ),
)
"""Options for the fields of `Scheme`. An option that is not given is None; the model or its plan decides."""

json_option = click.option("--json", "as_json", is_flag=True, help="Print one JSON object.")


def _loudness(ctx: click.Context, param: click.Parameter, verbose: bool | None) -> bool:
    """Returns True for --verbose, and makes the verb quiet for --quiet."""
    set_quiet(ctx, verbose is False)
    return verbose is True


verbose_option = click.option(
    "-v/-q",
    "--verbose/--quiet",
    "verbose",
    default=None,
    show_default=False,
    callback=_loudness,
    help="Print all details, or only the verdict.",
)


def _quiet_option() -> Option:
    """Returns the option --quiet of a verb without the option --verbose."""
    return Option(
        ["-q", "--quiet"],
        is_flag=True,
        expose_value=False,
        callback=lambda ctx, param, quiet: set_quiet(ctx, quiet),
        help="Print only the verdict.",
    )


def _figure_name(ctx: click.Context, param: click.Parameter, value: Path | None) -> Path | None:
    """Refuses a file name whose suffix is not a figure format, before anything is computed."""
    if value is not None and value.suffix.lower() not in FIGURES:
        raise InputError(f"{value} is not a figure file: its name must end in {', '.join(FIGURES)}")
    return value


def plot_option(shows: str, name: str = "--plot") -> Callable[[F], F]:
    """Returns the option --plot PNG, which draws a figure."""
    return click.option(
        name, type=PATH, metavar="PNG", default=None, callback=_figure_name, help=f"Draw {shows}."
    )


def require_model_name(output: Path) -> None:
    """Refuses an output file of a model without the ending .json, before anything is computed.

    Raises
    ------
    InputError
        The name has another ending.
    """
    if output.suffix.lower() != ".json":
        raise InputError(f"{output} is not a model file: its name must end in .json")


def require_writable(
    *targets: Path | None,
    recording: Path | None = None,
    force: bool = False,
    inputs: Sequence[Path | None] = (),
) -> None:
    """Refuses output files that cannot be written, before anything is computed. None means no file.

    Parameters
    ----------
    *targets : path, optional
        Output files, which replace an existing file that is not a recording.
    recording : path, optional
        An output file, which replaces an existing file only if `force` is True.
    force : bool
        The value of the option --force.
    inputs : sequence of path
        The files that the verb reads.

    Raises
    ------
    InputError
        A folder does not exist or cannot be written, an output is a folder or one of the inputs, two outputs
        are one file, or an existing file must not be replaced.
    """
    wanted = [target for target in (recording, *targets) if target is not None]
    places = [os.path.realpath(target) for target in wanted]
    for target, place in zip(wanted, places, strict=True):
        if not target.parent.is_dir():
            raise InputError(f"{target} cannot be written: there is no folder {target.parent}")
        if target.is_dir():
            raise InputError(f"{target} cannot be written: it is a folder")
        for given in inputs:
            if given is not None and given.exists() and target.exists() and target.samefile(given):
                raise InputError(f"{target} is also an input; the result would overwrite it")
        if target == recording:
            if not force:
                require_absent(target)
        elif target.suffix.lower() in RECORDINGS and os.path.lexists(target):
            raise InputError(f"{target} exists already, and a recording is not replaced: choose another name")
        try:
            with tempfile.TemporaryFile(dir=Path(place).parent):
                pass
        except OSError as error:
            raise InputError(
                f"{target} cannot be written: its folder accepts no new file ({error.strerror})"
            ) from None
        if places.count(place) > 1:
            raise InputError(f"two results have the same file name: {target}")

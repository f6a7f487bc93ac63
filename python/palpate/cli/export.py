# SPDX-License-Identifier: Apache-2.0
"""palpate export: writes a model or a recording as a file for programs without palpate."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any

import click
from click.core import ParameterSource

from ..errors import InputError
from ..export.request import COGGING_TABLES, Request, Written
from .exit_status import end_with, finishing
from .printing import print_json, print_numbers, print_verdict, talk
from .verb import (
    PATH,
    READING_NAMES,
    ReadingOptions,
    accept_model_option,
    json_option,
    options,
    reading_options,
    require_writable,
    verb,
)

FORMATS = {
    "c": (
        "c_header",
        "A C header for a microcontroller: force law and structure with proved errors.",
        {"source", "precision", "name", "uncertified", "encoder_step", "force_limit", "accept_model"},
    ),
    "fmu": (
        "fmu",
        "An FMU (FMI 3.0, co-simulation) of the force law for simulators; needs a C compiler.",
        {"source", "name", "accept_model"},
    ),
    "table": ("table", "A CSV table of the force over the position.", {"source", "accept_model"}),
    "schema": ("schema", "The JSON schema of model files; needs no MODEL.json.", set[str]()),
    "mcap": (
        "mcap",
        "An MCAP file of a recording or flight record, for tools that show logs.",
        {"source", *READING_NAMES},
    ),
    "cogging": (
        "cogging",
        "The table of a motor controller against the cogging of its motor.",
        {"source", "cogging", "unit_force", "encoder_zero", "scale", "accept_model"},
    ),
    "knots": ("knots", "A curve of NUMBER knots, as pedals use it.", {"source", "knots", "accept_model"}),
}
"""Formats: option -> module of `palpate.export` with a function `write`, the help, the parameters it uses."""

_WITH_VALUE: dict[str, dict[str, Any]] = {
    "cogging": {"type": click.Choice(COGGING_TABLES)},
    "knots": {"type": int, "metavar": "NUMBER"},
}
"""Formats whose option has a value -> settings of the option."""

_EVERY_FORMAT = {"kind", "output", "as_json", "quiet"}
"""Parameters that every format uses."""

format_options: Callable[[Any], Any] = options(
    *(
        click.option(f"--{name}", default=None, show_default=False, help=text, **_WITH_VALUE[name])
        if name in _WITH_VALUE
        else click.option(
            f"--{name}", "kind", flag_value=name, type=str, default=None, show_default=False, help=text
        )
        for name, (_, text, _) in FORMATS.items()
    )
)


def _require_use(kind: str) -> None:
    """Refuses parameters that the format does not use."""
    context = click.get_current_context()
    for param in context.command.params:
        name = str(param.name)
        is_given = context.get_parameter_source(name) is ParameterSource.COMMANDLINE
        if is_given and name not in _EVERY_FORMAT | FORMATS[kind][2]:
            word = param.opts[0] if isinstance(param, click.Option) else context.params[name]
            raise InputError(f"{word} is given, but --{kind} does not use it: leave it out")


@verb("palpate export knob.json --c -o knob.h")
@click.argument("source", metavar="[MODEL.json|RECORDING]", type=PATH, required=False)
@format_options
@click.option(
    "-o",
    "--output",
    type=PATH,
    metavar="OUT",
    required=True,
    help="File to write; an existing one is replaced, except a recording.",
)
@click.option(
    "--precision",
    type=click.Choice(["single", "double"]),
    default="single",
    help="Number type of a program: float, or double for a processor with doubles.",
)
@click.option(
    "--name",
    default=None,
    show_default="from OUT",
    help="Name of the model in a program: an identifier of C.",
)
@click.option("--uncertified", is_flag=True, help="Export also a model without certificate.")
@click.option(
    "--encoder-step",
    type=float,
    default=None,
    metavar="NUMBER",
    show_default="of the certified device",
    help="Position for each count of the encoder, without certificate.",
)
@click.option(
    "--force-limit",
    type=float,
    default=None,
    metavar="NUMBER",
    show_default="of the certified device",
    help="Largest force of the device, without certificate.",
)
@click.option(
    "--unit-force",
    type=float,
    default=None,
    metavar="NUMBER",
    show_default="1 if the table has the unit of the model",
    help="Force for one unit of a table against cogging, such as N*m for 1 A of a moteus.",
)
@click.option(
    "--encoder-zero",
    type=float,
    default=0.0,
    metavar="RAD",
    help="Position of the model at zero of the controller's encoder, for a table against cogging.",
)
@click.option(
    "--scale",
    type=float,
    default=1.0,
    metavar="SHARE",
    help="Share of the cogging that the table cancels; palpate plan --compensate states the largest proved.",
)
@accept_model_option
@json_option
@reading_options
def export(
    source: Path | None,
    kind: str | None,
    output: Path,
    precision: str,
    name: str | None,
    uncertified: bool,
    encoder_step: float | None,
    force_limit: float | None,
    cogging: str | None,
    knots: int | None,
    unit_force: float | None,
    encoder_zero: float,
    scale: float,
    accept_model: bool,
    as_json: bool,
    reading: ReadingOptions,
) -> None:
    """Write a model or a recording as a file for programs without palpate.

    The file is compared with the model before it is written. A model needs a certificate for its device
    (palpate plan), because the file renders it without the guards of palpate. The exit code is 1 if the
    comparison fails.
    """
    valued = {"cogging": cogging, "knots": knots}
    kind = kind or next((name for name, value in valued.items() if value is not None), None)
    if kind is None:
        raise InputError(f"no format is given: one of {', '.join(f'--{each}' for each in FORMATS)}")
    _require_use(kind)
    require_writable(output, inputs=(source,))
    talk(f"writing {output} ...")
    recording = reading.read(source) if kind == "mcap" and source is not None else None
    request = Request(
        output,
        source,
        precision,
        name,
        uncertified,
        encoder_step,
        force_limit,
        accept_model,
        recording,
        cogging,
        unit_force,
        encoder_zero,
        scale,
        knots,
    )
    with finishing():
        writer = "admittance" if kind == "c" and request.is_for_display else FORMATS[kind][0]
        written: Written = import_module(f"palpate.export.{writer}").write(request)
        verdict = written.verdict
        if "accept_model" in FORMATS[kind][2]:
            verdict = request.model.verdict + verdict
        if as_json:
            print_json({"output": str(output), "format": kind, "verdict": str(verdict)} | written.record)
        else:
            print_verdict(verdict)
            print_numbers(written.numbers)
    end_with(verdict)

# SPDX-License-Identifier: Apache-2.0
"""palpate show: prints a model or a recording, or compares two models."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click
from click.core import ParameterSource

from ..errors import InputError
from ..model import Model, load_model
from ..planning import Plan
from ..recording.units import Unit, split_name
from ..verdict import Verdict
from ..verification import compare
from ..verification.metrics import noticed_findings
from .exit_status import end_with, finishing
from .figures import FrameFigure, drawing, figure_file, picture_frame, picture_path
from .printing import (
    number,
    print_json,
    print_line,
    print_numbers,
    print_table,
    print_verdict,
)
from .show_recording import is_recording, show_recording
from .verb import PATH, ReadingOptions, json_option, plot_option, reading_options, require_writable, verb

_SHOWN = ("kind", "inputs", "units", "network", "play_radius", "mass", "damping", "domain", "continuation",
          "slope_bounds", "data", "band")  # fmt: skip
"""Fields of a model file that `palpate show --json` prints unchanged."""


def _voices(ctx: click.Context, param: click.Parameter, value: str) -> tuple[int, ...]:
    """Parses numbers of voices that are separated by commas."""
    try:
        return tuple(int(number) for number in value.split(","))
    except ValueError:
        message = f"{value!r} must be whole numbers separated by commas, such as 1,2,4"
        raise click.BadParameter(message, ctx, param) from None


@verb("palpate show press.json")
@click.argument("file", metavar="MODEL.json|RECORDING", type=PATH)
@click.option(
    "--beside",
    "other_file",
    metavar="OTHER.json",
    type=PATH,
    help="Another model; prints the largest difference of both forces, over the just noticeable difference.",
)
@plot_option(
    "error of every compared network (the force is drawn by palpate identify --plot); with --beside the "
    "forces of both models and their difference; of a recording force, power spectrum, short-time and "
    "wavelet transform"
)
@plot_option("bounds of the frame of candidate wavelets, and its grid over the positions", "--plot-frame")
@click.option(
    "--a0",
    type=float,
    default=FrameFigure.a0,
    show_default=True,
    help="Ratio of neighbouring dilations in the figure of --plot-frame, above 1.",
)
@click.option(
    "--b0",
    type=float,
    default=FrameFigure.b0,
    show_default=True,
    help="Translation step in the figure of --plot-frame, above 0.",
)
@click.option(
    "--voices",
    metavar="N,...",
    callback=_voices,
    default=",".join(map(str, FrameFigure.voices)),
    show_default=True,
    help="Numbers of voices in the figure of --plot-frame, at most four; the grid has one voice.",
)
@json_option
@reading_options
def show(
    file: Path,
    other_file: Path | None,
    plot: Path | None,
    plot_frame: Path | None,
    a0: float,
    b0: float,
    voices: tuple[int, ...],
    as_json: bool,
    reading: ReadingOptions,
) -> None:
    """Print a model: its verdict, terms, domain and units, how it was identified, and its plan.

    Of a recording, print verdict, columns, ranges, rate and strokes. Exit code 1: the verdict is "no".
    """
    require_writable(plot, plot_frame, inputs=(file, other_file))
    frame = None if plot_frame is None else FrameFigure(plot_frame, a0, b0, voices)
    if frame is None and (unused := _given("a0", "b0", "voices")):
        raise click.UsageError(f"--{unused[0]} is a setting of the figure --plot-frame PNG: give both")
    if is_recording(file):
        if other_file is not None:
            raise InputError(f"--beside compares two models, but {file} is a recording: identify it first")
        show_recording(file, reading, plot=plot, frame=frame, as_json=as_json)
        return
    _refuse_reading_options(file, reading)
    model_file, model = file, load_model(file)
    if other_file is not None:
        if frame is not None:
            raise click.UsageError("--plot-frame draws the frame of one model, and --beside compares two")
        _compare(model, model_file, load_model(other_file), other_file, plot=plot, as_json=as_json)
        return
    with drawing() as write_figures:
        if plot is not None:
            picture_path(plot, model)
        if frame is not None:
            domain = float(model.lower[0]), float(model.upper[0])
            picture_frame(frame, domain, model.units["position"], of=file.name)
    with finishing():
        write_figures()
        if as_json:
            print_json(_record(model, model_file))
        else:
            print_verdict(model.verdict)
            for line in str(model).split("\n")[1 + len(model.verdict.reasons) :]:
                print_line(line, hanging=4)
            if (plan := _plan_record(model)) is not None:
                print_line()
                print_numbers({f"plan, {name}": str(value) for name, value in plan.items()})
        end_with(model.verdict)


def _refuse_reading_options(file: Path, reading: ReadingOptions) -> None:
    """Refuses options of the reading of recordings if the file is a model."""
    given = _given(*reading.options)
    for parameter in click.get_current_context().command.params:
        if parameter.name in given:
            raise InputError(f"{parameter.opts[0]} is an option for recordings, but {file} is a model")


def _given(*names: str) -> list[str]:
    """Returns the parameters among `names` that the command line contains."""
    source = click.get_current_context().get_parameter_source
    return [name for name in names if source(name) is ParameterSource.COMMANDLINE]


def _record(model: Model, file: Path) -> dict[str, Any]:
    """Returns the values of a model that `palpate show --json` prints, by their names in the model file."""
    content = model.to_dict()
    fit = {name: value for name, value in content["fit"].items() if name != "path"}
    return {
        "model": str(file),
        "verdict": str(model.verdict),
        **{name: content[name] for name in _SHOWN if name in content},
        "fit": fit,
        "plan": _plan_record(model),
    }


def _plan_record(model: Model) -> dict[str, Any] | None:
    """Returns structure, device and verdict of the plan in a model file."""
    if model.plan is None:
        return None
    plan = Plan.of(model)
    return {
        "structure": plan.description,
        "device": None if plan.certificate is None else plan.certificate.device.id,
        "verdict": str(plan.verdict),
    }


def _compare(
    model: Model, model_file: Path, other: Model, other_file: Path, *, plot: Path | None, as_json: bool
) -> None:
    """Prints the largest force difference of two models, and a verdict on both models and the difference."""
    strokes = compare(model, other)
    position, force = (_file_unit(model, role) for role in ("position", "force"))
    verdict = model.verdict + other.verdict + Verdict(noticed_findings(strokes, position, force))
    with drawing() as write_figures:
        if plot is not None:
            from ..plotting import draw_two_models

            title = f"{model_file.name} and {other_file.name}"
            with figure_file(plot, height_inches=3.6, rows=(2.2, 1.0), title=title) as (above, beneath):
                names = (model_file.stem, other_file.stem)
                draw_two_models(above, beneath, strokes, model.units, names=names)
    with finishing():
        write_figures()
        if as_json:
            print_json(
                {
                    "model": str(model_file),
                    "beside": str(other_file),
                    "verdict": str(verdict),
                    **{
                        name: {stroke.name or "both": getattr(stroke, name) for stroke in strokes}
                        for name in ("worst", "worst_difference", "worst_position", "noticed_share")
                    },
                }
            )
        else:
            print_verdict(verdict)
            print_table(
                ("stroke", "largest difference", "at", "in JND", "noticed on"),
                [
                    (
                        each.name or "both",
                        force.text(each.worst_difference),
                        position.text(each.worst_position),
                        number(each.worst),
                        f"{each.noticed_share:.0%}",
                    )
                    for each in strokes
                ],
            )
        end_with(verdict)


def _file_unit(model: Model, role: str) -> Unit:
    """Returns the unit of a role in the recording of a model, if its column names it, else the SI unit."""
    named = split_name(model.data.columns.get(role, ""))[1]
    return named if named is not None and named.si == model.units[role] else Unit.of_si(model.units[role])

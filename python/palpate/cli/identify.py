# SPDX-License-Identifier: Apache-2.0
"""palpate identify: identifies a model from recordings."""

from __future__ import annotations

import re
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, fields
from itertools import chain
from pathlib import Path
from types import NoneType, UnionType
from typing import Any, Union, get_args, get_origin, get_type_hints

import click
import numpy as np

from ..baselines import Compared, compare
from ..identification import identify as identify_model
from ..identification.classes.findings import error_findings, error_text
from ..identification.identify_files import identify_files
from ..identification.options import (
    CHOICES,
    RESERVED_INPUTS,
    IdentifyOptions,
    SearchOptions,
    default_of,
    summaries,
)
from ..identification.search.evidence import reporting_to
from ..model import Model
from ..model.model_file import CONTINUATIONS, dynamics_of
from ..recording import Recording
from ..recording.files import CELL_BYTES, TooLargeError, require_memory
from ..recording.formats import is_read_in_parts
from ..recording.units import POSITION_UNITS, UNSTATED_UNIT, Unit, symbols_of, unit_of
from ..verdict import Verdict
from ..verification import verify
from ..verification.verification import circumstances, errors_of
from .exit_status import end_with, finishing
from .figures import drawing, picture_verification
from .printing import (
    WIDEST,
    Verb,
    number,
    print_details,
    print_json,
    print_line,
    print_numbers,
    print_table,
    print_verdict,
    prints_unicode,
    progress,
    talk,
    terminal_width,
)
from .sketch import sketch_of
from .verb import (
    PATH,
    ReadingOptions,
    expert_option,
    json_option,
    options,
    plot_option,
    reading_options,
    require_model_name,
    require_writable,
    verb,
    verbose_option,
)

_READ_BY_PARTS = (
    "position",
    "force",
    "time",
    "direction",
    "units",
    "columns",
    "decimal",
    "negate",
    "invalid",
)
"""Arguments of `read_recording` that can be used if a file is too large for memory and is read in parts."""


def _text(value: Any) -> str:
    """Returns the default value of a setting as the text that follows NAME= in the help."""
    if isinstance(value, tuple):
        return ",".join(f"{number:g}" for number in value)
    return str(value).lower() if isinstance(value, bool) else str(value)


_HELP = summaries() | {
    "search": "Setting of the search, repeatable: "
    + ", ".join(f"{each.name}={_text(each.default)}" for each in fields(SearchOptions))
    + "."
}
"""Help of each option that is a field of `IdentifyOptions`; its docstring begins with the same sentence."""

_METAVAR = {
    "slope_bounds": "LEAST LARGEST",
    "fixed_force": "POSITION FORCE",
    "inputs": "NAMES",
    "period": "15deg",
}
"""Placeholder that the help shows for the value of an option, by option."""

_MOST_DECISIONS = 6
"""Largest number of decisions of the model selection that the summary prints"""

_GROUP = {"inputs": "Model", "period": "Model", "monotone": "Constraints"}
"""Heading in the help, by option; options that are not listed here are under "Expert"."""


def _search(ctx: click.Context, param: click.Parameter, values: tuple[str, ...]) -> SearchOptions:
    """Returns the settings of the search for wavelets, each given as NAME=VALUE."""
    for value in values:
        if "=" not in value:
            raise click.BadParameter(f"{value!r} must be NAME=VALUE", ctx, param)
    return SearchOptions.parsed(dict(value.split("=", 1) for value in values))


_QUANTITY = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:e[-+]?\d+)?)\s*(.*?)\s*", re.IGNORECASE)
"""A number and the text behind it."""


def _period(ctx: click.Context, param: click.Parameter, value: str | None) -> tuple[float, str] | None:
    """Returns a period in SI and its SI unit, which is empty if the number has no unit."""
    if value is None:
        return None
    found = _QUANTITY.fullmatch(value)
    unit = unit_of(found[2]) if found and found[2] else UNSTATED_UNIT
    if not found or unit is None or unit.si not in ("", *POSITION_UNITS):
        message = (
            f"{value!r} must be a number in m or rad, or a number and a unit ({symbols_of(POSITION_UNITS)})"
        )
        raise click.BadParameter(message, ctx, param)
    return float(found[1]) * unit.factor, unit.si


def _option(name: str, hint: Any, default: Any) -> Callable[[Any], Any]:
    flag = "--" + name.replace("_", "-")
    text: dict[str, Any] = {
        "default": default,
        "help": _HELP.get(name, "").replace(" [-]", ""),
        "group": _GROUP.get(name, "Expert"),
    }
    if name == "period":
        return expert_option(flag, name, metavar=_METAVAR[name], callback=_period, **text)
    alternatives = get_args(hint) if get_origin(hint) in (Union, UnionType) else (hint,)
    kinds = [kind for kind in alternatives if kind is not NoneType]
    if kinds == [bool]:
        return expert_option(f"{flag}/--no-{flag[2:]}", name, show_default=default, **text)
    if kinds == [SearchOptions]:
        text |= {"default": (), "metavar": "NAME=VALUE", "callback": _search}
        return expert_option(flag, name, multiple=True, **text)
    if len(kinds) == 1 and get_args(kinds[0]):
        text |= {"nargs": len(get_args(kinds[0])), "metavar": _METAVAR.get(name)}
        return expert_option(flag, name, type=float, **text)
    kind = click.Choice(CHOICES[name]) if name in CHOICES else kinds[0]
    return expert_option(flag, name, type=kind, metavar=_METAVAR.get(name), **text)


_HINTS = get_type_hints(IdentifyOptions)
_IDENTIFY_OPTIONS = [
    _option(each.name, _HINTS[each.name], default_of(each)) for each in fields(IdentifyOptions)
]


_OBJECT_SIZES = "palpate.object_sizes"
"""Key of the context of the verb: numbers of files that follow each --object"""


class _IdentifyVerb(Verb):
    """The verb identify, whose option --object takes all files up to the next option."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Moves the files of each --object to the arguments, and notes how many belong to each object."""
        kept: list[str] = []
        sizes: list[int] = []
        in_object = False
        for word in args:
            if word == "--object":
                sizes.append(0)
                in_object = True
                continue
            in_object = in_object and not word.startswith("-")
            if in_object:
                sizes[-1] += 1
            kept.append(word)
        ctx.meta[_OBJECT_SIZES] = sizes
        return super().parse_args(ctx, kept)


def _require_object_of_each(sizes: Sequence[int], files: int) -> None:
    """Refuses an object without files, and files that belong to no object, if there are objects."""
    if sizes and (min(sizes) == 0 or sum(sizes) != files):
        raise click.UsageError(
            f"--object is followed by {' and '.join(map(str, sizes))} files, and {files} files are given: "
            "give each file after an --object"
        )


def _objects(sizes: Sequence[int], recordings: Sequence[Recording]) -> list[list[Recording]] | None:
    """Returns the recordings of each object; None without the option --object."""
    following = iter(recordings)
    return [[next(following) for _ in range(size)] for size in sizes] or None


@verb("palpate identify press.csv -o press.json --hold-out-every 5 --plot press.png", cls=_IdentifyVerb)
@click.argument("recording_files", metavar="RECORDING...", type=PATH, nargs=-1, required=True)
@click.option("-o", "--output", type=PATH, metavar="MODEL.json", required=True, help="Model file to write.")
@expert_option(
    "--object",
    metavar="RECORDING...",
    multiple=True,
    expose_value=False,
    help="Recordings of one object; repeat it for each of several objects of one kind.",
)
@click.option(
    "--hold-out-every",
    type=click.IntRange(min=2),
    default=None,
    metavar="K",
    help="Hold out every K-th row for the error.",
)
@plot_option("force over position, and the residuals")
@json_option
@verbose_option
@expert_option(
    "--baselines",
    "with_baselines",
    is_flag=True,
    help="Fit the usual methods to the same rows and compare; needs --hold-out-every.",
)
@expert_option(
    "--sketch/--no-sketch",
    default=None,
    show_default="on a terminal",
    help="Print the force curve as text.",
)
@expert_option(
    "--out-of-core",
    is_flag=True,
    help="Read CSV or Parquet part by part, as files above 4 GiB of cells are.",
)
@expert_option(
    "--jobs",
    type=click.IntRange(min=1),
    default=1,
    help="Processes that read the files; above 1 implies --out-of-core.",
)
@expert_option(
    "--scheduler",
    metavar="ADDRESS",
    default=None,
    help="Dask scheduler whose workers read the files (tcp://host:8786); implies --out-of-core.",
)
@reading_options
@options(*_IDENTIFY_OPTIONS)
def identify(
    recording_files: tuple[Path, ...],
    output: Path,
    hold_out_every: int | None,
    verbose: bool,
    with_baselines: bool,
    sketch: bool | None,
    out_of_core: bool,
    jobs: int,
    scheduler: str | None,
    plot: Path | None,
    as_json: bool,
    reading: ReadingOptions,
    **settings: Any,
) -> None:
    """Identify a model of force over position from recordings.

    RECORDING: CSV, Parquet, .xlsx, .xls, .ods, .npz, .mat or MCAP, with the unit in each column name:
    position_rad, "Force [gf]", "Force / N". The simplest model that fits is taken.
    """
    require_model_name(output)
    require_writable(output, plot, inputs=recording_files)
    recordings: list[Recording] = []
    sizes = click.get_current_context().meta[_OBJECT_SIZES]
    _require_object_of_each(sizes, len(recording_files))
    by_parts = out_of_core or jobs != 1 or scheduler is not None
    if not by_parts:
        columns = [name for name in settings["inputs"].split(",") if name.strip() not in RESERVED_INPUTS]
        try:
            recordings = _read_at_once(recording_files, reading, [name.strip() for name in columns])
        except TooLargeError as error:
            if not all(map(is_read_in_parts, recording_files)):
                raise
            by_parts = True
            talk(str(error))
    if by_parts:
        left = {name: value for name, value in reading.options.items() if name not in _READ_BY_PARTS}
        left |= {"object": sizes, "plot": plot, "baselines": with_baselines}
        _require_unused(hold_out_every=hold_out_every, **left)
    period, unit = settings["period"] or (None, "")
    settings["period"] = period
    others = _fit_baselines(recordings, hold_out_every) if with_baselines else []
    judged_on = recordings
    if hold_out_every is not None:
        parts = [recording.split(hold_out_every) for recording in recordings]
        recordings, judged_on = [train for train, _ in parts], [test for _, test in parts]
    if recordings:
        _require_unit_of_period(unit, recordings[0].units["position"])
    talk("identifying ...")
    start = time.perf_counter()
    with progress("identifying") as shown, reporting_to(lambda name, n: shown(f"{name}, {n} wavelets")):
        if by_parts:
            chosen = {name: reading.options[name] for name in _READ_BY_PARTS}
            model = identify_files(
                list(recording_files),
                jobs=jobs,
                scheduler=scheduler,
                progress=lambda done, total: shown(
                    f"read {done} of {total} parts ({100 * done / total:.0f} %)"
                ),
                **{name: value for name, value in chosen.items() if value is not None},
                **settings,
            )
        else:
            objects = _objects(sizes, recordings)
            model = identify_model(recordings if objects is None else None, objects=objects, **settings)
    if by_parts:
        _require_unit_of_period(unit, model.units["position"])
        chosen_columns = ", ".join(f"{role} is {column}" for role, column in model.data.columns.items())
        talk(f"read {model.data.rows} rows; {chosen_columns}")
        for note in (*model.notes["rows"], *model.notes["identification"]):
            talk(f"  {note}")
    seconds = time.perf_counter() - start
    verified = []
    if hold_out_every is not None or plot is not None:
        verified = [(recording, verify(model, recording)) for recording in judged_on]
    nrmse, settled, rms = model.fit.nrmse, model.notes["settled_nrmse"], ""
    compared = sum(verification.n for _, verification in verified)
    verdict = model.verdict
    if hold_out_every is not None:
        whole, weighted = errors_of([found for _, found in verified])
        nrmse, settled = whole.nrmse, weighted.nrmse
        rms = f"RMS {verified[0][0].file_unit('force').text(whole.rmse)}, "
        verdict += Verdict(tuple(error_findings(settled, f"{compared} held-out rows")))
        verdict += Verdict(tuple(chain.from_iterable(circumstances(model, *each) for each in verified)))
    result = {
        "model": str(output),
        "n_wavelets": model.n_wavelets,
        "n_parameters": model.n_parameters,
        "model_class": model.fit.model_class,
        "stop_reason": model.stop_reason,
        "nrmse": nrmse,
        "settled_nrmse": settled,
        "verdict": str(verdict),
        "seconds": seconds,
    }
    if hold_out_every is not None:
        result["held_out_rows"] = compared
    if model.band is not None:
        result["unseen_error"], result["band_coverage"] = model.band.unseen_error, model.band.coverage
    if "roles" in model.notes:
        result["roles"] = model.notes["roles"]
    if with_baselines:
        result["baselines"] = [asdict(each) for each in others]
    rows = sum(len(recording) for recording in judged_on)
    of_rows = str(rows) if compared == rows else f"{compared} of {rows}"
    judged = f"{of_rows} rows held out"
    if hold_out_every is None:
        fitted = model.notes["error_rows"]
        judged = f"{fitted} of {rows} rows" if fitted < rows else "the rows of the identification"
    left_out_nrmse, rows_left_out = model.notes["left_out_nrmse"], model.notes["rows"]
    left_out = ""
    if hold_out_every is None and left_out_nrmse > nrmse:
        left_out = f", {number(left_out_nrmse)} on rows left out of the fit"
    if hold_out_every is None and (shift_nrmse := model.notes["shift_nrmse"]):
        left_out += f", {number(shift_nrmse)} if press and release are shifted"
    with drawing() as write_figures:
        if plot is not None:
            picture_verification(plot, model, verified, recordings)
    with finishing():
        write_figures()
        model.save(output)
        if as_json:
            print_json(result)
        else:
            print_verdict(verdict)
            print_numbers(
                {
                    "model": f"{output}: {model.fit.model_class}, {model.terms}, "
                    f"{model.n_parameters} parameters",
                    "error": f"{rms}{error_text(nrmse, settled, judged)}{left_out}",
                    **({"rows": " ".join(rows_left_out).removesuffix(".")} if rows_left_out else {}),
                    **_outside_text(model, recordings),
                    **_object_text(model),
                    **_band_text(model, recordings),
                    **dict(note.split(": ", 1) for note in model.notes["model_selection"][-_MOST_DECISIONS:]),
                    **_corrected_lag(recordings),
                    "time": f"{seconds:.2f} s",
                }
            )
            if with_baselines:
                _print_baselines(nrmse, model.n_parameters, seconds, others)
            if sketch or (sketch is None and terminal_width() is not None):
                _print_sketch(model, recordings)
            if verbose:
                reason = f"growth of the network stopped by {model.stop_reason}"
                print_details([reason, *rows_left_out, *model.notes["identification"]])
    end_with(verdict)


def _read_at_once(files: Sequence[Path], reading: ReadingOptions, inputs: Sequence[str]) -> list[Recording]:
    """Reads all rows of files, and refuses files that together need more memory than the limit."""
    recordings: list[Recording] = []
    cells = 0
    for file in files:
        recording = reading.read(file, inputs)
        cells += len(recording) * (len(recording.source.columns) + len(recording.columns))
        require_memory(f"{file}, with the files before it,", CELL_BYTES * cells)
        recordings.append(recording)
    return recordings


def _require_unit_of_period(unit: str, position_unit: str) -> None:
    """Refuses a period in the unit of another quantity than the position."""
    if unit and position_unit and unit != position_unit:
        raise click.UsageError(
            f"--period is in {unit} and the position in {position_unit}: both must be lengths or both angles"
        )


def _outside_text(model: Model, recordings: Sequence[Recording]) -> dict[str, str]:
    """Returns the line of the summary on the force outside the recorded positions, for one input, or on its
    period."""
    unit = _unit_of("position", model, recordings)
    if model.period is not None:
        return {"period": f"the force repeats every {unit.text(model.period)}"}
    if len(model.inputs) > 1:
        return {}
    force = _unit_of("force", model, recordings)
    both = f"{force.shown}/{unit.shown}" if force.shown and unit.shown else ""
    stiffness = Unit(both, both, force.factor / unit.factor)
    way = {"direction": 1.0} if model.hysteretic else {}
    texts = []
    for side, end, out, kind in (
        ("below", float(model.lower[0]), -1.0, model.below),
        ("above", float(model.upper[0]), 1.0, model.above),
    ):
        slope = float(model.slope(end + out * float(np.ptp(model.domain)), **way))
        how = f" with {stiffness.text(slope)}" if kind == "linear" else " (the tool leaves)"
        texts.append(f"{side} {unit.text(end)}: {CONTINUATIONS[kind]}{how}")
    return {"outside": "; ".join(texts)}


def _object_text(model: Model) -> dict[str, str]:
    """Returns the line of the summary on mass and damping of the object, if the model has one of them."""
    values = [f"{name} {value}" for name, value in dynamics_of(model).items()]
    return {"object": ", ".join(values)} if values else {}


def _unit_of(role: str, model: Model, recordings: Sequence[Recording]) -> Unit:
    """Returns the unit of the first file if it was read as a whole, else that of the model."""
    return recordings[0].file_unit(role) if recordings else Unit.of_si(model.units[role])


def _band_text(model: Model, recordings: Sequence[Recording]) -> dict[str, str]:
    """Returns the check of the band for the summary; empty without band."""
    band = model.band
    if band is None:
        return {}
    force = recordings[0].file_unit("force")
    inside = "" if band.coverage is None else f", {band.coverage:.1%} of its rows in the band"
    error = f"RMS {force.text(band.unseen_error)} on each {band.left_out} left out of the fit{inside}"
    return {"repeats": error}


def _print_sketch(model: Model, recordings: Sequence[Recording]) -> None:
    """Prints the force curve as text, in the units of the first file if it was read as a whole."""
    position, force = (_unit_of(role, model, recordings) for role in ("position", "force"))
    columns = terminal_width() or WIDEST
    if lines := sketch_of(model, position, force, columns=columns, unicode=prints_unicode()):
        print_line()
        for line in lines:
            print_line(line)


def _corrected_lag(recordings: Sequence[Recording]) -> dict[str, str]:
    """Returns the line of the summary on a corrected lag of the force; empty without correction."""
    corrected_s = max((part.corrected_lag_s for part in recordings), default=0.0)
    return {"force lag": f"{1e3 * corrected_s:.3g} ms corrected"} if corrected_s else {}


def _require_unused(**others: Any) -> None:
    """Refuses options that need all rows in memory; called if a file is read part by part."""
    for name, value in others.items():
        if value:
            raise click.UsageError(
                f"--{name.replace('_', '-')} needs all rows at once, and these files are read part by part; "
                "palpate verify compares the model with a recording"
            )


def _fit_baselines(recordings: Sequence[Recording], hold_out_every: int | None) -> list[Compared]:
    """Fits the usual methods (baselines), to compare with the model, to the rows that are not held out."""
    if hold_out_every is None:
        raise click.UsageError("--baselines compares on held-out rows and needs --hold-out-every K")
    talk("fitting the baselines ...")
    return compare(recordings, hold_out_every)


def _print_baselines(nrmse: float, n_parameters: int, seconds: float, others: Sequence[Compared]) -> None:
    """Prints the NRMSE on the held-out rows, first of the model, then of the usual methods (baselines)."""
    rows = [("wavelet network", number(nrmse), str(n_parameters), f"{seconds:.2f}")]
    rows += [
        (each.name, "refused", "", "")
        if each.refused
        else (each.name, number(each.nrmse), str(each.n_parameters), f"{each.seconds:.2f}")
        for each in others
    ]
    print_line()
    print_table(("on the same held-out rows", "nrmse", "parameters", "seconds"), rows)
    for each in others:
        if each.refused:
            print_line(f"{each.name} is refused: {each.refused}")

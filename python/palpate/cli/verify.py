# SPDX-License-Identifier: Apache-2.0
"""palpate verify: compares a model with a recording."""

from __future__ import annotations

from pathlib import Path

import click

from ..errors import InputError
from ..model import load_model
from ..verification import ClosedLoop, columns_of
from ..verification import verify as verify_model
from .exit_status import end_with, finishing
from .figures import (
    close_loops,
    picture_closed_loops,
    picture_verification,
    print_closed_loops,
)
from .printing import (
    number,
    print_json,
    print_numbers,
    print_verdict,
    talk,
)
from .verb import PATH, ReadingOptions, json_option, plot_option, reading_options, require_writable, verb


@verb("palpate verify press.json fresh.csv --plot residuals.png")
@click.argument("model_file", metavar="MODEL.json", type=PATH)
@click.argument("recording_file", metavar="RECORDING", type=PATH)
@plot_option("measured and modelled force over position, residuals beneath")
@plot_option("recorded and rendered force over position, the loop closed both ways", "--plot-closed-loop")
@click.option(
    "--play-radius",
    type=float,
    default=None,
    metavar="NUMBER",
    help="r of a model with hysteresis: its play operator follows the positions, whatever the direction. "
    "Without a direction: that of the flight record, the model or its plan, or 1 % of the travel.",
)
@json_option
@reading_options
def verify(
    model_file: Path,
    recording_file: Path,
    plot: Path | None,
    plot_closed_loop: Path | None,
    play_radius: float | None,
    as_json: bool,
    reading: ReadingOptions,
) -> None:
    """Compare a model with a recording, best one that it has not seen.

    The closed loop is run both ways: the recorded motion moves the device and the rendered force is compared;
    the recorded force drives the object and the resulting position is compared. The exit code is 1 if the
    verdict is no.
    """
    if recording_file.suffix == ".json" != model_file.suffix:
        raise InputError(f"the model comes first: palpate verify {recording_file} {model_file}")
    require_writable(plot, plot_closed_loop, inputs=(model_file, recording_file))
    model = load_model(model_file)
    recording = reading.read(recording_file, columns_of(model))
    verification = verify_model(model, recording, play_radius=play_radius)
    for note in verification.notes:
        talk(f"  {note}")
    loops: list[ClosedLoop] = []
    if plot_closed_loop is not None:
        loops = close_loops(model, recording)
        for note in dict.fromkeys(note for loop in loops for note in loop.notes):
            talk(f"  {note}")
    with finishing():
        if plot is not None:
            picture_verification(plot, model, [(recording, verification)])
        if plot_closed_loop is not None:
            picture_closed_loops(plot_closed_loop, recording, loops)
        if as_json:
            print_json(
                {
                    name: getattr(verification, name)
                    for name in ("nrmse", "rmse", "mse", "r2", "worst", "within_jnd", "n", "fresh",
                                 "extrapolated")
                }
                | {"verdict": str(verification.verdict), "units": verification.units}
            )  # fmt: skip
        else:
            print_verdict(verification.verdict)
            unit = recording.units["force"]
            print_numbers(
                {
                    "nrmse": number(verification.nrmse),
                    "rmse": f"{number(verification.rmse)} {unit}",
                    "r2": f"{verification.r2:.6f}",
                    "worst": f"{number(verification.worst)} {unit}",
                    "within what a hand can tell": f"{100 * verification.within_jnd:.3g} % of rows",
                    "rows": f"{verification.n} of {len(recording)}",
                    "fresh": "yes" if verification.fresh else "no: the model was identified on this data",
                    "outside the model's domain": f"{verification.extrapolated} rows",
                }
            )
            if loops:
                click.echo()
                print_closed_loops(loops)
    end_with(verification.verdict)

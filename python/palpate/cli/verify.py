# SPDX-License-Identifier: Apache-2.0
"""palpate verify: compares a model with a recording."""

from __future__ import annotations

from pathlib import Path

import click

from ..errors import InputError, command_word
from ..model import load_model
from ..recording import Recording
from ..verdict import FORCE_JND
from ..verification import ClosedLoop, Verification, columns_of
from ..verification import verify as verify_model
from ..verification.metrics import STIFFNESS_JND
from ..verification.verification import is_fresh
from .exit_status import end_with, finishing
from .figures import (
    close_loops,
    drawing,
    picture_closed_loops,
    picture_verification,
    print_closed_loops,
)
from .printing import (
    print_details,
    print_json,
    print_line,
    print_numbers,
    print_paragraph,
    print_verdict,
    talk,
)
from .verb import (
    PATH,
    ReadingOptions,
    expert_option,
    json_option,
    plot_option,
    reading_options,
    require_writable,
    verb,
    verbose_option,
)


@verb("palpate verify press.json fresh.csv --plot residuals.png")
@click.argument("model_file", metavar="MODEL.json", type=PATH)
@click.argument("recording_file", metavar="RECORDING", type=PATH)
@plot_option("measured and modelled force over position, residuals beneath")
@plot_option(
    "recorded and simulated force over position: the recorded motion drives the device, and the recorded "
    "force drives the virtual object alone",
    "--plot-closed-loop",
)
@json_option
@verbose_option
@expert_option(
    "--play-radius",
    group="Model",
    type=float,
    default=None,
    metavar="NUMBER",
    show_default="from the flight record, the model or its plan, else 1 % of the model's domain",
    help="Play radius r of a model with hysteresis. The play operator then ignores the recorded direction.",
)
@reading_options
def verify(
    model_file: Path,
    recording_file: Path,
    plot: Path | None,
    plot_closed_loop: Path | None,
    as_json: bool,
    verbose: bool,
    play_radius: float | None,
    reading: ReadingOptions,
) -> None:
    """Compare a model with a recording, best one that it has not seen.

    Of the recording of the identification only the rows are compared that --hold-out-every held out.

    The closed loop is run both ways: the recorded motion moves the device and the rendered force is compared;
    the recorded force drives the object and the resulting position is compared. The exit code is 1 if the
    verdict is no.
    """
    if recording_file.suffix == ".json" != model_file.suffix:
        swapped = f"palpate verify {command_word(recording_file)} {command_word(model_file)}"
        raise InputError(f"the model comes first: {swapped}")
    require_writable(plot, plot_closed_loop, inputs=(model_file, recording_file))
    model = load_model(model_file)
    recording = reading.read(recording_file, columns_of(model))
    whole, held_out = recording, model.data.held_out_every
    if held_out and not is_fresh(model.data, recording.source):
        recording = recording.split(held_out)[1]
        talk(f"  the model was identified on the other rows: every {held_out}th row is compared")
    verification = verify_model(model, recording, play_radius=play_radius)
    loops: list[ClosedLoop] = []
    if plot_closed_loop is not None:
        loops = close_loops(model, whole)
    with drawing() as write_figures:
        if plot is not None:
            picture_verification(plot, model, [(recording, verification)])
        if plot_closed_loop is not None:
            picture_closed_loops(plot_closed_loop, whole, loops)
    with finishing():
        write_figures()
        if as_json:
            print_json(
                {
                    name: getattr(verification, name)
                    for name in ("nrmse", "settled_nrmse", "rmse", "mse", "r2", "worst", "within_jnd",
                                 "within_band", "n", "fresh", "extrapolated")
                }
                | {"verdict": str(verification.verdict), "units": verification.units}
            )  # fmt: skip
        else:
            print_verdict(verification.verdict)
            print_numbers(verification.summary())
            if loops:
                print_line()
                print_closed_loops(loops)
                for note in dict.fromkeys(note for loop in loops for note in loop.notes):
                    print_paragraph(note, indent="  ")
            if verbose:
                print_details([*_further_numbers(recording, verification), *verification.notes])
    end_with(verification.verdict)


def _further_numbers(recording: Recording, found: Verification) -> list[str]:
    """Returns the numbers of a verification that --verbose adds, in sentences."""
    numbers = [
        f"r2 {found.r2:.6f}",
        f"lag-1 autocorrelation of the residuals {found.whiteness:.3g} (0 is white), "
        f"Durbin-Watson statistic {found.durbin_watson:.3g} (2 is white)",
        "a hand does not feel a force error up to "
        f"{FORCE_JND:.0%} of the force, or {recording.file_unit('force').text(found.jnd_floor)}",
    ]
    if found.stiffness_within_jnd is not None:
        numbers.append(
            f"stiffness within {STIFFNESS_JND:.0%} of the recorded one in {found.stiffness_within_jnd:.1%} "
            "of the position cells"
        )
    return numbers

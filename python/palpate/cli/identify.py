# SPDX-License-Identifier: Apache-2.0
"""palpate identify: recordings in, a model out."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import asdict
from itertools import chain
from pathlib import Path
from typing import Any

import click
import numpy as np

from ..baselines import Compared, compare
from ..identification import identify as identify_model
from ..identification.classes.findings import error_findings
from ..identification.options import RESERVED_INPUTS
from ..identification.search.evidence import reporting_to
from ..recording import Recording
from ..verdict import Verdict
from ..verification import Verification, verify
from ..verification.verification import circumstances
from .exit_status import end_with, finishing
from .figures import picture_verification, require_figure_name
from .identify_options import identify_options
from .large_files import LargeFiles, large_file_options
from .printing import (
    number,
    print_json,
    print_line,
    print_numbers,
    print_table,
    print_verdict,
    progress,
    require_distinct,
    require_writable,
    talk,
)
from .verb import PATH, ReadingOptions, json_option, plot_option, reading_options, verb


@verb("palpate identify press.csv -o press.json --hold-out-every 5 --plot press.png")
@click.argument("recording_files", metavar="RECORDING...", type=PATH, nargs=-1, required=True)
@click.option(
    "-o", "--output", type=PATH, metavar="MODEL.json", required=True, help="The model file to write."
)
@click.option(
    "--hold-out-every",
    type=click.IntRange(min=2),
    default=None,
    metavar="K",
    help="Keep every K-th row out of the identification and report the error on these rows.",
)
@click.option(
    "--baselines",
    "beside",
    is_flag=True,
    help="Fit the usual methods to the same rows and compare; needs --hold-out-every.",
)
@large_file_options
@plot_option("measured and modelled force over position, residuals beneath")
@json_option
@reading_options
@identify_options
def identify(
    recording_files: tuple[Path, ...],
    output: Path,
    hold_out_every: int | None,
    beside: bool,
    large: LargeFiles,
    plot: Path | None,
    as_json: bool,
    reading: ReadingOptions,
    options: dict[str, Any],
) -> None:
    """Identify a model of force over position from recordings.

    A recording is CSV, Parquet, Excel, NumPy (.npz), MATLAB (.mat) or MCAP. The name of a column states its
    unit: position_rad, "Force [gf]", "Force (mN)", "Force / N". Columns are chosen by name and unit; the
    first line printed says which. The model is as simple as the data allows: a constant, a line, a wavelet
    network, and hysteresis where press and release differ.
    """

    if plot is not None:
        require_figure_name(plot)
    for target in filter(None, (output, plot)):
        require_writable(target, inputs=recording_files)
    require_distinct(output, plot)
    recordings: list[Recording] = []
    if large.wanted:
        large.require_alone({"--hold-out-every": hold_out_every, "--baselines": beside, "--plot": plot})
    else:
        columns = [name for name in options["inputs"].split(",") if name.strip() not in RESERVED_INPUTS]
        recordings = [reading.read(path, [name.strip() for name in columns]) for path in recording_files]
    others = _fit_baselines(recordings, hold_out_every) if beside else []
    judged_on = recordings
    if hold_out_every is not None:
        parts = [recording.split(hold_out_every) for recording in recordings]
        recordings, judged_on = [train for train, _ in parts], [test for _, test in parts]
    talk("identifying ...")
    start = time.perf_counter()
    with progress("identifying") as shown, reporting_to(lambda name, n: shown(f"{name}, {n} wavelets")):
        if large.wanted:
            model = large.identify(recording_files, reading, options)
        else:
            model = identify_model(recordings if len(recordings) > 1 else recordings[0], **options)
    seconds = time.perf_counter() - start
    verified = [(recording, verify(model, recording)) for recording in judged_on]
    for note in model.notes.get("identification", ()):
        talk(f"  {note}")
    nrmse = model.fit.nrmse if hold_out_every is None else _pooled_nrmse(verified)
    verdict = model.verdict
    if hold_out_every is not None:
        held_out = sum(verification.n for _, verification in verified)
        verdict += Verdict(tuple(error_findings(nrmse, f"{held_out} held-out rows")))
        verdict += Verdict(tuple(chain.from_iterable(circumstances(model, *each) for each in verified)))
    result = {
        "model": str(output),
        "n_wavelets": model.n_wavelets,
        "n_parameters": model.n_parameters,
        "model_class": model.fit.model_class,
        "stop_reason": model.stop_reason,
        "nrmse": nrmse,
        "verdict": str(verdict),
        "seconds": seconds,
    }
    if hold_out_every is not None:
        result["held_out_rows"] = sum(verification.n for _, verification in verified)
    if beside:
        result["baselines"] = [asdict(each) for each in others]
    rows = sum(len(recording) for recording in judged_on)
    compared = sum(verification.n for _, verification in verified)
    of_rows = str(rows) if compared == rows else f"{compared} of {rows}"
    judged = "the rows it was identified on" if hold_out_every is None else f"{of_rows} rows held out"
    if hold_out_every is None and options["loss"] == "huber":
        judged += ", those far from the others weighed down"
    with finishing():
        if plot is not None:
            picture_verification(plot, model, verified, recordings)
        model.save(output)
        if as_json:
            print_json(result)
            end_with(verdict)
            return
        print_verdict(verdict)
        print_numbers(
            {
                "model": str(output),
                "wavelets": str(model.n_wavelets),
                "parameters": str(model.n_parameters),
                "kind": f"{model.fit.model_class}, stopped by {model.stop_reason}",
                "nrmse": f"{number(nrmse)} on {judged}",
                "seconds": f"{seconds:.2f}",
            }
        )
        if beside:
            _print_beside(nrmse, model.n_parameters, seconds, others)
        end_with(verdict)


def _pooled_nrmse(verified: Sequence[tuple[Recording, Verification]]) -> float:
    """RMSE over the standard deviation of the force, the rows of all recordings taken together."""
    residual = np.concatenate([verification.residual for _, verification in verified])
    force = np.concatenate([recording.force[verification.rows] for recording, verification in verified])
    return float(np.sqrt(np.mean(residual**2)) / np.std(force))


def _fit_baselines(recordings: Sequence[Recording], hold_out_every: int | None) -> list[Compared]:
    """The baselines, fitted to what is not held out."""
    if hold_out_every is None:
        raise click.UsageError("--baselines compares on held-out rows and needs --hold-out-every K")
    talk("fitting the baselines ...")
    return compare(recordings, hold_out_every)


def _print_beside(nrmse: float, n_parameters: int, seconds: float, others: Sequence[Compared]) -> None:
    """The model first, then the baselines."""
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

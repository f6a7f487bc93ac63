# SPDX-License-Identifier: Apache-2.0
"""palpate demo: identifies, verifies and renders a model of a simulated knob."""

from __future__ import annotations

import os
import time
from pathlib import Path

import click

from ..errors import InputError
from ..identification import identify
from ..identification.classes.findings import error_findings
from ..planning import Comparison, compare_structures, describe, mechanical_units, rig_for
from ..recording.sample import sample_recording
from ..verdict import Verdict
from ..verification import verify
from .exit_status import end_with, finishing
from .figures import (
    close_loops,
    drawing,
    picture_closed_loops,
    picture_structures,
    picture_verification,
    print_closed_loops,
)
from .printing import (
    number,
    print_json,
    print_line,
    print_numbers,
    print_table,
    print_verdict,
    talk,
)
from .verb import PATH, json_option, require_writable, verb

IDENTIFY_SEED, FRESH_SEED = 1, 2
"""Random seeds of two simulated recordings: one to identify the model, one to verify it."""

RENDERED_S = 4.0
"""Simulated time of each rendering [s]."""


_SAMPLES = ("sample-1.csv", "sample-2.csv")
"""Names of the recordings to identify and to verify"""

_SIMULATED = b"# simulated: yes, by palpate"
"""First line of a recording of a demo"""


@verb("palpate demo -o demo", no_args_is_help=False)
@click.option(
    "-o", "--output", type=PATH, metavar="FOLDER", default=Path("demo"), help="Folder of the results."
)
@json_option
def demo(output: Path, as_json: bool) -> None:
    """Identify, verify and render a sample, without any input or device.

    Two recordings of a knob with a soft spring and a hard stop are simulated. A model is identified from one
    of them, verified on the other, and rendered on a simulated device with each structure.
    """
    _require_folder(output)
    talk(f"all data of this demo is simulated; results: {output}")
    recording, fresh = (sample_recording(seed) for seed in (IDENTIFY_SEED, FRESH_SEED))
    talk(f"identifying from {len(recording)} simulated samples ...")
    start = time.perf_counter()
    model = identify(recording)
    seconds = time.perf_counter() - start
    talk("verifying on a fresh simulated recording, also in closed loop ...")
    verification = verify(model, fresh)
    loops = close_loops(model, fresh)
    talk("rendering on a simulated device with each structure ...")
    structures = compare_structures(model, rig_for(model), RENDERED_S)

    verdict = model.verdict + Verdict(tuple(error_findings(verification.nrmse, "the fresh recording")))
    files = {
        "sample-1.csv": "simulated recording that the model was identified from",
        "sample-2.csv": "simulated recording that the model was verified on",
        "model.json": "the model",
        "force-over-position.png": "modelled force, and force of the fresh recording, with their difference",
        "closed-loop.png": "recorded and rendered force over position, with a simulated device in the loop",
        "structures.png": "force error of each rendering structure",
    }
    talk("drawing the figures ...")
    with drawing() as write_figures:
        picture_verification(output / "force-over-position.png", model, [(fresh, verification)])
        picture_closed_loops(output / "closed-loop.png", fresh, loops)
        picture_structures(
            output / "structures.png",
            structures,
            fresh.units["force"],
            of=f"model of simulated data, rendered for {number(RENDERED_S)} s",
        )
    with finishing():
        output.mkdir(exist_ok=True)
        for name, each in zip(_SAMPLES, (recording, fresh), strict=True):
            each.write(output / name)
        model.save(output / "model.json")
        write_figures()
        if as_json:
            print_json(
                {
                    "verdict": str(verdict),
                    "n_wavelets": model.n_wavelets,
                    "n_parameters": model.n_parameters,
                    "nrmse": verification.nrmse,
                    "rmse": verification.rmse,
                    "seconds": seconds,
                    "closed_loops": [
                        {"view": loop.view, "scheme": describe(loop.scheme), "nrmse": loop.nrmse}
                        for loop in loops
                    ],
                    "structures": [
                        {
                            "scheme": row.name,
                            "force_error_end": None if row.error is None else row.error.end,
                            "force_error_instant": None if row.error is None else row.error.instant,
                            "force_error_mean": None if row.error is None else row.error.mean,
                            "force_error_band": None if row.error is None else row.error.band,
                            "force_error_work": None if row.error is None else row.error.work,
                        }
                        for row in structures
                    ],
                    "files": [str(output / name) for name in files],
                }
            )
            end_with(verdict)
            return
        print_verdict(verdict)
        print_numbers(
            {
                "wavelets": str(model.n_wavelets),
                "parameters": str(model.n_parameters),
                "NRMSE, fresh": number(verification.nrmse),
                "RMSE, fresh": f"{number(verification.rmse)} {fresh.units['force']}",
                "identified in": f"{seconds:.2f} s",
            }
        )
        print_line()
        print_closed_loops(loops)
        print_line()
        _print_structures(structures, fresh.units["force"])
        print_line()
        for name, meaning in files.items():
            print_line(f"{output / name}: {meaning}")
        end_with(verdict)


def _require_folder(folder: Path) -> None:
    """Refuses a folder that cannot be created or written, before anything is computed."""
    if folder.is_dir():
        require_writable(folder / "model.json")
        for path in (folder / name for name in _SAMPLES):
            if os.path.lexists(path) and not path.read_bytes().startswith(_SIMULATED):
                raise InputError(f"{path} exists already and is not from a demo; choose another folder")
    elif folder.exists():
        raise InputError(
            f"{folder} is a file, but the demo writes a folder; choose another name with --output"
        )
    else:
        require_writable(folder)


def _print_structures(rows: tuple[Comparison, ...], unit: str) -> None:
    """Prints the force error of each structure, or the reason why the structure is refused."""
    mass, damping, _ = mechanical_units("rad")
    print_line(f"force error of each structure, RMS in {unit}; m in {mass}, B_o in {damping}")
    print_table(
        ("structure", "tick mean", "below 50 Hz", "end of tick", "sampled"),
        [
            (
                row.name,
                *(
                    number(error)
                    for error in (row.error.mean, row.error.band, row.error.end, row.error.instant)
                ),
            )
            if row.error is not None
            else (row.name, "refused", "", "", "")
            for row in rows
        ],
    )
    for row in rows:
        if row.refused is not None:
            print_line(f"{row.name} is refused: {row.refused}")

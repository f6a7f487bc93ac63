# SPDX-License-Identifier: Apache-2.0
"""palpate report: writes one HTML page about a model, its verification and its plan."""

from __future__ import annotations

from pathlib import Path

import click

from ..errors import InputError, command_word
from ..report import Subject, report_of
from ..verification import columns_of
from .exit_status import end_with, finishing
from .printing import print_json, print_numbers, print_verdict, talk
from .profiles import ProfileName, device_for
from .verb import PATH, ReadingOptions, expert_option, json_option, reading_options, require_writable, verb

PAGES = (".html", ".htm")
"""Endings of the name of a page"""


@verb("palpate report press.json fresh.csv -o press.html")
@click.argument("model_file", metavar="MODEL.json", type=PATH)
@click.argument("recording_file", metavar="[RECORDING]", type=PATH, required=False)
@expert_option(
    "-o",
    "--output",
    group="Output",
    type=PATH,
    metavar="REPORT.html",
    required=True,
    help="Page to write; an existing one is replaced.",
)
@json_option
@expert_option(
    "--identified-on",
    "identified_on",
    group="Input",
    type=PATH,
    metavar="FILE",
    multiple=True,
    help="Recording of the identification, for the 95 % band; repeatable.",
)
@expert_option(
    "--device",
    type=ProfileName(),
    group="Input",
    metavar="PROFILE.toml",
    default=None,
    help="Plan the model on this device; a refused plan is shown with the reason.",
)
@reading_options
def report(
    model_file: Path,
    recording_file: Path | None,
    output: Path,
    as_json: bool,
    identified_on: tuple[Path, ...],
    device: str | None,
    reading: ReadingOptions,
) -> None:
    """Write one HTML page about a model: verdict, curves, errors, certificate and origin.

    The page fetches nothing and can be printed. It needs pip install 'palpate[report]'. The exit code is 1 if
    the verdict is no; the page is then written too.
    """
    if recording_file is not None and recording_file.suffix == ".json" != model_file.suffix:
        swapped = f"palpate report {command_word(recording_file)} {command_word(model_file)}"
        raise InputError(f"the model comes first: {swapped}")
    require_writable(output, inputs=(model_file, recording_file, *identified_on))
    if output.suffix.lower() not in PAGES:
        raise InputError(f"{output} is not a page: its name must end in {' or '.join(PAGES)}")
    subject = Subject.of(model_file)
    if device is not None:
        subject = subject.planned_on(device_for(subject.model, device))
    columns = columns_of(subject.model)
    recording = None if recording_file is None else reading.read(recording_file, columns)
    others = [reading.read(each, columns) for each in identified_on]
    talk("writing the report ...")
    page = report_of(subject.compared_with(recording, others))
    with finishing():
        page.write(output)
        size = output.stat().st_size
        if as_json:
            print_json(
                {
                    "report": str(output),
                    "verdict": str(page.verdict),
                    "sections": page.sections,
                    "left_out": page.left_out,
                    "bytes": size,
                }
            )
        else:
            print_verdict(page.verdict)
            print_numbers(
                {
                    "written": f"{output}, {size / 1e6:.2g} MB",
                    **{f"left out, {name}": reason for name, reason in page.left_out.items()},
                }
            )
    end_with(page.verdict)

# SPDX-License-Identifier: Apache-2.0
"""palpate app: one local page in the browser, from a recording to a C header."""

from __future__ import annotations

import inspect
import os
import shutil
import sys
import tempfile
import webbrowser
from collections.abc import Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any

import click

from ..app import Option, OptionTable, Session, StoppedError, serve, words_of
from ..identification import identify as identify_model
from ..identification.options import RESERVED_INPUTS, IdentifyOptions
from ..identification.search.evidence import reporting_to
from ..model import Model
from ..planning import DeviceProfile, Plan
from ..planning.search import plan as choose
from ..recording import Recording, read_recording
from ..recording.files import require_file
from ..verdict import GOOD
from .exit_status import terminated_as_interrupted
from .identify import _require_unit_of_period, identify
from .plan import plan
from .printing import print_json, print_numbers, print_verdict, talk
from .verb import PATH, READING_NAMES, json_option, verb

_PLAN_NAMES = {*inspect.signature(choose).parameters, "accept_model"} - {"model", "device", "on_device"}
"""Parameters of `palpate plan` that the page may set"""


_DESKTOP = ("DISPLAY", "WAYLAND_DISPLAY", "BROWSER")
"""Variables of which a desktop sets one; without them a browser would open in the terminal, and block it"""


class CommandLine:
    """The verbs identify and plan: what they do with options, without reading or writing other files."""

    reading = OptionTable(identify, READING_NAMES)
    identify = OptionTable(identify, {*READING_NAMES, *(each.name for each in fields(IdentifyOptions))})
    plan = OptionTable(plan, _PLAN_NAMES)
    progress = ""
    """Progress of the running identification, as a sentence; empty if none runs"""
    _to_stop = False

    def stop_identification(self) -> None:
        """Makes a running identification raise `StoppedError` before its next wavelet."""
        self._to_stop = bool(self.progress)

    def read(self, file: str, options: Sequence[Option]) -> Recording:
        """Reads a recording as `palpate identify` does."""
        given = _given(identify, [file, "-o", "model.json", *words_of(options)])
        inputs = [name.strip() for name in given["inputs"].split(",")]
        columns = [name for name in inputs if name and name not in RESERVED_INPUTS]
        return read_recording(file, inputs=columns, **{name: given[name] for name in READING_NAMES})

    def model_of(self, recording: Recording, file: str, options: Sequence[Option]) -> Model:
        """Identifies a model as `palpate identify` does."""
        given = _given(identify, [file, "-o", "model.json", *words_of(options)])
        settings = {each.name: given[each.name] for each in fields(IdentifyOptions)}
        settings["period"], unit = settings["period"] or (None, "")
        _require_unit_of_period(unit, recording.units["position"])

        def report(name: str, wavelets: int) -> None:
            if self._to_stop:
                raise StoppedError("The identification was stopped; the page is as before.")
            self.progress = f"Identifying: {name}, {wavelets} wavelets"

        try:
            with reporting_to(report):
                return identify_model(recording, **settings)
        finally:
            self.progress, self._to_stop = "", False

    def plan_of(self, model: Model, file: str, device: DeviceProfile, options: Sequence[Option]) -> Plan:
        """Plans a model as `palpate plan` does."""
        given = _given(plan, [file, "--device", device.id, *words_of(options)])
        usable = model.require_use(file, accepted=given.pop("accept_model"))
        chosen = {name: given[name] for name in _PLAN_NAMES if given.get(name) is not None}
        return choose(usable, device, **chosen)


def _given(command: click.Command, words: list[str]) -> dict[str, Any]:
    """Returns the values of the parameters of a verb for a command line."""
    return command.make_context(command.name, words).params


@verb("palpate app press.csv", ends_at_once=False, no_args_is_help=False)
@click.argument("recording_file", metavar="[RECORDING]", type=PATH, required=False)
@click.option("--port", type=click.IntRange(0, 65535), default=0, show_default="a free one", help="Port.")
@click.option("--browser/--no-browser", default=True, help="Open the page in the browser.")
@click.option(
    "--idle-s",
    type=click.FloatRange(0.0),
    default=float("inf"),
    help="End when no page was open for this time [s].",
)
@json_option
def app(recording_file: Path | None, port: int, browser: bool, idle_s: float, as_json: bool) -> None:
    """Open a page in the browser: drop a recording, correct, identify, plan, export.

    The page runs on this computer only and needs no network. Results are downloads of the browser; the page
    shows the commands that make the same files. Needs pip install 'palpate[report]'. Ctrl-C ends it.
    """
    if recording_file is not None:
        require_file(recording_file)
    start = Path.cwd()
    with tempfile.TemporaryDirectory(prefix="palpate-app-") as name:
        if recording_file is not None:
            shutil.copyfile(recording_file, Path(name) / recording_file.name)
        # Results name the recording as a command in its folder does.
        os.chdir(name)
        try:
            session = Session(Path(name), CommandLine())
            if recording_file is not None:
                session.add_file(recording_file.name, Path(recording_file.name).read_bytes())

            def opened(address: str, once: str) -> None:
                if as_json:
                    print_json({"verdict": str(GOOD), "address": address})
                else:
                    print_verdict(GOOD)
                    print_numbers({"address": address})
                sys.stdout.flush()
                talk("Open the address in a browser on this computer. Ctrl-C ends the app.")
                if browser and any(map(os.environ.get, _DESKTOP)):
                    webbrowser.open(once)

            with terminated_as_interrupted():
                serve(session, port=port, idle_s=idle_s, opened=opened)
        except KeyboardInterrupt:
            pass
        finally:
            os.chdir(start)
    talk("The app has ended.")

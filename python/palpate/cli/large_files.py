# SPDX-License-Identifier: Apache-2.0
"""Identification of files that are read part by part, with progress on standard error."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import wraps
from pathlib import Path
from typing import Any, TypeVar, cast

import click

from ..identification.identify_files import identify_files
from ..model import Model
from .printing import echo, talk
from .verb import ReadingOptions

F = TypeVar("F", bound=Callable[..., Any])

_EVERY_S = 10.0
"""Seconds between two lines of progress where standard error is a file."""

_READS = ("position", "force", "time", "direction", "units", "negate", "invalid")
"""Reading options that make sense without all rows at once."""


@dataclass(frozen=True)
class LargeFiles:
    """Whether and by whom files are read part by part."""

    out_of_core: bool
    jobs: int
    scheduler: str | None

    @property
    def wanted(self) -> bool:
        return self.out_of_core or self.jobs != 1 or self.scheduler is not None

    def require_alone(self, others: Mapping[str, Any]) -> None:
        """Refuse options that need all rows at once."""
        for name, value in others.items():
            if value:
                raise click.UsageError(
                    f"{name} needs all rows at once, and these files are read part by part; "
                    "palpate verify compares the model with a recording"
                )

    def identify(self, files: Sequence[Path], reading: ReadingOptions, options: dict[str, Any]) -> Model:
        """The model, and on the way how far it is."""

        left = {f"--{name}": value for name, value in reading.options.items() if name not in _READS}
        self.require_alone({name.replace("_", "-"): value for name, value in left.items()})
        chosen = {name: reading.options[name] for name in _READS if reading.options[name] is not None}
        progress = _Progress()
        try:
            model = identify_files(
                list(files), jobs=self.jobs, scheduler=self.scheduler, progress=progress, **chosen, **options
            )
        finally:
            progress.end()
        talk(f"read {model.data.rows} rows; {_chosen(model)}")
        return model


def large_file_options(command: F) -> F:
    """--out-of-core, --jobs and --scheduler as one argument `large`."""

    @wraps(command)
    def invoke(*args: Any, out_of_core: bool, jobs: int, scheduler: str | None, **others: Any) -> Any:
        return command(*args, large=LargeFiles(out_of_core, jobs, scheduler), **others)

    described: Any = invoke
    for option in (
        click.option(
            "--scheduler",
            metavar="ADDRESS",
            default=None,
            help="Dask scheduler whose workers read the files (tcp://host:8786); implies --out-of-core.",
        ),
        click.option(
            "--jobs",
            type=click.IntRange(min=1),
            default=1,
            help="Processes that read the files; more than one implies --out-of-core.",
        ),
        click.option(
            "--out-of-core", is_flag=True, help="Read files larger than memory part by part, each row once."
        ),
    ):
        described = option(described)
    return cast(F, described)


class _Progress:
    """One line that is written over on a screen, a line now and then in a file."""

    def __init__(self) -> None:
        self._start = self._told = time.monotonic()
        self._screen = sys.stderr.isatty()

    def __call__(self, done: int, total: int) -> None:
        now = time.monotonic()
        line = f"read {done} of {total} parts ({100 * done / total:.0f} %) in {now - self._start:.0f} s"
        if self._screen:
            echo(f"\r{line}", err=True, nl=False)
        elif done == total or now - self._told >= _EVERY_S:
            self._told = now
            talk(line)

    def end(self) -> None:
        if self._screen:
            echo("", err=True)


def _chosen(model: Model) -> str:
    return ", ".join(f"{role} is {column}" for role, column in model.data.columns.items())

# SPDX-License-Identifier: Apache-2.0
"""palpate chart: the figures of the documentation, one subject at a time."""

from __future__ import annotations

from importlib import import_module

import click

from .verb import Verbs

_SUBJECTS = {
    "failures": "Where each method fails, measured beside its theory.",
    "prediction": "Force error of the half-sample prediction, against the damping it needs.",
    "identification": "Identification beside its rivals, from the output of the benchmarks.",
    "speed": "Error against computing time, from the output of the benchmarks.",
}
"""Every subject with its line in the help; its file, chart_SUBJECT.py, is imported only when it is used."""


class _Subjects(Verbs):
    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(_SUBJECTS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        if cmd_name not in _SUBJECTS:
            return None
        command = getattr(import_module(f".chart_{cmd_name}", __package__), f"chart_{cmd_name}")
        assert isinstance(command, click.Command)
        return command

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        with formatter.section("Subjects"):
            formatter.write_dl(list(_SUBJECTS.items()))


@click.group(
    cls=_Subjects, no_args_is_help=True, epilog="Example: palpate chart speed build/bench --to docs/figures"
)
def chart() -> None:
    """Draw the figures of the documentation."""

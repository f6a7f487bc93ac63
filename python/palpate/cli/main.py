# SPDX-License-Identifier: Apache-2.0
"""Entry point: finds the verb, runs it, returns an exit code and prints at most one sentence."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from importlib import import_module

import click

from .exit_status import INTERRUPTED, exit_status_of
from .printing import TERMS, Verbs, drop_what_cannot_be_written, prepare_streams, print_line

_VERBS = {
    "identify": "Identify a model from recordings.",
    "verify": "Compare a model with a recording.",
    "plan": "Choose and certify the rendering of a model on a device.",
    "simulate": "Render a model on a simulated device.",
    "render": "Render a model live, tick by tick.",
    "record": "Record a real object.",
    "devices": "List haptic devices.",
    "check-device": "Measure a device and judge if it can render force.",
    "show": "Print a model or a recording.",
    "demo": "Identify, verify and render a simulated sample.",
}
"""Verbs with their lines in the help. The file of a verb is imported only when the verb is used."""


class _LazyVerbs(Verbs):
    """Group of the verbs; each verb is a command in the module with the verb's name."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(_VERBS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        if cmd_name not in _VERBS:
            return None
        name = cmd_name.replace("-", "_")
        command = getattr(import_module(f".{name}", __package__), name)
        assert isinstance(command, click.Command)
        return command

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        with formatter.section("Verbs"):
            formatter.write_dl(list(_VERBS.items()))


def _print_version(ctx: click.Context, param: click.Parameter, wanted: bool) -> None:
    if wanted:
        print_line(f"palpate {import_module('._core', 'palpate').__version__}")
        ctx.exit()


@click.group(
    cls=_LazyVerbs,
    no_args_is_help=True,
    context_settings={"help_option_names": ["-h", "--help"], "show_default": True},
    epilog=f"Example: palpate identify press.csv -o press.json\n\n{TERMS}",
)
@click.option(
    "--version",
    is_flag=True,
    is_eager=True,
    expose_value=False,
    show_default=False,
    callback=_print_version,
    help="Print the version.",
)
def palpate() -> None:
    """Identify, verify, plan and render the force of a recorded object."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs the command line and returns its exit code.

    0 done; 1 the work failed; 2 bad usage or bad input; 130 Ctrl-C, and the output does not exist. A failure
    is one sentence on standard error, or with --json {"error": "..."} on standard output.
    """
    prepare_streams()
    given = list(sys.argv[1:] if arguments is None else arguments)
    code = 0
    try:
        with palpate.make_context("palpate", given) as context:
            palpate.invoke(context)
        sys.stdout.flush()
    except BaseException as error:
        status = exit_status_of(error)
        status.report(as_json="--json" in given)
        code = status.code
    drop_what_cannot_be_written()
    if code == INTERRUPTED and arguments is None:
        os._exit(code)  # a normal exit would unload the libraries, which takes long
    return code

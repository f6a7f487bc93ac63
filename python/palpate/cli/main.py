# SPDX-License-Identifier: Apache-2.0
"""Entry point: finds the verb, runs it, returns an exit code and prints at most one sentence."""

from __future__ import annotations

import gc
import os
import sys
from collections.abc import Sequence
from importlib import import_module
from pathlib import Path

import click
from click.shell_completion import CompletionItem

from ..errors import command_word, did_you_mean
from ..system import require_live_control
from .completion import SHELLS, completes, script_of
from .exit_status import INTERRUPTED, exit_status_of
from .printing import TERMS, Verbs, drop_what_cannot_be_written, echo, prepare_streams, print_line

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
    "report": "Write one HTML page about a model.",
    "export": "Write a model or a recording for other programs.",
    "app": "Open a page in the browser for all steps.",
    "demo": "Identify, verify and render a simulated sample.",
}
"""Verbs with their lines in the help. The file of a verb is imported only when the verb is used."""

_LIVE_VERBS = ("render", "record", "devices", "check-device")
"""Verbs that control a device in real time."""


_USUAL_WORDS = {
    "identify": ("fit", "train", "learn", "estimate", "model"),
    "verify": ("validate", "test", "evaluate", "compare"),
    "render --device": ("run", "play", "control"),
    "show --plot FILE.png": ("plot", "draw", "info", "print"),
    "plan --device": ("certify",),
    "plan --examples": ("profiles", "profile"),
    "check-device": ("check", "measure", "calibrate"),
}
"""Words that other programs use for the work of a verb, by the verb with the option that is needed."""


def _hint(name: str) -> str:
    """Returns the end of the message that there is no verb `name`: the verb that was probably meant."""
    for verb, words in _USUAL_WORDS.items():
        if name.lower() in words:
            return f"; use palpate {verb}"
    if Path(name).suffix == ".json":
        return f"; to print a model, use palpate show {command_word(Path(name))}"
    if Path(name).is_file():
        return f"; to identify a model, use palpate identify {command_word(Path(name))} -o MODEL.json"
    return did_you_mean(name, _VERBS) or f"; the verbs are {', '.join(_VERBS)}"


class _LazyVerbs(Verbs):
    """Group of the verbs; each verb is a command in the module with the verb's name."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(_VERBS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        if cmd_name not in _VERBS:
            return None
        if cmd_name in _LIVE_VERBS:
            require_live_control(f"palpate {cmd_name}")
        name = cmd_name.replace("-", "_")
        command = getattr(import_module(f".{name}", __package__), name)
        assert isinstance(command, click.Command)
        return command

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        name = args[0]
        if name not in _VERBS and not name.startswith("-") and not ctx.resilient_parsing:
            raise click.UsageError(f"there is no verb {name!r}{_hint(name)}")
        return super().resolve_command(ctx, args)

    def shell_complete(self, ctx: click.Context, incomplete: str) -> list[CompletionItem[str]]:
        # Group.shell_complete would import the files of all verbs.
        verbs = [CompletionItem(name, help=text) for name, text in _VERBS.items()]
        return [
            *(verb for verb in verbs if verb.value.startswith(incomplete)),
            *click.Command.shell_complete(self, ctx, incomplete),
        ]

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        with formatter.section("Verbs"):
            formatter.write_dl(list(_VERBS.items()))


def _print_version(ctx: click.Context, param: click.Parameter, wanted: bool) -> None:
    if wanted:
        print_line(f"palpate {import_module('._core', 'palpate').__version__}")
        ctx.exit()


def _print_script(ctx: click.Context, param: click.Parameter, shell: str | None) -> None:
    if shell is not None:
        echo(script_of(shell))
        ctx.exit()


def _print_glossary(ctx: click.Context, param: click.Parameter, wanted: bool) -> None:
    if wanted:
        package = Path(__file__).parents[1]
        installed, source = package / "glossary.md", package.parents[1] / "docs" / "glossary.md"
        text = (installed if installed.exists() else source).read_text(encoding="utf-8")
        for line in text.splitlines():
            echo(line)
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
@click.option(
    "--glossary",
    is_flag=True,
    is_eager=True,
    expose_value=False,
    show_default=False,
    callback=_print_glossary,
    help="Print the terms of palpate with their meaning.",
)
@click.option(
    "--completion",
    type=click.Choice(SHELLS),
    is_eager=True,
    expose_value=False,
    callback=_print_script,
    help='Print the completion script of a shell: eval "$(palpate --completion bash)".',
)
def palpate() -> None:
    """Identify, verify, plan and render the force of a recorded object."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs the command line and returns its exit code.

    0 done; 1 the work failed; 2 bad usage or bad input; 130 Ctrl-C, and the output does not exist. A failure
    is one sentence on standard error, or with --json {"error": "..."} on standard output.
    """
    prepare_streams()
    if arguments is None and completes(palpate):
        return 0
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
    if arguments is None:
        gc.freeze()  # else Python searches all objects of the libraries for garbage before it ends
        if code == INTERRUPTED:
            os._exit(code)  # a normal exit would unload the libraries, which takes long
    return code

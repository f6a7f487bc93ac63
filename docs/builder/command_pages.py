# SPDX-License-Identifier: Apache-2.0
"""Makes the page of the command line from the help texts of `palpate` and `palpate-control`."""

from __future__ import annotations

import os
import re
import subprocess
from pathlib import Path
from textwrap import indent

import click

from palpate.cli.main import palpate as group

ROOT = Path(__file__).parents[2]
CONTROL = Path(os.environ.get("PALPATE_CONTROL", ROOT / "build" / "control" / "palpate-control"))

_TITLE = "Command line"
_INTRODUCTION = """\
Every text of this page is the help text of its program. Each verb reads the files that other verbs write.
Exit codes of ``palpate``: 0 done, 1 the work failed or the verdict is no, 2 bad usage or input, 130 Ctrl-C.
"""


def write_pages(folder: Path) -> None:
    """Writes the page `command-line.rst` to `folder`."""
    folder.mkdir(parents=True, exist_ok=True)
    context = click.Context(group, info_name="palpate")
    text = f"{_TITLE}\n{'=' * len(_TITLE)}\n\n{_INTRODUCTION}\n"
    for verb in group.list_commands(context):
        command = group.get_command(context, verb)
        assert command is not None
        text += _verb(command, click.Context(command, parent=context, info_name=verb))
    (folder / "command-line.rst").write_text(text + _control(), encoding="utf-8")


def _verb(command: click.Command, context: click.Context) -> str:
    """Returns the section of a verb: usage, description, options and example."""
    name = context.command_path
    usage = " ".join([name, *command.collect_usage_pieces(context)])
    text = f"{name}\n{'-' * len(name)}\n\n.. code-block:: text\n\n   {usage}\n\n"
    for part in f"{command.help or ''}\n\n{command.epilog or ''}".split("\n\n"):
        lines = part.strip("\n").splitlines()
        if lines and lines[0] == "\b":
            text += "::\n\n" + indent("\n".join(lines[1:]), "   ") + "\n\n"
        elif part.startswith("Example: "):
            text += ".. code-block:: text\n\n   " + part.removeprefix("Example: ") + "\n\n"
        elif not part.startswith("Terms: "):
            text += _escaped(" ".join(line.strip() for line in lines)) + "\n\n"
    text += f".. program:: {name}\n\n"
    for parameter in command.params:
        record = parameter.get_help_record(context) if isinstance(parameter, click.Option) else None
        if record is not None:
            names, meaning = record
            text += f".. option:: {_option(names)}\n\n   {_escaped(meaning)}\n\n"
    return text


def _option(names: str) -> str:
    """Returns "-o, --output FILE" as Sphinx writes it: the value after each name."""
    names = names.replace(" / ", ", ")
    return re.sub(r"\s+", " ", names)


def _control() -> str:
    """Returns the section of palpate-control, with its whole help text."""
    completed = subprocess.run([CONTROL, "--help"], capture_output=True, text=True, check=True)
    title = "palpate-control"
    return f"{title}\n{'-' * len(title)}\n\n.. code-block:: text\n\n{indent(completed.stdout, '   ')}\n"


def _escaped(text: str) -> str:
    return re.sub(r"([\\*`|_])", r"\\\1", text)

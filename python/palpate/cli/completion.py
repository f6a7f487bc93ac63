# SPDX-License-Identifier: Apache-2.0
"""Completion of command lines in bash, zsh and fish, with the scripts of click."""

from __future__ import annotations

import os
import re
from pathlib import Path

import click
from click.shell_completion import CompletionItem, get_completion_class, shell_complete

SHELLS = ("bash", "zsh", "fish")

_VARIABLE = "_PALPATE_COMPLETE"
"""Environment variable with which the script in the shell requests completions."""

RECORDINGS = (".csv", ".part", ".parquet", ".xlsx", ".xls", ".ods", ".npz", ".mat", ".mcap")
"""Suffixes of the files that can be recordings."""

FIGURES = (".png", ".pdf", ".svg")
"""Suffixes (formats) that the file name of a figure may have."""

_PLAIN_NAME = re.compile(r"[\w./~+-]*")
"""File names that a shell reads as one word without quotes."""


def script_of(shell: str) -> str:
    """Returns the script that makes a shell complete the command line of palpate."""
    kind = get_completion_class(shell)
    assert kind is not None
    return kind(click.Command("palpate"), {}, "palpate", _VARIABLE).source()


def completes(group: click.Group) -> bool:
    """Returns True after it printed the completions that a shell requested; without a request False.

    An error prints nothing, because its message would appear within the line that the user types.
    """
    instruction = os.environ.get(_VARIABLE)
    if instruction is None:
        return False
    try:
        shell_complete(group, {}, "palpate", _VARIABLE, instruction)
    except Exception:
        return True
    return True


def suffixes_of(placeholder: str) -> tuple[str, ...]:
    """Returns the suffixes of files for the placeholder of a parameter in the help."""
    placeholder = placeholder.strip("[]")  # an argument that may be left out
    if placeholder.startswith("RECORDING"):
        return RECORDINGS
    if placeholder == "PNG":
        return FIGURES
    return (Path(placeholder).suffix,)


def files_with(suffixes: tuple[str, ...], incomplete: str) -> list[CompletionItem[str]]:
    """Returns the files with these suffixes that complete a name.

    If there are none, or if a name needs quotes, the shell completes with all files and folders.
    """
    folder, start = os.path.split(incomplete)
    try:
        names = sorted(
            each.name
            for each in os.scandir(folder or ".")
            if each.name.startswith(start) and each.name.endswith(suffixes) and each.is_file()
        )
    except OSError:
        names = []
    if not names or not all(_PLAIN_NAME.fullmatch(name) for name in names):
        return [CompletionItem(incomplete, type="file")]
    return [CompletionItem(os.path.join(folder, name)) for name in names]


class FileName(click.Path):
    """Name of a file, as a path. It is completed by the suffix that its placeholder in the help states."""

    def shell_complete(
        self, ctx: click.Context, param: click.Parameter, incomplete: str
    ) -> list[CompletionItem[str]]:
        """Returns the completions of a file name that the user types."""
        suffixes = suffixes_of(param.metavar or "")
        if suffixes == ("",):
            return [CompletionItem(incomplete, type="dir")]
        return files_with(suffixes, incomplete)

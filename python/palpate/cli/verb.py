# SPDX-License-Identifier: Apache-2.0
"""The class of all verbs: help that can be read on a narrow terminal."""

from __future__ import annotations

import shutil
from collections.abc import Iterable

import click

_WIDEST = 80
"""Text wider than this is hard to read on any screen."""

_NARROWEST = 30


class _Formatter(click.HelpFormatter):
    """Click's formatter, except that it follows a terminal below 50 columns too."""

    def __init__(
        self, indent_increment: int = 2, width: int | None = None, max_width: int | None = None
    ) -> None:
        terminal = shutil.get_terminal_size().columns
        super().__init__(indent_increment, max(_NARROWEST, min(terminal, _WIDEST)))

    def write_dl(self, rows: Iterable[tuple[str, str]], col_max: int = 30, col_spacing: int = 2) -> None:
        super().write_dl(list(rows), min(col_max, self.width // 3), col_spacing)


class _Context(click.Context):
    formatter_class = _Formatter


class Verb(click.Command):
    """A command with our help."""

    context_class = _Context


class Verbs(click.Group):
    """A group of commands with our help."""

    context_class = _Context

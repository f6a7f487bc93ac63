# SPDX-License-Identifier: Apache-2.0
"""Pages of the documentation whose tables are written by a command, between marks."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from ..errors import InputError
from ..recording.files import replacing


def markdown_table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A table whose first column is text and whose others are numbers."""
    lines = [header, ["---", *["---:"] * (len(header) - 1)], *rows]
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)


def with_tables(text: str, page: Path, tables: Mapping[str, str]) -> str:
    """The page's text with new tables between its marks `<!-- name -->` and `<!-- end -->`."""
    for name, table in tables.items():
        mark, end = f"<!-- {name} -->\n", "<!-- end -->\n"
        before, _, marked = text.partition(mark)
        _, found, after = marked.partition(end)
        if not found or mark in after:
            raise InputError(
                f"{page} has no table between '<!-- {name} -->' and '<!-- end -->', each on a line"
            )
        text = before + mark + table + end + after
    return text


def write_text(path: Path, text: str) -> None:
    """Whole or not at all."""
    with replacing(path) as temporary:
        temporary.write_text(text, encoding="utf-8")

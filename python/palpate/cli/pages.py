# SPDX-License-Identifier: Apache-2.0
"""Pages of the documentation whose tables are written by a command, between marks."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from ..errors import InputError
from ..recording.files import replacing

_END = "<!-- end -->\n"


def markdown_table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A table whose first column is text and whose others are numbers."""
    lines = [header, ["---", *["---:"] * (len(header) - 1)], *rows]
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)


def with_tables(text: str, page: Path, tables: Mapping[str, str]) -> str:
    """The page's text with new tables between its marks `<!-- name -->` and `<!-- end -->`."""
    for name, table in tables.items():
        mark = f"<!-- {name} -->\n"
        before, found, rest = text.partition(mark)
        _, end, after = rest.partition(_END)
        if not (found and end) or mark in rest:
            raise InputError(
                f"{page} has no table between '<!-- {name} -->' and '<!-- end -->', each on a line"
            )
        text = before + mark + table + end + after
    return text


def write_text(path: Path, text: str) -> None:
    """Whole or not at all."""
    with replacing(path) as temporary:
        temporary.write_text(text, encoding="utf-8")

# SPDX-License-Identifier: Apache-2.0
"""Pages whose tables are written by commands, each between '<!-- NAME -->' and '<!-- end -->'."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from ..errors import InputError

_END = "<!-- end -->\n"


def with_tables(text: str, page: Path, tables: Mapping[str, str]) -> str:
    """The page with new tables between its marks.

    Raises
    ------
    InputError
        A table has no marks in the page, or more than one pair.
    """
    for name, table in tables.items():
        mark = f"<!-- {name} -->\n"
        before, _, marked = text.partition(mark)
        _, end, after = marked.partition(_END)
        if not end or mark in after:
            raise InputError(
                f"{page} has no table between '<!-- {name} -->' and '<!-- end -->', each on a line"
            )
        text = before + mark + table + end + after
    return text

# SPDX-License-Identifier: Apache-2.0
"""Makes links of the pages to files of the repository lead to the pages of the site."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

DOCS = Path(__file__).parents[1]
_LINK = re.compile(r"\]\((?P<up>(?:\.\./)+)(?P<target>[\w./-]+)(?P<anchor>#[\w-]+)?\)")


def page_of(target: str) -> str | None:
    """Returns the page of the site for a file or folder of the repository; None if it has no page."""
    header = re.fullmatch(r"cpp/include/palpate/(\w+)(?:/.*)?", target)
    if header:
        return f"generated/cpp/{header[1]}.rst"
    if target == "SECURITY.md":
        return "generated/security.md"
    if target.rstrip("/") == "examples":
        return "gallery/index.rst"
    return None


def inside_the_site(_app: Any, name: str, source: list[str]) -> None:
    """Replaces links to headers and examples by links to their pages."""
    depth = name.count("/")

    def replaced(found: re.Match[str]) -> str:
        # Links inside docs/ stay; only those that leave it are replaced.
        page = page_of(found["target"]) if found["up"].count("../") == depth + 1 else None
        return found[0] if page is None else f"](/{page})"

    source[0] = _LINK.sub(replaced, source[0])

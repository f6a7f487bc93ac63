# SPDX-License-Identifier: Apache-2.0
"""Makes the navigation of all pages from one tree of their titles.

Sphinx and the theme make the tree again for each page, which takes a third of the time of the build. The
trees differ only in the addresses and in the entries of the page and its parents.
"""

from __future__ import annotations

import re
from functools import cache
from typing import Any

from furo.navigation import get_navigation_tree
from sphinx.environment.adapters.toctree import global_toctree_for_doc

_ENTRY = re.compile(
    r'<li class="([^"]*)"><a class="([^"]*)" href="([^"]*)">(.*?)</a>(<input [^>]*>)?', re.DOTALL
)
"""Entry of a page: classes of the item and of the link, address, title, switch that opens the pages below"""


@cache
def _tree(builder: Any) -> str:
    """Returns the navigation of a page that is in the folder of the site, but in no list of pages."""
    contents = global_toctree_for_doc(
        builder.env,
        builder.config.root_doc,
        builder,
        tags=builder.tags,
        collapse=False,
        includehidden=True,
        maxdepth=-1,
        titles_only=True,
    )
    return get_navigation_tree(builder.render_partial(contents)["fragment"])


def leave_out(_app: Any, _name: str, _template: str, context: dict[str, Any], _document: Any) -> None:
    """Gives the theme an empty tree."""
    context["toctree"] = lambda **_: ""


def add(app: Any, name: str, _template: str, context: dict[str, Any], _document: Any) -> None:
    """Adds the navigation of a page: addresses from its folder; the lists that contain the page are open."""
    parents = {page: parent for parent, pages in app.env.toctree_includes.items() for page in pages}
    opened = [name]
    while (parent := parents.get(opened[-1])) is not None and parent not in opened:
        opened.append(parent)
    to_the_site = "../" * name.count("/")

    def entry(found: re.Match[str]) -> str:
        item, link, address, title, switch = found.groups(default="")
        page = address.removesuffix(".html")
        if page in opened:
            item += " current"
            switch = switch.replace("<input ", '<input checked="" ')
        if page == name:
            item, link, address = f"{item} current-page", f"current {link}", "#"
        else:
            address = to_the_site + address
        return f'<li class="{item}"><a class="{link}" href="{address}">{title}</a>{switch}'

    context["furo_navigation_tree"] = _ENTRY.sub(entry, _tree(app.builder))

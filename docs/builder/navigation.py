# SPDX-License-Identifier: Apache-2.0
"""Makes the navigation of each page from the titles of all pages.

For each page, Sphinx copies thousands of entries of all pages, and then keeps the titles. Here the titles
are selected once, because the copies take a third of the time of the build.
"""

from __future__ import annotations

from typing import Any

from docutils import nodes
from sphinx.addnodes import toctree

_titles: dict[str, nodes.Element] = {}
"""Title of each page, and its lists of further pages."""


def select_titles(_app: Any, builder: Any) -> None:
    """Selects the titles and the lists of pages as Sphinx does in each copy."""
    for name, contents in builder.env.tocs.items():
        _titles[name] = contents.deepcopy()
        for entry in _titles[name].children:
            if len(entry) > 1:
                lists = list(entry.findall(toctree))
                entry[1:] = [nodes.bullet_list("", *lists)] if lists else []


def use_titles(app: Any, _name: str, _template: str, context: dict[str, Any], _document: Any) -> None:
    """Makes the function of a template that returns the navigation use the titles."""
    whole = context.get("toctree")
    if whole is None:
        return

    def of_titles(**settings: Any) -> str:
        contents, app.env.tocs = app.env.tocs, _titles
        try:
            text: str = whole(**settings)
            return text
        finally:
            app.env.tocs = contents

    context["toctree"] = of_titles

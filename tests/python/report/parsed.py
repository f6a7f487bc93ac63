# SPDX-License-Identifier: Apache-2.0
"""HTML of a report, parsed for tests: elements with attributes, and the text of each section."""

from collections import defaultdict
from html.parser import HTMLParser


class Parsed(HTMLParser):
    """Elements and texts of a page."""

    def __init__(self, html: str) -> None:
        super().__init__()
        self.elements: list[tuple[str, dict[str, str | None]]] = []
        self.text: dict[str, str] = defaultdict(str)
        """Text of each section by its id, with single spaces; "" for text outside of sections"""
        self._section = ""
        self._code = False
        self.feed(html)
        self.text = {key: " ".join(text.split()) for key, text in self.text.items()}

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.elements.append((tag, dict(attrs)))
        self._code = tag in ("script", "style")
        if tag == "section":
            self._section = dict(attrs)["id"] or ""

    def handle_endtag(self, tag: str) -> None:
        self._code = False
        if tag == "section":
            self._section = ""

    def handle_data(self, data: str) -> None:
        if not self._code:
            self.text[self._section] += f" {data}"

    def all(self, tag: str) -> list[dict[str, str | None]]:
        """Returns the attributes of all elements with a tag."""
        return [attributes for name, attributes in self.elements if name == tag]

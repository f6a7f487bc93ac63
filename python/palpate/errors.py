# SPDX-License-Identifier: Apache-2.0
"""The exception for bad input, and text from a file inside its sentence: escaped, cut where it is long."""

from __future__ import annotations

import unicodedata
from collections.abc import Iterable

LONGEST_TEXT = 60
"""Characters of a name or a cell in a message."""

MOST_NAMES = 20
"""Names that a message lists."""

_UNSEEN = ("Cc", "Cf", "Cs", "Co", "Cn", "Zl", "Zp")
"""Categories of characters that a terminal acts on or that break a line."""


class InputError(ValueError):
    """Bad input: one sentence that names the file, line or field, the value, and what would be right."""


def visible(text: str) -> str:
    """Returns the text with its control and format characters escaped, so that no terminal acts on them."""
    if text.isascii() and text.isprintable():
        return text
    return "".join(
        character.encode("unicode_escape").decode()
        if unicodedata.category(character) in _UNSEEN and character != "\t"
        else character
        for character in text
    )


def shortened(text: str, longest: int = LONGEST_TEXT) -> str:
    """Returns the visible text, with its end left out where it is long."""
    shown = visible(text)
    return shown if len(shown) <= longest else f"{shown[:longest]}..."


def listed(names: Iterable[str]) -> str:
    """Names joined by commas, without those beyond a limit."""
    every = list(names)
    shown = ", ".join(map(shortened, every[:MOST_NAMES]))
    return shown if len(every) <= MOST_NAMES else f"{shown} and {len(every) - MOST_NAMES} more"

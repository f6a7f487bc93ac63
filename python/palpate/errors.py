# SPDX-License-Identifier: Apache-2.0
"""Exception for bad input; functions that escape and shorten text from files for its message."""

from __future__ import annotations

import difflib
import os
import shlex
import unicodedata
from collections.abc import Iterable

LONGEST_TEXT = 60
"""Largest length of a column name or a cell in a message; longer texts are cut [characters]."""

MOST_NAMES = 20
"""Largest number of names that a message lists."""

_CONTROL_CATEGORIES = ("Cc", "Cf", "Cs", "Co", "Cn", "Zl", "Zp")
"""Unicode categories of characters that control a terminal or break a line."""


class InputError(ValueError):
    """Bad input: one sentence that names the file, line or field, the value, and the cure."""


def escaped(text: str) -> str:
    """Returns the text with its control and format characters escaped, to protect the terminal."""
    if text.isascii() and text.isprintable():
        return text
    return "".join(
        character.encode("unicode_escape").decode()
        if unicodedata.category(character) in _CONTROL_CATEGORIES and character != "\t"
        else character
        for character in text
    )


def shortened(text: str, longest: int = LONGEST_TEXT) -> str:
    """Returns the escaped text; the end of a long text is cut."""
    shown = escaped(text)
    return shown if len(shown) <= longest else f"{shown[:longest]}..."


def command_word(value: str | os.PathLike[str]) -> str:
    """Returns one word of a command that a message suggests: no shell expands it.

    A path that begins with a minus sign is not an option.
    """
    text = os.fspath(value)
    is_path = isinstance(value, os.PathLike)
    return shlex.quote(f"./{text}" if is_path and text.startswith("-") else text)


def nearest_name(name: str, known: Iterable[str]) -> str | None:
    """Returns the known name that differs least from a misspelt one; None if none is similar."""
    by_lower_case = {each.lower(): each for each in known}
    nearest = difflib.get_close_matches(name.lower(), by_lower_case, 1)
    return by_lower_case[nearest[0]] if nearest else None


def did_you_mean(name: str, known: Iterable[str]) -> str:
    """Returns the end of a message on an unknown name: " (did you mean 'force_N'?)", or empty text."""
    nearest = nearest_name(name, known)
    return "" if nearest is None else f" (did you mean {shortened(nearest)!r}?)"


def listed(names: Iterable[str]) -> str:
    """Returns names joined by commas; after the first `MOST_NAMES` it states only how many more there are."""
    all_names = list(names)
    shown = ", ".join(map(shortened, all_names[:MOST_NAMES]))
    return shown if len(all_names) <= MOST_NAMES else f"{shown} and {len(all_names) - MOST_NAMES} more"

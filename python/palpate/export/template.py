# SPDX-License-Identifier: Apache-2.0
"""Fills the template of an exported program: keeps the lines for the parts that a model has.

Directives of a template, each on its own line:

- ``//@ if A and not B``, ``//@ else``, ``//@ end``: lines for a combination of parts;
- ``//@ each WORD in LIST`` to ``//@ end``: the lines once for each element of a list, with WORD replaced;
- ``//@ NAME``: the text of this name.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence


def filled(
    template: str, parts: Mapping[str, bool], lists: Mapping[str, Sequence[str]], texts: Mapping[str, str]
) -> str:
    """Returns a template with its directives replaced.

    Parameters
    ----------
    template : str
        Text with directives.
    parts : mapping of str to bool
        Parts that the conditions name; True if the model has the part.
    lists : mapping of str to sequence of str
        Elements of each list.
    texts : mapping of str to str
        Inserted texts by name.
    """
    lines = _lines(template.splitlines(), parts, lists, texts)
    return "".join(f"{line}\n" for line in lines)


def _lines(
    given: Sequence[str],
    parts: Mapping[str, bool],
    lists: Mapping[str, Sequence[str]],
    texts: Mapping[str, str],
) -> Iterator[str]:
    k = 0
    while k < len(given):
        words = given[k].split()
        if words[:1] != ["//@"]:
            yield given[k]
        elif words[1] == "if":
            middle, end = _end_of(given, k)
            chosen = given[k + 1 : middle] if _holds(words[2:], parts) else given[middle + 1 : end]
            yield from _lines(chosen, parts, lists, texts)
            k = end
        elif words[1] == "each":
            _, end = _end_of(given, k)
            for element in lists[words[4]]:
                body = [line.replace(words[2], element) for line in given[k + 1 : end]]
                yield from _lines(body, parts, lists, texts)
            k = end
        else:
            yield texts[words[1]]
        k += 1


def _end_of(lines: Sequence[str], start: int) -> tuple[int, int]:
    """Returns the lines of the `else`, or else of the `end`, and of the `end` of a block."""
    depth, middle = 0, None
    for k in range(start, len(lines)):
        words = lines[k].split()
        if words[:1] != ["//@"]:
            continue
        depth += (words[1] in ("if", "each")) - (words[1] == "end")
        if depth == 1 and words[1] == "else":
            middle = k
        if depth == 0:
            return k if middle is None else middle, k
    raise ValueError(f"line {start + 1} of the template has no end")


def _holds(words: Sequence[str], parts: Mapping[str, bool]) -> bool:
    """Returns True if every part of a condition is present, or absent after `not`."""
    conditions = " ".join(words).split(" and ")
    return all(
        not parts[each.removeprefix("not ")] if each.startswith("not ") else parts[each]
        for each in conditions
    )

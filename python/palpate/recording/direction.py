# SPDX-License-Identifier: Apache-2.0
"""Words for the direction of the stroke: into the object (+1), out of it (-1), neither (0)."""

from __future__ import annotations

DIRECTION_WORDS: dict[str, int] = {
    **dict.fromkeys(("press", "approach", "load", "loading", "forward", "+1"), 1),
    **dict.fromkeys(("release", "retract", "unload", "unloading", "back", "-1"), -1),
    **dict.fromkeys(("pause", "hold", "extra", "0"), 0),
}


def direction_of(word: str) -> int | None:
    """The direction that a cell states, or None for a word that is not known.

    Numbers count by their value, so ``1``, ``+1`` and ``1.0`` are the same direction.
    """
    text = word.strip()
    if text in DIRECTION_WORDS:
        return DIRECTION_WORDS[text]
    try:
        value = float(text)
    except ValueError:
        return None
    return int(value) if value in (-1.0, 0.0, 1.0) else None

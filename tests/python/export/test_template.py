# SPDX-License-Identifier: Apache-2.0
"""Tests the directives of a template."""

import pytest

from palpate.export.template import filled

TEMPLATE = """\
a
//@ if big and not red
  b
//@ if red
  never
//@ else
  c
//@ end
//@ else
  d
//@ end
//@ each WORD in words
  WORD
//@ if WORD_used
  WORD is used
//@ end
//@ end
//@ text
"""


def lines(big: bool, red: bool) -> list[str]:
    parts = {"big": big, "red": red, "x_used": True, "y_used": False}
    return filled(TEMPLATE, parts, {"words": ["x", "y"]}, {"text": "end"}).split()


def test_lines_follow_the_parts_of_the_model() -> None:
    rest = ["x", "x", "is", "used", "y", "end"]
    assert lines(big=True, red=False) == ["a", "b", "c", *rest]
    assert lines(big=True, red=True) == ["a", "d", *rest]
    assert lines(big=False, red=False) == ["a", "d", *rest]


def test_block_without_an_end_is_refused() -> None:
    with pytest.raises(ValueError, match="line 1 of the template has no end"):
        filled("//@ if big\n", {"big": True}, {}, {})

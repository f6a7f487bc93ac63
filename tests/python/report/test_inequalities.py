# SPDX-License-Identifier: Apache-2.0
"""Every inequality, basis and verdict of the core has a meaning in words."""

import re
from typing import get_args

from conftest import ROOT
from palpate.report.inequalities import BASES, MEANINGS, SYMBOLS, VERDICTS, symbols_in
from palpate.report.of_plan import _unit
from palpate.report.summary import LEVEL_WORDS
from palpate.verdict import Level

STABILITY = ROOT / "cpp" / "include" / "palpate" / "stability"


def words_in(file: str, of: str) -> set[str]:
    text = (STABILITY / file).read_text(encoding="utf-8")
    found = re.search(rf"words_of<{of}> =[^{{]*\{{([^}}]*)\}}", text)
    assert found
    return set(re.findall(r'"([\w-]+)"', found[1]))


def test_every_inequality_of_the_core_has_a_meaning_and_a_unit() -> None:
    files = (*STABILITY.glob("*_inequalities.hpp"), *STABILITY.rglob("*certificate.hpp"))
    text = "".join(file.read_text(encoding="utf-8") for file in files)
    ids = set(re.findall(r'"([a-z]+(?:-[a-z]+)+)"', text)) - words_in("certificate.hpp", "Verdict")
    assert ids == set(MEANINGS)
    assert all(_unit(kind, "rad") for kind, _ in MEANINGS.values() if kind)


def test_every_basis_and_verdict_has_words() -> None:
    assert set(BASES) == words_in("inequality.hpp", "Basis")
    assert set(VERDICTS) == words_in("certificate.hpp", "Verdict")
    assert set(LEVEL_WORDS) == set(get_args(Level))


NOT_SYMBOLS = {"max", "min", "mean", "cos", "Re", "and", "of", "hand", "servo"}


def test_every_symbol_of_a_formula_has_a_meaning() -> None:
    texts = [
        text
        for kind in ("direct", "coupled", "explicit", "tangent", "admittance")
        for text in re.findall(
            r'"([^"\n]*)"', (STABILITY / f"{kind}_inequalities.hpp").read_text(encoding="utf-8")
        )
    ]
    formulas = [text for text in texts if re.search(r" [>/+] | >= ", text) and "proved" not in text]
    assert "b >= T M / 2" in formulas
    words = {word for each in formulas for word in re.findall(r"[A-Za-z][A-Za-z_]*", each)}
    assert not words - NOT_SYMBOLS - set(SYMBOLS)


def test_only_the_symbols_of_the_given_formulas_are_listed() -> None:
    symbols = [line.partition(":")[0] for line in symbols_in(["b >= T M / 2", "f_c >= L Delta / 2"])]
    assert symbols == ["b", "f_c", "T", "Delta", "M", "L"]


def test_units_are_those_of_a_rotary_or_linear_device() -> None:
    assert _unit("stiffness", "rad") == "N·m/rad"
    assert _unit("damping", "m") == "N·s/m"

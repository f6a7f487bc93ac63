# SPDX-License-Identifier: Apache-2.0
"""Closed table of units, and the units in column names."""

from __future__ import annotations

import re
from dataclasses import dataclass
from math import pi

GRAVITY = 9.80665
"""Standard gravity [m/s^2], converts gram-force to newton."""

POUND = 0.45359237
"""Avoirdupois pound [kg]."""


@dataclass(frozen=True)
class Unit:
    """Unit of a column: its symbol, the SI unit of the same quantity, and the factor between both."""

    symbol: str
    si: str
    """SI unit to which values in this unit are converted: m, rad, count, N, N*m, A or s."""
    factor: float
    """Factor of the conversion: value in SI = factor * value in this unit"""

    def text(self, value: float) -> str:
        """Returns a value given in SI as text in this unit, with four significant digits and the symbol."""
        return f"{value / self.factor:.4g} {self.shown}".rstrip()

    def interval(self, low: float, high: float) -> str:
        """Returns the interval of two values given in SI as text in this unit: "0.1 to 0.3 mm"."""
        return f"{low / self.factor:.4g} to {self.text(high)}"

    @property
    def shown(self) -> str:
        """Symbol in texts: the SI symbol if the factor is 1."""
        return self.si if self.factor == 1.0 else self.symbol

    @staticmethod
    def of_si(symbol: str) -> Unit:
        """Returns the SI unit with this symbol; the empty symbol is a unit that is not stated."""
        return Unit(symbol, symbol, 1.0)


UNSTATED_UNIT = Unit.of_si("")
"""Unit of a quantity in SI units whose source does not state the unit."""

_FACTORS: dict[str, dict[str, float]] = {
    "m": {"m": 1.0, "mm": 1e-3, "um": 1e-6, "nm": 1e-9, "cm": 1e-2, "in": 0.0254},
    "rad": {"rad": 1.0, "deg": pi / 180},
    "count": {"count": 1.0, "counts": 1.0},
    "N": {
        "N": 1.0,
        "mN": 1e-3,
        "uN": 1e-6,
        "nN": 1e-9,
        "kN": 1e3,
        "gf": 1e-3 * GRAVITY,
        "kgf": GRAVITY,
        "lbf": POUND * GRAVITY,
        "ozf": POUND / 16 * GRAVITY,
    },
    "N*m": {"Nm": 1.0, "mNm": 1e-3, "uNm": 1e-6, "kNm": 1e3, "N*mm": 1e-3, "N*cm": 1e-2},
    "A": {"A": 1.0, "mA": 1e-3},
    "s": {"s": 1.0, "ms": 1e-3, "us": 1e-6, "min": 60.0},
}

UNITS: dict[str, Unit] = {
    symbol: Unit(symbol, si, factor) for si, symbols in _FACTORS.items() for symbol, factor in symbols.items()
}
"""All units that columns can have. No units library is used: it would read `Nm` as nanometre."""

POSITION_UNITS = ("m", "rad", "count")
FORCE_UNITS = ("N", "N*m", "A")
TIME_UNITS = ("s",)

COLUMN_SUFFIX = {"m": "m", "rad": "rad", "count": "count", "N": "N", "N*m": "Nm", "A": "A", "s": "s"}
"""Ending of a column name that states its SI unit, by this unit."""

MINUTE_STEMS = ("time", "t", "timestamp", "elapsed", "elapsed_time")
"""Column names after which the ending ``_min`` means minute; after other names it usually means minimum."""

_SPELLINGS = str.maketrans({"µ": "u", "μ": "u", "·": "*", "⋅": "*", "∙": "*", ".": "*"})

_BRACKETS = re.compile(r"(?P<stem>.*?)\s*(?:\[(?P<square>[^\[\]]*)\]|\((?P<round>[^()]*)\))\s*$", re.DOTALL)


def unit_of(symbol: str) -> Unit | None:
    """Returns the unit with this symbol, or None. ``µm`` is um, ``°`` is deg, ``N·m`` and ``N.m`` are Nm."""
    text = symbol.strip()
    if text == "°":
        return UNITS["deg"]
    plain = text.translate(_SPELLINGS) if "." not in (text[:1], text[-1:]) else text
    return UNITS.get(plain) or UNITS.get(plain.replace("N*m", "Nm"))


def symbols_of(si_units: tuple[str, ...]) -> str:
    """Returns the symbols of the table that belong to these SI units, joined by commas."""
    return ", ".join(symbol for symbol, unit in UNITS.items() if unit.si in si_units)


def split_name(column: str) -> tuple[str, Unit | None]:
    """Splits a column name into its stem and its unit: ``displacement_mm`` is (``displacement``, mm).

    The unit follows the last underscore (``force_N``), the last comma (``force, N``) or one slash (``Force /
    N``), or is in brackets at the end (``Force [gf]``, ``Force (mN)``). Symbols are case-sensitive. Without a
    unit of the table the stem is the whole name and the unit is None.
    """
    for stem, symbol in _stated(column):
        unit = unit_of(symbol)
        if stem and unit is not None:
            return stem, unit
    return column, None


def _stated(column: str) -> list[tuple[str, str]]:
    """Returns the stem of a column name and the text where a unit can be: a list of one pair, or empty."""
    if brackets := _BRACKETS.fullmatch(column):
        return [(brackets["stem"], brackets["square"] or brackets["round"] or "")]
    if "," in column:
        stem, _, symbol = column.rpartition(",")
        return [(stem.strip(), symbol)]
    if "/" in column:
        stem, _, symbol = column.rpartition("/")
        # `mm/s` and `velocity m/s` are quotients of units, `F/A` may be a quotient of quantities.
        quotient = "/" in stem or len(stem.strip()) < 2 or unit_of(re.split(r"[\s_]", stem.strip())[-1])
        return [] if quotient else [(stem.strip(), symbol)]
    stem, _, symbol = column.rpartition("_")
    if symbol == "min" and stem_key(stem) not in MINUTE_STEMS:
        return []
    return [(stem, symbol)]


def stem_key(stem: str) -> str:
    """Returns the normalised stem: ``Tip position`` is ``tip_position``."""
    return re.sub(r"\W+", "_", stem.strip()).strip("_").lower()

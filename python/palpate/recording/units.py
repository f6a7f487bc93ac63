# SPDX-License-Identifier: Apache-2.0
"""Units of columns: their symbols, their usual spellings, and the unit that a column name states."""

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
    """SI unit to which values in this unit are converted: m, rad, count, N, N*m, A or s. The symbol itself
    for a unit of another quantity, such as kPa or mm/s."""
    factor: float
    """Factor of the conversion: value in SI = factor * value in this unit"""
    scale: float = 1.0
    """Value given to :meth:`text` = scale * value in SI; 1 except for the scaled forces of a fit"""

    def text(self, value: float) -> str:
        """Returns a value given in SI, times the scale, as text in this unit, with four significant digits
        and the symbol."""
        return f"{value / (self.factor * self.scale):.4g} {self.shown}".rstrip()

    def interval(self, low: float, high: float) -> str:
        """Returns the interval of two values, as :meth:`text` takes them, as text: "0.1 to 0.3 mm"."""
        return f"{low / (self.factor * self.scale):.4g} to {self.text(high)}"

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

_MASS_UNITS = {("N", "m"): "kg", ("N*m", "rad"): "kg*m^2"}
"""Units of a mass that have a name, by the units of force and position."""


def unit_of_dynamics(name: str, force: str, position: str) -> str:
    """Returns the SI unit of a "mass" or a "damping" for SI units of force and position; empty if one of
    these is not stated."""
    if not (force and position):
        return ""
    if name == "damping":
        return f"{force}*s/{position}"
    return _MASS_UNITS.get((force, position), f"{force}*s^2/{position}")


CLOCK = Unit("date or clock time", "s", 1.0)
"""Unit of a column of dates or clock times, which are read as seconds since the first row."""

_FACTORS: dict[str, dict[str, float]] = {
    "m": {
        "m": 1.0,
        "mm": 1e-3,
        "um": 1e-6,
        "nm": 1e-9,
        "cm": 1e-2,
        "dm": 0.1,
        "in": 0.0254,
        "mil": 2.54e-5,
        "ft": 0.3048,
    },
    "rad": {"rad": 1.0, "mrad": 1e-3, "deg": pi / 180, "gon": pi / 200, "rev": 2 * pi},
    "count": {"count": 1.0},
    "N": {
        "N": 1.0,
        "cN": 1e-2,
        "mN": 1e-3,
        "uN": 1e-6,
        "nN": 1e-9,
        "pN": 1e-12,
        "daN": 10.0,
        "kN": 1e3,
        "MN": 1e6,
        "gf": 1e-3 * GRAVITY,
        "kgf": GRAVITY,
        "lbf": POUND * GRAVITY,
        "ozf": POUND / 16 * GRAVITY,
    },
    "N*m": {"Nm": 1.0, "mNm": 1e-3, "uNm": 1e-6, "kNm": 1e3, "N*mm": 1e-3, "N*cm": 1e-2},
    "A": {"A": 1.0, "mA": 1e-3},
    "s": {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "min": 60.0, "h": 3600.0},
}

UNITS: dict[str, Unit] = {
    symbol: Unit(symbol, si, factor) for si, symbols in _FACTORS.items() for symbol, factor in symbols.items()
}
"""All units except products; :func:`unit_of` also reads products such as ``in-lb``. No units
library is used: it would read `Nm` as nanometre and `g` as a mass."""

POSITION_UNITS = ("m", "rad", "count")
FORCE_UNITS = ("N", "N*m", "A")
TIME_UNITS = ("s",)

COLUMN_SUFFIX = {"m": "m", "rad": "rad", "count": "count", "N": "N", "N*m": "Nm", "A": "A", "s": "s"}
"""Ending of a column name that states its SI unit, by this unit."""

_MASSES = {"gf": "g gm gr gram gramme", "kgf": "kg kilo kilogram", "lbf": "lb lbm pound", "ozf": "oz ounce"}
"""Spellings of a mass by the symbol of the force that its weight is."""

_WORDS = {
    "m": "meter",
    "mm": "millimeter",
    "um": "micrometer micron mikrometer",
    "nm": "nanometer",
    "cm": "centimeter",
    "in": 'inch inche " ″ ”',
    "mil": "thou",
    "ft": "foot feet",
    "rad": "radian",
    "deg": "degree °",
    "rev": "revolution turn umdrehung",
    "count": "tick step pulse increment",
    "N": "newton",
    "mN": "millinewton",
    "kN": "kilonewton",
    "gf": "gram-force pond",
    "kgf": "kp kilopond kilogram-force",
    "lbf": "lb-f pound-force",
    "ozf": "oz-f ounce-force",
    "Nm": "newtonmeter",
    "A": "amp ampere",
    "mA": "milliamp milliampere",
    "s": "sec second sek sekunde",
    "ms": "msec millisecond milli",
    "us": "usec microsecond",
    "ns": "nsec nanosecond",
    "min": "minute",
    "h": "hr hour std stunde",
}
"""Spellings in lower case and without the plural ending, by symbol."""

_SPELLINGS = {
    word: symbol for table in (_WORDS, _MASSES) for symbol, words in table.items() for word in words.split()
}

_OF_OTHER_QUANTITIES = re.compile(
    r"[hkMG]?Pa|m?bar|[kp]si|[mk]?V|(deg|°)[CF]|K|C|[mk]?J|[mk]?W|%|k?Hz|px|pixel|dB"
)
"""Symbols of units that are neither of a position nor of a force nor of a time."""

_QUANTITIES: dict[tuple[str, ...], str] = {
    ("m", "rad", "count"): "pos disp depth indent height travel stroke compr exten deflec distance crosshead "
    "gap weg hub course depla allonge despla carrera sposta corsa encoder 変位",
    ("rad", "count"): "angle winkel rotation ang_ theta phi",
    ("N", "N*m"): "force load weight mass kraft fuerza forza carga carico 荷重 試験力",
    ("N*m",): "torque moment coppia",
    ("A",): "current strom amps",
    ("s",): "time zeit temps tiempo tempo elapsed stamp clock date uhr 時間",
    (): "pressure stress strain stiff modulus energy work_ veloc speed accel temperature temp_ volt power "
    "adc humid freq cycle segment status sample index row_ number record trial spannung druck",
}
"""Parts of column names by the SI units of the quantity that they name."""

JAPANESE_QUANTITIES = ("変位", "荷重", "試験力", "時間")
"""Names of quantities by which a text in Shift JIS is recognised."""

_WHOLE_NAMES = {
    **dict.fromkeys(("x", "z"), ("m", "rad", "count")),
    **dict.fromkeys(("f", "fx", "fy", "fz", "fn"), ("N", "N*m")),
    "force": FORCE_UNITS,
    "t": ("s",),
    "i": ("A",),
}
"""SI units of the quantity that a whole name denotes; palpate itself calls a motor current a force."""

_UNCLEAR = {"in", "min", "h"}
"""Symbols that are also words or abbreviations. After an underscore or a space, they are units only if the
rest of the name is that of a quantity which they can measure."""

_BRACKETS = re.compile(r"(?P<stem>.*?)\s*(?:\[(?P<square>[^\[\]]*)\]|\((?P<round>[^()]*)\))\s*$", re.DOTALL)
_PREPOSITION = re.compile(r"(?P<stem>.+?)\s+in\s+(?P<symbol>\S+)\s*$")
_PRODUCT = re.compile(r"(.+?)[*\-.\s]+(.+)")


def unit_of(symbol: str) -> Unit | None:
    """Returns the unit with this symbol or spelling, or None.

    ``µm`` and ``microns`` are um, ``°`` is deg, ``inches`` is in. A mass (``g``, ``lbs``) is the force that
    is its weight. A force and a length (``N·m``, ``in-lb``, ``kgf.cm``) are a torque. Capital letters count
    if they distinguish units (mN and MN). A step of an encoder is a part of a unit (``rev/4096``). A unit of
    another quantity (``kPa``, ``mm/s``) has an SI unit that no role has.
    """
    text = " ".join(symbol.replace("µ", "u").replace("μ", "u").replace("·", "*").replace("⋅", "*").split())
    text = text.replace("∙", "*")
    if found := _simple(text) or _torque(text):
        return found
    whole, _, parts = text.partition("/")
    if (unit := _simple(whole.strip())) and re.fullmatch(r" ?[1-9]\d*", parts):
        return Unit(f"({text})", unit.si, unit.factor / int(parts))
    first = re.split(r"[/^²³]|\*\*", text)[0]
    if _OF_OTHER_QUANTITIES.fullmatch(text) or (first != text and (unit_of(first) or not first)):
        return Unit.of_si(text)
    return None


def _simple(text: str) -> Unit | None:
    """Returns the unit if it is not a product, or None."""
    if text in UNITS:
        return UNITS[text]
    if text == "Grad":  # the German noun; `grad` is a gon in other languages
        return UNITS["deg"]
    word = text.lower().rstrip(".").replace("metre", "meter")
    if spelling := _SPELLINGS.get(word) or _SPELLINGS.get(word.removesuffix("s")):
        return UNITS[spelling]
    plural = word.removesuffix("s") if len(word) > 3 else word
    same = [unit for symbol, unit in UNITS.items() if symbol.lower() in (word, plural)]
    return same[0] if len(same) == 1 else None


def _torque(text: str) -> Unit | None:
    """Returns the product of a force and a length in any order, written with or without a sign, or None."""
    known = {*UNITS, *_SPELLINGS}
    pairs = [match.groups()] if (match := _PRODUCT.fullmatch(text)) else []
    pairs += [(text[:k], text[k:]) for k in range(1, len(text)) if text[:k] in known and text[k:] in known]
    for pair in pairs:
        units = {unit.si: unit for unit in map(_simple, pair) if unit is not None}
        if units.keys() == {"N", "m"}:
            force, length = units["N"], units["m"]
            joined = UNITS.get(force.symbol + length.symbol) or UNITS.get(f"{force.symbol}*{length.symbol}")
            return joined or Unit(f"{force.symbol}*{length.symbol}", "N*m", force.factor * length.factor)
    return None


def symbols_of(si_units: tuple[str, ...]) -> str:
    """Returns the symbols of the table that belong to these SI units, joined by commas."""
    return ", ".join(symbol for symbol, unit in UNITS.items() if unit.si in si_units)


def quantity_of(stem: str) -> set[str] | None:
    """Returns the SI units of the quantities that a column name without its unit names.

    None if it names none; an empty set for a quantity that is neither position, force nor time.
    """
    key = stem_key(stem)
    if key in _WHOLE_NAMES:
        return set(_WHOLE_NAMES[key])
    named = [
        units for units, words in _QUANTITIES.items() if any(word in f"{key}_" for word in words.split())
    ]
    return set().union(*named) if named else None


@dataclass(frozen=True)
class ColumnName:
    """Parts of a column name."""

    stem: str
    """The name without its unit"""
    unit: Unit | None
    stated: str = ""
    """Text in the place of a unit that is not read as one; empty if there is none"""


def parse_name(column: str) -> ColumnName:
    """Splits a column name into its stem and its unit: ``displacement_mm`` is ``displacement`` in mm.

    The unit is in brackets at the end (``Force [gf]``, ``Force (mN)``), or follows the last comma (``force,
    N``), one slash (``Force / N``), the word in (``Weg in mm``), or the last underscore or space
    (``force_N``, ``Load N``), or is the whole name (``grams``). Without a unit
    the stem is the whole name. A unit that contradicts the rest of the name is none: ``Load_A`` is not a
    current, ``Work [Nm]`` not a torque.
    """
    whole = _simple(column.strip()) if len(column.strip()) > 1 else None
    if whole is not None and column.strip().lower() not in ("count", "counts"):
        return ColumnName(column, whole)  # the name is a unit: `grams`, `mm`
    stem, text, mark = _place_of_unit(column)
    unit = unit_of(text) if stem else None
    named = quantity_of(stem)
    if unit is not None and unit.si in COLUMN_SUFFIX:
        explicit = mark not in ("_", " ") and named != set() and unit.si != "count"
        fits = explicit or unit.si in named if named is not None else not _needs_name(text, mark)
        if fits:
            return ColumnName(stem, unit)
    certain = mark not in ("_", " ") or (unit is not None and (len(text) > 1 or unit.si not in COLUMN_SUFFIX))
    return ColumnName(column, None, text.strip() if certain and stem else "")


def split_name(column: str) -> tuple[str, Unit | None]:
    """Returns the stem of a column name and its unit, or the whole name and None."""
    parts = parse_name(column)
    return parts.stem, parts.unit


def _needs_name(text: str, mark: str) -> bool:
    """Returns True if a text is a unit only behind a name of a quantity that the unit can measure.

    A mass needs such a name, because its weight may not be the force. A text behind an underscore or a space
    needs one if it may also be an index, an axis or a word.
    """
    word = text.strip().lower().rstrip(".")
    if any(word.removesuffix("s") in spellings.split() for spellings in _MASSES.values()):
        return True
    unclear = word in _UNCLEAR or (mark == " " and len(text) == 1) or (text not in UNITS and len(text) < 3)
    return mark in ("_", " ") and (unclear or (text not in UNITS and text.lower() in UNITS))


def _place_of_unit(column: str) -> tuple[str, str, str]:
    """Returns the stem of a column name, the text where a unit can be, and the mark before this text."""
    if brackets := _BRACKETS.fullmatch(column):
        return brackets["stem"], brackets["square"] or brackets["round"] or "", "["
    if "," in column:
        stem, _, symbol = column.rpartition(",")
        return stem.strip(), symbol, ","
    if "/" in column:
        stem, _, symbol = column.rpartition("/")
        # `mm/s` and `velocity m/s` are quotients of units, `F/A` is one of quantities, `F/N` is none.
        unit, named = unit_of(symbol), quantity_of(stem)
        is_short = len(stem.strip()) < 2 and not (unit and named and unit.si in named)
        quotient = "/" in stem or is_short or unit_of(re.split(r"[\s_]", stem.strip())[-1])
        return ("", "", "/") if quotient else (stem.strip(), symbol, "/")
    if preposition := _PREPOSITION.fullmatch(column):
        return preposition["stem"], preposition["symbol"], "in"
    mark = max("_ ", key=column.rstrip().rfind)
    stem, _, symbol = column.rstrip().rpartition(mark)
    return stem, symbol, mark


def stem_key(stem: str) -> str:
    """Returns the normalised stem: ``Tip position`` is ``tip_position``."""
    return re.sub(r"\W+", "_", stem.strip()).strip("_").lower()

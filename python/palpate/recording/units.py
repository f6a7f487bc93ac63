# SPDX-License-Identifier: Apache-2.0
"""The closed table of units, and what a column name says about its unit."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi

GRAVITY = 9.80665
"""Standard gravity [m/s^2]: turns gram-force into newton."""


@dataclass(frozen=True)
class Unit:
    """One unit of the table: what it measures, and the factor to the SI unit."""

    symbol: str
    si: str
    """The unit inside the package: m, rad, count, N, N*m, A or s."""
    factor: float
    """value in SI = factor * value in this unit"""


_FACTORS: dict[str, dict[str, float]] = {
    "m": {"m": 1.0, "mm": 1e-3, "um": 1e-6, "nm": 1e-9, "cm": 1e-2},
    "rad": {"rad": 1.0, "deg": pi / 180},
    "count": {"count": 1.0, "counts": 1.0},
    "N": {"N": 1.0, "mN": 1e-3, "uN": 1e-6, "nN": 1e-9, "gf": 1e-3 * GRAVITY, "kgf": GRAVITY},
    "N*m": {"Nm": 1.0, "mNm": 1e-3, "uNm": 1e-6},
    "A": {"A": 1.0, "mA": 1e-3},
    "s": {"s": 1.0, "ms": 1e-3, "us": 1e-6},
}

UNITS: dict[str, Unit] = {
    symbol: Unit(symbol, si, factor) for si, symbols in _FACTORS.items() for symbol, factor in symbols.items()
}
"""Every unit that a column may carry. The table is closed: a units library would read `Nm` as nanometre."""

POSITION_UNITS = ("m", "rad", "count")
FORCE_UNITS = ("N", "N*m", "A")
TIME_UNITS = ("s",)

COLUMN_SUFFIX = {"m": "m", "rad": "rad", "count": "count", "N": "N", "N*m": "Nm", "A": "A", "s": "s"}
"""How an SI unit is written at the end of a column name."""


def symbols_of(si_units: tuple[str, ...]) -> str:
    """The symbols of the table that belong to these SI units, as a person would list them."""
    return ", ".join(symbol for symbol, unit in UNITS.items() if unit.si in si_units)


def split_name(column: str) -> tuple[str, Unit | None]:
    """Split a column name into its stem and its unit: ``displacement_mm`` is (``displacement``, mm).

    The unit is the text after the last underscore, case-sensitive. A name without a unit of the table keeps
    its whole text as stem and gets None: a unit is never guessed.
    """
    stem, separator, symbol = column.rpartition("_")
    if separator and stem and symbol in UNITS:
        return stem, UNITS[symbol]
    return column, None

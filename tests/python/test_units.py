# SPDX-License-Identifier: Apache-2.0
"""The closed table of units."""

import math

import pytest

from palpate.recording.units import UNITS, split_name, symbols_of

# value of one unit in SI: SI brochure, and g_n = 9.80665 m/s^2 (CGPM 1901) for gram-force.
EXPECTED = {
    "m": ("m", 1.0),
    "mm": ("m", 1e-3),
    "um": ("m", 1e-6),
    "nm": ("m", 1e-9),
    "cm": ("m", 1e-2),
    "rad": ("rad", 1.0),
    "deg": ("rad", math.pi / 180),
    "count": ("count", 1.0),
    "counts": ("count", 1.0),
    "N": ("N", 1.0),
    "mN": ("N", 1e-3),
    "uN": ("N", 1e-6),
    "nN": ("N", 1e-9),
    "gf": ("N", 9.80665e-3),
    "kgf": ("N", 9.80665),
    "Nm": ("N*m", 1.0),
    "mNm": ("N*m", 1e-3),
    "uNm": ("N*m", 1e-6),
    "A": ("A", 1.0),
    "mA": ("A", 1e-3),
    "s": ("s", 1.0),
    "ms": ("s", 1e-3),
    "us": ("s", 1e-6),
}


def test_the_table_is_closed() -> None:
    assert UNITS.keys() == EXPECTED.keys()


@pytest.mark.parametrize("symbol", EXPECTED)
def test_a_unit_has_its_si_unit_and_factor(symbol: str) -> None:
    si, factor = EXPECTED[symbol]
    assert UNITS[symbol].si == si
    assert UNITS[symbol].factor == pytest.approx(factor, rel=1e-15)


def test_the_unit_is_the_text_after_the_last_underscore() -> None:
    assert split_name("tip_position_um") == ("tip_position", UNITS["um"])
    assert split_name("torque_Nm") == ("torque", UNITS["Nm"])


@pytest.mark.parametrize(
    "name",
    ["torque_nM", "position_MM", "voltage_V", "x", "m", "_m", "speed_m_s2", "beam_angle", "contact_x", ""],
)
def test_a_name_without_a_unit_of_the_table_has_none(name: str) -> None:
    assert split_name(name) == (name, None)


def test_units_are_listed_by_what_they_measure() -> None:
    assert symbols_of(("m", "rad")) == "m, mm, um, nm, cm, rad, deg"

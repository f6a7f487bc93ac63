# SPDX-License-Identifier: Apache-2.0
"""Every unit that a recording may have, and its value in SI units."""

import math

import pytest

from palpate.recording.units import UNITS, split_name, symbols_of, unit_of

# Value of each unit in SI, from the SI brochure; standard gravity g_n = 9.80665 m/s^2 (CGPM 1901);
# lb = 0.45359237 kg and in = 25.4 mm (1959).
EXPECTED = {
    "m": ("m", 1.0),
    "mm": ("m", 1e-3),
    "um": ("m", 1e-6),
    "nm": ("m", 1e-9),
    "cm": ("m", 1e-2),
    "in": ("m", 0.0254),
    "rad": ("rad", 1.0),
    "deg": ("rad", math.pi / 180),
    "count": ("count", 1.0),
    "counts": ("count", 1.0),
    "N": ("N", 1.0),
    "mN": ("N", 1e-3),
    "uN": ("N", 1e-6),
    "nN": ("N", 1e-9),
    "kN": ("N", 1e3),
    "gf": ("N", 9.80665e-3),
    "kgf": ("N", 9.80665),
    "lbf": ("N", 4.4482216152605),
    "ozf": ("N", 4.4482216152605 / 16),
    "Nm": ("N*m", 1.0),
    "mNm": ("N*m", 1e-3),
    "uNm": ("N*m", 1e-6),
    "kNm": ("N*m", 1e3),
    "N*mm": ("N*m", 1e-3),
    "N*cm": ("N*m", 1e-2),
    "A": ("A", 1.0),
    "mA": ("A", 1e-3),
    "s": ("s", 1.0),
    "ms": ("s", 1e-3),
    "us": ("s", 1e-6),
    "min": ("s", 60.0),
}


def test_the_table_has_exactly_the_expected_units() -> None:
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
    [
        *(
            "torque_nM",
            "position_MM",
            "voltage_V",
            "x",
            "m",
            "_m",
            "speed_m_s2",
            "beam_angle",
            "contact_x",
            "",
        ),
        *(
            "Speed (mm/min)",
            "velocity / m/s",
            "velocity m/s",
            "speed_mm/s",
            "F/A",
            "Speed, mm/s",
            "Strain [-]",
        ),
        *("Force (N) [filtered]", "(N)", "force_min", "angle_min", "Force N"),
    ],
)
def test_a_name_without_a_unit_of_the_table_has_none(name: str) -> None:
    assert split_name(name) == (name, None)


def test_units_are_listed_by_quantity() -> None:
    assert symbols_of(("m", "rad")) == "m, mm, um, nm, cm, in, rad, deg"


@pytest.mark.parametrize(
    ("name", "stem", "symbol"),
    [
        ("Force [gf]", "Force", "gf"),
        ("Force (mN)", "Force", "mN"),
        ("Load(N)", "Load", "N"),
        ("Force / N", "Force", "N"),
        ("Kraft/kN", "Kraft", "kN"),
        ("force, N", "force", "N"),
        ("Tip position [µm]", "Tip position", "um"),
        ("Winkel [°]", "Winkel", "deg"),
        ("Torque [N·m]", "Torque", "Nm"),
        ("Torque (mN.m)", "Torque", "mNm"),
        ("Torque (N*cm)", "Torque", "N*cm"),
        ("torque_N.mm", "torque", "N*mm"),
        ("time_min", "time", "min"),
        ("Time [min]", "Time", "min"),
        ("a / b [mm]", "a / b", "mm"),
    ],
)
def test_the_unit_of_a_name_is_read_in_each_notation(name: str, stem: str, symbol: str) -> None:
    assert split_name(name) == (stem, UNITS[symbol])


@pytest.mark.parametrize("symbol", ["N/m", "MM", "n", "N m", "lb", "%", "-", "", ".", "m."])
def test_a_symbol_outside_the_table_has_no_unit(symbol: str) -> None:
    assert unit_of(symbol) is None

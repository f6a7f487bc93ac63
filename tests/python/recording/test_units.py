# SPDX-License-Identifier: Apache-2.0
"""Every unit that a recording may have, and its value in SI units."""

import math

import pytest

from palpate.recording.units import UNITS, parse_name, split_name, symbols_of, unit_of

# Value of each unit in SI, from the SI brochure; standard gravity g_n = 9.80665 m/s^2 (CGPM 1901);
# lb = 0.45359237 kg and in = 25.4 mm (1959).
EXPECTED = {
    "m": ("m", 1.0),
    "mm": ("m", 1e-3),
    "um": ("m", 1e-6),
    "nm": ("m", 1e-9),
    "cm": ("m", 1e-2),
    "dm": ("m", 0.1),
    "in": ("m", 0.0254),
    "mil": ("m", 25.4e-6),
    "ft": ("m", 0.3048),
    "rad": ("rad", 1.0),
    "deg": ("rad", math.pi / 180),
    "gon": ("rad", math.pi / 200),
    "mrad": ("rad", 1e-3),
    "rev": ("rad", 2 * math.pi),
    "count": ("count", 1.0),
    "N": ("N", 1.0),
    "mN": ("N", 1e-3),
    "uN": ("N", 1e-6),
    "nN": ("N", 1e-9),
    "pN": ("N", 1e-12),
    "cN": ("N", 1e-2),
    "daN": ("N", 10.0),
    "kN": ("N", 1e3),
    "MN": ("N", 1e6),
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
    "ns": ("s", 1e-9),
    "h": ("s", 3600.0),
    "min": ("s", 60.0),
}


def test_the_table_has_exactly_the_expected_units() -> None:
    assert UNITS.keys() == EXPECTED.keys()


@pytest.mark.parametrize("symbol", EXPECTED)
def test_a_unit_has_its_si_unit_and_factor(symbol: str) -> None:
    si, factor = EXPECTED[symbol]
    assert UNITS[symbol].si == si
    assert UNITS[symbol].factor == pytest.approx(factor, rel=1e-15)


@pytest.mark.parametrize(("symbol", "degrees"), [("rev/4096", 360.0 / 4096.0), ("deg / 10", 0.1)])
def test_a_step_of_an_encoder_is_a_part_of_a_unit(symbol: str, degrees: float) -> None:
    unit = unit_of(symbol)
    assert unit is not None
    assert unit.si == "rad"
    assert unit.factor == pytest.approx(math.radians(degrees), rel=1e-15)


def test_the_unit_is_the_text_after_the_last_underscore() -> None:
    assert split_name("tip_position_um") == ("tip_position", UNITS["um"])
    assert split_name("torque_Nm") == ("torque", UNITS["Nm"])


@pytest.mark.parametrize(
    "name",
    [
        *(
            "torque_nM",
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
        *(
            "Force (N) [filtered]",
            "(N)",
            "force_min",
            "angle_min",
            "Sensor N",
            "Data in",
            "Load_A",
            "adc_in",
            "sample_N",
        ),
        *("Work [Nm]", "Strain [mm/mm]", "Scale (g)", "pressure_kPa", "row_count"),
    ],
)
def test_a_name_without_a_unit_of_the_table_has_none(name: str) -> None:
    assert split_name(name) == (name, None)


def test_units_are_listed_by_quantity() -> None:
    assert symbols_of(("m", "rad")) == "m, mm, um, nm, cm, dm, in, mil, ft, rad, mrad, deg, gon, rev"


@pytest.mark.parametrize(
    ("name", "stem", "symbol"),
    [
        ("Force [gf]", "Force", "gf"),
        ("Force (mN)", "Force", "mN"),
        ("Load(N)", "Load", "N"),
        ("Force / N", "Force", "N"),
        ("F / N", "F", "N"),
        ("x/mm", "x", "mm"),
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
        ("position_MM", "position", "mm"),
        ("Weg in mm", "Weg", "mm"),
        ("Load N", "Load", "N"),
        ("Force kg", "Force", "kgf"),
        ("travel_inches", "travel", "in"),
        ("encoder_mm", "encoder", "mm"),
        ("encoder_deg", "encoder", "deg"),
        ("force_g", "force", "gf"),
        ("Elapsed (sec.)", "Elapsed", "s"),
    ],
)
def test_the_unit_of_a_name_is_read_in_each_notation(name: str, stem: str, symbol: str) -> None:
    assert split_name(name) == (stem, UNITS[symbol])


@pytest.mark.parametrize("symbol", ["nM", "NM", "mn", "grad", "raw", "hh:mm:ss", "-", "", ".", "lbx"])
def test_a_text_with_several_meanings_or_none_is_not_read(symbol: str) -> None:
    assert unit_of(symbol) is None


@pytest.mark.parametrize("symbol", ["N/m", "%", "kPa", "MPa", "mm/s", "N/mm2", "kgf/cm²", "V", "°C"])
def test_a_unit_of_another_quantity_has_no_role(symbol: str) -> None:
    unit = unit_of(symbol)
    assert unit is not None
    assert unit.si not in {each.si for each in UNITS.values()}


@pytest.mark.parametrize(
    ("spellings", "symbol"),
    [
        ("mm MM Mm millimeter millimetres Millimeter", "mm"),
        ('in inch inches in. "', "in"),
        ("mil mils thou", "mil"),
        ("µm μm um micron microns Micrometer", "um"),
        ("deg degree degrees ° Grad", "deg"),
        ("rev turns revolutions", "rev"),
        ("count counts ticks steps pulses", "count"),
        ("N Newton Newtons n", "N"),
        ("kN KN", "kN"),
        ("g gram grams gf gF", "gf"),
        ("kg kgf kp KG", "kgf"),
        ("lb lbs lbf LBF lb-f pounds", "lbf"),
        ("oz ozf ounces", "ozf"),
        ("s S sec secs sec. second Seconds", "s"),
        ("ms msec milliseconds", "ms"),
        ("min minutes mins", "min"),
        ("h hr hours", "h"),
        ("Nm N-m N.m N·m N*m", "Nm"),
        ("mNm mN.m mN-m", "mNm"),
        ("Ncm N-cm N.cm", "N*cm"),
        ("Nmm N-mm N.mm", "N*mm"),
    ],
)
def test_usual_spellings_are_read(spellings: str, symbol: str) -> None:
    assert {unit_of(each) for each in spellings.split()} == {UNITS[symbol]}


@pytest.mark.parametrize(
    ("spellings", "factor"),
    [
        ("in-lb in.lb lb-in lbf-in lbf*in inlb", 4.4482216152605 * 0.0254),
        ("oz-in ozf-in oz.in ozin", 4.4482216152605 / 16 * 0.0254),
        ("ft-lb ft-lbs lbf-ft", 4.4482216152605 * 0.3048),
        ("kgf-cm kgf.cm kg-cm kgcm", 9.80665e-2),
        ("gf-cm gf.cm g-cm", 9.80665e-5),
    ],
)
def test_the_product_of_a_force_and_a_length_is_a_torque(spellings: str, factor: float) -> None:
    for each in spellings.split():
        unit = unit_of(each)
        assert unit is not None
        assert (unit.si, unit.factor) == ("N*m", pytest.approx(factor, rel=1e-12))


def test_a_name_keeps_the_text_in_the_place_of_a_unit_that_is_not_read() -> None:
    assert parse_name("Force (grains)").stated == "grains"
    assert parse_name("pressure_kPa").stated == "kPa"
    assert parse_name("tip_left").stated == ""

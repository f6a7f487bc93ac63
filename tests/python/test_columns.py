# SPDX-License-Identifier: Apache-2.0
"""The rules by which columns are chosen, and the sentences when they do not choose."""

import re

import pytest

from palpate import InputError
from palpate.recording.columns import Choice, choose_columns


def choose(header: str, **named: object) -> Choice:
    return choose_columns("press.csv", header.split(","), **named)  # type: ignore[arg-type]


def test_a_named_column_wins_over_every_rule() -> None:
    choice = choose("position_mm,depth_mm,force_N,torque_Nm", position="depth_mm", force="torque_Nm")
    assert (choice.position.name, choice.force.name) == ("depth_mm", "torque_Nm")


def test_si_wins_over_counts_in_one_stem() -> None:
    choice = choose("angle_counts,angle_rad,hold_current_A")
    assert choice.position.name == "angle_rad"
    assert "angle_rad is used in place of angle_counts (SI wins)" in choice.notes


def test_si_wins_over_converted_units_in_one_stem() -> None:
    assert choose("angle_deg,angle_rad,torque_Nm").position.name == "angle_rad"


def test_the_only_candidate_is_taken_whatever_it_is_called() -> None:
    choice = choose("knob_deg,load_cell_mN,label")
    assert (choice.position.name, choice.force.name, choice.time) == ("knob_deg", "load_cell_mN", None)
    assert choice.notes == ()


@pytest.mark.parametrize(
    ("header", "position"),
    [
        ("height_um,tip_position_um,force_nN", "tip_position_um"),
        ("tip_position_um,indentation_um,force_nN", "indentation_um"),
        ("indentation_um,angle_rad,force_nN", "angle_rad"),
        ("angle_rad,depth_mm,force_nN", "depth_mm"),
        ("depth_mm,displacement_mm,force_nN", "displacement_mm"),
        ("displacement_mm,position_mm,force_nN", "position_mm"),
        ("x_mm,height_um,y_mm,force_nN", "height_um"),
    ],
)
def test_the_first_preferred_stem_is_the_position(header: str, position: str) -> None:
    choice = choose(header)
    assert choice.position.name == position
    assert choice.notes[0].startswith(f"{position} is preferred by its name to ")


@pytest.mark.parametrize(
    ("header", "force"),
    [
        ("depth_mm,current_A,hold_current_A", "hold_current_A"),
        ("depth_mm,hold_current_A,normal_force_N", "normal_force_N"),
        ("depth_mm,normal_force_N,torque_Nm", "torque_Nm"),
        ("depth_mm,torque_Nm,force_N", "force_N"),
        ("depth_mm,force_x_N,force_y_N,normal_force_N", "normal_force_N"),
    ],
)
def test_the_first_preferred_stem_is_the_force(header: str, force: str) -> None:
    assert choose(header).force.name == force


def test_a_preferred_stem_in_two_equal_units_does_not_choose() -> None:
    with pytest.raises(InputError, match=r"position_mm, position_um.*--position"):
        choose("position_mm,position_um,force_N")


@pytest.mark.parametrize(
    ("header", "sentence"),
    [
        (
            "back_angle_rad,front_angle_rad,torque_Nm",
            "press.csv: two columns could be the position (back_angle_rad, front_angle_rad); "
            "choose with --position NAME",
        ),
        (
            "depth_mm,force_x_N,force_y_N,force_z_N",
            "press.csv: three columns could be the force (force_x_N, force_y_N, force_z_N); "
            "choose with --force NAME",
        ),
        (
            "start_s,stop_s,depth_mm,force_N",
            "press.csv: two columns could be the time (start_s, stop_s); choose with --time NAME",
        ),
        (
            "x,y",
            "press.csv: no column name ends in a unit of position "
            "(m, mm, um, nm, cm, rad, deg, count, counts) among x, y; "
            "name one with --position NAME and state its unit with --units NAME=UNIT",
        ),
        (
            "depth_mm,y",
            "press.csv: no column name ends in a unit of force (N, mN, uN, nN, gf, kgf, Nm, mNm, uNm, A, mA) "
            "among depth_mm, y; name one with --force NAME and state its unit with --units NAME=UNIT",
        ),
    ],
    ids=["two positions", "three forces", "two times", "no unit", "no force unit"],
)
def test_what_no_rule_decides_is_refused_with_the_option(header: str, sentence: str) -> None:
    with pytest.raises(InputError, match=f"^{re.escape(sentence)}$"):
        choose(header)


def test_a_stated_unit_makes_a_candidate() -> None:
    choice = choose("x,y", units={"x": "rad", "y": "Nm"})
    assert (choice.position.name, choice.force.name) == ("x", "y")


def test_a_unit_may_be_stated_by_the_role_of_a_named_column() -> None:
    choice = choose("in,out", position="in", force="out", units={"position": "deg", "force": "gf"})
    assert choice.position.unit is not None
    assert choice.force.unit is not None
    assert (choice.position.unit.symbol, choice.force.unit.symbol) == ("deg", "gf")


def test_a_stated_unit_wins_over_the_name() -> None:
    choice = choose("depth_mm,force_N", units={"depth_mm": "um"})
    assert choice.position.unit is not None
    assert choice.position.unit.symbol == "um"


def test_a_column_in_an_unknown_unit_takes_the_stated_one() -> None:
    choice = choose(
        "input_V,output_V", position="input_V", force="output_V", units={"input_V": "m", "output_V": "N"}
    )
    assert (choice.position.name, choice.force.name) == ("input_V", "output_V")


@pytest.mark.parametrize(
    ("named", "sentence"),
    [
        ({"position": "deep_mm"}, "has no column 'deep_mm' for --position; its columns are depth_mm, y"),
        ({"direction": "stroke"}, "has no column 'stroke' for --direction"),
        ({"inputs": ("load",)}, "has no column 'load' for inputs"),
        ({"units": {"z": "N"}}, "has no column 'z' for --units"),
        ({"units": {"force": "N"}}, "--units force=N also needs --force NAME"),
        ({"units": {"y": "lbf"}}, "--units y=lbf: 'lbf' is no unit; use one of m, mm"),
        ({"force": "y"}, "column y has no known unit; state it with --units y=UNIT (one of N, mN"),
        ({"force": "depth_mm"}, "column depth_mm is in mm, which is no unit of force"),
        ({"force": "y", "units": {"y": "mm"}}, "column y is in mm, which is no unit of force"),
    ],
)
def test_wrong_hints_are_refused_by_name(named: dict[str, object], sentence: str) -> None:
    with pytest.raises(InputError, match=re.escape(sentence)):
        choose("depth_mm,y", **named)


def test_one_column_cannot_play_two_parts() -> None:
    with pytest.raises(InputError, match="column p cannot be both the position and the force"):
        choose("p,q", position="p", force="p", unstated=("p",))


@pytest.mark.parametrize("name", ["direction", "segment"])
def test_the_direction_is_found_by_its_name(name: str) -> None:
    assert choose(f"depth_mm,force_N,{name}").direction == name
    assert choose("depth_mm,force_N,stroke").direction is None

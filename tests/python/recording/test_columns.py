# SPDX-License-Identifier: Apache-2.0
"""Rules that choose position and force columns of a file, and errors if no rule can choose."""

import re

import pytest

from palpate import InputError
from palpate.recording.columns import Choice, choose_columns
from palpate.recording.looks import Look
from palpate.recording.units import UNITS


def choose(header: str, **named: object) -> Choice:
    return choose_columns("press.csv", header.split(","), **named)  # type: ignore[arg-type]


def test_an_explicitly_named_column_overrides_every_rule() -> None:
    choice = choose("position_mm,depth_mm,force_N,load_N", position="depth_mm", force="load_N")
    assert (choice.position.name, choice.force.name) == ("depth_mm", "load_N")


def test_si_is_preferred_to_counts_of_one_stem() -> None:
    choice = choose("angle_counts,angle_rad,hold_current_A")
    assert choice.position.name == "angle_rad"
    assert "angle_rad is used in place of angle_counts (SI units are preferred)" in choice.notes


def test_si_is_preferred_to_converted_units_of_one_stem() -> None:
    assert choose("angle_deg,angle_rad,torque_Nm").position.name == "angle_rad"


def test_the_only_candidate_is_chosen_for_any_name() -> None:
    choice = choose("knob_mm,load_cell_mN,label")
    assert (choice.position.name, choice.force.name, choice.time) == ("knob_mm", "load_cell_mN", None)
    assert choice.notes == ()


@pytest.mark.parametrize(
    ("header", "position"),
    [
        ("height_um,tip_position_um,force_nN", "tip_position_um"),
        ("tip_position_um,indentation_um,force_nN", "indentation_um"),
        ("indentation_um,depth_mm,force_nN", "depth_mm"),
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
        ("depth_mm,normal_force_N,force_N", "force_N"),
        ("depth_mm,force_x_N,force_y_N,normal_force_N", "normal_force_N"),
    ],
)
def test_the_first_preferred_stem_is_the_force(header: str, force: str) -> None:
    assert choose(header).force.name == force


def test_a_preferred_stem_in_two_non_si_units_is_refused() -> None:
    with pytest.raises(InputError, match=r"position_mm, position_um.*--position position_mm$"):
        choose("position_mm,position_um,force_N")


POSITION_SYMBOLS = "such as mm, in or deg"
FORCE_SYMBOLS = "such as N, gf or N*m"


@pytest.mark.parametrize(
    ("header", "sentence"),
    [
        (
            "back_angle_rad,front_angle_rad,torque_Nm",
            "press.csv: two columns could be the position (back_angle_rad, front_angle_rad). "
            "For example, add: --position back_angle_rad",
        ),
        (
            "depth_mm,force_x_N,force_y_N,force_z_N",
            "press.csv: three columns could be the force (force_x_N, force_y_N, force_z_N). "
            "For example, add: --force force_x_N",
        ),
        (
            "start_s,stop_s,depth_mm,force_N",
            "press.csv: two columns could be the time (start_s, stop_s). For example, add: --time start_s",
        ),
        (
            "x,y",
            f"press.csv: no column name has a unit of position {POSITION_SYMBOLS}; "
            f"no column name has a unit of force {FORCE_SYMBOLS}. The columns are x, y. "
            "If x is in mm and y is in N, add: --position x --units x=mm --force y --units y=N",
        ),
        (
            "depth_mm,y",
            f"press.csv: no column name has a unit of force {FORCE_SYMBOLS}. The columns are depth_mm, y. "
            "If y is in N, add: --force y --units y=N",
        ),
        (
            "a_mm,b_mm,load cell,start_s,stop_s",
            "press.csv: two columns could be the position (a_mm, b_mm); "
            f"no column name has a unit of force {FORCE_SYMBOLS}; "
            "two columns could be the time (start_s, stop_s). "
            "The columns are a_mm, b_mm, load cell, start_s, stop_s. If load cell is in N, add: "
            "--position a_mm --force 'load cell' --units 'load cell=N' --time start_s",
        ),
        (
            "Travel up (mm),Force up (N),Travel down (mm),Force down (N)",
            "press.csv: Travel up (mm), Travel down (mm) are the position of press and release; "
            "Force up (N), Force down (N) are the force of press and release. "
            "Write the rows of the release below those of the press, with the words press and release in a "
            "column direction",
        ),
    ],
    ids=[
        *("two positions", "three forces", "two times", "no unit", "no force unit", "three problems"),
        "both strokes",
    ],
)
def test_a_refusal_names_all_problems_and_one_command(header: str, sentence: str) -> None:
    with pytest.raises(InputError, match=f"^{re.escape(sentence)}$"):
        choose(header)


@pytest.mark.parametrize(
    "name", ["Scale [g]", "Gewicht in g", "Waage (g)", "Poids (g)", "tension (kg)", "Netto (g)", "m, g"]
)
def test_a_mass_on_a_scale_is_the_force_that_is_its_weight(name: str) -> None:
    choice = choose_columns("press.csv", ["Weg (mm)", name])
    unit = UNITS["kgf" if "kg" in name else "gf"]
    assert (choice.force.name, choice.force.unit) == (name, unit)
    assert choice.notes == (f"{name} is read in {unit.symbol}",)


def test_a_mass_of_another_quantity_or_next_to_a_force_is_not_read() -> None:
    assert choose("x_mm,Vibration [g],Kraft (N)").force.name == "Kraft (N)"
    with pytest.raises(InputError, match="needs two columns of numbers"):
        choose("x_mm,Acceleration [g]")


def test_a_cure_states_the_unit_in_a_name() -> None:
    with pytest.raises(InputError, match=r"If hx711_g is in gf, add: --force hx711_g --units hx711_g=gf$"):
        choose("x_mm,hx711_g")
    with pytest.raises(InputError, match=r"add: --units 'Scale \[g\]=gf'$"):
        choose("x_mm,force_N,Scale [g]", force="Scale [g]")


def test_a_cure_suggests_the_likely_columns() -> None:
    def cure(header: str, **named: object) -> str:
        with pytest.raises(InputError) as refused:
            choose(header, **named)
        return str(refused.value).split("add: ")[1]

    assert cure("reaction torque,angle,sample") == (
        "--position angle --units angle=rad --force 'reaction torque' --units 'reaction torque=Nm'"
    )
    assert cure("n,angle,input,speed", looks={"input": Look(steady=True)}) == (
        "--position angle --units angle=rad --force n --units n=Nm"
    )
    assert cure("probe,x,y", looks={"probe": Look(text=True)}).startswith(
        "--position x --units x=mm --force y"
    )
    assert cure("t,F,x").startswith("--position x --units x=mm --force F --units F=N --time t")
    assert cure("count,pos,force_N", looks={"count": Look(counter=True)}) == "--position pos --units pos=mm"
    assert cure("encoder,torque_Nm") == "--position encoder --units encoder=rad"
    assert cure("encoder,force_N") == "--position encoder --units encoder=mm"
    assert cure("cmd_mm,actual_mm,force_N") == "--position actual_mm"
    assert cure("PedalPosTarget_mm,PedalPosAct_mm,force_N") == "--position PedalPosAct_mm"
    assert cure("depth_mm,Force_filt [N],Force_raw [N]") == "--force 'Force_raw [N]'"
    assert cure("depth_mm,Peak Load (N),Load (N)") == "--force 'Load (N)'"


@pytest.mark.parametrize(
    "header",
    [
        *("force_N,pressure_kPa", "Force [N],Stress [MPa]", "Force (N),Stiffness (N/mm)", "force_N,velocity"),
        *("force_N,Temperature", "force_N,Strain (%)", "force_N,work", "voltage,position_mm", "F_N,cycle"),
    ],
)
def test_a_quantity_that_is_neither_position_nor_force_is_never_suggested(header: str) -> None:
    with pytest.raises(
        InputError, match=r"A recording needs two columns of numbers, a position and a force$"
    ):
        choose(header)


def test_the_user_fills_in_the_unit_of_a_name_that_states_another_text() -> None:
    with pytest.raises(InputError, match="with the unit in place of UNIT: --force") as refused:
        choose("position_mm,Force (grains)")
    assert str(refused.value).endswith("--force 'Force (grains)' --units 'Force (grains)=UNIT'")
    with pytest.raises(InputError, match="'UNIT' is not a unit"):
        choose("position_mm,Force (grains)", force="Force (grains)", units={"Force (grains)": "UNIT"})


def test_units_between_which_no_object_has_a_law_are_refused() -> None:
    with pytest.raises(InputError, match="angle_deg and force_N: a force needs a position in m"):
        choose("angle_deg,force_N")
    assert choose("angle_deg,travel_mm,force_N").position.name == "travel_mm"
    assert choose("angle_deg,force_N,torque_Nm").force.name == "torque_Nm"
    assert choose("angle_deg,current_A").force.name == "current_A"


def test_a_column_with_a_stated_unit_is_a_candidate() -> None:
    choice = choose("x,y", units={"x": "rad", "y": "Nm"})
    assert (choice.position.name, choice.force.name) == ("x", "y")


def test_a_unit_may_be_stated_by_the_role_of_a_named_column() -> None:
    choice = choose("in,out", position="in", force="out", units={"position": "mil", "force": "gf"})
    assert choice.position.unit is not None
    assert choice.force.unit is not None
    assert (choice.position.unit.symbol, choice.force.unit.symbol) == ("mil", "gf")


def test_a_stated_unit_overrides_the_unit_in_the_name() -> None:
    choice = choose("depth_mm,force_N", units={"depth_mm": "um"})
    assert choice.position.unit is not None
    assert choice.position.unit.symbol == "um"


def test_a_column_with_an_unknown_unit_is_read_in_the_stated_unit() -> None:
    choice = choose(
        "input_V,output_V",
        position="input_V",
        force="output_V",
        units={"input_V": "m", "output_V": "N"},
    )
    assert (choice.position.name, choice.force.name) == ("input_V", "output_V")


@pytest.mark.parametrize(
    ("named", "sentence"),
    [
        (
            {"position": "deep_mm"},
            "there is no column 'deep_mm' for --position (did you mean 'depth_mm'?); "
            "no column name has a unit of force",
        ),
        (
            {"position": "deep_mm"},
            "The columns are depth_mm, y. If y is in N, add: --position depth_mm --force y",
        ),
        ({"direction": "stroke"}, "no column 'stroke' for --direction"),
        ({"inputs": ("load",)}, "no column 'load' for inputs"),
        ({"units": {"z": "N"}}, "no column 'z' for --units"),
        (
            {"units": {"force": "N"}},
            "--units force=N also needs --force NAME, which names its column",
        ),
        ({"units": {"y": "grains"}}, "--units y=grains: 'grains' is not a unit; use one of m, mm"),
        ({"units": {"y": "kPa"}, "force": "y"}, "column y is in kPa, which is not a unit of force"),
        (
            {"force": "y"},
            f"column y has no known unit {FORCE_SYMBOLS}. If y is in N, add: --units y=N",
        ),
        ({"force": "depth_mm"}, "column depth_mm is in mm, which is not a unit of force"),
        ({"force": "y", "units": {"y": "mm"}}, "column y is in mm, which is not a unit of force"),
    ],
)
def test_wrong_options_are_refused_with_the_option_and_value(named: dict[str, object], sentence: str) -> None:
    with pytest.raises(InputError, match=re.escape(sentence)):
        choose("depth_mm,y", **named)


@pytest.mark.parametrize(
    "header",
    [
        "Depth [mm],Load (N)",
        "Weg / mm,Kraft / N",
        "depth, mm;force, N",
        "depth_mm,force_N",
    ],
)
def test_units_are_read_in_brackets_after_a_slash_and_after_a_comma(header: str) -> None:
    names = header.split(";" if ";" in header else ",")
    choice = choose_columns("press.csv", names)
    assert (choice.position.name, choice.force.name) == tuple(names)


def test_a_stem_is_compared_without_case_and_spaces() -> None:
    assert choose("Tip position (um),Height (um),X (um),Force (nN)").position.name == "Tip position (um)"


def test_a_name_ending_in_in_with_a_counterpart_in_out_is_not_in_inches() -> None:
    assert choose("pos_in,pos_out,depth_mm,force_N").position.name == "depth_mm"
    assert choose("depth_in,force_N").position.unit == UNITS["in"]


def test_one_column_cannot_be_both_position_and_force() -> None:
    with pytest.raises(InputError, match="column p cannot be both the position and the force"):
        choose("p,q", position="p", force="p", unstated=("p",))


def test_a_time_without_a_unit_is_reported_and_added_by_the_cure() -> None:
    assert choose("Time,depth_mm,force_N").unread_time == (
        "column Time has no known unit and is not read as time, so damping and memory are not tested; if it "
        "is in s, add: --time Time --units Time=s"
    )
    assert choose("Time (ticks),depth_mm,force_N").unread_time.endswith(
        "replace UNIT and add: --time 'Time (ticks)' --units 'Time (ticks)=UNIT'"
    )
    unreadable = {"Time": Look(text=True, example="noon")}
    assert (
        "column Time holds 'noon' and is not read"
        in choose("Time,depth_mm,force_N", looks=unreadable).unread_time
    )
    with pytest.raises(InputError, match=r"--force y --units y=N --time Time --units Time=s$"):
        choose("Time,depth_mm,y")


def test_the_column_suggested_as_force_is_not_also_suggested_as_time() -> None:
    with pytest.raises(InputError, match=r"--force b --units b=N$"):
        choose("a,b,c", looks={"b": Look(least=0.0, largest=1.0, rises=True)})


@pytest.mark.parametrize(
    ("since_1970", "unit"), [(1.67e9, "s"), (1.67e12, "ms"), (1.67e15, "us"), (1673419984615459296, "ns")]
)
def test_times_since_1970_have_the_unit_in_which_they_lie_between_2000_and_2100(
    since_1970: float, unit: str
) -> None:
    look = Look(least=since_1970, largest=since_1970 * 1.001)
    time = choose("rosbagTimestamp,z_m,fz_N", looks={"rosbagTimestamp": look}).time
    assert time is not None
    assert time.unit == UNITS[unit]


@pytest.mark.parametrize("name", ["direction", "segment"])
def test_the_direction_is_found_by_its_name(name: str) -> None:
    assert choose(f"depth_mm,force_N,{name}").direction == name
    assert choose("depth_mm,force_N,stroke").direction is None


def test_a_stated_unit_that_contradicts_the_name_is_noted() -> None:
    names = ["displacement_mm", "force_gf"]
    contradicted = choose_columns("a.csv", names, units={"force_gf": "N"})
    assert contradicted.notes == ("force_gf is read in N, although its name states gf",)
    assert choose_columns("a.csv", names, units={"force_gf": "gf"}).notes == ()
    assert choose_columns("a.csv", names).notes == ()

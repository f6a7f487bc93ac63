# SPDX-License-Identifier: Apache-2.0
"""Reading recordings: what is accepted, what is refused and in which words, and every measured file."""

import importlib
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from conftest import measured_data
from palpate import InputError, read_recording

Write = Callable[..., Path]

HEADER = "depth_mm,force_gf,direction"


def rows(n: int = 12) -> list[str]:
    return [f"{0.5 * k},{10 * k},press" for k in range(n)]


def timed(n: int = 12) -> list[str]:
    return [f"{10 * k},{0.5 * k},{2 * k}" for k in range(n)]


def refusal(path: Path, **options: object) -> str:
    """The one sentence with which a file is refused, without its folder."""
    with pytest.raises(InputError) as refused:
        read_recording(path, **options)  # type: ignore[arg-type]
    sentence = str(refused.value)
    assert "\n" not in sentence
    return sentence.replace(f"{path.parent}/", "")


def test_values_are_converted_to_si(csv_file: Write) -> None:
    recording = read_recording(csv_file("time_ms,angle_deg,torque_mNm", timed()))
    k = np.arange(12)
    assert recording.time is not None
    np.testing.assert_allclose(recording.time, 0.01 * k, rtol=1e-15)
    np.testing.assert_allclose(recording.position, np.radians(0.5 * k), rtol=1e-15)
    np.testing.assert_allclose(recording.force, 2e-3 * k, rtol=1e-15)
    assert recording.units == {"position": "rad", "force": "N*m"}
    assert recording.source.columns == {"position": "angle_deg", "force": "torque_mNm", "time": "time_ms"}


def test_what_was_chosen_is_the_first_note(csv_file: Write) -> None:
    recording = read_recording(csv_file(HEADER, rows()))
    assert recording.notes == (
        "position is depth_mm, force is force_gf, there is no time, direction is direction",
    )


def test_other_columns_are_kept_as_they_stand(csv_file: Write) -> None:
    path = csv_file(
        "depth_mm,force_gf,probe,grade,half_mm", [f"{k},{k},p{k % 2},{k % 3},{k}" for k in range(12)]
    )
    columns = read_recording(path, position="depth_mm").columns
    assert columns["probe"].tolist() == [f"p{k % 2}" for k in range(12)]
    assert columns["grade"].tolist() == [k % 3 for k in range(12)]
    assert columns["half_mm"].tolist() == list(range(12))
    assert columns.keys() == {"probe", "grade", "half_mm"}


def test_metadata_comes_before_the_header(csv_file: Write) -> None:
    path = csv_file("# device: bench 3\n#\n# remark\n\n" + HEADER, rows())
    assert read_recording(path).metadata == {"device": "bench 3", "": "", "remark": ""}


@pytest.mark.parametrize("ending", ["\n", "\r\n"])
@pytest.mark.parametrize("mark", ["", "\ufeff"], ids=["plain", "byte-order-mark"])
def test_line_ends_and_byte_order_marks_do_not_matter(tmp_path: Path, ending: str, mark: str) -> None:
    path = tmp_path / "a.csv"
    path.write_bytes((mark + ending.join([HEADER, *rows()])).encode())
    recording = read_recording(path)
    assert len(recording) == 12
    assert recording.source.columns["position"] == "depth_mm"


def test_blank_lines_do_not_matter_and_do_not_shift_line_numbers(csv_file: Write) -> None:
    lines = ["", *rows(6), "", "   ", *rows(6), ""]
    assert len(read_recording(csv_file(HEADER, lines))) == 12
    lines[10] = "nan,1,press"
    assert "press.csv, line 12: column depth_mm holds 'nan'" in refusal(csv_file(HEADER, lines))


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (["press", "+1", " Press "], None),
        (["press", "approach", "load", "loading", "forward", "+1", "1", "1.0", " press "], 1),
        (["release", "retract", "unload", "unloading", "back", "-1", "-1.0"], -1),
        (["pause", "hold", "extra", "0", "0.0"], 0),
    ],
    ids=["case", "into", "out", "neither"],
)
def test_direction_words(csv_file: Write, words: list[str], expected: int | None) -> None:
    path = csv_file(HEADER, [f"{k},{k},{words[k % len(words)]}" for k in range(18)])
    if expected is None:
        assert (
            "line 4: column direction holds ' Press ', which is no direction; known words are press"
            in refusal(path)
        )
        return
    direction = read_recording(path).direction
    assert direction is not None
    assert direction.dtype == np.int8
    assert set(direction.tolist()) == {expected}


@pytest.mark.parametrize("invalid", ["refuse", "drop"])
@pytest.mark.parametrize("word", ["upward", "2", "0.5"])
def test_an_unknown_direction_is_refused_in_any_case(csv_file: Write, invalid: str, word: str) -> None:
    path = csv_file(HEADER, [*rows(10), f"5,100,{word}", *rows(3)])
    assert refusal(path, invalid=invalid).startswith(f"press.csv, line 12: column direction holds '{word}'")


def test_a_segment_column_of_words_is_the_direction(csv_file: Write) -> None:
    path = csv_file(
        "depth_mm,force_N,segment", [f"{k},{k},{'approach' if k < 7 else 'retract'}" for k in range(12)]
    )
    recording = read_recording(path)
    assert recording.direction is not None
    assert recording.direction.tolist() == [1] * 7 + [-1] * 5
    assert recording.source.columns["direction"] == "segment"


def test_a_segment_column_of_numbers_is_not_the_direction(csv_file: Write) -> None:
    recording = read_recording(csv_file("depth_mm,force_N,segment", [f"{k},{k},{k // 6}" for k in range(12)]))
    assert recording.direction is None
    assert recording.columns["segment"].tolist() == [0.0] * 6 + [1.0] * 6


def test_current_stays_a_current_until_a_torque_constant_is_given(csv_file: Write) -> None:
    path = csv_file("angle_rad,hold_current_mA", [f"{k},{k}" for k in range(12)])
    recording = read_recording(path)
    assert recording.units["force"] == "A"
    assert "it stays in A" in recording.notes[0]
    torque = read_recording(path, torque_constant=0.0075)
    assert torque.units["force"] == "N*m"
    np.testing.assert_allclose(torque.force, recording.force * 0.0075, rtol=1e-15)
    for wrong in (0.0, -0.1, float("nan"), float("inf")):
        assert f"--torque-constant-Nm-per-A is {wrong}" in refusal(path, torque_constant=wrong)
    other = csv_file("angle_rad,torque_Nm", [f"{k},{k}" for k in range(12)])
    assert "--torque-constant-Nm-per-A turns a current into a torque" in refusal(
        other, torque_constant=0.0075
    )


def test_further_inputs_are_converted_and_renamed(csv_file: Write) -> None:
    path = csv_file("depth_mm,force_N,load_gf,grade", [f"{k},{k},{k},{k % 2}" for k in range(12)])
    recording = read_recording(path, force="force_N", inputs=("load_gf", "grade"))
    assert recording.input_names == ("load_N", "grade")
    np.testing.assert_allclose(recording.inputs[:, 0], 9.80665e-3 * np.arange(12), rtol=1e-15)
    assert recording.columns == {}


def test_signs_are_turned_on_request_only(csv_file: Write) -> None:
    path = csv_file("depth_mm,force_N", [f"{-k},{k}" for k in range(12)])
    recording = read_recording(path)
    assert recording.position[11] == pytest.approx(-0.011)
    assert [note for note in recording.notes if "--negate" in note] == [
        "the force falls with position over the whole file (correlation -1.00): "
        "if the position grows out of the object give --negate position, "
        "if the force is positive when pulling give --negate force"
    ]
    for name in ("position", "depth_mm"):
        turned = read_recording(path, negate=(name,))
        assert turned.position[11] == pytest.approx(0.011)
        assert turned.force[11] == 11
        assert not [note for note in turned.notes if "--negate" in note]
    assert read_recording(path, negate=("force",)).force[11] == -11
    assert "--negate z names no column that is used (depth_mm, force_N)" in refusal(path, negate=("z",))


def test_a_direction_against_the_motion_is_noticed(csv_file: Write) -> None:
    path = csv_file(HEADER, [f"{-k},{k % 3},press" for k in range(12)])
    assert "the position falls where the direction goes into the object" in read_recording(path).notes[-1]


def test_rows_selects_a_half_open_range(csv_file: Write) -> None:
    path = csv_file("depth_mm,force_N", [f"{k},{k}" for k in range(40)])
    for given, kept in (
        ((5, 30), (5, 30)),
        ((None, 20), (0, 20)),
        ((20, None), (20, 40)),
        ((0, 40), (0, 40)),
    ):
        recording = read_recording(path, rows=given)
        np.testing.assert_allclose(recording.force, np.arange(*kept))
    assert "rows 5 to 29 of 0 to 39 are used" in read_recording(path, rows=(5, 30)).notes
    assert refusal(path, rows=(30, 41)) == "press.csv: rows 30 to 41 were asked for, but it has 40 rows"
    assert "rows 9 to 9 were asked for" in refusal(path, rows=(9, 9))


def test_rows_outside_the_selection_are_not_checked(csv_file: Write) -> None:
    path = csv_file("depth_mm,force_N", ["x,y", *[f"{k},{k}" for k in range(20)], "nan,1"])
    assert len(read_recording(path, rows=(1, 21))) == 20
    assert "line 23" in refusal(path, rows=(2, 22))


# What a bad row holds: (header, bad row, what it is called).
BAD_ROWS = {
    "not a number": (HEADER, "nan,1,press", "column depth_mm holds 'nan', which is no finite number"),
    "infinity": (HEADER, "1,-inf,press", "column force_gf holds '-inf', which is no finite number"),
    "overflow": (HEADER, "1,1e999,press", "column force_gf holds '1e999', which is no finite number"),
    "empty": (HEADER, ",1,press", "column depth_mm holds nothing, which is no finite number"),
    "text": (HEADER, "1,12 gf,press", "column force_gf holds '12 gf', which is no finite number"),
    "underscore": (HEADER, "1,1_2,press", "column force_gf holds '1_2', which is no finite number"),
    "short": (HEADER, "1", "column force_gf holds nothing, which is no finite number"),
    "no direction": (HEADER, "1,1,", "column direction says no direction"),
    "repeated time": ("time_ms,depth_mm,force_N", "50,1,1", "column time_ms holds '50', no later than"),
    "backward time": ("time_ms,depth_mm,force_N", "49,1,1", "column time_ms holds '49', no later than"),
    "no time": ("time_ms,depth_mm,force_N", ",1,1", "column time_ms holds nothing, which is no finite"),
}


def with_bad_row(write: Write, case: str, count: int = 1) -> Path:
    header, bad, _ = BAD_ROWS[case]
    good = rows(20) if header == HEADER else timed(20)
    return write(header, good[:6] + [bad] * count + good[6:])


@pytest.mark.parametrize("case", BAD_ROWS)
def test_a_bad_row_is_refused_with_file_line_column_and_value(csv_file: Write, case: str) -> None:
    sentence = refusal(with_bad_row(csv_file, case))
    assert sentence.startswith(f"press.csv, line 8: {BAD_ROWS[case][2]}")
    assert sentence.endswith("correct the file or drop such rows with --invalid drop")
    assert "(and 2 more such rows)" in refusal(with_bad_row(csv_file, case, count=3))


@pytest.mark.parametrize("case", BAD_ROWS)
def test_bad_rows_are_dropped_and_counted_on_request(csv_file: Write, case: str) -> None:
    recording = read_recording(with_bad_row(csv_file, case, count=3), invalid="drop")
    assert len(recording) == 20
    np.testing.assert_allclose(np.diff(recording.position), 0.5e-3, rtol=1e-9)
    assert re.fullmatch(r"dropped 3 rows .* \(first: line 8\)", recording.notes[1])


def test_a_row_that_is_bad_twice_is_counted_once(csv_file: Write) -> None:
    recording = read_recording(csv_file(HEADER, [*rows(12), "nan,inf,"]), invalid="drop")
    assert recording.notes[1:] == ("dropped 1 row without a finite number in depth_mm (first: line 14)",)


def test_time_must_pass_the_latest_time_before_it(csv_file: Write) -> None:
    lines = [*timed(12), "50,90,1", "60,91,1", "nan,92,1", "120,93,1"]
    recording = read_recording(csv_file("time_ms,depth_mm,force_N", lines), invalid="drop")
    np.testing.assert_allclose(recording.position[11:], [5.5e-3, 93e-3])
    assert recording.notes[2] == "dropped 2 rows whose time repeats or runs backward (first: line 14)"


def test_ten_rows_are_enough(csv_file: Write) -> None:
    assert len(read_recording(csv_file(HEADER, rows(10)))) == 10


def test_text_far_below_the_start_is_found(csv_file: Write) -> None:
    lines = [f"{k},{k},{k}" for k in range(1500)]
    lines[1400] = "1,oops,1"
    assert "line 1402: column force_N holds 'oops'" in refusal(csv_file("depth_mm,force_N,grade", lines))
    assert len(read_recording(csv_file("depth_mm,force_N,grade", lines), invalid="drop")) == 1499
    lines[1400] = "1,1,oops"
    grade = read_recording(csv_file("depth_mm,force_N,grade", lines)).columns["grade"]
    assert grade[1399] == "1399"
    assert grade[1400] == "oops"


def test_numbers_are_read_to_the_last_bit(csv_file: Write) -> None:
    random = np.random.default_rng(3)
    exact = random.normal(size=2000) * 10.0 ** random.integers(-100, 100, 2000)
    recording = read_recording(csv_file("depth_m,force_N", [f"{x!r},{x!r}" for x in exact.tolist()]))
    np.testing.assert_array_equal(recording.force, exact)


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("", "press.csv is empty"),
        ("# only: metadata\n", "press.csv holds no header: the first line must name the columns"),
        (HEADER + "\n", "press.csv has 0 usable rows; a recording needs at least 10"),
        ("\n".join([HEADER, *rows(3)]), "press.csv has 3 usable rows; a recording needs at least 10"),
        ("\n".join([HEADER, *rows(9)]), "press.csv has 9 usable rows; a recording needs at least 10"),
        (
            "\n".join([HEADER, *["1,1,press"] * 12]),
            "press.csv: column depth_mm holds 1 distinct value; force over position needs at least 3",
        ),
        (
            "\n".join([HEADER, *["1,1,press", "2,1,press"] * 6]),
            "press.csv: column depth_mm holds 2 distinct values; force over position needs at least 3",
        ),
        (
            "depth_mm\n1\n2\n",
            "press.csv, line 1: there is one column (depth_mm); a recording needs a position and a force, "
            "separated by commas",
        ),
        (
            "depth_mm;force_N\n1;2\n",
            "press.csv, line 1: there is one column (depth_mm;force_N); a recording needs a position and a "
            "force, separated by commas",
        ),
        ("1,2\n3,4\n", "press.csv, line 1: a header with column names must come first, found 1, 2"),
        ("depth_mm,,force_N\n", "press.csv, line 1: column 2 has no name"),
        ("depth_mm,force_N,depth_mm\n", "press.csv, line 1: column name depth_mm stands 2 times"),
        (
            "\n".join([HEADER, *rows(5), "1,2,press,4", *rows(5)]),
            "press.csv, line 7: 4 cells, but the header names 3 columns",
        ),
        (
            "\n".join([HEADER, *rows(1500), "1,2,press,4", *rows(5)]),
            "press.csv, line 1502: 4 cells, but the header names 3 columns",
        ),
    ],
    ids=[
        "empty",
        "metadata only",
        "header only",
        "3 rows",
        "9 rows",
        "positions equal",
        "2 positions",
        "one column",
        "semicolons",
        "no header",
        "nameless column",
        "name twice",
        "too many cells",
        "too many cells far below",
    ],
)
def test_what_is_no_recording_is_refused_in_one_sentence(csv_file: Write, text: str, sentence: str) -> None:
    assert refusal(csv_file(text)) == sentence


def test_a_file_that_is_not_there_is_refused(tmp_path: Path) -> None:
    assert refusal(tmp_path / "none.csv") == "there is no file none.csv"
    (tmp_path / "folder.csv").mkdir()
    assert refusal(tmp_path / "folder.csv") == "folder.csv is a folder, not a file"


def test_a_file_that_is_not_text_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "press.csv"
    path.write_bytes(b"depth_mm,force_N,word\n" + b"1,2,\xff\xfe\n" * 12)
    assert refusal(path) == "press.csv is not text in UTF-8; a recording is CSV or Parquet"


def test_an_unknown_treatment_of_bad_rows_is_refused(csv_file: Write) -> None:
    assert "invalid is 'ignore'" in refusal(csv_file(HEADER, rows()), invalid="ignore")


@pytest.mark.parametrize("torn", ["6,12", "6,120,pre", "6,120,press", "6,1e", "6", ","])
def test_a_torn_last_line_of_a_growing_file_is_left_out(csv_file: Write, torn: str) -> None:
    text = "\n".join([HEADER, *rows(12), torn])
    recording = read_recording(csv_file(text, name="press.csv.part"))
    assert len(recording) == 12
    assert "1 torn line at the end is left out" in recording.notes


def test_a_growing_file_that_ends_with_its_line_is_whole(csv_file: Write) -> None:
    recording = read_recording(csv_file(HEADER, rows(12), name="press.csv.part"))
    assert len(recording) == 12
    assert not any("torn" in note for note in recording.notes)


def test_a_growing_file_of_one_torn_line_is_refused(csv_file: Write) -> None:
    assert "holds no header" in refusal(csv_file("depth_mm,for", name="press.csv.part"))


def test_a_finished_file_keeps_its_last_line_without_a_line_feed(csv_file: Write) -> None:
    assert len(read_recording(csv_file("\n".join([HEADER, *rows(12)])))) == 12


def parquet(path: Path, **columns: object) -> Path:
    pytest.importorskip("pyarrow")
    pd.DataFrame(columns).to_parquet(path)
    return path


def test_parquet_is_read_like_csv(tmp_path: Path, csv_file: Write) -> None:
    k = np.arange(12)
    path = parquet(
        tmp_path / "a.parquet",
        depth_mm=k / 3,
        force_N=k.astype(np.float32),
        direction=["press"] * 12,
        note=["n"] * 12,
    )
    recording = read_recording(path)
    text = csv_file(
        "depth_mm,force_N,direction,note", [f"{x!r},{n},press,n" for n, x in enumerate((k / 3).tolist())]
    )
    same = read_recording(text)
    np.testing.assert_array_equal(recording.position, same.position)
    np.testing.assert_array_equal(recording.force, same.force)
    assert recording.notes == same.notes
    assert recording.columns["note"].tolist() == same.columns["note"].tolist()
    assert recording.metadata == {}


def test_parquet_rows_are_named_by_number(tmp_path: Path) -> None:
    k = np.arange(12.0)
    bad = parquet(tmp_path / "a.parquet", depth_mm=k, force_N=np.where(k == 4, np.nan, k))
    assert refusal(bad).startswith("a.parquet, row 4: column force_N holds nothing")
    text = parquet(tmp_path / "b.parquet", depth_mm=k, force_N=["1", "x"] * 6)
    assert refusal(text).startswith("b.parquet, row 1: column force_N holds 'x'")


def test_what_is_not_parquet_is_refused(tmp_path: Path) -> None:
    pytest.importorskip("pyarrow")
    path = tmp_path / "a.parquet"
    path.write_text("depth_mm,force_N\n", encoding="utf-8")
    assert refusal(path).startswith("a.parquet is not readable as Parquet: ")
    assert refusal(parquet(tmp_path / "b.parquet", depth_mm=[1.0])).startswith(
        "b.parquet: there is one column"
    )


def test_parquet_without_pyarrow_says_what_to_install(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "a.parquet"
    path.write_bytes(b"PAR1")

    def missing(name: str) -> object:
        raise ImportError(name)

    reader = importlib.import_module("palpate.recording.parquet_file")
    monkeypatch.setattr(reader, "import_module", missing)
    assert refusal(path) == "a.parquet is Parquet, which needs pyarrow: install it with pip install pyarrow"


# --- every measured file ------------------------------------------------------------------------------------

RESOLVES = {
    "afm_indentation",
    "keyswitches",
    "magnet_attraction",
    "motor_cogging",
    "organ_probing",
    "rubber_domes",
    "switch_springs",
    "vhb4910_viscoelastic",
}

VOLTS = {"position": "speed_out", "force": "input_V", "units": {"speed_out": "rad", "input_V": "Nm"}}

# File or set -> options that the refusals ask for, one after the other.
HINTS: dict[str, dict[str, object]] = {
    "davinci_grip": {"position": "back_angle_rad", "force": "back_torque_Nm"},
    "palpation_continuous": {"position": "pos_z_mm", "force": "force_z_N"},
    "silverbox": {
        "position": "output_V2_V",
        "force": "input_V1_V",
        "units": {"input_V1_V": "N", "output_V2_V": "m"},
    },
    "sysid_benchmarks/ball_and_beam.csv": {
        "position": "beam_angle",
        "force": "ball_position",
        "units": {"position": "rad", "force": "N"},
    },
    "sysid_benchmarks/cascaded_tanks.csv": {
        "position": "pump_voltage_V",
        "force": "level_sensor_V",
        "units": {"pump_voltage_V": "m", "level_sensor_V": "N"},
        "rows": (0, 1024),
    },
    "sysid_benchmarks/coupled_drives_prbs_amp0p5.csv": VOLTS,
    "sysid_benchmarks/coupled_drives_prbs_amp1.csv": VOLTS,
    "sysid_benchmarks/emps_validation_pulses_250hz.csv": {"force": "motor_force_N"},
    "sysid_benchmarks/f16_sysidentpy_subset_16384.csv": {
        "position": "x1",
        "force": "y",
        "units": {"x1": "m", "y": "N"},
    },
    "sysid_benchmarks/flexible_robot_arm.csv": {
        "position": "acceleration",
        "force": "reaction_torque",
        "units": {"acceleration": "rad", "reaction_torque": "Nm"},
    },
    "teacher_functions/zhang_benveniste_1d_test1001.csv": {
        "position": "x",
        "force": "y",
        "units": {"x": "rad", "y": "Nm"},
    },
    "teacher_functions/zhang_benveniste_1d_train200.csv": {
        "position": "x",
        "force": "y",
        "units": {"x": "rad", "y": "Nm"},
    },
    "teacher_functions": {
        "position": "x1",
        "force": "y",
        "inputs": ("x2",),
        "units": {"x1": "rad", "y": "Nm"},
    },
}

# A table of published figures beside the recordings: text, and no recording.
NO_RECORDING = "sysid_benchmarks/published_results.csv"


def measured_files() -> list[str]:
    """Every CSV file of the measured data; without it one name, for which the tests skip."""
    folder = measured_data()
    if folder is None:
        return ["keyswitches", "teacher_functions"]
    return sorted(str(path.relative_to(folder)) for path in folder.rglob("*.csv"))


def resolves(file: str) -> bool:
    return file.split("/")[0] in RESOLVES or file == "sysid_benchmarks/emps_estimation_250hz.csv"


def hint_for(file: str) -> dict[str, object]:
    return HINTS.get(file) or HINTS[file.split("/")[0]]


@pytest.mark.parametrize("file", [file for file in measured_files() if resolves(file)])
def test_a_measured_file_resolves_without_a_hint(data: Path, file: str) -> None:
    recording = read_recording(data / file)
    header, *lines = (data / file).read_text(encoding="utf-8").splitlines()
    assert len(recording) == len(lines)
    assert recording.units["position"] in ("rad", "m")
    assert recording.units["force"] == ("A" if file.startswith("motor_cogging") else "N")
    assert (recording.direction is not None) == file.startswith(
        ("keyswitches", "rubber_domes", "switch_springs", "afm_indentation")
    )
    assert (recording.time is not None) == ("time_" in header)


@pytest.mark.parametrize("file", [f for f in measured_files() if not resolves(f) and f != NO_RECORDING])
def test_an_ambiguous_measured_file_names_each_option_and_works_with_them(data: Path, file: str) -> None:
    hint = hint_for(file)
    given: dict[str, object] = {}
    for role in ("position", "force"):
        if role in hint:
            assert f"--{role} NAME" in refusal(data / file, **given)
            given[role] = hint[role]
            if "units" in hint:
                assert f"--units {hint[role]}=UNIT" in refusal(data / file, **given)
                units: dict[str, str] = dict(hint["units"])  # type: ignore[call-overload]
                symbol = units.get(str(hint[role])) or units[role]
                given["units"] = {**given.get("units", {}), str(hint[role]): symbol}  # type: ignore[dict-item]
    recording = read_recording(data / file, **hint)  # type: ignore[arg-type]
    assert len(recording) >= 200


def test_a_table_of_text_is_not_taken_for_a_recording(data: Path) -> None:
    assert "--position NAME" in refusal(data / NO_RECORDING)


def test_time_that_starts_again_is_refused_with_its_line(data: Path) -> None:
    hint = {
        name: value
        for name, value in hint_for("sysid_benchmarks/cascaded_tanks.csv").items()
        if name != "rows"
    }
    sentence = refusal(data / "sysid_benchmarks/cascaded_tanks.csv", **hint)
    assert sentence.startswith("cascaded_tanks.csv, line 1026: column time_s holds '0', no later than")


def test_the_force_of_rows_that_touch_nothing_is_taken_off(csv_file: Callable[..., Path]) -> None:
    rows = [f"{0.1 * k:.1f},{0.25 + max(0.0, 0.1 * k - 1.0):.6f}" for k in range(30)]
    path = csv_file("depth_mm,force_N", rows)
    recording = read_recording(path, zero=(0, 10), rows=(2, None))
    assert recording.force[:8] == pytest.approx(np.zeros(8))
    assert recording.force[-1] == pytest.approx(1.9)
    assert "0.25 N, the mean force of rows 0 to 9, is taken off" in recording.notes
    with pytest.raises(InputError, match="--zero 0:2 holds none of the rows that are used"):
        read_recording(path, zero=(0, 2), rows=(2, None))

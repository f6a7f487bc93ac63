# SPDX-License-Identifier: Apache-2.0
"""Reading of recordings: accepted files, conversion to SI, choice of columns, and kept metadata."""

from pathlib import Path

import numpy as np
import pytest

from palpate import InputError, read_recording
from palpate.recording import Source
from palpate.recording.checks import quality_findings
from small_files import HEADER, Write, refusal, rows, timed_rows


def test_values_are_converted_to_si(csv_file: Write) -> None:
    recording = read_recording(csv_file("time_ms,angle_deg,torque_mNm", timed_rows()))
    k = np.arange(12)
    assert recording.time is not None
    np.testing.assert_allclose(recording.time, 0.01 * k, rtol=1e-15)
    np.testing.assert_allclose(recording.position, np.radians(0.5 * k), rtol=1e-15)
    np.testing.assert_allclose(recording.force, 2e-3 * k, rtol=1e-15)
    assert recording.units == {"position": "rad", "force": "N*m"}
    assert recording.source.columns == {"position": "angle_deg", "force": "torque_mNm", "time": "time_ms"}


def test_the_first_note_names_the_chosen_columns(csv_file: Write) -> None:
    recording = read_recording(csv_file(HEADER, rows()))
    assert recording.notes == (
        "position is depth_mm, force is force_gf, there is no time, direction is direction",
    )


def test_the_source_counts_the_rows_of_the_file(csv_file: Write) -> None:
    file = csv_file(HEADER, [*rows(20), "x,1,press"])
    recording = read_recording(file, invalid="drop", rows=(5, None))
    assert (recording.source.rows, recording.source.file_rows) == (15, 21)
    both = Source.merged([recording.source, recording.source])
    assert (both.rows, both.file_rows) == (30, 42)


def test_other_columns_are_kept_unconverted(csv_file: Write) -> None:
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


@pytest.mark.parametrize("line_end", ["\n", "\r\n"])
@pytest.mark.parametrize("mark", ["", "\ufeff"], ids=["plain", "byte-order-mark"])
def test_line_ends_and_byte_order_marks_do_not_change_the_data(
    tmp_path: Path, line_end: str, mark: str
) -> None:
    path = tmp_path / "a.csv"
    path.write_bytes((mark + line_end.join([HEADER, *rows()])).encode())
    recording = read_recording(path)
    assert len(recording) == 12
    assert recording.source.columns["position"] == "depth_mm"


def test_blank_lines_are_ignored_and_counted_in_line_numbers(csv_file: Write) -> None:
    lines = ["", *rows(6), "", "   ", *rows(6), ""]
    assert len(read_recording(csv_file(HEADER, lines))) == 12
    lines[10] = "nan,1,press"
    assert "press.csv, line 12: column depth_mm holds 'nan'" in refusal(csv_file(HEADER, lines))


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (["press", "approach", "load", "loading", "forward", "+1", "1", "1.0", " Press "], 1),
        (["release", "retract", "unload", "unloading", "back", "-1", "-1.0"], -1),
        (["pause", "hold", "extra", "0", "0.0"], 0),
    ],
    ids=["into", "out", "neither"],
)
def test_each_direction_word_gives_its_direction(csv_file: Write, words: list[str], expected: int) -> None:
    path = csv_file(HEADER, [f"{k},{k},{words[k % len(words)]}" for k in range(18)])
    direction = read_recording(path).direction
    assert direction is not None
    assert direction.dtype == np.int8
    assert set(direction.tolist()) == {expected}


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("Direction", ("Down", "Up")),
        ("Stroke", ("press", "release")),
        ("Richtung", ("Druck", "Entlastung")),
        ("Sens", ("montée", "descente")),
        ("DIRECTION", ("1", "-1")),
        ("Weg", ("auf", "ab")),
    ],
)
def test_a_column_of_words_of_direction_is_found_by_its_words(
    csv_file: Write, name: str, words: tuple[str, str]
) -> None:
    """In the words for a way of the tool, the position decides which of them is into the object."""
    rows = [f"{k},{k},{words[0]}" for k in range(12)] + [f"{12 - k},{k},{words[1]}" for k in range(12)]
    recording = read_recording(csv_file(f"depth_mm,force_N,{name}", rows))
    assert recording.direction is not None
    assert recording.direction.tolist() == [1] * 12 + [-1] * 12
    assert recording.source.columns["direction"] == name


def test_rows_without_the_order_of_a_motion_keep_their_stated_direction(csv_file: Write) -> None:
    place = np.random.default_rng(0).permutation(60)
    rows = [f"{k // 2},{k // 2 - k % 2},{('down', 'up')[k % 2]}" for k in place]
    recording = read_recording(csv_file("depth_mm,force_N,Direction", rows))
    assert recording.direction is not None
    assert recording.direction.tolist() == (1 - 2 * (place % 2)).tolist()
    assert not quality_findings(recording)


def test_an_unread_column_of_directions_is_named(csv_file: Write) -> None:
    rows = [f"{k},{k},{('vor', 'zurueck')[k > 5]}" for k in range(12)]
    recording = read_recording(csv_file("depth_mm,force_N,Richtung", rows))
    assert recording.direction is None
    assert any("Richtung holds 'vor' and is not read" in note for note in recording.notes)


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


def test_a_current_is_converted_only_with_a_torque_constant(csv_file: Write) -> None:
    path = csv_file("angle_rad,hold_current_mA", [f"{k},{k}" for k in range(12)])
    recording = read_recording(path)
    assert recording.units["force"] == "A"
    assert "it stays in A" in recording.notes[0]
    torque = read_recording(path, torque_constant=0.0075)
    assert torque.source.columns["force"].endswith(" times 0.0075 N*m/A"), "the origin is in the model file"
    assert torque.units["force"] == "N*m"
    np.testing.assert_allclose(torque.force, recording.force * 0.0075, rtol=1e-15)


def test_further_inputs_are_converted_and_renamed(csv_file: Write) -> None:
    path = csv_file("depth_mm,force_N,load_gf,grade", [f"{k},{k},{k},{k % 2}" for k in range(12)])
    recording = read_recording(path, force="force_N", inputs=("load_gf", "grade"))
    assert recording.input_names == ("load_N", "grade")
    np.testing.assert_allclose(recording.inputs[:, 0], 9.80665e-3 * np.arange(12), rtol=1e-15)
    assert recording.columns == {}


def test_signs_are_reversed_only_with_negate(csv_file: Write) -> None:
    path = csv_file("depth_mm,force_N", [f"{-k},{k}" for k in range(12)])
    recording = read_recording(path)
    assert recording.position[11] == pytest.approx(-0.011)
    assert [each.sentence for each in quality_findings(recording)] == [
        "the force falls with position over the whole file (correlation -1.00): "
        "if the position grows out of the object give --negate position, "
        "if the force is positive when pulling give --negate force, "
        "if the object attracts the tool identify it with --below linear"
    ]
    for name in ("position", "depth_mm"):
        negated = read_recording(path, negate=(name,))
        assert negated.position[11] == pytest.approx(0.011)
        assert negated.force[11] == 11
        assert not quality_findings(negated)
    assert read_recording(path, negate=("force",)).force[11] == -11


def test_a_direction_opposite_to_the_motion_is_reported(csv_file: Write) -> None:
    path = csv_file(HEADER, [f"{-k},{k % 3},press" for k in range(12)])
    (finding,) = quality_findings(read_recording(path))
    assert finding.sentence.startswith("the position falls in rows whose direction is into the object (100%")


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


def test_rows_outside_the_selection_are_not_checked(csv_file: Write) -> None:
    path = csv_file("depth_mm,force_N", ["x,y", *[f"{k},{k}" for k in range(20)], "nan,1"])
    assert len(read_recording(path, rows=(1, 21))) == 20
    assert "line 23" in refusal(path, rows=(2, 22))


def test_rows_that_are_left_out_are_neither_used_nor_checked(csv_file: Write) -> None:
    lines = [f"{0.1 * k:.1f},{k},{k}" for k in range(40)]
    lines[6] = "0.6,x,y"
    path = csv_file("time_s,depth_mm,force_N", lines)
    recording = read_recording(path, leave_out=[(5, 10), (38, None)])
    np.testing.assert_allclose(recording.force, [*range(5), *range(10, 38)])
    assert {"rows 5 to 9 are left out", "rows 38 to 39 are left out"} <= set(recording.notes)
    np.testing.assert_allclose(read_recording(path, rows=(2, None), leave_out=[(0, 7)]).force, range(7, 40))
    assert "line 8" in refusal(path, leave_out=[(10, 20)])
    with pytest.raises(InputError, match="rows 30:50 are outside the 40 rows of the file"):
        read_recording(path, leave_out=[(30, 50)])


def test_strokes_around_a_left_out_stretch_stay_those_of_the_motion(csv_file: Write) -> None:
    depth = [*range(30), *range(29, -1, -1)]
    path = csv_file("time_s,depth_mm,force_N", [f"{0.1 * k:.1f},{x},{x}" for k, x in enumerate(depth)])
    recording = read_recording(path, leave_out=[(20, 40)])
    assert len(recording.motion.position) == 60
    np.testing.assert_array_equal(recording.motion.rows, [*range(20), *range(40, 60)])


def test_a_recording_of_ten_rows_is_accepted(csv_file: Write) -> None:
    assert len(read_recording(csv_file(HEADER, rows(10)))) == 10


def test_text_below_the_examined_rows_is_found(csv_file: Write) -> None:
    lines = [f"{k},{k},{k}" for k in range(1500)]
    lines[1400] = "1,oops,1"
    assert "line 1402: column force_N holds 'oops'" in refusal(csv_file("depth_mm,force_N,grade", lines))
    assert len(read_recording(csv_file("depth_mm,force_N,grade", lines), invalid="drop")) == 1499
    lines[1400] = "1,1,oops"
    grade = read_recording(csv_file("depth_mm,force_N,grade", lines)).columns["grade"]
    assert grade[1399] == "1399"
    assert grade[1400] == "oops"


def test_numbers_are_read_exactly(csv_file: Write) -> None:
    random = np.random.default_rng(3)
    exact = random.normal(size=2000) * 10.0 ** random.integers(-100, 100, 2000)
    recording = read_recording(csv_file("depth_m,force_N", [f"{x!r},{x!r}" for x in exact.tolist()]))
    np.testing.assert_array_equal(recording.force, exact)


def test_the_mean_force_of_rows_without_contact_is_subtracted(csv_file: Write) -> None:
    path = csv_file(
        "depth_mm,force_N", [f"{0.1 * k:.1f},{0.25 + max(0.0, 0.1 * k - 1.0):.6f}" for k in range(30)]
    )
    recording = read_recording(path, zero=(0, 10), rows=(2, None))
    assert recording.force[:8] == pytest.approx(np.zeros(8))
    assert recording.force[-1] == pytest.approx(1.9)
    assert "0.25 N, the mean force of rows 0 to 9, is subtracted" in recording.notes
    with pytest.raises(InputError, match="--zero 0:2 contains no row that is used"):
        read_recording(path, zero=(0, 2), rows=(2, None))


def test_a_late_force_is_moved_to_its_position_while_reading(tmp_path: Path) -> None:
    file = tmp_path / "late.csv"
    rows = [f"{k / 100:g},{k / 10:g},{k}" for k in range(40)]
    file.write_text("\n".join(["time_s,position_m,force_N", *rows]) + "\n", encoding="utf-8")
    recording = read_recording(file, force_late_s=0.025)
    assert len(recording) == recording.source.rows == 37
    assert recording.position == pytest.approx(np.arange(3, 40) / 10 - 0.25)
    assert np.array_equal(recording.force, np.arange(3.0, 40.0))
    assert any("0.025 s before" in note for note in recording.notes)

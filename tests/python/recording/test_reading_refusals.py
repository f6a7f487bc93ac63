# SPDX-License-Identifier: Apache-2.0
"""Refusals while reading a recording, their sentences, and rows that are dropped on request."""

import os
import re
import socket
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from models_by_hand import model_by_hand
from palpate import read_recording
from small_files import HEADER, Write, options_in, refusal, rows, timed_rows


def lines(*parts: str | list[str]) -> str:
    """Returns the text of a file from lines and lists of lines."""
    return "\n".join(line for part in parts for line in (part if isinstance(part, list) else [part]))


PLAIN = [f"{k},{k}" for k in range(40)]

# Name of a case -> (text of the file, options of reading, sentence of the error).
REFUSED: dict[str, tuple[str, dict[str, Any], str]] = {
    "empty": ("", {}, "press.csv is empty"),
    "metadata only": (
        "# only: metadata\n",
        {},
        "press.csv has no header: the first line must name the columns",
    ),
    "header only": (HEADER, {}, "press.csv has 0 usable rows; a recording needs at least 10"),
    "3 rows": (lines(HEADER, rows(3)), {}, "press.csv has 3 usable rows; a recording needs at least 10"),
    "9 rows": (lines(HEADER, rows(9)), {}, "press.csv has 9 usable rows; a recording needs at least 10"),
    "positions equal": (
        lines(HEADER, ["1,1,press"] * 12),
        {},
        "press.csv: column depth_mm holds 1 distinct value; force over position needs at least 3; "
        "choose another column with --position NAME",
    ),
    "2 positions": (
        lines(HEADER, ["1,1,press", "2,1,press"] * 6),
        {},
        "press.csv: column depth_mm holds 2 distinct values; force over position needs at least 3; "
        "choose another column with --position NAME",
    ),
    "one column": (
        "depth_mm\n1\n2\n",
        {},
        "press.csv, line 1: there is one column (depth_mm); a recording needs a position and a force, "
        "separated by commas, semicolons, tabs or spaces",
    ),
    "direction is the position": (
        lines(HEADER, rows()),
        {"direction": "depth_mm"},
        "press.csv: column depth_mm is the direction and also a column of numbers; use another column for "
        "one of them",
    ),
    "status is the force": (
        lines('# palpate-columns: {"status": "force_gf"}', HEADER, rows()),
        {},
        "press.csv: column force_gf is the status and also a column of numbers; use another column for one "
        "of them",
    ),
    "no header": (
        "1,2\n3,4\n",
        {},
        "press.csv has no header. The columns are 1: 1 to 3, 2: 2 to 4. If column 1 "
        "is the position in mm and column 2 is the force in N, add: "
        "--columns position_mm,force_N",
    ),
    "nameless column": (
        "depth_mm,,force_N\n",
        {},
        "press.csv, line 1: column 2 has no name; name it in the file",
    ),
    "name twice": (
        "depth_mm,force_N,depth_mm\n",
        {},
        "press.csv, line 1: column name depth_mm occurs 2 times; rename these columns in the file",
    ),
    "too many cells": (
        lines(HEADER, rows(5), "1,2,press,4", rows(5)),
        {},
        "press.csv, line 7: 4 cells, but the header names 3 columns",
    ),
    "too many cells far below": (
        lines(HEADER, rows(1500), "1,2,press,4", rows(5)),
        {},
        "press.csv, line 1502: 4 cells, but the header names 3 columns",
    ),
    **{
        f"{word} as a direction, {invalid} invalid rows": (
            lines(HEADER, rows(10), f"5,100,{word}", rows(3)),
            {"invalid": invalid},
            f"press.csv, line 12: column direction holds '{word}', which is not a direction; use one of "
            "press, approach, load, loading, forward, +1, release, retract, unload, unloading, back, -1, "
            "pause, hold, extra, 0",
        )
        for word in ("upward", "2", "0.5")
        for invalid in ("refuse", "drop")
    },
    "rows beyond the end": (
        lines("depth_mm,force_N", PLAIN),
        {"rows": (30, 41)},
        "press.csv: rows 30:41 are outside the 40 rows of the file, or START is not below STOP",
    ),
    "no rows": (
        lines("depth_mm,force_N", PLAIN),
        {"rows": (9, 9)},
        "press.csv: rows 9:9 are outside the 40 rows of the file, or START is not below STOP",
    ),
    "a sign of an unknown column": (
        lines("depth_mm,force_N", PLAIN),
        {"negate": ("z",)},
        "press.csv: --negate is z, must be position, force or a used column (depth_mm, force_N)",
    ),
    "an unknown treatment": (
        lines("depth_mm,force_N", PLAIN),
        {"invalid": "ignore"},
        "invalid is 'ignore'; it must be 'refuse' or 'drop'",
    ),
    **{
        f"a torque constant of {wrong}": (
            lines("angle_rad,hold_current_mA", PLAIN),
            {"torque_constant": wrong},
            f"--torque-constant-Nm-per-A is {wrong}; it must be a number > 0",
        )
        for wrong in (0.0, -0.1, float("nan"), float("inf"))
    },
    "a torque constant for a torque": (
        lines("angle_rad,torque_Nm", PLAIN),
        {"torque_constant": 0.0075},
        "press.csv: --torque-constant-Nm-per-A converts a current to a torque, but the force is torque_Nm, "
        "which is not in A",
    ),
    "a missing status column": (
        lines('# palpate-columns: {"status": "status"}', "depth_mm,force_N", PLAIN),
        {},
        "press.csv has no column 'status', which its metadata names as the status",
    ),
}


@pytest.mark.parametrize("case", REFUSED)
def test_an_unreadable_file_is_refused_in_one_sentence(csv_file: Write, case: str) -> None:
    text, options, sentence = REFUSED[case]
    assert refusal(csv_file(text), **options) == sentence


def test_a_missing_file_and_a_folder_are_refused(tmp_path: Path) -> None:
    assert refusal(tmp_path / "none.csv") == "there is no file none.csv"
    (tmp_path / "folder.csv").mkdir()
    assert refusal(tmp_path / "folder.csv") == "folder.csv is a folder, not a file"


FORMATS = "a recording is CSV, Parquet, a workbook (.xlsx, .xls, .ods), NumPy (.npz), MATLAB (.mat) or MCAP"


def test_a_file_that_is_not_text_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "press.csv"
    path.write_bytes(b"PK\x03\x04" + bytes(range(256)) * 20)
    assert refusal(path) == f"press.csv is not text; {FORMATS}"


def test_json_is_refused_in_a_short_sentence(tmp_path: Path) -> None:
    model = tmp_path / "m.json"
    model_by_hand().save(model)
    assert refusal(model) == f"m.json looks like a palpate model; {FORMATS}"
    (tmp_path / "other.txt").write_text('{"a": [' + "1.5, " * 20_000 + "2]}", encoding="utf-8")
    assert refusal(tmp_path / "other.txt") == f"other.txt looks like JSON; {FORMATS}"


def test_a_message_is_short_for_a_long_header(csv_file: Write) -> None:
    header = ",".join(f"{'column' * 300}{k}" for k in range(200))
    assert len(refusal(csv_file(header, [",".join(["1.5"] * 200)] * 12))) < 2000


def test_control_characters_of_a_header_are_escaped(csv_file: Write) -> None:
    header = "depth\x1b[31m_mm,force\x07_N,evil\x1b]0;title\x07_mm"
    path = csv_file(header, [f"{k},{k},{k}" for k in range(12)])
    sentence = refusal(path)
    assert sentence.isprintable()
    assert r"depth\x1b[31m_mm" in sentence
    recording = read_recording(path, **options_in(sentence))  # type: ignore[arg-type]
    assert all(note.isprintable() for note in recording.notes)
    assert recording.source.columns == {"position": r"depth\x1b[31m_mm", "force": r"force\x07_N"}
    assert np.array_equal(recording.force, np.arange(12.0))


@pytest.mark.parametrize("kind", ["pipe", "socket", "device"])
def test_a_pipe_socket_or_device_is_refused_without_waiting(tmp_path: Path, kind: str) -> None:
    path = tmp_path / "press.csv"
    if kind == "pipe":
        os.mkfifo(path)
    elif kind == "device":
        path.symlink_to("/dev/zero")
    else:
        with socket.socket(socket.AF_UNIX) as server:
            os.chdir(tmp_path)
            server.bind("press.csv")
    assert refusal(path) == ("press.csv is a pipe, a device or a socket; save its contents to a file first")


THOUSANDS_SEPARATED = {
    "points and a decimal comma": (";", "1.234,5"),
    "commas and a decimal point": ("\t", "1,234.5"),
    "repeated commas": (";", "1,234,500"),
    "in quotes": (",", '"1,234.5"'),
    "an apostrophe": (";", "1'234.5"),
    "a space": (";", "1 234.5"),
}


@pytest.mark.parametrize("row", [0, 1500], ids=["at the start", "far below"])
@pytest.mark.parametrize("case", THOUSANDS_SEPARATED)
def test_thousands_separators_are_read(csv_file: Write, case: str, row: int) -> None:
    separator, cell = THOUSANDS_SEPARATED[case]
    decimal = "," if cell.endswith(",5") else "."
    lines = [f"{k}{decimal}5{separator}{k}{decimal}25" for k in range(1510)]
    lines[row] = f"2{decimal}5{separator}{cell}"
    path = csv_file(separator.join(["depth_mm", "force_N"]), lines)
    assert read_recording(path).force[row] == (1234500.0 if case == "repeated commas" else 1234.5)


def cures_of_marks(path: Path) -> list[str]:
    return re.findall(r"add: --decimal '?([.,])'?", refusal(path))


def test_ambiguous_commas_are_refused_with_both_cures(csv_file: Write) -> None:
    path = csv_file("depth_mm;force_N", [f"{k};{k},500" for k in range(1, 13)])
    assert cures_of_marks(path) == [",", "."]
    assert read_recording(path, decimal=",").force[1] == 2.5
    assert read_recording(path, decimal=".").force[1] == 2500.0


def test_a_comma_in_a_file_with_decimal_points_is_refused_unless_the_mark_is_stated(csv_file: Write) -> None:
    path = csv_file("depth_mm,force_N", [f'{k}.5,"{k},500"' for k in range(1, 13)])
    assert cures_of_marks(path) == ["."]
    assert read_recording(path, decimal=".").force[1] == 2500.0


def test_a_decimal_comma_below_the_examined_rows_is_refused_with_the_cure(csv_file: Write) -> None:
    lines = [f"{k};{k}" for k in range(1500)]
    path = csv_file("depth_mm;force_N", [*lines, "1500;7,25"])
    assert refusal(path).startswith(
        "press.csv: column force_N holds '7,25', and the decimal mark of the first"
    )
    assert cures_of_marks(path) == [","]
    assert read_recording(path, decimal=",").force[1500] == 7.25


def test_digits_that_are_grouped_by_the_decimal_mark_are_refused(csv_file: Write) -> None:
    path = csv_file("depth_mm;force_N", [*(f"{k},5;{k}" for k in range(1, 13)), "1,000,000;3"])
    assert refusal(path).endswith("export the file again without a mark between thousands")


# Cases of a row that cannot be used: (header of the file, the row, name of the case).
BAD_ROWS = {
    "not a number": (HEADER, "nan,1,press", "column depth_mm holds 'nan', which is not a finite number"),
    "infinity": (HEADER, "1,-inf,press", "column force_gf holds '-inf', which is not a finite number"),
    "overflow": (HEADER, "1,1e999,press", "column force_gf holds '1e999', which is not a finite number"),
    "empty": (HEADER, ",1,press", "column depth_mm holds nothing, which is not a finite number"),
    "text": (HEADER, "1,12 gf,press", "column force_gf holds '12 gf', which is not a finite number"),
    "underscore": (HEADER, "1,1_2,press", "column force_gf holds '1_2', which is not a finite number"),
    "short": (HEADER, "1", "column force_gf holds nothing, which is not a finite number"),
    "no direction": (HEADER, "1,1,", "column direction has no direction"),
    "repeated time": ("time_ms,depth_mm,force_N", "50,1,1", "column time_ms holds '50', must be later than"),
    "backward time": ("time_ms,depth_mm,force_N", "49,1,1", "column time_ms holds '49', must be later than"),
    "no time": ("time_ms,depth_mm,force_N", ",1,1", "column time_ms holds nothing, which is not a finite"),
}


def with_bad_row(write: Write, case: str, count: int = 1) -> Path:
    header, bad, _ = BAD_ROWS[case]
    good = rows(20) if header == HEADER else timed_rows(20)
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


def test_a_row_with_two_defects_is_counted_once(csv_file: Write) -> None:
    recording = read_recording(csv_file(HEADER, [*rows(12), "nan,inf,"]), invalid="drop")
    assert recording.notes[1:] == ("dropped 1 row without a finite number in depth_mm (first: line 14)",)


def test_time_must_be_later_than_all_times_before_it(csv_file: Write) -> None:
    lines = [*timed_rows(12), "50,90,1", "60,91,1", "nan,92,1", "120,93,1"]
    recording = read_recording(csv_file("time_ms,depth_mm,force_N", lines), invalid="drop")
    np.testing.assert_allclose(recording.position[11:], [5.5e-3, 93e-3])
    assert (
        recording.notes[2]
        == "dropped 2 rows with a time that is not later than in a row before (first: line 14)"
    )

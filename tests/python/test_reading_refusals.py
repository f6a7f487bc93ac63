# SPDX-License-Identifier: Apache-2.0
"""What is refused while reading a recording, in which words, and what is dropped on request."""

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from palpate import read_recording
from small_files import HEADER, Write, refusal, rows, timed


def lines(*parts: str | list[str]) -> str:
    """A file's text from lines and lists of lines."""
    return "\n".join(line for part in parts for line in (part if isinstance(part, list) else [part]))


PLAIN = [f"{k},{k}" for k in range(40)]

# What it is: (the file's text, the options of reading, the whole sentence).
REFUSED: dict[str, tuple[str, dict[str, Any], str]] = {
    "empty": ("", {}, "press.csv is empty"),
    "metadata only": (
        "# only: metadata\n",
        {},
        "press.csv holds no header: the first line must name the columns",
    ),
    "header only": (HEADER, {}, "press.csv has 0 usable rows; a recording needs at least 10"),
    "3 rows": (lines(HEADER, rows(3)), {}, "press.csv has 3 usable rows; a recording needs at least 10"),
    "9 rows": (lines(HEADER, rows(9)), {}, "press.csv has 9 usable rows; a recording needs at least 10"),
    "positions equal": (
        lines(HEADER, ["1,1,press"] * 12),
        {},
        "press.csv: column depth_mm holds 1 distinct value; force over position needs at least 3",
    ),
    "2 positions": (
        lines(HEADER, ["1,1,press", "2,1,press"] * 6),
        {},
        "press.csv: column depth_mm holds 2 distinct values; force over position needs at least 3",
    ),
    "one column": (
        "depth_mm\n1\n2\n",
        {},
        "press.csv, line 1: there is one column (depth_mm); a recording needs a position and a force, "
        "separated by commas",
    ),
    "semicolons": (
        "depth_mm;force_N\n1;2\n",
        {},
        "press.csv, line 1: there is one column (depth_mm;force_N); a recording needs a position and a "
        "force, separated by commas",
    ),
    "no header": (
        "1,2\n3,4\n",
        {},
        "press.csv, line 1: a header with column names must come first, found 1, 2",
    ),
    "nameless column": ("depth_mm,,force_N\n", {}, "press.csv, line 1: column 2 has no name"),
    "name twice": (
        "depth_mm,force_N,depth_mm\n",
        {},
        "press.csv, line 1: column name depth_mm stands 2 times",
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
            f"press.csv, line 12: column direction holds '{word}', which is no direction; known words are "
            "press, approach, load, loading, forward, +1, release, retract, unload, unloading, back, -1, "
            "pause, hold, extra, 0",
        )
        for word in ("upward", " Press ", "2", "0.5")
        for invalid in ("refuse", "drop")
    },
    "rows beyond the end": (
        lines("depth_mm,force_N", PLAIN),
        {"rows": (30, 41)},
        "press.csv: rows 30:41 were asked for; it has 40 rows, and START must be below STOP",
    ),
    "no rows": (
        lines("depth_mm,force_N", PLAIN),
        {"rows": (9, 9)},
        "press.csv: rows 9:9 were asked for; it has 40 rows, and START must be below STOP",
    ),
    "a sign of nothing": (
        lines("depth_mm,force_N", PLAIN),
        {"negate": ("z",)},
        "press.csv: --negate z names no column that is used (depth_mm, force_N)",
    ),
    "a treatment that is none": (
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
        "press.csv: --torque-constant-Nm-per-A turns a current into a torque, but the force is torque_Nm, "
        "which is not in A",
    ),
    "a status column that is not there": (
        lines('# palpate-columns: {"status": "status"}', "depth_mm,force_N", PLAIN),
        {},
        "press.csv has no column 'status', which its metadata names as the status",
    ),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_cannot_be_read_is_refused_in_one_sentence(csv_file: Write, case: str) -> None:
    text, options, sentence = REFUSED[case]
    assert refusal(csv_file(text), **options) == sentence


def test_a_file_that_is_not_there_is_refused(tmp_path: Path) -> None:
    assert refusal(tmp_path / "none.csv") == "there is no file none.csv"
    (tmp_path / "folder.csv").mkdir()
    assert refusal(tmp_path / "folder.csv") == "folder.csv is a folder, not a file"


def test_a_file_that_is_not_text_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "press.csv"
    path.write_bytes(b"depth_mm,force_N,word\n" + b"1,2,\xff\xfe\n" * 12)
    assert refusal(path) == "press.csv is not text in UTF-8; a recording is CSV or Parquet"


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

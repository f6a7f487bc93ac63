# SPDX-License-Identifier: Apache-2.0
"""Lines and rows in messages are those that an editor shows."""

import os
import random
import re
from collections.abc import Callable
from itertools import product
from pathlib import Path
from typing import Any

import openpyxl
import pytest

from conftest import sampled
from palpate import identify_files, read_recording
from palpate.errors import InputError
from palpate.recording.csv_file import CsvFile

SCALE = float(os.environ.get("PALPATE_TEST_SCALE", "1"))

BEFORE = ("", "# a: b\n\nDevice;X\n\n\n")
HEADER = {
    "names": "time_s,position_mm,force_N,note\n",
    "units": "time,position,force,note\ns,mm,N,\n",
    "units after a blank line": "time,position,force,note\n\ns,mm,N,\n",
    "a blank line after the header": "time_s,position_mm,force_N,note\n\n",
}
BETWEEN = {
    "nothing": "",
    "blank": "\n\n",
    "spaces": "   \n \t\n",
    "quoted": '0.5,1.0,2.0,"two\nlines"\n',
}
DEFECTS = {
    "word": "0.7,1.5,BAD,x",
    "cells": "0.7,1.5,2,x,7,8",
    "nothing": "0.7,1.5,,x",
    "words in two lines": '0.7,1.5,BAD,"two\nlines"',
}
GOOD = "".join(f"{k / 1000},{k * 0.01},{k * 0.02},x\n" for k in range(20))


def in_parts(path: Path) -> Any:
    return identify_files(path, part_rows=5)


def named_line(read: Callable[[Path], Any], path: Path) -> int:
    with pytest.raises(InputError) as refused:
        read(path)
    found = re.search(r"line (\d+)", str(refused.value))
    assert found is not None, refused.value
    return int(found[1])


@pytest.mark.parametrize(
    ("read", "ending"),
    sampled(product((read_recording, in_parts), ("\n", "\r\n")), (read_recording, "\r\n"), (in_parts, "\n")),
)
@pytest.mark.parametrize("between", sampled(BETWEEN, "nothing", "quoted"))
@pytest.mark.parametrize("header", sampled(HEADER, "names", "units after a blank line"))
def test_the_first_line_of_a_defective_row_is_named(
    tmp_path: Path, header: str, between: str, ending: str, read: Callable[[Path], Any]
) -> None:
    path = tmp_path / "press.csv"
    for before in BEFORE:
        for defect in DEFECTS.values():
            above = before + HEADER[header] + GOOD + BETWEEN[between]
            text = above + defect + "\n0.9,1.6,3,x\n"
            path.write_bytes(text.replace("\n", ending).encode())
            assert named_line(read, path) == above.count("\n") + 1


ODD_LINES = ("", "  ", "\t", " \t ", "\x0c", "\x0b", "\xa0", "\u2028", "\x85", '""', '"  "', '"\n"', '"a\nb"')
"""Blank lines, and lines that look blank but are rows without numbers"""


@pytest.mark.parametrize("read", [read_recording, in_parts])
def test_a_line_that_looks_blank_is_a_row_for_the_reader_and_for_the_message(
    tmp_path: Path, read: Callable[[Path], Any]
) -> None:
    """The named line is the first one that is neither blank nor complete."""
    chance, path = random.Random(0), tmp_path / "press.csv"
    for _ in range(20 if SCALE == 1 else int(60 * SCALE)):
        separator = chance.choice(",;\t")
        text = f"position_mm{separator}force_N\n"
        lines = [f"{k * 0.5}{separator}{k * 0.25}\n" for k in range(15)]
        for _ in range(4):
            lines.insert(chance.randrange(5, len(lines)), chance.choice(ODD_LINES) + "\n")
        blank = " \t\n".replace(separator, "")
        first = next(
            (k for k, line in enumerate(lines) if line[0] not in "0123456789" and line.strip(blank)), None
        )
        if first is None:
            continue
        path.write_bytes((text + "".join(lines)).encode())
        assert named_line(read, path) == 2 + "".join(lines[:first]).count("\n")


@pytest.mark.parametrize("read", [read_recording, in_parts])
def test_incomplete_rows_that_fill_a_block_are_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, read: Callable[[Path], Any]
) -> None:
    monkeypatch.setattr("palpate.recording.csv_file._CHUNK_CELLS", 4 * 20)
    monkeypatch.setattr("palpate.recording.reading.BLOCK_ROWS", 20)
    path = tmp_path / "press.csv"
    path.write_text("# a: b\ntime_s,position_mm,force_N,note\n\n" + GOOD + "0.9\n0.91\n")
    assert named_line(read, path) == 24


def workbook(path: Path, rows: dict[int, list[Any]]) -> Path:
    """Writes cells into the given rows of a sheet."""
    book = openpyxl.Workbook()
    assert book.active is not None
    for row, cells in rows.items():
        for column, cell in enumerate(cells, 1):
            book.active.cell(row, column, cell)
    book.save(path)
    return path


def test_rows_of_a_sheet_are_named_as_excel_numbers_them(tmp_path: Path) -> None:
    rows: dict[int, list[Any]] = {2: ["Device: X"], 4: ["position", "force"], 6: ["mm", "N"]}
    rows |= {k: [0.1 * k, 0.2 * k] for k in range(10, 40)}
    rows |= {k: [" ", ""] for k in range(40, 44)} | {k: [0.1 * k, 0.2 * k] for k in range(50, 60)}
    rows[57] = [5.7, "BAD"]
    with pytest.raises(InputError, match=r"press.xlsx, row 57: column force \[N\] holds 'BAD'"):
        read_recording(workbook(tmp_path / "press.xlsx", rows))
    notes = read_recording(tmp_path / "press.xlsx", invalid="drop").notes
    assert any("(first: row 57)" in note for note in notes)


def test_the_header_row_of_a_sheet_is_named_as_excel_numbers_it(tmp_path: Path) -> None:
    rows: dict[int, list[Any]] = {3: ["notes"], 7: ["force_N", "force_N"]}
    rows |= {k: [0.1 * k, 0.2 * k] for k in range(9, 40)}
    with pytest.raises(InputError, match=r"press.xlsx, row 7: column name force_N occurs 2 times"):
        read_recording(workbook(tmp_path / "press.xlsx", rows))


def test_a_decimal_mark_in_a_sheet_is_named_with_its_row(tmp_path: Path) -> None:
    rows: dict[int, list[Any]] = {1: ["position_mm", "force_N"]}
    rows |= {k: [f"1,{k}00", f"2,{k}00"] for k in range(4, 9)}
    with pytest.raises(InputError, match=r"press.xlsx, row 4 holds '1,400'"):
        read_recording(workbook(tmp_path / "press.xlsx", rows))


def test_lines_before_a_part_are_counted(tmp_path: Path) -> None:
    path = tmp_path / "press.csv"
    path.write_text("position_mm,force_N\n\n" + "1,2\n\n3,4\n" * 30)
    table = CsvFile(path)
    assert table.place(0) == "line 3"
    assert table.place(3) == "line 8"

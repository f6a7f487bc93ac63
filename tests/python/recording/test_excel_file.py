# SPDX-License-Identifier: Apache-2.0
"""Choice of the sheet of a workbook, stray cells, and the limit of memory."""

import zipfile
from pathlib import Path
from typing import Any

import openpyxl
import pytest

from any_input import SCALE
from conftest import sampled
from palpate import InputError, read_recording
from palpate.recording.files import MEMORY_LIMIT

HEADER = ("position_mm", "force_N")

LAST_CELL = (1048576, 16384)
"""Row and column of the last cell of a sheet: XFD1048576"""


def rows(slope: float = 2.0) -> list[tuple[Any, ...]]:
    return [HEADER, *((k / 10, slope * k / 10) for k in range(20))]


def workbook(path: Path, *sheets: tuple[str, str, list[tuple[Any, ...]]]) -> Path:
    """Writes sheets, each with name, state (visible, hidden, veryHidden) and rows."""
    book = openpyxl.Workbook()
    for _ in sheets[1:]:
        book.create_sheet()
    for sheet, (name, state, cells) in zip(book.worksheets, sheets, strict=True):
        sheet.title, sheet.sheet_state = name, state
        for row in cells:
            sheet.append(row)
    book.active = next((k for k, (_, state, _) in enumerate(sheets) if state == "visible"), 0)
    book.save(path)
    return path


def with_cell(path: Path, row: int, column: int, value: Any) -> Path:
    book = openpyxl.load_workbook(path)
    book.worksheets[0].cell(row, column, value)
    book.save(path)
    return path


@pytest.mark.parametrize("state", ["hidden", "veryHidden"])
def test_a_visible_sheet_wins_over_a_hidden_one(tmp_path: Path, state: str) -> None:
    sheets = (("before", state, rows(-1.0)), ("none", "visible", []), ("run", "visible", rows()))
    recording = read_recording(workbook(tmp_path / "a.xlsx", *sheets))
    assert recording.force[-1] == 3.8
    assert recording.notes[0].endswith("read as: sheet run")


def test_a_hidden_sheet_is_read_and_named_if_no_visible_one_has_cells(tmp_path: Path) -> None:
    path = workbook(tmp_path / "a.xlsx", ("cover", "visible", []), ("run", "hidden", rows()))
    recording = read_recording(path)
    assert recording.force[-1] == 3.8
    assert recording.notes[0].endswith("read as: hidden sheet run")


@pytest.mark.parametrize("blank", sampled([" ", "", "\n\t", "\xa0"], "", "\xa0"))
def test_a_blank_cell_far_away_has_no_effect(tmp_path: Path, blank: str) -> None:
    plain = read_recording(workbook(tmp_path / "a.xlsx", ("run", "visible", rows())))
    stray = read_recording(with_cell(tmp_path / "a.xlsx", *LAST_CELL, blank))
    assert (stray.force == plain.force).all()
    assert stray.notes == plain.notes
    assert not stray.columns


def test_a_value_outside_the_columns_is_named_with_its_row(tmp_path: Path) -> None:
    path = workbook(tmp_path / "a.xlsx", ("run", "visible", rows()))
    with pytest.raises(InputError, match=r"row 1048576: 16384 cells, but the header names 2 columns"):
        read_recording(with_cell(path, *LAST_CELL, "checked"))


def test_a_preamble_wider_than_the_table_does_not_add_columns(tmp_path: Path) -> None:
    cells = [("Device", "A", "B", "C", "D", "E"), *rows()]
    recording = read_recording(workbook(tmp_path / "a.xlsx", ("run", "visible", cells)))
    assert recording.metadata == {"Device": "A B C D E"}
    assert not recording.columns


@pytest.mark.parametrize("first", [1, 300], ids=["first rows", "later rows"])
def test_columns_without_a_name_are_refused(tmp_path: Path, first: int) -> None:
    cells = [HEADER, *((k / 10, k / 5, *([k] if k >= first else [])) for k in range(400))]
    sentence = "row 1: column 3 has no name" if first == 1 else "row 302: 3 cells, but the header names 2"
    with pytest.raises(InputError, match=sentence):
        read_recording(workbook(tmp_path / "a.xlsx", ("run", "visible", cells)))


@pytest.mark.parametrize("element", ["<c/>", "<row/>", "<x/>", "<row><c/></row>"])
def test_a_workbook_that_needs_too_much_memory_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, element: str
) -> None:
    """The short run divides the limit and the size of the workbook by 100."""
    limit = MEMORY_LIMIT // (100 if SCALE == 1 else 1)
    monkeypatch.setattr("palpate.recording.files.MEMORY_LIMIT", limit)
    path, count = tmp_path / "a.xlsx", limit // 98 // element.count("<")
    good_path = workbook(tmp_path / "b.xlsx", ("run", "visible", rows()))
    with zipfile.ZipFile(good_path) as good, zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as bad:
        for name in good.namelist():
            content = good.read(name)
            if name == "xl/worksheets/sheet1.xml":
                before, mark, after = content.partition(b"<row")
                content = before + element.encode() * count + mark + after
            bad.writestr(name, content)
    with pytest.raises(
        InputError,
        match=rf"a.xlsx needs at least \d+(\.\d+)? GiB of memory, and the limit is {limit / 2**30:.3g} GiB",
    ):
        read_recording(path)

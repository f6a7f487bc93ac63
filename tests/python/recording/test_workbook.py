# SPDX-License-Identifier: Apache-2.0
"""Sheets of a workbook, stray cells, times, and the limit of memory."""

import datetime
from pathlib import Path
from typing import Any

import numpy as np
import openpyxl
import openpyxl.styles
import pytest

from conftest import sampled
from palpate import InputError, read_recording
from small_files import refusal
from workbooks import SUFFIXES, any_file, text_file, write_ods_content

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


def test_cells_that_only_have_a_format_have_no_effect(tmp_path: Path) -> None:
    path = workbook(tmp_path / "a.xlsx", ("run", "visible", rows()))
    plain = read_recording(path)
    book = openpyxl.load_workbook(path)
    book.worksheets[0].cell(*LAST_CELL).font = openpyxl.styles.Font(bold=True)
    book.save(path)
    assert read_recording(path).notes == plain.notes


@pytest.mark.parametrize("blank", sampled([" ", "\n\t", "\xa0"], " ", "\xa0"))
def test_a_blank_cell_below_and_right_of_the_table_has_no_effect(tmp_path: Path, blank: str) -> None:
    plain = read_recording(workbook(tmp_path / "a.xlsx", ("run", "visible", rows())))
    stray = read_recording(with_cell(tmp_path / "a.xlsx", 1000, 100, blank))
    assert (stray.force == plain.force).all()
    assert stray.notes == plain.notes
    assert not stray.columns


def test_a_value_outside_the_columns_is_named_with_its_row(tmp_path: Path) -> None:
    path = workbook(tmp_path / "a.xlsx", ("run", "visible", rows()))
    recording = read_recording(with_cell(path, 5000, 2, "checked"))
    assert "not used: row 5000 below the table (checked)" in recording.notes
    assert len(recording) == 20


def test_a_preamble_wider_than_the_table_does_not_add_columns(tmp_path: Path) -> None:
    cells = [("Device", "A", "B", "C", "D", "E"), *rows()]
    recording = read_recording(workbook(tmp_path / "a.xlsx", ("run", "visible", cells)))
    assert recording.metadata == {"Device": "A B C D E"}
    assert not recording.columns


def test_a_column_of_numbers_without_a_name_is_refused(tmp_path: Path) -> None:
    cells = [HEADER, *((k / 10, k / 5, k) for k in range(400))]
    with pytest.raises(InputError, match="row 1: column 3 has no name"):
        read_recording(workbook(tmp_path / "a.xlsx", ("run", "visible", cells)))


@pytest.mark.parametrize("value", ["checked", " "])
def test_a_cell_in_the_last_row_and_column_is_refused_before_memory_is_used(
    tmp_path: Path, value: str
) -> None:
    """The library would hold all cells up to the last one."""
    path = workbook(tmp_path / "a.xlsx", ("run", "visible", rows()))
    sentence = "a.xlsx needs more than 4 GiB of memory: it is damaged, or it has cells far below or right of"
    assert refusal(with_cell(path, *LAST_CELL, value)).startswith(sentence)


@pytest.mark.parametrize(("rows_repeated", "columns_repeated"), [(1_000_000, 1), (1, 16384), (50_000, 16384)])
def test_a_small_file_with_repeated_cells_is_read_or_refused_within_the_memory(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, rows_repeated: int, columns_repeated: int
) -> None:
    """A trace of the stack would wait forever for memory."""
    monkeypatch.setenv("RUST_BACKTRACE", "1")
    monkeypatch.setattr("palpate.recording.files.MEMORY_LIMIT", 64 << 20)
    cell = (
        f"<table:table-cell office:value-type='float' office:value='1' "
        f"table:number-columns-repeated='{columns_repeated}'/>"
    )
    row = f"<table:table-row table:number-rows-repeated='{rows_repeated}'>{cell}</table:table-row>"
    write_ods_content(tmp_path / "a.ods", f"<table:table table:name='run'>{row}</table:table>")
    assert (tmp_path / "a.ods").stat().st_size < 2000
    sentence = refusal(tmp_path / "a.ods")
    assert "needs more than 0.0625 GiB of memory" in sentence or rows_repeated == 1


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_times_are_read_in_seconds(tmp_path: Path, suffix: str) -> None:
    header = ["Time", "Travel (mm)", "Force (N)"]
    cells = [[datetime.time(0, k // 4, k % 60, 500_000), 0.1 * k, 0.2 * k] for k in range(20)]
    recording = read_recording(any_file(tmp_path / f"a{suffix}", [header, *cells]))
    assert recording.time is not None
    np.testing.assert_allclose(recording.time, [60 * (k // 4) + k + 0.5 for k in range(20)], rtol=1e-12)
    assert recording.notes[0].endswith("read as: times to a millisecond")


def test_dates_are_read_in_seconds(tmp_path: Path) -> None:
    start = datetime.datetime(2026, 3, 1, 23, 59, 50)
    header = ("Started", start, None), ("Date", "Travel (mm)", "Force (N)")
    cells = [(start + datetime.timedelta(seconds=k), 0.1 * k, 0.2 * k) for k in range(20)]
    recording = read_recording(workbook(tmp_path / "a.xlsx", ("run", "visible", [*header, *cells])))
    assert recording.time is not None
    assert np.diff(recording.time).tolist() == [1.0] * 19
    assert recording.metadata == {"Started": "2026-03-01 23:59:50"}


def test_times_in_a_column_of_another_unit_are_refused(tmp_path: Path) -> None:
    header = ("Time (min)", "Travel (mm)", "Force (N)")
    cells = [(datetime.time(0, 0, k), 0.1 * k, 0.2 * k) for k in range(20)]
    path = workbook(tmp_path / "a.xlsx", ("run", "visible", [header, *cells]))
    assert refusal(path) == (
        "a.xlsx, row 1: column Time (min) holds times such as 00:00:00, but its name states min; "
        "format its cells as numbers, or state s"
    )


def test_the_content_decides_if_the_name_ends_in_xls(tmp_path: Path) -> None:
    """Machines give the ending .xls to text, and people rename an .xlsx."""
    plain = text_file(tmp_path / "a.xls", rows(), separator="\t")
    other = any_file(tmp_path / "b.xlsx", rows()).rename(tmp_path / "b.xls")
    assert read_recording(plain).force.tolist() == read_recording(other).force.tolist()


@pytest.mark.parametrize("damage", sampled(["short", "zeros", "repeated"], "short", "repeated"))
def test_a_broken_workbook_is_refused_in_one_sentence(damage: str, tmp_path: Path) -> None:
    whole = any_file(tmp_path / "a.xls", rows()).read_bytes()
    damaged = {
        "short": whole[:600],
        "zeros": whole[:512] + bytes(len(whole) - 512),
        "repeated": whole[:1000] * 3,
    }
    path = tmp_path / "b.xls"
    path.write_bytes(damaged[damage])
    assert refusal(path).startswith(("b.xls is not readable as a workbook: ", "b.xls needs more"))

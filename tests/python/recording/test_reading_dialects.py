# SPDX-License-Identifier: Apache-2.0
"""Text files of other programs: positions of header, units and rows, and the first note."""

from pathlib import Path

import numpy as np
import pytest

from palpate import Recording, read_recording
from palpate.recording import sample_recording
from small_files import Write, refusal

ROW_NUMBERS = np.arange(12)


def read_as(recording: Recording) -> str:
    return recording.notes[0].partition("; read as: ")[2]


def comma(value: float) -> str:
    return f"{value:.2f}".replace(".", ",")


ROWS = [f"{0.5 * k},{10 * k}" for k in ROW_NUMBERS]
SEMICOLONS = [f"{comma(0.5 * k)};{comma(10 * k)}" for k in ROW_NUMBERS]

# Name of a program -> (lines of a file that it writes, text of the recording's first note, metadata).
FILES: dict[str, tuple[list[str], str, dict[str, str]]] = {
    "header in a comment, as numpy.savetxt writes it": (
        ["# bench: 3", "# depth_mm,force_N", *ROWS],
        "header in the comment in line 2",
        {"bench": "3"},
    ),
    "units in a second line, in brackets and quotes": (
        ['"Depth","Load"', '"(mm)","(N)"', *(f'"{0.5 * k}","{10 * k}"' for k in ROW_NUMBERS)],
        "units in line 2",
        {},
    ),
    "lines of the same number of cells before the header": (
        ["Operator;Smith", "Sample;7", "Depth [mm];Load [N]", *SEMICOLONS],
        "separated by semicolons, decimal comma, 2 lines before the header in line 3",
        {"Operator": "Smith", "Sample": "7"},
    ),
    "header of two lines in quotes": (
        ['"Depth\n(mm)","Load\n(N)"', *ROWS],
        "",
        {},
    ),
    "a column of words without a unit in the line of units": (
        ["Depth\tLoad\tStroke\tRate", "mm\tN\t\tV", *(f"{0.5 * k}\t{10 * k}\tpress\t1" for k in ROW_NUMBERS)],
        "separated by tabs, units in line 2",
        {},
    ),
    "an index column and a separator at the end of each row": (
        [";Depth [mm];Load [N];", *(f"{k};{line};" for k, line in enumerate(SEMICOLONS))],
        "separated by semicolons, decimal comma, the first column has no name (an index)",
        {},
    ),
    "a separator at the end of each row of data alone": (
        ["Depth [mm];Load [N]", *(f"{line};" for line in SEMICOLONS)],
        "separated by semicolons, decimal comma",
        {},
    ),
    "decimal commas in quotes": (
        ["Depth [mm],Load [N]", *(f'"{comma(0.5 * k)}","{comma(10 * k)}"' for k in ROW_NUMBERS)],
        "decimal comma",
        {},
    ),
    "semicolons in a text column": (
        ["depth_mm,force_N,remark", *(f"{line},a;b" for line in ROWS)],
        "",
        {},
    ),
}


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "utf-16-le", "utf-16-be"])
@pytest.mark.parametrize("case", FILES)
def test_a_file_of_another_program_is_read_and_its_dialect_reported(
    tmp_path: Path, case: str, encoding: str
) -> None:
    lines, dialect_note, metadata = FILES[case]
    path = tmp_path / "press.csv"
    path.write_bytes("\n".join(lines).encode(encoding))
    recording = read_recording(path)
    np.testing.assert_allclose(recording.position, 0.5e-3 * ROW_NUMBERS, rtol=1e-15)
    np.testing.assert_array_equal(recording.force, 10.0 * ROW_NUMBERS)
    assert recording.metadata == metadata
    if not encoding.startswith("utf-16"):
        assert read_as(recording) == dialect_note
    assert read_recording(recording.write(tmp_path / "again.csv")).metadata == metadata


def test_a_header_in_shift_jis_is_read(tmp_path: Path) -> None:
    path = tmp_path / "press.csv"
    text = "変位(mm),荷重(g)\n" + "".join(f"{0.5 * k},{10 * k}\n" for k in range(12))
    path.write_bytes(text.encode("cp932"))
    recording = read_recording(path)
    assert read_as(recording) == "Shift JIS"
    assert recording.source.columns == {"position": "変位(mm)", "force": "荷重(g)"}
    np.testing.assert_allclose(recording.force, 9.80665e-2 * np.arange(12), rtol=1e-12)


@pytest.mark.parametrize("row", [3, 100_000], ids=["at the start", "far below"])
def test_a_byte_outside_utf_8_is_read_as_latin_1_or_refused_with_a_command(tmp_path: Path, row: int) -> None:
    lines = [f"{0.5 * k},{10 * k},ok".encode() for k in range(row + 20)]
    lines[row] = f"{0.5 * row},{10 * row},weiß".encode("latin-1")
    path = tmp_path / "press.csv"
    path.write_bytes(b"\n".join([b"depth_mm,force_N,remark", *lines]))
    if row == 3:
        recording = read_recording(path)
        assert read_as(recording) == "Latin-1"
        assert recording.columns["remark"][3] == "weiß"
    else:
        assert refusal(path) == (
            "press.csv begins as UTF-8 and later has other bytes; if they are Latin-1, "
            "convert the file: iconv -f LATIN1 -t UTF-8 OLD.csv > NEW.csv"
        )


def test_the_last_cells_of_a_row_may_be_missing(csv_file: Write) -> None:
    path = csv_file("depth_mm,force_N,remark", ROWS)
    assert np.isnan(read_recording(path).columns["remark"]).all()


def test_a_cell_after_the_last_separator_is_refused_with_its_line(csv_file: Write) -> None:
    lines = [f"{k};{k};" for k in range(1500)]
    lines[1400] = "1400;1400;7"
    assert refusal(csv_file("depth_mm;force_N;", lines)).startswith(
        "press.csv, line 1402: 3 cells, but the header names 2 columns"
    )


def test_a_file_of_the_package_is_read_without_a_dialect_note(tmp_path: Path) -> None:
    recording = read_recording(sample_recording(1, 1.0).write(tmp_path / "press.csv"))
    assert read_as(recording) == ""

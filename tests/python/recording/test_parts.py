# SPDX-License-Identifier: Apache-2.0
"""Files with several things: sheets, specimens side by side, blocks of rows, and notes around a table."""

import json
import shlex
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from conftest import sampled
from palpate import InputError, Recording, read_recording
from palpate.cli.main import main
from palpate.recording import workbook as workbook_reader
from palpate.recording.grid import Grid
from palpate.verification.verification import is_fresh
from small_files import options_in, refusal
from workbooks import SUFFIXES, Rows, any_file, text_file, workbook

HEADER = ["Time (s)", "Travel (mm)", "Force (N)"]

ALL = (".csv", *SUFFIXES)


@pytest.fixture(autouse=True)
def each_workbook_is_read_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Reads equal bytes of a workbook only once, because each reading starts a process."""
    known: dict[bytes, list[Grid]] = {}

    def read_once(path: Path) -> list[Grid]:
        content = path.read_bytes()
        if content not in known:
            known[content] = workbook_reader.read_sheets(path)
        return known[content]

    monkeypatch.setattr("palpate.recording.parts.read_sheets", read_once)


def indent(number: int, rows: int = 40) -> list[list[float]]:
    """Returns time, travel and force of a press and its release; each object has another stiffness."""
    half = rows // 2
    travel = [0.1 * min(k, 2 * half - k) for k in range(rows)]
    return [
        [round(0.01 * k, 6), round(x, 6), round((1.0 + number) * x + 0.2 * (k < half), 6)]
        for k, x in enumerate(travel)
    ]


def clean(folder: Path, *blocks: Rows) -> Recording:
    """Returns the recording in a file with these rows below one header, without their times."""
    rows = [row[1:] for block in blocks for row in block]
    return read_recording(text_file(folder / "clean.csv", [HEADER[1:], *rows]))


def assert_same_rows(found: Recording, expected: Recording) -> None:
    np.testing.assert_array_equal(found.position, expected.position)
    np.testing.assert_array_equal(found.force, expected.force)
    assert found.units == expected.units


def follow(path: Path, sentence: str, capsys: pytest.CaptureFixture[str]) -> Recording:
    """Executes the options that a refusal suggests, on the command line and in Python."""
    words = shlex.split(sentence.split("add: ")[1])
    assert main(["show", str(path), *words, "--json"]) in (0, 1)
    recording = read_recording(path, **options_in(sentence))  # type: ignore[arg-type]
    assert json.loads(capsys.readouterr().out)["rows"] == len(recording)
    return recording


def side_by_side(*tables: Rows) -> list[list[Any]]:
    """Returns the rows of tables side by side, with an empty column between them."""
    height = max(map(len, tables))
    rows = []
    for k in range(height):
        row: list[Any] = []
        for table in tables:
            width = max(map(len, table))
            cells = list(table[k]) if k < len(table) else []
            row += cells + [None] * (width + 1 - len(cells))
        rows.append(row[:-1])
    return rows


# ------------------------------------------------------------------------------------------------ sheets


RESULTS = [["Specimen", "Fmax", "Travel"], [None, "N", "mm"], *([f"S{k}", 70.0 + k, 12.0] for k in range(12))]
PARAMETERS = [["Test speed", "10 mm/min"], ["Preload", 0.5]]


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_the_sheet_with_the_longest_table_of_position_and_force_is_read(tmp_path: Path, suffix: str) -> None:
    sheets = {"Parameters": PARAMETERS, "Results": RESULTS, "Curve": [HEADER, *indent(0)]}
    recording = read_recording(workbook(tmp_path / f"a{suffix}", sheets))
    assert_same_rows(recording, clean(tmp_path, indent(0)))
    assert recording.notes[0].endswith("read as: sheet Curve")
    assert (
        "not used: Parameters (1 row), Results (12 rows); --part NAME reads another part" in recording.notes
    )


@pytest.mark.parametrize("suffix", sampled(SUFFIXES, ".ods"))
def test_sheets_of_several_specimens_are_listed_and_one_is_chosen_by_name(
    tmp_path: Path, suffix: str, capsys: pytest.CaptureFixture[str]
) -> None:
    specimens = {f"Specimen {k}": [HEADER, *indent(k, 40 + 2 * k)] for k in range(3)}
    path = workbook(tmp_path / f"a{suffix}", {"Results": RESULTS, **specimens})
    sentence = refusal(path)
    listed = "Specimen 0 (40 rows), Specimen 1 (42 rows), Specimen 2 (44 rows)"
    assert sentence.startswith(f"a{suffix} holds 3 recordings: {listed}. ")
    assert_same_rows(follow(path, sentence, capsys), clean(tmp_path, indent(0)))
    assert_same_rows(read_recording(path, part="Specimen 2"), clean(tmp_path, indent(2, 44)))
    assert_same_rows(read_recording(path, part=3), clean(tmp_path, indent(1, 42)))


def test_a_refusal_of_columns_without_units_also_names_the_part(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    sheets = {f"S{k}": [["Time", "Travel", "Load"], *indent(k)] for k in range(3)}
    path = workbook(tmp_path / "a.xlsx", sheets)
    sentence = refusal(path)
    assert "a.xlsx, part S0: no column name has a unit of position" in sentence
    assert_same_rows(follow(path, sentence, capsys), clean(tmp_path, indent(0)))


def test_a_hidden_sheet_is_read_if_it_is_named(tmp_path: Path) -> None:
    sheets = {"Old": [HEADER, *indent(1, 60)], "Run": [HEADER, *indent(0)]}
    for suffix in SUFFIXES:
        path = workbook(tmp_path / f"a{suffix}", sheets, hidden=["Old"])
        assert_same_rows(read_recording(path), clean(tmp_path, indent(0)))
        assert_same_rows(read_recording(path, part="Old"), clean(tmp_path, indent(1, 60)))


def test_show_lists_all_parts_of_a_file_with_several_recordings(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = workbook(tmp_path / "a.xlsx", {f"S{k}": [HEADER, *indent(k)] for k in range(25)})
    assert main(["show", str(path)]) == 2
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].split() == ["part", "number", "rows"]
    assert [line.split() for line in lines[1:]] == [[f"S{k}", str(k + 1), "40"] for k in range(25)]


# ------------------------------------------------------------------------------------------ side by side


@pytest.mark.parametrize("suffix", sampled(ALL, ".csv", ".xls"))
def test_specimens_side_by_side_are_chosen_by_the_title_above_their_columns(
    tmp_path: Path, suffix: str, capsys: pytest.CaptureFixture[str]
) -> None:
    first = [["Specimen A"], ["Time", "Travel", "Force"], ["s", "mm", "N"], *indent(0)]
    second = [["Specimen B"], ["Time", "Travel", "Force"], ["s", "mm", "N"], *indent(1, 30)]
    path = any_file(tmp_path / f"a{suffix}", [["Report", 7], [], *side_by_side(first, second)])
    sentence = refusal(path)
    assert sentence.startswith(f"a{suffix} holds 2 recordings: Specimen A (40 rows), Specimen B (30 rows). ")
    assert_same_rows(follow(path, sentence, capsys), clean(tmp_path, indent(0)))
    assert_same_rows(read_recording(path, part="Specimen B"), clean(tmp_path, indent(1, 30)))


@pytest.mark.parametrize("suffix", sampled(ALL, ".csv", ".xlsx"))
def test_specimens_side_by_side_without_titles_have_numbers_and_share_a_time(
    tmp_path: Path, suffix: str
) -> None:
    shared = [[*row, *other[1:]] for row, other in zip(indent(0), indent(1), strict=True)]
    path = any_file(tmp_path / f"a{suffix}", [[*HEADER, *HEADER[1:]], *shared])
    assert refusal(path).endswith("holds 2 recordings: 1 (40 rows), 2 (40 rows). For example, add: --part 1")
    second = read_recording(path, part=2)
    assert_same_rows(second, clean(tmp_path, indent(1)))
    assert second.time is not None


def test_a_column_that_occurs_twice_in_one_table_is_refused(tmp_path: Path) -> None:
    header = ["Force (N)", "Travel (mm)", "Force (N)", "Velocity (mm/s)"]
    for suffix in (".csv", ".xlsx"):
        rows = [[row[2], row[1], row[2], 1.0] for row in indent(0)]
        assert "column name Force (N) occurs 2 times" in refusal(
            any_file(tmp_path / f"a{suffix}", [header, *rows])
        )


# ------------------------------------------------------------------------------------------------ blocks


def blocks(kind: str, count: int) -> list[list[Any]]:
    """Returns indents below one another, with times that all begin at 0."""
    rows: list[list[Any]] = [HEADER]
    for k in range(count):
        if kind == "repeated headers" and k:
            rows.append(HEADER)
        if kind == "titles below the header":
            rows.append([f"Indent {k + 1}"])
        rows += indent(k)
        if kind != "repeated headers":
            rows.append([])
    return rows


KINDS = ("empty rows", "repeated headers", "titles below the header")


@pytest.mark.parametrize(
    ("suffix", "kind"),
    sampled(product(ALL, KINDS), *((".csv", kind) for kind in KINDS), *zip(SUFFIXES, KINDS, strict=True)),
)
def test_blocks_without_separate_names_are_strokes_of_one_recording(
    tmp_path: Path, suffix: str, kind: str
) -> None:
    path = any_file(tmp_path / f"a{suffix}", blocks(kind, 10))
    recording = read_recording(path)
    assert_same_rows(recording, clean(tmp_path, *(indent(k) for k in range(10))))
    note = "10 blocks are read as strokes of one recording; --part 1 reads one of them"
    assert note in recording.notes
    assert_same_rows(read_recording(path, part=3), clean(tmp_path, indent(2)))
    joined = read_recording(path, part=[1, "10"])
    assert_same_rows(joined, clean(tmp_path, indent(0), indent(9)))


def test_the_time_of_a_block_continues_after_the_longest_block(tmp_path: Path) -> None:
    recording = read_recording(text_file(tmp_path / "a.csv", blocks("empty rows", 3)))
    assert recording.time is not None
    np.testing.assert_allclose(recording.time[[0, 39, 40, 79, 80]], [0.0, 0.39, 0.78, 1.17, 1.56])
    assert (
        "the time begins again in line 43; it continues after a pause as long as the longest block, and "
        "--rows 0:40 reads the first one"
    ) in recording.notes
    assert_same_rows(read_recording(tmp_path / "a.csv", rows=(0, 40)), clean(tmp_path, indent(0)))


def test_a_time_that_begins_again_within_a_table_continues(tmp_path: Path) -> None:
    for suffix in (".csv", ".xlsx"):
        path = any_file(tmp_path / f"a{suffix}", [HEADER, *indent(0), *indent(1), *indent(2)])
        recording = read_recording(path)
        assert_same_rows(recording, clean(tmp_path, indent(0), indent(1), indent(2)))
        assert recording.time is not None
        np.testing.assert_allclose(recording.time[[0, 39, 40, 79, 80]], [0.0, 0.39, 0.78, 1.17, 1.56])


@pytest.mark.parametrize(("row", "time"), [(20, 0.0), (20, 0.15), (35, 0.0)], ids=["jump", "back", "late"])
def test_a_single_time_that_does_not_increase_is_refused(tmp_path: Path, row: int, time: float) -> None:
    rows = indent(0)
    rows[row][0] = time
    sentence = refusal(text_file(tmp_path / "a.csv", [HEADER, *rows]))
    assert (
        f"line {row + 2}: column Time (s) holds '{time}', must be later than the time before it" in sentence
    )


def test_a_clock_that_is_set_back_is_refused(tmp_path: Path) -> None:
    rows = [[row[0] - 0.05 * (k >= 20), *row[1:]] for k, row in enumerate(indent(0))]
    assert "line 22: column Time (s) holds" in refusal(text_file(tmp_path / "a.csv", [HEADER, *rows]))


def test_dropped_rows_do_not_join_specimens(tmp_path: Path) -> None:
    rows = [row for k in range(3) for row in ([f"Specimen {k}"], HEADER, *indent(k))]
    assert "holds 3 recordings: Specimen 0 (40 rows)" in refusal(
        text_file(tmp_path / "a.csv", rows), invalid="drop"
    )


def test_the_time_of_blocks_is_kept_if_it_increases(tmp_path: Path) -> None:
    later = [[row[0] + 5.0, *row[1:]] for row in indent(1)]
    recording = read_recording(text_file(tmp_path / "a.csv", [HEADER, *indent(0), [], *later]))
    assert recording.time is not None
    assert recording.time[40] == 5.0
    assert not any("begins again" in note for note in recording.notes)


@pytest.mark.parametrize("suffix", sampled(ALL, ".csv", ".ods"))
def test_blocks_with_a_title_above_each_header_are_chosen_by_it(
    tmp_path: Path, suffix: str, capsys: pytest.CaptureFixture[str]
) -> None:
    rows = [row for k in range(3) for row in ([f"Cycle {k + 1}"], HEADER, *indent(k), [])]
    path = any_file(tmp_path / f"a{suffix}", rows)
    sentence = refusal(path)
    assert "holds 3 recordings: Cycle 1 (40 rows), Cycle 2 (40 rows), Cycle 3 (40 rows). " in sentence
    assert_same_rows(follow(path, sentence, capsys), clean(tmp_path, indent(0)))
    assert_same_rows(read_recording(path, part=["Cycle 2", "Cycle 3"]), clean(tmp_path, indent(1), indent(2)))
    assert refusal(path, invalid="drop") == sentence


def test_a_table_with_single_empty_rows_is_one_block(tmp_path: Path) -> None:
    rows = [each for row in indent(0) for each in (row, [])]
    for suffix in (".csv", ".xlsx"):
        recording = read_recording(any_file(tmp_path / f"a{suffix}", [HEADER, *rows]))
        assert_same_rows(recording, clean(tmp_path, indent(0)))
        assert not any("blocks" in note for note in recording.notes)


def test_parts_with_different_columns_are_not_joined(tmp_path: Path) -> None:
    sheets = {"S0": [HEADER, *indent(0)], "S1": [["Time (s)", "Travel (mm)", "Load (N)"], *indent(1)]}
    sentence = refusal(workbook(tmp_path / "a.xlsx", sheets), part=["S0", "S1"])
    assert "parts S0 (40 rows) and S1 (40 rows) have different columns" in sentence


# ------------------------------------------------------------------------------------- notes and results


@pytest.mark.parametrize("suffix", sampled(ALL, ".csv", ".xls"))
@pytest.mark.parametrize("gap", [[], [[]]], ids=["directly below", "after an empty row"])
def test_calculations_below_a_table_are_named_and_not_used(
    tmp_path: Path, suffix: str, gap: list[list[Any]]
) -> None:
    rows = [HEADER, *indent(0), *gap, ["Mean", 1.5, 3.1], ["Std", 0.2, 0.1]]
    recording = read_recording(any_file(tmp_path / f"a{suffix}", rows))
    assert_same_rows(recording, clean(tmp_path, indent(0)))
    word, first = ("line" if suffix == ".csv" else "row"), 42 + len(gap)
    assert f"not used: {word}s {first} to {first + 1} below the table (Mean 1.5 3.1)" in recording.notes


@pytest.mark.parametrize("suffix", sampled(SUFFIXES, ".xlsx"))
def test_notes_next_to_a_table_are_named_and_not_used(tmp_path: Path, suffix: str) -> None:
    rows: list[list[Any]] = [HEADER, *indent(0)]
    rows[0] = [*rows[0], None, "Fmax", 2.2]
    rows[5] = [*rows[5], None, None, "saturated?"]
    recording = read_recording(workbook(tmp_path / f"a{suffix}", {"Data": rows}))
    assert_same_rows(recording, clean(tmp_path, indent(0)))
    assert "not used: 3 cells next to the table (first: row 1, Fmax)" in recording.notes
    assert not recording.columns


@pytest.mark.parametrize("suffix", sampled(ALL, ".csv", ".ods"))
def test_a_table_of_results_above_the_curve_is_not_the_recording(tmp_path: Path, suffix: str) -> None:
    rows = [
        ["No", "Travel (mm)", "Fmax (N)"],
        *([k, 12.0 + k, 70.0] for k in range(12)),
        [],
        HEADER,
        *indent(0),
    ]
    recording = read_recording(any_file(tmp_path / f"a{suffix}", rows))
    assert_same_rows(recording, clean(tmp_path, indent(0)))
    assert "not used: part 1 (12 rows); --part NAME reads another part" in recording.notes


def test_an_incomplete_row_at_the_end_of_a_table_is_refused(tmp_path: Path) -> None:
    for suffix in (".csv", ".xlsx"):
        path = any_file(tmp_path / f"a{suffix}", [HEADER, *indent(0), [0.4, 0.1, "BAD"]])
        assert "42: column Force (N) holds 'BAD'" in refusal(path)


# ------------------------------------------------------------------------------------- names and sources


def test_an_unknown_part_is_refused_with_the_nearest_name_and_all_parts(tmp_path: Path) -> None:
    path = workbook(tmp_path / "a.xlsx", {"Run one": [HEADER, *indent(0)], "Run two": [HEADER, *indent(1)]})
    assert refusal(path, part="Run on") == (
        "a.xlsx: there is no part 'Run on' (did you mean 'Run one'?); its parts are Run one (40 rows), "
        "Run two (40 rows)"
    )
    assert "there is no part '3'" in refusal(path, part=3)
    assert "there is no part ''" in refusal(path, part="")
    assert refusal(path, part=[]) == "part is empty; give the name or the number of a part"
    with pytest.raises(InputError, match=r"part is 1\.5; it must be the name or the number of a part"):
        read_recording(path, part=[1.5])  # type: ignore[list-item]


def test_a_part_of_a_format_with_one_table_is_refused(tmp_path: Path) -> None:
    np.savez(tmp_path / "a.npz", travel_mm=np.arange(20.0), force_N=np.arange(20.0))
    assert refusal(tmp_path / "a.npz", part=1) == "a.npz has one part only; leave out --part"


def test_another_part_of_a_file_is_fresh_data_and_the_same_part_is_not(tmp_path: Path) -> None:
    path = workbook(
        tmp_path / "a.xlsx", {"Results": RESULTS, "S0": [HEADER, *indent(0)], "S1": [HEADER, *indent(1)]}
    )
    first, again, second = (read_recording(path, part=name).source for name in ("S0", "2", "S1"))
    both = read_recording(path, part=["S0", "S1"]).source
    assert is_fresh(first, second)
    assert not is_fresh(first, again)
    assert not is_fresh(both, second)
    assert first.files == (f"{path}, part S0",)


def test_specimens_in_two_sheets_and_side_by_side_are_different_data(tmp_path: Path) -> None:
    pair = side_by_side([HEADER, *indent(0)], [HEADER, *indent(1)])
    path = workbook(tmp_path / "a.xlsx", {"A": pair, "B": pair})
    listed = "A 1 (40 rows), A 2 (40 rows), B 1 (40 rows), B 2 (40 rows)"
    assert f"holds 4 recordings: {listed}. For example, add: --part 'A 1'" in refusal(path)
    assert "holds 2 recordings: B 1 (40 rows), B 2 (40 rows)" in refusal(path, part="B")
    sources = [read_recording(path, part=k + 1).source for k in range(4)]
    assert len({source.sha256 for source in sources}) == 4
    assert [source.files[0] for source in sources] == [
        f"{path}, part {name}" for name in ("A 1", "A 2", "B 1", "B 2")
    ]


def test_one_part_is_identified_and_verified_with_another(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    other = [[time, travel, force + 1e-3] for time, travel, force in indent(0, 80)]
    path = workbook(tmp_path / "a.xlsx", {"S0": [HEADER, *indent(0, 80)], "S1": [HEADER, *other]})
    model = tmp_path / "m.json"
    assert main(["identify", str(path), "--part", "S0", "-o", str(model)]) == 0
    assert main(["verify", str(model), str(path), "--part", "S1"]) == 0
    assert "recording  fresh" in capsys.readouterr().out
    assert main(["verify", str(model), str(path), "--part", "S0"]) == 0
    assert "not fresh" in capsys.readouterr().out


def test_a_table_behind_the_first_megabyte_is_found(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("palpate.recording.parts.HEAD_BYTES", 300)
    for kind in ("empty rows", "repeated headers"):
        path = text_file(tmp_path / "a.csv", blocks(kind, 3))
        assert any("3 blocks" in note for note in read_recording(path).notes)
    rows = [row for k in range(2) for row in ([f"Cycle {k + 1}"], HEADER, *indent(k))]
    assert "holds 2 recordings: Cycle 1 (40 rows)" in refusal(text_file(tmp_path / "b.csv", rows))


def test_the_only_recording_of_a_file_has_the_same_source_with_and_without_its_name(tmp_path: Path) -> None:
    path = workbook(tmp_path / "a.xlsx", {"Results": RESULTS, "S0": [HEADER, *indent(0)]})
    assert read_recording(path).source == read_recording(path, part="S0").source
    alone = workbook(tmp_path / "b.xlsx", {"S0": [HEADER, *indent(0)]})
    assert read_recording(alone).source == read_recording(alone, part=1).source


def three_cycles(folder: Path) -> Path:
    rows = [row for number in range(3) for row in indent(number)]
    return text_file(folder / "a.csv", [HEADER, *([0.01 * k, *row[1:]] for k, row in enumerate(rows))])


def test_cycles_are_listed_by_show_and_chosen_by_their_number(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = three_cycles(tmp_path)
    assert main(["show", str(path)]) == 0
    text = " ".join(capsys.readouterr().out.split())
    assert "cycle 1 (rows 0 to 40) to cycle 3 (rows 81 to 119)" in text
    whole, second = read_recording(path), read_recording(path, part="cycle 2")
    np.testing.assert_array_equal(second.position, whole.position[41:81])
    np.testing.assert_array_equal(second.force, whole.force[41:81])
    assert second.source.files == (f"{path}, cycle 2",)
    assert second.notes[-1] == "cycle 2 of 3"
    np.testing.assert_array_equal(
        read_recording(path, part=["cycle 1", "cycle 3"]).force, np.delete(whole.force, np.s_[41:81])
    )


def test_a_cycle_that_a_recording_does_not_have_is_refused_with_their_number(tmp_path: Path) -> None:
    path = three_cycles(tmp_path)
    assert refusal(path, part="cycle 4") == "a.csv: there is no cycle 4; the recording has 3"
    assert refusal(path, part="cycle 0") == "a.csv: there is no cycle 0; the recording has 3"


def test_a_cycle_of_a_specimen_is_chosen_by_both_names_and_a_specimen_named_cycle_by_its_name(
    tmp_path: Path,
) -> None:
    path = workbook(
        tmp_path / "a.xlsx",
        {"S": [HEADER, *indent(0), *indent(1)], "cycle 1": [HEADER, *indent(2), *indent(3), *indent(4)]},
    )
    both = read_recording(path, part=["S", "cycle 2"])
    np.testing.assert_array_equal(both.force, read_recording(path, part="S").force[41:])
    assert len(read_recording(path, part="cycle 1")) == 120


# ------------------------------------------------------------------------------------------------ no header


@pytest.mark.parametrize("suffix", sampled(ALL, ".csv", ".xlsx"))
def test_a_table_without_a_header_is_refused_with_the_option_that_names_its_columns(
    tmp_path: Path, suffix: str, capsys: pytest.CaptureFixture[str]
) -> None:
    above: Rows = [["Operator", "me"], ["Rate", "10 mm/min"]]
    path = any_file(tmp_path / f"a{suffix}", [*above, [], *indent(0), *indent(1)])
    sentence = refusal(path)
    assert sentence.endswith("add: --columns time_s,position_mm,force_N")
    found = follow(path, sentence, capsys)
    assert_same_rows(found, clean(tmp_path, indent(0), indent(1)))
    assert "the column names are stated" in found.notes[0]


@pytest.mark.parametrize("suffix", sampled(ALL, ".csv", ".xls"))
def test_blocks_without_a_header_are_strokes_of_one_recording(tmp_path: Path, suffix: str) -> None:
    path = any_file(tmp_path / f"a{suffix}", [*indent(0), [], *indent(1)])
    columns = ["time_s", "position_mm", "force_N"]
    assert_same_rows(read_recording(path, columns=columns), clean(tmp_path, indent(0), indent(1)))
    assert_same_rows(read_recording(path, columns=columns, part=2), clean(tmp_path, indent(1)))


@pytest.mark.parametrize("suffix", sampled(ALL, ".csv", ".ods"))
def test_another_number_of_names_than_columns_is_refused(tmp_path: Path, suffix: str) -> None:
    path = any_file(tmp_path / f"a{suffix}", indent(0))
    found = refusal(path, columns=["position_mm", "force_N"])
    assert found == f"{path.name} has 3 columns, but --columns names 2"

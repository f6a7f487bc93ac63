# SPDX-License-Identifier: Apache-2.0
"""Every row of a file that is read part by part is used once, or left out and counted."""

import json
import re
import subprocess
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import palpate
from palpate.cli.main import main
from palpate.errors import InputError
from palpate.recording.reading import LongRecording, open_long_recording

BLOCK = 400
"""Rows of a block in these tests."""

SIZES = {"half": 200, "one": 400, "one-and-a-row": 401, "two": 800, "two-and-a-half": 1000, "five": 2000}


@pytest.fixture(autouse=True)
def _small_blocks(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("palpate.recording.reading.BLOCK_ROWS", BLOCK)


def rows(n: int) -> pd.DataFrame:
    """A spring with hysteresis, pressed and released; every force differs."""
    phase = 2.0 * np.pi * np.arange(n) / 97.0
    press = np.sin(phase) >= 0.0
    x = 0.3 - 0.3 * np.cos(phase)
    y = 2.0 * x + np.where(press, 0.05, -0.05) + 1e-9 * np.arange(n)
    return pd.DataFrame({"position_rad": x, "torque_Nm": y, "direction": np.where(press, "press", "release")})


def written(frame: pd.DataFrame, file: Path) -> Path:
    if file.suffix == ".csv":
        frame.to_csv(file, index=False)
    else:
        frame.to_parquet(file, row_group_size=300)
    return file


def read(recording: LongRecording) -> tuple[np.ndarray, np.ndarray]:
    blocks = [block for part in recording.parts for block in recording.blocks(part)]
    return (
        np.concatenate([block.position for block in blocks]),
        np.concatenate([block.force for block in blocks]),
    )


@pytest.mark.parametrize("suffix", ["csv", "parquet"])
@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("columns", ["numbers", "text", "direction"])
def test_every_row_is_used_once(tmp_path: Path, suffix: str, size: str, columns: str) -> None:
    n = SIZES[size]
    frame = rows(n)
    if columns == "numbers":
        frame = frame.drop(columns="direction")
    if columns == "text":
        frame["direction"] = [f"note {k}" for k in range(n)]
        frame = frame.rename(columns={"direction": "note"})
    file = written(frame, tmp_path / f"press.{suffix}")
    position, force = read(open_long_recording(file))
    assert np.array_equal(position, frame.position_rad)
    assert np.array_equal(force, frame.torque_Nm)
    assert palpate.identify_files(file, max_wavelets=1).data.rows == n


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("part_rows", [150, 1_000_000], ids=["parts", "one-part"])
def test_every_row_is_used_once_where_text_appears_late(tmp_path: Path, size: str, part_rows: int) -> None:
    n = SIZES[size]
    frame = rows(n).astype({"torque_Nm": object})
    bad = [n - 1, n // 2]
    frame.loc[bad, "torque_Nm"] = ["none", ""]
    file = written(frame, tmp_path / "press.csv")
    position, _ = read(open_long_recording(file, invalid="drop", part_rows=part_rows))
    assert np.array_equal(position, frame.position_rad.drop(bad))
    model = palpate.identify_files(file, invalid="drop", part_rows=part_rows, max_wavelets=1)
    assert model.data.rows == n - 2
    note = f"dropped 2 rows without a finite number in torque_Nm (first: line {n // 2 + 2})"
    assert model.notes["identification"][0] == note


def test_dropped_rows_are_reported_by_the_command(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    frame = rows(1000)
    frame.loc[[10, 990], "torque_Nm"] = np.nan
    frame.loc[500, "direction"] = ""
    file = written(frame, tmp_path / "press.csv")
    command = ["identify", str(file), "-o", str(tmp_path / "m.json"), "--out-of-core", "--invalid", "drop"]
    assert main(command) == 0
    told = capsys.readouterr().err
    assert "read 997 rows;" in told
    assert "dropped 2 rows without a finite number in torque_Nm (first: line 12)" in told
    assert "dropped 1 row without a direction in direction (first: line 502)" in told


@pytest.mark.parametrize("part_rows", [20, 90, 333, 1_000_000])
@pytest.mark.parametrize("separator", [",", ";", "\t"], ids=["comma", "semicolon", "tab"])
def test_line_breaks_in_quotes_and_blank_lines_lose_no_row(
    tmp_path: Path, part_rows: int, separator: str
) -> None:
    lines = [separator.join(["depth_mm", "note", "force_N"])]
    notes = ['"a\nb"', '"say ""x""\n\n, ; \ny"', '5" pipe', "plain", '""', '"a,b;c"']
    for k in range(1000):
        note = notes[k % len(notes)]
        lines.append(separator.join([str(k), note if separator not in note else notes[0], str(2 * k)]))
        if k % 7 == 0:
            lines.append(["", "  ", "\r"][k % 3])
    file = tmp_path / "press.csv"
    file.write_bytes(("\n".join(lines) + "\n").encode())
    recording = open_long_recording(file, part_rows=part_rows)
    assert recording.rows == 1000
    position, force = read(recording)
    assert np.array_equal(force, 2.0 * np.arange(1000))
    assert np.allclose(position, 1e-3 * np.arange(1000), rtol=1e-14)
    assert len(palpate.read_recording(file)) == 1000


def test_a_bad_row_after_quoted_line_breaks_is_named_with_its_line(tmp_path: Path) -> None:
    lines = ["depth_mm,note,force_N", *(f'{k},"a\nb",{2 * k}' for k in range(100)), "1,x,nan"]
    file = tmp_path / "press.csv"
    file.write_text("\n".join(lines), encoding="utf-8")
    with pytest.raises(InputError, match=r"press.csv, line 202: column force_N holds 'nan'"):
        palpate.identify_files(file, part_rows=30)


@pytest.mark.parametrize("row", [0, 350, 700, 999])
def test_a_row_with_too_many_cells_is_refused(tmp_path: Path, row: int) -> None:
    lines = [f"{k},{2 * k},press" for k in range(1000)]
    lines[row] = f"{row},5,{2 * row},press"
    file = tmp_path / "press.csv"
    file.write_text("\n".join(["depth_mm,force_N,direction", *lines]), encoding="utf-8")
    with pytest.raises(InputError, match=rf"line {row + 2}: 4 cells, but the header names 3 columns"):
        palpate.identify_files(file, part_rows=350)


def test_a_file_that_loses_a_row_while_it_is_read_is_refused(tmp_path: Path) -> None:
    file = written(rows(1000), tmp_path / "press.csv")

    def blank_the_last_row(done: int, total: int) -> None:
        if done == 1:
            text = file.read_text(encoding="utf-8").rstrip("\n")
            kept, _, last = text.rpartition("\n")
            file.write_text(f"{kept}\n{' ' * len(last)}\n", encoding="utf-8")

    with pytest.raises(InputError, match=r"has 1000 rows, but 999 were used and 0 left out"):
        palpate.identify_files(file, part_rows=300, progress=blank_the_last_row)


def test_rows_whose_force_was_not_the_models_are_left_out_and_counted(tmp_path: Path) -> None:
    frame = rows(1000)
    frame["status"] = "Ok"
    frame.loc[:20, "status"] = "Starting"
    frame.loc[:20, "torque_Nm"] = 100.0
    file = tmp_path / "press.csv"
    layout = {"position": "position_rad", "force": "torque_Nm", "direction": "direction", "status": "status"}
    file.write_text(
        f"# palpate-columns: {json.dumps(layout)}\n" + frame.to_csv(index=False), encoding="utf-8"
    )
    model = palpate.identify_files(file)
    assert model.data.rows == 979
    assert model.fit.nrmse < 1e-3
    assert model.notes["identification"][0] == (
        "21 rows whose force was not the model's alone are left out (21 Starting)"
    )


def test_numbered_segments_are_no_direction(tmp_path: Path) -> None:
    frame = rows(1000).drop(columns="direction")
    frame["segment"] = np.arange(1000) // 500
    for suffix in ("csv", "parquet"):
        recording = open_long_recording(written(frame, tmp_path / f"press.{suffix}"))
        assert recording.direction is None


@pytest.mark.parametrize("suffix", ["csv", "parquet"])
def test_hysteresis_is_tried_without_a_direction(tmp_path: Path, suffix: str) -> None:
    stated = written(rows(4000), tmp_path / f"stated.{suffix}")
    silent = written(rows(4000).drop(columns="direction"), tmp_path / f"silent.{suffix}")
    expected, model = palpate.identify_files(stated), palpate.identify_files(silent)
    assert model.fit.model_class == expected.fit.model_class == "hysteresis"
    assert model.fit.nrmse < 0.02
    assert "direction is taken from the order of rows, block by block" in model.notes["identification"]
    x = np.linspace(0.05, 0.55, 100)
    for side in (1.0, -1.0):
        sides = np.full(100, side)
        assert model.force(x, direction=sides) == pytest.approx(expected.force(x, direction=sides), abs=5e-3)


def test_rows_in_no_order_give_a_finding_that_hysteresis_was_not_tested(tmp_path: Path) -> None:
    frame = rows(4000).drop(columns="direction").sample(frac=1.0, random_state=1)
    model = palpate.identify_files(written(frame, tmp_path / "press.csv"))
    assert model.verdict.level == "usable"
    assert "hysteresis was not tested" in str(model.verdict)
    assert re.search(r"standard deviation of 0\.0[45]\d* \(\d\.\d% of its range\)", str(model.verdict))
    assert "add a column direction" in str(model.verdict)


def test_a_force_that_falls_with_position_is_reported_part_by_part(tmp_path: Path) -> None:
    frame = rows(1000)
    frame["position_rad"] *= -1.0
    file = written(frame, tmp_path / "press.csv")
    at_once = palpate.read_recording(file).notes[-1]
    assert "the force falls with position over the whole file" in at_once
    model = palpate.identify_files(file, part_rows=300, max_wavelets=1)
    falling = [note for note in model.notes["identification"] if "--negate position" in note]
    assert len(falling) == 1
    assert falling[0][:60] == at_once[:60]


def test_utf_16_is_refused_part_by_part_and_the_command_cures_it(tmp_path: Path) -> None:
    file = tmp_path / "press.csv"
    file.write_text(rows(1000).to_csv(index=False), encoding="utf-16")
    with pytest.raises(InputError, match="cannot be read part by part; convert it: iconv") as refused:
        palpate.identify_files(file)
    command = str(refused.value).split("convert it: ")[1].split(" OLD.csv")[0]
    new = tmp_path / "new.csv"
    new.write_bytes(subprocess.run([*command.split(), str(file)], check=True, capture_output=True).stdout)
    assert palpate.identify_files(new).data.rows == 1000


@pytest.mark.parametrize("decimal", [".", ","])
def test_other_dialects_are_read_part_by_part(tmp_path: Path, decimal: str) -> None:
    file = tmp_path / "press.csv"
    text = rows(2000).to_csv(index=False, sep=";", decimal=decimal)
    header, body = text.split("\n", 1)
    file.write_bytes(
        f"Prüfung 7;\nStoff: Gummi;\n{header};µ\n".encode("latin-1") + body.replace("\n", ";1\n").encode()
    )
    recording = open_long_recording(file, part_rows=300)
    position, force = read(recording)
    assert np.array_equal(position, rows(2000).position_rad)
    assert np.array_equal(force, rows(2000).torque_Nm)
    model = palpate.identify_files(file, part_rows=300, max_wavelets=1)
    form = "read as: Latin-1, separated by semicolons, "
    assert form in model.notes["identification"][0]

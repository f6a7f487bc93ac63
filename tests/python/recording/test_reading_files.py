# SPDX-License-Identifier: Apache-2.0
"""Recordings that are still being written, recordings that were cut off, and Parquet files."""

import importlib
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from palpate import read_recording
from small_files import HEADER, Write, refusal, rows


@pytest.mark.parametrize("torn", ["6,12", "6,120,pre", "6,120,press", "6,1e", "6", ","])
def test_a_torn_last_line_of_a_growing_file_is_left_out(csv_file: Write, torn: str) -> None:
    text = "\n".join([HEADER, *rows(12), torn])
    recording = read_recording(csv_file(text, name="press.csv.part"))
    assert len(recording) == 12
    assert "1 torn line at the end is left out" in recording.notes


def test_a_growing_file_that_ends_with_a_line_feed_keeps_every_row(csv_file: Write) -> None:
    recording = read_recording(csv_file(HEADER, rows(12), name="press.csv.part"))
    assert len(recording) == 12
    assert not any("torn" in note for note in recording.notes)


def test_a_growing_file_of_one_torn_line_is_refused(csv_file: Write) -> None:
    assert "has no header" in refusal(csv_file("depth_mm,for", name="press.csv.part"))


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


def test_a_file_that_is_not_parquet_is_refused(tmp_path: Path) -> None:
    pytest.importorskip("pyarrow")
    path = tmp_path / "a.parquet"
    path.write_text("depth_mm,force_N\n", encoding="utf-8")
    assert refusal(path).startswith("a.parquet is not readable as Parquet: ")
    assert refusal(parquet(tmp_path / "b.parquet", depth_mm=[1.0])).startswith(
        "b.parquet: there is one column"
    )


def test_parquet_without_pyarrow_is_refused_with_the_install_command(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "a.parquet"
    path.write_bytes(b"PAR1")

    def missing(name: str) -> object:
        raise ImportError(name)

    reader = importlib.import_module("palpate.recording.memory_table")
    monkeypatch.setattr(reader, "import_module", missing)
    assert refusal(path) == (
        "a.parquet is Parquet, which needs pyarrow: install it with pip install 'palpate[parquet]'"
    )

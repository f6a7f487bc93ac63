# SPDX-License-Identifier: Apache-2.0
"""Workbooks, NumPy, MATLAB and MCAP files are read like CSV, and refusals name broken Parquet files."""

import importlib
import json
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from scipy.io import savemat
from scipy.sparse import csc_array

import palpate
from palpate import read_recording
from small_files import options_in, refusal

ROW_NUMBERS = np.arange(30)
X, F = ROW_NUMBERS / 3, np.sin(ROW_NUMBERS / 9) + 2.0


def check(path: Path, note: str = "", **options: Any) -> None:
    recording = read_recording(path, **options)
    np.testing.assert_allclose(recording.position, 1e-3 * X, rtol=1e-12)
    np.testing.assert_allclose(recording.force, F, rtol=1e-12)
    assert recording.units == {"position": "m", "force": "N"}
    assert note in recording.notes[0]


def workbook(path: Path, *sheets: tuple[str, list[list[Any]]]) -> Path:
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.Workbook()
    book.remove(book.active)
    for title, cells in sheets:
        sheet = book.create_sheet(title)
        for row in cells:
            sheet.append(row)
    book.save(path)
    return path


def numbers() -> list[list[Any]]:
    return [[float(x), float(f)] for x, f in zip(X, F, strict=True)]


def test_an_excel_sheet_is_read(tmp_path: Path) -> None:
    plain = workbook(tmp_path / "a.xlsx", ("Data", [["Depth (mm)", "Force [N]"], *numbers()]))
    check(plain)
    preamble = [["Machine", "INSTRON"], ["Speed: 10 mm/min"], [], ["Depth", "Force"], ["mm", "N"], *numbers()]
    path = workbook(tmp_path / "b.xlsx", ("Empty", []), ("Data", preamble), ("More", [["x"]]))
    check(path, "read as: sheet Data, 2 rows before the header, units in a second header row")
    assert read_recording(path).metadata == {"Machine": "INSTRON", "Speed": "10 mm/min"}


def test_an_excel_row_without_a_number_is_named(tmp_path: Path) -> None:
    cells = [["Depth (mm)", "Force [N]"], *numbers()]
    cells[5][1] = None
    path = workbook(tmp_path / "a.xlsx", ("Data", cells))
    assert refusal(path).startswith("a.xlsx, row 6: column Force [N] holds nothing")
    assert len(read_recording(path, invalid="drop")) == 29
    cells[5][1] = "broken"
    path = workbook(tmp_path / "b.xlsx", ("Data", cells))
    assert refusal(path).startswith("b.xlsx, row 6: column Force [N] holds 'broken'")


def test_numbers_as_text_in_excel_are_read_with_their_decimal_mark(tmp_path: Path) -> None:
    cells = [["Depth (mm)", "Force [N]"], *([str(c).replace(".", ",") for c in row] for row in numbers())]
    check(workbook(tmp_path / "a.xlsx", ("Data", cells)))


def test_numpy_arrays_are_read(tmp_path: Path) -> None:
    np.savez(tmp_path / "a.npz", depth_mm=X, force_N=F, direction=np.array(["press"] * 30), rate_Hz=100.0)
    check(tmp_path / "a.npz")
    recording = read_recording(tmp_path / "a.npz")
    assert recording.direction is not None
    assert recording.metadata == {"rate_Hz": "100.0"}
    np.savez(tmp_path / "b.npz", x=X, y=F, image=np.ones((3, 4)))
    sentence = refusal(tmp_path / "b.npz")
    check(tmp_path / "b.npz", "left out image, not vectors of 30 values", **options_in(sentence))
    np.savez(tmp_path / "c.npz", depth_mm=np.where(ROW_NUMBERS == 4, np.nan, X), force_N=F)
    assert refusal(tmp_path / "c.npz").startswith("c.npz, row 4: column depth_mm holds nothing")


def test_numpy_objects_are_not_unpickled(tmp_path: Path) -> None:
    np.savez(tmp_path / "a.npz", depth_mm=np.array([{}] * 30, dtype=object), force_N=F)
    assert refusal(tmp_path / "a.npz").startswith("a.npz is not readable as NumPy (.npz): ")


def test_matlab_vectors_are_read(tmp_path: Path) -> None:
    savemat(tmp_path / "a.mat", {"depth_mm": X[:, None], "force_N": F[None, :], "rate": 100.0})
    check(tmp_path / "a.mat")
    savemat(tmp_path / "b.mat", {"rec": {"depth_mm": X, "force_N": F, "operator": "me"}})
    check(tmp_path / "b.mat")


def test_matlab_7_3_is_refused_with_the_cure(tmp_path: Path) -> None:
    head = b"MATLAB 7.3 MAT-file, Platform: GLNXA64, Created on: Mon Jan  1 00:00:00 2024 HDF5 schema 1.00 ."
    (tmp_path / "a.mat").write_bytes(head.ljust(124) + b"\x00\x02IM" + bytes(600))
    assert refusal(tmp_path / "a.mat").endswith("save it in MATLAB as version 7: save('NEW.mat', '-v7')")


def test_matlab_files_of_all_kinds_are_read(tmp_path: Path) -> None:
    more = {
        "text": "é",
        "z": 1j * X,
        "cells": np.array(["a", 1, X], dtype=object),
        "nothing": np.empty((0, 0)),
        "table": {"x": X, "words": ["ab", "cde"]},
        "sparse": csc_array(np.eye(3)),
    }
    for compressed in (False, True):
        path = tmp_path / f"{compressed}.mat"
        savemat(path, {"depth_mm": X, "force_N": F, **more}, do_compression=compressed)
        check(path)
    savemat(tmp_path / "four.mat", {"depth_mm": X, "force_N": F}, format="4")
    check(tmp_path / "four.mat")


def mcap(path: Path, topics: dict[str, list[dict[str, Any]]], encoding: str = "json") -> Path:
    writer_module = pytest.importorskip("mcap.writer")
    with path.open("wb") as stream:
        writer = writer_module.Writer(stream)
        writer.start()
        schema = writer.register_schema(name="sample", encoding="jsonschema", data=b'{"type": "object"}')
        for topic, messages in topics.items():
            channel = writer.register_channel(topic=topic, message_encoding=encoding, schema_id=schema)
            for k, message in enumerate(messages):
                when = 10**18 + k * 1_000_000
                data = json.dumps(message).encode()
                writer.add_message(channel_id=channel, log_time=when, publish_time=when, data=data)
        writer.finish()
    return path


def test_mcap_messages_are_read(tmp_path: Path) -> None:
    messages = [
        {"probe": {"depth_mm": float(x)}, "force_N": float(f), "ok": True} for x, f in zip(X, F, strict=True)
    ]
    path = mcap(tmp_path / "a.mcap", {"/press": messages, "/log": [{"text": "start"}]})
    check(path, "read as: topic /press, other topics are left out")
    recording = read_recording(path)
    assert recording.time is not None
    np.testing.assert_allclose(np.diff(recording.time), 1e-3, rtol=1e-6)
    two = {"/pose": [{"depth_mm": 1.0, "n": 1}], "/wrench": [{"force_N": 1.0, "n": 1}]}
    assert "2 topics hold two values or more (/pose, /wrench)" in refusal(mcap(tmp_path / "b.mcap", two))
    binary_messages = mcap(tmp_path / "c.mcap", {"/pose": [{}]}, encoding="cdr")
    assert refusal(binary_messages).startswith(
        "c.mcap holds only messages in cdr; it must hold JSON messages"
    )


WRITERS = {
    "xlsx": lambda path: workbook(path, ("Data", [["Depth (mm)", "Force [N]"], *numbers()])),
    "npz": lambda path: np.savez(path, depth_mm=X, force_N=F),
    "mat": lambda path: savemat(path, {"depth_mm": X, "force_N": F}),
    "mcap": lambda path: mcap(path, {"/p": [{"depth_mm": x, "force_N": f} for x, f in numbers()]}),
    "parquet": lambda path: pd.DataFrame({"depth_mm": X, "force_N": F}).to_parquet(path),
}


@pytest.mark.parametrize("kind", WRITERS)
def test_a_broken_file_is_refused_by_its_name(tmp_path: Path, kind: str) -> None:
    path = tmp_path / f"a.{kind}"
    WRITERS[kind](path)
    whole = path.read_bytes()
    random = np.random.default_rng(5)
    sentences = []
    for damage in range(60):
        broken = bytearray(whole)
        if damage < 20:
            broken = broken[: len(broken) * damage // 20]
        else:
            for place in random.integers(0, len(broken), 8):
                broken[place] = int(random.integers(0, 256))
        path.write_bytes(bytes(broken))
        try:
            read_recording(path)
        except palpate.InputError as error:
            sentences.append(str(error))
    assert len(sentences) > 15
    for sentence in sentences:
        assert sentence.startswith(str(path))
        assert "\n" not in sentence
        assert len(sentence) < 1000


@pytest.mark.parametrize(
    ("offset", "value", "element"),
    [(5, 0xFF, 128), (8, 200, 136), (17, 0x08, 128), (56, 200, 184), (61, 0xFF, 184)],
    ids=["size_of_array", "type_of_flags", "complex", "type_of_values", "size_of_values"],
)
def test_a_damaged_matlab_file_is_refused_with_the_byte(
    tmp_path: Path, offset: int, value: int, element: int
) -> None:
    path = tmp_path / "a.mat"
    WRITERS["mat"](path)
    broken = bytearray(path.read_bytes())
    broken[128 + offset] = value
    path.write_bytes(bytes(broken))
    expected = f"a.mat is not readable as MATLAB (.mat): the element at byte {element} is damaged"
    assert refusal(path) == expected


@pytest.mark.parametrize(
    ("kind", "module", "sentence"),
    [
        (
            "xlsx",
            "python_calamine",
            "a.xlsx is a workbook, which needs python_calamine: install it with pip install 'palpate[excel]'",
        ),
        (
            "mcap",
            "mcap.records",
            "a.mcap is MCAP, which needs mcap: install it with pip install 'palpate[mcap]'",
        ),
    ],
)
def test_a_missing_library_is_named_with_the_command_that_installs_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, kind: str, module: str, sentence: str
) -> None:
    (tmp_path / f"a.{kind}").write_bytes(b"x")
    real = importlib.import_module

    def missing(name: str) -> Any:
        if name == module:
            raise ImportError(name)
        return real(name)

    monkeypatch.setattr(importlib.import_module("palpate.recording.memory_table"), "import_module", missing)
    assert refusal(tmp_path / f"a.{kind}") == sentence


@pytest.mark.parametrize("kind", ["xlsx", "npz", "mat", "mcap"])
def test_a_format_without_parts_is_refused_out_of_core(tmp_path: Path, kind: str) -> None:
    path = tmp_path / f"a.{kind}"
    WRITERS[kind](path)
    with pytest.raises(palpate.InputError, match="cannot be read part by part; leave out --out-of-core"):
        palpate.identify_files(path)

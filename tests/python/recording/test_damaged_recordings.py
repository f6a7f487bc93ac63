# SPDX-License-Identifier: Apache-2.0
"""Damaged binary recordings are refused or read without a change; no damage crashes the reader."""

import importlib.util
import json
import struct
import sys
import zipfile
import zlib
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from scipy.io import savemat
from scipy.sparse import csc_array

from any_input import SCALE
from conftest import ROOT
from palpate import Recording, read_recording
from small_files import refusal

ROWS = np.arange(400.0)
ARRAYS = {"depth_mm": 0.5 - 0.5 * np.cos(ROWS / 30), "force_N": np.sin(ROWS / 9) + 2.0}


def damaged_recordings() -> ModuleType:
    """Returns the module tests/fuzz/damaged_recordings.py."""
    path = ROOT / "tests" / "fuzz" / "damaged_recordings.py"
    spec = importlib.util.spec_from_file_location(path.stem, path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[path.stem] = module
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def reader() -> Iterator[Any]:
    """Returns a process that reads files, so that a crash does not end the tests."""
    process = damaged_recordings().Reader()
    yield process
    process.stop()


class SharedReader:
    """The reader of this module, which goes on after the campaign: a new one takes a second to start."""

    def __init__(self, reader: Any) -> None:
        self.content = reader.content

    def stop(self) -> None:
        pass


def test_damage_is_refused_or_without_effect(reader: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    module = damaged_recordings()
    if SCALE == 1:
        monkeypatch.setattr(module, "Reader", lambda: SharedReader(reader))
        monkeypatch.setattr(module.os, "cpu_count", lambda: 1)
    assert module.campaign(2 if SCALE == 1 else 15 * SCALE, 1, list(module.KINDS)) == []


# ------------------------------------------------------------------------------------------------ MATLAB


def mat(path: Path, *, compressed: bool = True, **arrays: Any) -> Path:
    savemat(path, {**ARRAYS, **arrays}, do_compression=compressed)
    return path


def with_content(path: Path, change: Any) -> Path:
    """Changes the content of the last compressed element; its checksum is correct."""
    data, offset = path.read_bytes(), 128
    while True:
        (size,) = struct.unpack_from("<I", data, offset + 4)
        if offset + 8 + size == len(data):
            break
        offset += 8 + size
    content = bytearray(zlib.decompress(data[offset + 8 :]))
    change(content)
    packed = zlib.compress(bytes(content))
    path.write_bytes(data[:offset] + struct.pack("<II", 15, len(packed)) + packed)
    return path


@pytest.mark.parametrize(
    ("array", "offset", "value"),
    [
        (ROWS, 64, 0x80),
        (ROWS, 64, 14),
        (ROWS, 44, 0x18),
        ("word", 64, 15),
        (np.array(["a", "b"], dtype=object), 108, 8),
        (np.array(["a", "b"], dtype=object), 36, 3),
        ({"a": 1.0}, 36, 9),
        (csc_array(np.eye(3)), 64, 0x80),
    ],
    ids=["type", "array", "name", "text", "cell", "cells", "structures", "sparse"],
)
def test_a_damaged_compressed_matlab_element_is_refused(
    reader: Any, tmp_path: Path, array: Any, offset: int, value: int
) -> None:
    path = mat(tmp_path / "a.mat", last_array=array)
    assert "rows" in reader.content(path)

    def change(content: bytearray) -> None:
        content[offset] = value

    found = reader.content(with_content(path, change))
    assert "is damaged" in found.get("refused", str(found))


def test_a_changed_bit_of_a_compressed_matlab_element_is_refused(tmp_path: Path) -> None:
    path = mat(tmp_path / "a.mat")
    whole = path.read_bytes()
    for place in range(136, len(whole), 97):
        changed = bytearray(whole)
        changed[place] ^= 1
        path.write_bytes(changed)
        assert refusal(path).startswith("a.mat is not readable as MATLAB (.mat): the element at byte ")


def test_a_matlab_array_without_dimensions_is_refused(reader: Any, tmp_path: Path) -> None:
    path = mat(tmp_path / "a.mat", compressed=False, last="word")
    changed = bytearray(path.read_bytes())
    place = changed.rindex(struct.pack("<II", 5, 8)) + 4
    changed[place] = 0
    path.write_bytes(changed)
    found = reader.content(path)
    assert "is damaged" in found.get("refused", str(found))


def test_a_matlab_file_of_an_unknown_minor_version_is_examined(reader: Any, tmp_path: Path) -> None:
    path = mat(tmp_path / "a.mat", compressed=False)
    changed = bytearray(path.read_bytes())
    changed[124] = 0x40
    changed[128 + 56] = 0x80
    path.write_bytes(changed)
    found = reader.content(path)
    assert "is damaged" in found.get("refused", str(found))


def test_sparse_arrays_and_structures_are_left_out(tmp_path: Path) -> None:
    nested = {"probe": {"name": "p", "sizes": [1, 2]}, "rate": 5.0}
    path = mat(tmp_path / "a.mat", sparse=csc_array(np.eye(3)), info=nested)
    recording = read_recording(path)
    assert recording.metadata == {"rate": "5.0"}
    assert "left out sparse, probe, not vectors of 400 values" in recording.notes[0]


def test_empty_cells_of_a_matlab_array_are_empty_words(tmp_path: Path) -> None:
    words = np.array(["", "press"] * 200, dtype=object)
    recording = read_recording(mat(tmp_path / "a.mat", words=words))
    assert recording.columns["words"][:2].tolist() == ["", "press"]


def test_a_matlab_element_that_states_more_than_the_memory_is_refused(tmp_path: Path) -> None:
    path = with_content(
        mat(tmp_path / "a.mat"), lambda content: struct.pack_into("<I", content, 4, 0xFFFFFFF0)
    )
    assert refusal(path).startswith("a.mat needs at least 8 GiB of memory, and the limit is 4 GiB; ")


# ----------------------------------------------------------------------------------------------- archives


def npz(path: Path) -> Path:
    np.savez_compressed(path, **ARRAYS, **{"temperature_°C": ROWS})
    return path


def test_an_archive_with_a_lost_member_is_refused(tmp_path: Path) -> None:
    path = npz(tmp_path / "a.npz")
    changed = bytearray(path.read_bytes())
    second = changed.rindex(b"PK\1\2", 0, changed.rindex(b"PK\1\2"))
    changed[second + 33] = 0x80  # the comment of this entry contains the next entry
    path.write_bytes(changed)
    assert list(np.load(path)) == ["depth_mm", "force_N"]
    assert refusal(path) == "a.npz is not readable as NumPy (.npz): its directory names 2 of 3 members"


def test_a_damaged_end_of_a_sheet_is_refused(tmp_path: Path) -> None:
    openpyxl = pytest.importorskip("openpyxl")
    book, path = openpyxl.Workbook(), tmp_path / "a.xlsx"
    for row in [list(ARRAYS), *zip(*(cells.tolist() for cells in ARRAYS.values()), strict=True)]:
        book.active.append(row)
    book.save(path)
    with zipfile.ZipFile(path) as archive:
        parts = {info: archive.read(info) for info in archive.infolist()}
    # A stored member with a wrong checksum in the part of the sheet behind its rows.
    with zipfile.ZipFile(path, "w") as archive:
        for info, data in parts.items():
            archive.writestr(info.filename, data, zipfile.ZIP_STORED)
    changed = bytearray(path.read_bytes())
    place = changed.index(b"<pageMargins") + 3
    changed[place] ^= 1
    path.write_bytes(changed)
    sentence = "Bad CRC-32 for file 'xl/worksheets/sheet1.xml'"
    assert refusal(path) == f"a.xlsx is not readable as a workbook: {sentence}"


@pytest.mark.parametrize("suffix", ["npz", "xlsx"])
def test_an_archive_that_states_more_than_the_memory_is_refused(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"a.{suffix}"
    with zipfile.ZipFile(path, "w") as archive:
        for name in ("depth_mm.npy", "force_N.npy"):
            archive.writestr(name, b"0")
            archive.getinfo(name).file_size = 3 << 30
    assert refusal(path).startswith(f"a.{suffix} needs at least 6 GiB of memory, and the limit is 4 GiB; ")


# -------------------------------------------------------------------------------------------------- MCAP


def recording() -> Recording:
    arrays = ARRAYS["depth_mm"], ARRAYS["force_N"], 1e-3 * ROWS
    return Recording.from_arrays(
        *arrays, units={"position": "m", "force": "N"}, metadata={"object": "spring"}
    )


def foreign_mcap(path: Path, **options: Any) -> Path:
    writer_module = pytest.importorskip("mcap.writer")
    with path.open("wb") as stream:
        writer = writer_module.Writer(stream, chunk_size=4096, **options)
        writer.start()
        channel = writer.register_channel("/r", "json", writer.register_schema("r", "jsonschema", b"{}"))
        for row in range(len(ROWS)):
            data = json.dumps({name: cells[row] for name, cells in ARRAYS.items()}).encode()
            writer.add_message(channel, row, data, row)
        writer.finish()
    return path


def records_of(path: Path) -> list[Any]:
    stream_reader = pytest.importorskip("mcap.stream_reader")
    with path.open("rb") as stream:
        return list(stream_reader.StreamReader(stream, emit_chunks=True).records)


def test_each_part_of_an_mcap_file_of_palpate_has_a_checksum(tmp_path: Path) -> None:
    pytest.importorskip("mcap")
    found = {type(each).__name__: each for each in records_of(recording().write(tmp_path / "a.mcap"))}
    assert found["Chunk"].uncompressed_crc != 0
    assert found["DataEnd"].data_section_crc != 0
    assert found["Footer"].summary_crc != 0


def test_each_changed_byte_of_an_mcap_file_of_palpate_is_refused(tmp_path: Path) -> None:
    pytest.importorskip("mcap")
    path = recording().write(tmp_path / "a.mcap")
    whole = path.read_bytes()
    between, at_the_end = (401, 1) if SCALE > 1 else (2003, 3)
    for place in (*range(0, len(whole), between), *range(len(whole) - 60, len(whole), at_the_end)):
        changed = bytearray(whole)
        changed[place] ^= 1 << (place % 8)
        path.write_bytes(changed)
        assert refusal(path).startswith("a.mcap is not readable as MCAP: ")


def test_a_lost_chunk_of_a_foreign_mcap_file_is_refused(tmp_path: Path) -> None:
    path = foreign_mcap(tmp_path / "a.mcap")
    assert len(read_recording(path)) == 400
    content = path.read_bytes()
    chunk = content.index(b"zstd", content.index(b"zstd") + 1) - 9 - 32
    assert content[chunk] == 6
    path.write_bytes(content[:chunk] + b"\x7f" + content[chunk + 1 :])  # a type of record that is skipped
    assert refusal(path).endswith(" of 400 messages")


def test_an_mcap_chunk_is_not_longer_than_it_states(tmp_path: Path) -> None:
    stream_reader = pytest.importorskip("mcap.stream_reader")
    builder_module = pytest.importorskip("mcap.data_stream")
    for name in ("zstd", "lz4", ""):
        for size, sentence in (
            (100, "a chunk does not have 100 bytes"),
            (1 << 30, "needs at least 25 GiB of memory"),
        ):
            builder = builder_module.RecordBuilder()
            for record in records_of(compressed_as(foreign_mcap, tmp_path / "a.mcap", name)):
                if isinstance(record, stream_reader.Chunk):
                    record = replace(record, uncompressed_size=size)
                record.write(builder)
            magic = b"\x89MCAP0\r\n"
            (tmp_path / "a.mcap").write_bytes(magic + builder.end() + magic)
            assert sentence in refusal(tmp_path / "a.mcap")


def compressed_as(write: Any, path: Path, name: str) -> Path:
    kinds = pytest.importorskip("mcap.writer").CompressionType
    compression = {"zstd": kinds.ZSTD, "lz4": kinds.LZ4, "": kinds.NONE}[name]
    return Path(write(path, compression=compression))


# ----------------------------------------------------------------------------------------------- Parquet


def parquet(path: Path, columns: dict[str, Any] | None = None, **options: Any) -> Path:
    pa, pq = pytest.importorskip("pyarrow"), pytest.importorskip("pyarrow.parquet")
    table = pa.table(columns or ARRAYS).replace_schema_metadata({"object": "spring"})
    pq.write_table(table, path, write_page_checksum=True, **options)
    return path


def changed_at(path: Path, text: bytes, change: bytes, *, last: bool = True) -> None:
    content = path.read_bytes()
    place = content.rindex(text) if last else content.index(text)
    path.write_bytes(content[:place] + change + content[place + len(change) :])


def test_a_changed_page_of_a_parquet_file_is_refused(tmp_path: Path) -> None:
    path = parquet(tmp_path / "a.parquet", compression="none", use_dictionary=False)
    changed_at(path, struct.pack("<d", ARRAYS["force_N"][7]), struct.pack("<d", 9.0), last=False)
    assert "crc" in refusal(path).lower()


@pytest.mark.parametrize("last", [True, False], ids=["place", "schema"])
def test_a_changed_name_in_a_parquet_footer_is_refused(tmp_path: Path, last: bool) -> None:
    path = parquet(tmp_path / "a.parquet", store_schema=False, row_group_size=100)
    changed_at(path, b"force_N", b"fosce_N", last=last)
    assert refusal(path) == "a.parquet is not readable as Parquet: the footer describes column " + (
        "force_N in two ways" if last else "fosce_N in two ways"
    )


def test_changed_metadata_of_a_parquet_file_are_refused(tmp_path: Path) -> None:
    for text, change in ((b"spring", b"sprinf"), (b"object", b"objecu"), (b"ARROW:schema", b"ARROW:schemb")):
        path = parquet(tmp_path / "a.parquet")
        assert read_recording(path).metadata == {"object": "spring"}
        changed_at(path, text, change)
        assert refusal(path) == "a.parquet is not readable as Parquet: the footer is damaged"


@pytest.mark.parametrize(
    ("text", "change"),
    [(b"\x16\xa0\x06\x19", b"\x16\xa2\x06\x19"), (b"\x19,\x18\x06object", b"\x19\x1c\x18\x06object")],
    ids=["number_of_rows", "number_of_metadata"],
)
def test_a_changed_number_in_a_parquet_footer_is_refused(tmp_path: Path, text: bytes, change: bytes) -> None:
    path = parquet(tmp_path / "a.parquet")
    changed_at(path, text, change)
    assert refusal(path) == "a.parquet is not readable as Parquet: the footer is damaged"


def test_two_parquet_columns_in_one_place_are_refused(tmp_path: Path) -> None:
    path = parquet(tmp_path / "a.parquet", compression="none", use_dictionary=False)
    pq = pytest.importorskip("pyarrow.parquet")
    group = pq.ParquetFile(path).metadata.row_group(0)
    first, second = (2 * group.column(index).data_page_offset for index in range(2))
    number = bytes([0x80 | second & 0x7F, second >> 7])
    changed_at(path, b"&" + number, b"&" + bytes([0x80 | first, 0]))
    sentence = "the footer states one place for two columns"
    assert refusal(path) == f"a.parquet is not readable as Parquet: {sentence}"


def test_metadata_that_a_parquet_footer_hides_are_reported(tmp_path: Path) -> None:
    path = parquet(tmp_path / "a.parquet")
    changed_at(path, b"\x19,\x18\x06object", b"\x59,\x18\x06object")
    found = read_recording(path)
    assert found.metadata == {}
    assert found.notes[0].endswith("read as: the footer names no program, so that metadata may be lost")


def test_a_damaged_description_of_a_parquet_column_does_not_end_the_process(
    reader: Any, tmp_path: Path
) -> None:
    path = parquet(tmp_path / "a.parquet")
    optional, required = b"%\x02\x18\x08depth_mm", b"%\x00\x18\x08depth_mm"
    changed_at(path, optional, required, last=False)
    found = reader.content(path)
    assert "is not readable as Parquet" in found.get("refused", str(found))


def test_a_long_word_in_each_row_of_a_parquet_file_is_stored_once(tmp_path: Path) -> None:
    pa = pytest.importorskip("pyarrow")
    word = "x" * 100_000
    words = pa.DictionaryArray.from_arrays(pa.array([0] * 399 + [None], pa.int32()), [word])
    path = parquet(tmp_path / "a.parquet", {**ARRAYS, "note": words.cast("string")}, compression="zstd")
    cells = read_recording(path).columns["note"]
    assert cells[0] == word
    assert cells[399] == ""
    assert len({id(cell) for cell in cells[:399]}) == 1


def test_columns_that_exceed_the_memory_are_left_out_or_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    words = [f"{row:0>200}" for row in range(400)]
    path = parquet(tmp_path / "a.parquet", {**ARRAYS, "note": words, "status": ["Ok"] * 400})
    assert list(read_recording(path).columns) == ["note", "status"]
    for module in ("files", "formats"):
        monkeypatch.setattr(f"palpate.recording.{module}.MEMORY_LIMIT", 40_000)
    found = read_recording(path)
    assert list(found.columns) == ["status"]
    assert found.notes[0].endswith("; read as: left out note, for which the limit of memory is too low")
    assert refusal(path, direction="note").startswith("a.parquet needs at least ")


def test_text_without_a_type_in_a_parquet_file_is_text(tmp_path: Path) -> None:
    pa = pytest.importorskip("pyarrow")
    words = pa.array([b"press"] * 200 + [None] * 200, pa.binary())
    path = parquet(tmp_path / "a.parquet", {**ARRAYS, "note": words})
    assert read_recording(path).columns["note"][[0, 399]].tolist() == ["press", ""]

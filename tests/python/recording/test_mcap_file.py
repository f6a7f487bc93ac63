# SPDX-License-Identifier: Apache-2.0
"""Recordings are written as MCAP, which the mcap library and palpate read back."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import palpate
from palpate import Recording, read_recording
from palpate.recording.sample import sample_recording

reader_module = pytest.importorskip("mcap.reader")
writer_module = pytest.importorskip("mcap.writer")


def recording(rows: int = 50) -> Recording:
    """Returns a recording with every kind of column."""
    position = np.linspace(0.1, 0.9, rows) ** 3
    force = np.sin(position) / 3.0
    given = Recording.from_arrays(
        position,
        force,
        time=-0.5 + 1e-3 * np.arange(rows),
        direction=np.where(np.arange(rows) < rows // 2, 1, -1),
        inputs={"temperature": np.full(rows, 21.5)},
        units={"position": "rad", "force": "N*m"},
        metadata={"object": 'detent "a: b"'},
    )
    measured = np.where(np.arange(rows) % 3 == 0, np.nan, force)
    words = np.array(["ok" if k % 2 else "" for k in range(rows)], dtype=object)
    digits = np.array([str(k) for k in range(rows)], dtype=object)
    nothing = np.full(rows, np.nan)
    columns = {"measured_Nm": measured, "status": words, "number": digits, "transducer_N": nothing}
    return replace(given, columns=columns)


def messages(path: Path) -> list[tuple[Any, Any, Any]]:
    with path.open("rb") as stream:
        return list(reader_module.make_reader(stream).iter_messages())


def refusal(path: Path) -> str:
    with pytest.raises(palpate.InputError) as info:
        read_recording(path)
    text = str(info.value).replace(str(path.parent) + "/", "")
    assert "\n" not in text
    return text


def test_the_mcap_library_reads_back_rows_names_units_and_times(tmp_path: Path) -> None:
    given = recording()
    path = given.write(tmp_path / "a.mcap")
    found = messages(path)
    assert len(found) == len(given)
    schema, channel, first = found[0]
    assert (schema.encoding, channel.message_encoding) == ("jsonschema", "json")
    content = json.loads(schema.data)
    assert content["type"] == "object"
    names = ["time_s", "position_rad", "force_Nm", "direction", "temperature", *given.columns]
    assert list(content["properties"]) == names
    assert content["properties"]["force_Nm"] == {"type": "number"}
    assert content["properties"]["status"] == {"type": "string"}
    assert first.log_time == 0
    assert [message.log_time for _, _, message in found] == [1_000_000 * k for k in range(len(given))]
    rows = [json.loads(message.data) for _, _, message in found]
    assert [row["position_rad"] for row in rows] == given.position.tolist()
    assert [row["force_Nm"] for row in rows] == given.force.tolist()
    assert [row["time_s"] for row in rows] == given.time.tolist()  # type: ignore[union-attr]
    # JSON has no NaN: the row has no such field.
    assert [("measured_Nm" in row) for row in rows] == np.isfinite(given.columns["measured_Nm"]).tolist()


def test_a_recording_is_read_back_exactly(tmp_path: Path) -> None:
    given = recording()
    found = read_recording(given.write(tmp_path / "a.mcap"))
    for name in ("position", "force", "time", "direction", "inputs"):
        np.testing.assert_array_equal(getattr(found, name), getattr(given, name))
    assert found.input_names == given.input_names
    assert dict(found.units) == dict(given.units)
    assert dict(found.metadata) == dict(given.metadata)
    assert list(found.columns) == list(given.columns)
    for name, cells in given.columns.items():
        np.testing.assert_array_equal(found.columns[name], cells)


def test_a_simulated_rendering_can_be_written_as_mcap(tmp_path: Path) -> None:
    sample = sample_recording(1, 2.0)
    path = sample.write(tmp_path / "sample.MCAP")
    np.testing.assert_array_equal(read_recording(path).force, sample.force)


def test_a_recording_without_time_is_not_written(tmp_path: Path) -> None:
    given = Recording.from_arrays(np.arange(20.0), np.arange(20.0))
    with pytest.raises(palpate.InputError, match="the recording has none; write CSV"):
        given.write(tmp_path / "a.mcap")
    assert not (tmp_path / "a.mcap").exists()


def test_an_existing_file_is_replaced_only_on_request(tmp_path: Path) -> None:
    path = recording().write(tmp_path / "a.mcap")
    with pytest.raises(palpate.InputError, match="exists already"):
        recording().write(path, replace=False)
    recording(30).write(path)
    assert len(read_recording(path)) == 30


def written(path: Path, rows: list[bytes], *, encoding: str = "json", schema: str = "jsonschema") -> Path:
    """Writes an MCAP file with messages and schema that palpate did not write."""
    with path.open("wb") as stream:
        writer = writer_module.Writer(stream)
        writer.start()
        schema_id = writer.register_schema("other", schema, b"message Other {}")
        channel = writer.register_channel("/other", encoding, schema_id)
        for k, data in enumerate(rows):
            writer.add_message(channel, k, data, k)
        writer.finish()
    return path


def test_an_empty_file_and_one_without_messages_are_refused(tmp_path: Path) -> None:
    (tmp_path / "a.mcap").write_bytes(b"")
    assert refusal(tmp_path / "a.mcap") == "a.mcap is empty"
    assert refusal(written(tmp_path / "b.mcap", [])).startswith("b.mcap holds no messages")


@pytest.mark.parametrize("share", [0.01, 0.3, 0.7, 0.99])
def test_a_truncated_file_is_refused(tmp_path: Path, share: float) -> None:
    path = recording(400).write(tmp_path / "a.mcap")
    content = path.read_bytes()
    path.write_bytes(content[: int(share * len(content))])
    assert refusal(path).startswith("a.mcap is not readable as MCAP: ")


def test_foreign_schemas_and_encodings_are_refused_or_read_by_their_fields(tmp_path: Path) -> None:
    protobuf = written(tmp_path / "a.mcap", [b"\x08\x01"] * 20, encoding="protobuf", schema="protobuf")
    assert refusal(protobuf).startswith("a.mcap holds only messages in protobuf; it must hold JSON messages")
    not_json = written(tmp_path / "b.mcap", [b"{"] * 20)
    assert refusal(not_json).startswith("b.mcap is not readable as MCAP: ")
    rows = [json.dumps({"depth_mm": 0.1 * k, "force_N": k / 3}).encode() for k in range(20)]
    foreign = written(tmp_path / "c.mcap", rows, schema="ros2msg")
    np.testing.assert_array_equal(read_recording(foreign).force, np.arange(20) / 3)


def test_a_damaged_schema_of_palpate_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    with path.open("wb") as stream:
        writer = writer_module.Writer(stream)
        writer.start()
        channel = writer.register_channel("/r", "json", writer.register_schema("r", "jsonschema", b"{}"))
        writer.add_metadata("palpate", {})
        writer.add_message(channel, 0, b'{"a_mm": 1, "b_N": 2}', 0)
        writer.finish()
    assert refusal(path) == "a.mcap is not readable as MCAP: 'properties'"


def test_a_missing_library_is_named_with_the_command(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def missing(name: str) -> Any:
        raise ImportError(name)

    monkeypatch.setattr("palpate.recording.memory_table.import_module", missing)
    with pytest.raises(palpate.InputError, match=r"install it with pip install 'palpate\[mcap\]'"):
        recording().write(tmp_path / "a.mcap")

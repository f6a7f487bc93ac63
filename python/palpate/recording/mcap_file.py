# SPDX-License-Identifier: Apache-2.0
"""MCAP files: one JSON message for each row of a recording, with a JSON schema."""

from __future__ import annotations

import json
import sys
import zlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from .. import _core
from ..errors import InputError, escaped, listed, shortened
from .files import Layout, readable, replacing, require_memory
from .memory_table import MemoryTable, cells_of, import_library
from .table import Cells, Table

TOPIC = "/recording"
"""Topic of the messages in files that palpate writes."""

_METADATA = "palpate"
"""Name of the MCAP metadata record with the metadata of a recording and the roles of its columns."""

_LOG_TIME = "log_time_s"
"""Column of the log times, in seconds after the first message."""

_FOOTER_BYTES, _AFTER_SUMMARY_BYTES = 37, 12
"""Number of bytes of a footer and the bytes that end a file, and of those that no checksum covers."""

_OBJECT_RATIO = 25
"""Largest ratio of the memory of objects to their length in the file: ``{},`` is a dictionary of 72 bytes."""

_PLACE_BYTES = 24
"""Memory of the place of one cell in two lists and in an array [bytes]."""


def write_mcap(
    path: Path, layout: Layout, columns: Mapping[str, Cells], metadata: Mapping[str, str], *, replace: bool
) -> None:
    """Writes columns as JSON messages; without `replace`, an existing file is refused.

    The log time of a message is the time of its row after the first row. A message has no field for a number
    that is not finite, because JSON has no such numbers.

    Raises
    ------
    InputError
        The recording has no time, the library mcap is not installed, the folder does not exist or cannot be
        written, or the file exists and `replace` is False.
    """
    library = import_library("mcap.writer", path, "MCAP", "mcap")
    if "time" not in layout.roles:
        raise InputError(
            f"{path} cannot be written: every MCAP message has a time, but the recording has none; write CSV"
        )
    time = np.asarray(columns[layout.roles["time"]], dtype=np.float64)
    log_times = np.round((time - time[:1]) * 1e9).astype(np.int64).tolist()
    types = {name: "string" if cells.dtype == object else "number" for name, cells in columns.items()}
    schema = {"type": "object", "properties": {name: {"type": word} for name, word in types.items()}}
    rows = zip(*(cells.tolist() for cells in columns.values()), strict=True)
    with replacing(path, replace=replace) as temporary, temporary.open("wb") as stream:
        writer = library.Writer(stream, enable_data_crcs=True)
        writer.start(library=f"palpate {_core.__version__}")
        schema_id = writer.register_schema("palpate.Recording", "jsonschema", json.dumps(schema).encode())
        channel = writer.register_channel(TOPIC, "json", schema_id)
        writer.add_metadata(_METADATA, {**metadata, **layout.record()})
        for sequence, (log_time, row) in enumerate(zip(log_times, rows, strict=True)):
            message = {name: value for name, value in zip(columns, row, strict=True) if _in_json(value)}
            writer.add_message(channel, log_time, json.dumps(message).encode(), log_time, sequence)
        writer.finish()


def _in_json(value: object) -> bool:
    return not isinstance(value, float) or abs(value) < float("inf")


@dataclass
class _Topic:
    """JSON messages of one topic, by field."""

    schema: bytes
    log_times: list[int] = field(default_factory=list)
    cells: dict[str, list[Any]] = field(default_factory=dict)
    """Values of each field; None, or the end of the list, for a message without the field"""

    def add(self, log_time: int, message: Any, path: Path, needed: int) -> int:
        """Appends a message; returns the memory that is needed with its cells [bytes]."""
        row = len(self.log_times)
        self.log_times.append(log_time)
        for name, value in _named_values(message):
            if name not in self.cells:
                self.cells[name] = []
                needed += sys.getsizeof(name)
            cells = self.cells[name]
            missing = row - len(cells)
            needed += _PLACE_BYTES * (missing + 1) + sys.getsizeof(value)
            require_memory(path, needed)
            cells.extend([None] * missing)
            cells[row:] = [value]
        return needed


def read_mcap(path: Path) -> Table:
    """Returns the JSON messages and log times of the only topic of an MCAP file with two values or more.

    Columns, their order and the metadata are exact if palpate wrote the file.

    Raises
    ------
    InputError
        The file is damaged: a checksum or the number of messages is wrong; or no topic can be chosen.
    """
    records = import_library("mcap.records", path, "MCAP", "mcap")
    with readable(path, "MCAP"):
        topics, others, stored = _content_of(path, records)
    if not topics:
        found = f"only messages in {listed(others)}" if others else "no messages"
        raise InputError(
            f"{path} holds {found}; it must hold JSON messages. Convert the messages to JSON or export CSV"
        )
    wide = [name for name, topic in topics.items() if len(topic.cells) > 1]
    if len(wide) != 1:
        raise InputError(
            f"{path}: {len(wide)} topics hold two values or more ({listed(wide or topics)}); one topic must "
            "hold position and force. Write both to one topic or export them as CSV"
        )
    topic = topics[wide[0]]
    # The schema of a file that palpate wrote also states columns without numbers, and which columns are text.
    with readable(path, "MCAP"):
        types = {} if stored is None else _column_types(topic.schema)
    log_times = np.array(topic.log_times)
    order = np.argsort(log_times, kind="stable").tolist()
    seconds = {} if types else {_LOG_TIME: ((log_times - log_times.min()) * 1e-9).tolist()}
    all_cells = {**seconds, **topic.cells}
    columns: dict[str, Cells] = {}
    for name in types or all_cells:
        cells = all_cells.get(name, [])
        values = [cells[row] if row < len(cells) else None for row in order]
        if types.get(name) == "string":
            columns[escaped(name)] = np.array(["" if each is None else each for each in values], dtype=object)
        else:
            columns[escaped(name)] = cells_of(values, ".")
    metadata = {escaped(key): escaped(value) for key, value in (stored or {}).items()}
    notes = [f"topic {shortened(wide[0])}"]
    if len(topics) > 1 or others:
        notes.append("other topics are left out")
    return MemoryTable(path, columns, metadata, notes, ("message", 0))


def _content_of(path: Path, records: Any) -> tuple[dict[str, _Topic], set[str], dict[str, str] | None]:
    """Returns topics with JSON, other encodings, and the metadata of palpate; checks all checksums.

    The checksum of the data section covers everything that is read. Files of other programs often lack it;
    there the checksums of chunks and summary, and the number of messages in the summary, cover the messages.
    """
    from mcap.stream_reader import StreamReader, breakup_chunk

    topics: dict[str, _Topic] = {}
    others: set[str] = set()
    metadata: dict[str, str] | None = None
    schemas: dict[int, bytes] = {}
    channels: dict[int, Any] = {}
    messages, needed, size = 0, 0, path.stat().st_size
    with path.open("rb") as stream:
        reader = StreamReader(stream, emit_chunks=True, validate_crcs=True)
        for record in reader.records:
            inside: list[Any] = [record]
            if isinstance(record, records.Chunk):
                require_memory(path, needed + _OBJECT_RATIO * record.uncompressed_size)
                inside = breakup_chunk(_inflated(record), validate_crc=True)
            for each in inside:
                if isinstance(each, records.Schema):
                    schemas.setdefault(each.id, each.data)
                elif isinstance(each, records.Channel):
                    channels.setdefault(each.id, each)
                elif isinstance(each, records.Message):
                    messages += 1
                    if each.channel_id not in channels:
                        raise ValueError(f"the channel {each.channel_id} of a message is missing")
                    channel = channels[each.channel_id]
                    if channel.message_encoding != "json":
                        others.add(channel.message_encoding)
                        continue
                    require_memory(path, needed + _OBJECT_RATIO * len(each.data))
                    topic = topics.setdefault(channel.topic, _Topic(schemas.get(channel.schema_id, b"")))
                    needed = topic.add(each.log_time, json.loads(each.data), path, needed)
                elif isinstance(each, records.Metadata) and each.name == _METADATA:
                    metadata = each.metadata
                elif isinstance(each, records.Statistics) and each.message_count != messages:
                    raise ValueError(f"it holds {messages} of {each.message_count} messages")
        footer = each  # the last record
        if footer.summary_crc:
            stream.seek(footer.summary_start or size - _FOOTER_BYTES)
            if zlib.crc32(stream.read()[:-_AFTER_SUMMARY_BYTES]) != footer.summary_crc:
                raise ValueError("the checksum of the summary is wrong")
    return topics, others, metadata


def _inflated(chunk: Any) -> Any:
    """Returns a chunk without its compression, after checking that it is not longer than it states."""
    size = chunk.uncompressed_size
    if chunk.compression == "zstd":  # mcap installs both libraries
        zstandard = import_module("zstandard")
        data = zstandard.ZstdDecompressor().stream_reader(chunk.data).read(size + 1)
    elif chunk.compression == "lz4":
        lz4 = import_module("lz4.frame")
        data = lz4.LZ4FrameDecompressor().decompress(chunk.data, max_length=size + 1)
    else:
        data = chunk.data
    if len(data) != size:
        raise ValueError(f"a chunk does not have {size} bytes")
    return replace(chunk, data=data, compression="")


def _column_types(schema: bytes) -> dict[str, str]:
    """Returns the columns in the JSON schema of a file that palpate wrote: name -> "number" or "string"."""
    return {name: part["type"] for name, part in json.loads(schema)["properties"].items()}


def _named_values(value: Any, name: str = "") -> Iterator[tuple[str, Any]]:
    """Yields the numbers and words of a JSON message; a nested field has a name like ``wrench.force_N``."""
    if isinstance(value, dict):
        for key, item in value.items():
            yield from _named_values(item, f"{name}.{key}" if name else str(key))
    elif isinstance(value, list):
        for index, item in enumerate(value):
            yield from _named_values(item, f"{name}.{index}")
    elif isinstance(value, (int, float, str)) and not isinstance(value, bool):
        yield name or "value", value

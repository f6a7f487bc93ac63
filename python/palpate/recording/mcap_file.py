# SPDX-License-Identifier: Apache-2.0
"""MCAP files: one JSON message for each row of a recording, with a JSON schema."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from .. import _core
from ..errors import InputError, escaped, listed, shortened
from .files import Layout, readable, replacing
from .memory_table import MemoryTable, cells_of, import_library
from .table import Cells, Table

TOPIC = "/recording"
"""Topic of the messages in files that palpate writes."""

_METADATA = "palpate"
"""Name of the MCAP metadata record with the metadata of a recording and the roles of its columns."""

_LOG_TIME = "log_time_s"
"""Column of the log times, in seconds after the first message."""


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
        writer = library.Writer(stream)
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


def read_mcap(path: Path) -> Table:
    """Returns the JSON messages and log times of the only topic of an MCAP file with two values or more.

    Columns, their order and the metadata are exact if palpate wrote the file.
    """
    library = import_library("mcap.reader", path, "MCAP", "mcap")
    topics: dict[str, list[dict[str, Any]]] = {}
    others: Counter[str] = Counter()
    schemas: dict[str, Any] = {}
    with readable(path, "MCAP"), path.open("rb") as stream:
        reader = library.make_reader(stream)
        for schema, channel, message in reader.iter_messages():
            if channel.message_encoding != "json":
                others[channel.message_encoding] += 1
                continue
            schemas[channel.topic] = schema
            row = {_LOG_TIME: message.log_time, **dict(_named_values(json.loads(message.data)))}
            topics.setdefault(channel.topic, []).append(row)
        stored = [record.metadata for record in reader.iter_metadata() if record.name == _METADATA]
    if not topics:
        content = f"only messages in {listed(others)}" if others else "no messages"
        raise InputError(
            f"{path} holds {content}; it must hold JSON messages. Convert the messages to JSON or export CSV"
        )
    sizes = {topic: len({name for row in rows for name in row}) for topic, rows in topics.items()}
    wide = [topic for topic, size in sizes.items() if size > 2]
    if len(wide) != 1:
        raise InputError(
            f"{path}: {len(wide)} topics hold two values or more ({listed(wide or sizes)}); one topic must "
            "hold position and force. Write both to one topic or export them as CSV"
        )
    rows = topics[wide[0]]
    start = rows[0][_LOG_TIME]
    for row in rows:
        row[_LOG_TIME] = (row[_LOG_TIME] - start) * 1e-9
    # The schema of a file that palpate wrote also states columns without numbers, and which columns are text.
    with readable(path, "MCAP"):
        types = _column_types(schemas[wide[0]]) if stored else {}
    names = list(types) or list(dict.fromkeys(name for row in rows for name in row))
    columns = {
        escaped(name): cells_of([row.get(name) for row in rows], ".")
        if types.get(name) != "string"
        else np.array([row.get(name, "") for row in rows], dtype=object)
        for name in names
    }
    metadata = {escaped(key): escaped(value) for key, value in stored[0].items()} if stored else {}
    notes = [f"topic {shortened(wide[0])}"]
    if len(topics) > 1 or others:
        notes.append("other topics are left out")
    return MemoryTable(path, columns, metadata, notes, ("message", 0))


def _column_types(schema: Any) -> dict[str, str]:
    """Returns the columns in the JSON schema of a file that palpate wrote: name -> "number" or "string"."""
    return {name: part["type"] for name, part in json.loads(schema.data)["properties"].items()}


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

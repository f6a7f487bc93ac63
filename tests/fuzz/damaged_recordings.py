# SPDX-License-Identifier: Apache-2.0
"""Reads damaged binary recordings: tests/fuzz/damaged_recordings.py CASES [SEED [KIND ...]].

A damaged file must be refused with one sentence, or read with the same rows, names, units and metadata.
Damage that no checksum of the format covers may change these, but must not crash the reader or let it hang.
Processes with limited memory read the files, so that a crash of a library counts as a failure.
"""

from __future__ import annotations

import hashlib
import io
import json
import os
import random
import re
import resource
import select
import struct
import subprocess
import sys
import tempfile
import threading
import time
import zlib
from collections import Counter
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from queue import SimpleQueue
from typing import Any

import numpy as np
import pandas as pd

ROOT = Path(__file__).parents[2]

LONGEST_S = 60.0
"""A reader that needs longer for a file of some kilobytes hangs [s]."""

MEMORY_BYTES = 6 << 30
"""Address space of a reader [bytes]; the libraries reserve 1 to 2 GB."""

ROWS = 400


# ------------------------------------------------------------------------------------------------ files


def arrays() -> dict[str, Any]:
    """Returns the columns of a recording: numbers of several types, words, and a name that is not ASCII."""
    row = np.arange(ROWS)
    position = 0.5 - 0.5 * np.cos(row / 30.0)
    return {
        "time_s": 1e-3 * row,
        "position_mm": position,
        "force_N": (3.0 * position + 0.2 * np.sin(row / 7.0)).astype(np.float32),
        "direction": np.where(np.sin(row / 30.0) >= 0.0, "press", "release"),
        "temperature_°C": 20 + row // 100,
        "cycle": (65_000 + row).astype(np.uint16),
    }


_ONE_WRITER = threading.Lock()
"""`savemat` keeps the tag of a matrix in a variable that all its calls share."""


def _mat(compressed: bool, form: str = "5") -> bytes:
    from scipy.io import savemat
    from scipy.sparse import csc_array

    stream = io.BytesIO()
    content = {name.replace("°", ""): cells for name, cells in arrays().items()}
    content["direction"] = np.array(content["direction"], dtype=object if form == "5" else None)
    content |= {"rate_Hz": 1000.0, "complex": np.arange(3) * 1j, "sparse": csc_array(np.eye(3))}
    if form == "4":
        del content["direction"]
    else:
        parts = np.array(["a", np.arange(3), {"b": 1}, np.empty((0, 0))], dtype=object)
        content["more"] = {"parts": parts, "probe": {"name": "p", "list": [1, 2]}}
    with _ONE_WRITER:
        savemat(stream, content, do_compression=compressed, format=form)
    return stream.getvalue()


def _big_endian_mat() -> bytes:
    """Returns an uncompressed MATLAB file of the other byte order, which `savemat` cannot write."""

    def element(kind: int, data: bytes) -> bytes:
        return struct.pack(">II", kind, len(data)) + data + bytes(-len(data) % 8)

    def matrix(name: str, cells: Any) -> bytes:
        flags, dimensions = struct.pack(">II", 6, 0), struct.pack(">ii", len(cells), 1)
        values = np.asarray(cells, dtype=">f8").tobytes()
        parts = element(6, flags), element(5, dimensions), element(1, name.encode()), element(9, values)
        return element(14, b"".join(parts))

    chosen = {name: cells for name, cells in arrays().items() if name in ("position_mm", "force_N", "time_s")}
    head = b"MATLAB 5.0 MAT-file".ljust(124) + struct.pack(">H", 0x0100) + b"MI"
    return head + b"".join(matrix(name, cells) for name, cells in chosen.items())


def _big_endian_mat4() -> bytes:
    chosen = {name: cells for name, cells in arrays().items() if name in ("position_mm", "force_N", "time_s")}
    return b"".join(
        struct.pack(">5i", 1000, len(cells), 1, 0, len(name) + 1)
        + name.encode()
        + b"\0"
        + np.asarray(cells, dtype=">f8").tobytes()
        for name, cells in chosen.items()
    )


def _npz() -> list[bytes]:
    files = []
    for save in (np.savez, np.savez_compressed):
        stream = io.BytesIO()
        save(stream, **arrays(), rate_Hz=1000.0)
        files.append(stream.getvalue())
    return files


def _xlsx() -> list[bytes]:
    stream = io.BytesIO()
    pd.DataFrame(arrays()).to_excel(stream, index=False)
    return [stream.getvalue()]


def _workbook(suffix: str) -> list[bytes]:
    sys.path.append(str(ROOT / "tests" / "python"))
    from workbooks import workbook

    columns = arrays()
    rows = [list(columns), *zip(*(np.asarray(cells).tolist() for cells in columns.values()), strict=True)]
    with tempfile.TemporaryDirectory() as folder:
        return [workbook(Path(folder) / f"a{suffix}", {"run": rows}).read_bytes()]


def _parquet(checksums: bool, **options: Any) -> bytes:
    import pyarrow as pa
    import pyarrow.parquet as parquet

    table = pa.Table.from_pandas(pd.DataFrame(arrays()), preserve_index=False)
    table = table.replace_schema_metadata({**(table.schema.metadata or {}), "object": "spring 3"})
    stream = io.BytesIO()
    parquet.write_table(table, stream, write_page_checksum=checksums, row_group_size=150, **options)
    return stream.getvalue()


def _parquet_files(checksums: bool) -> list[bytes]:
    return [
        _parquet(checksums),
        _parquet(checksums, compression="none", use_dictionary=False, data_page_version="2.0"),
        _parquet(checksums, compression="zstd", store_schema=False, write_page_index=True),
    ]


def _mcap_of_palpate() -> bytes:
    from palpate import Recording

    columns = arrays()
    recording = Recording.from_arrays(
        1e-3 * columns["position_mm"],
        columns["force_N"],
        time=columns["time_s"],
        direction=np.where(columns["direction"] == "press", 1, -1),
        inputs={"temperature_°C": columns["temperature_°C"]},
        units={"position": "m", "force": "N"},
        metadata={"object": "spring 3"},
    )
    with tempfile.TemporaryDirectory() as folder:
        return recording.write(Path(folder) / "a.mcap").read_bytes()


def _mcap(**options: Any) -> bytes:
    from mcap.writer import Writer

    stream = io.BytesIO()
    writer = Writer(stream, chunk_size=8192, **options)
    writer.start()
    schema = writer.register_schema("sample", "jsonschema", b"{}")
    channel = writer.register_channel("/sample", "json", schema)
    columns = {name: cells.tolist() for name, cells in arrays().items() if name != "time_s"}
    for row in range(ROWS):
        data = json.dumps({name: cells[row] for name, cells in columns.items()}).encode()
        writer.add_message(channel, 1_000_000 * row, data, 1_000_000 * row, row)
    writer.finish()
    return stream.getvalue()


def _mcap_files() -> list[bytes]:
    from mcap.writer import CompressionType

    kinds = (CompressionType.ZSTD, CompressionType.LZ4, CompressionType.NONE)
    return [_mcap_of_palpate(), *(_mcap(compression=kind) for kind in kinds)]


# ----------------------------------------------------------------------------------------------- damage


def one_bit(chance: random.Random, content: bytes) -> bytes:
    changed = bytearray(content)
    changed[chance.randrange(len(changed))] ^= 1 << chance.randrange(8)
    return bytes(changed)


def some_bytes(chance: random.Random, content: bytes) -> bytes:
    """Changes bytes, with a preference for the first ones, which hold types, sizes and names."""
    changed = bytearray(content)
    for _ in range(chance.choice([1, 1, 2, 5]) if changed else 0):
        place = chance.randrange(min(len(changed), chance.choice([64, 256, len(changed)])))
        kind = chance.random()
        if kind < 0.4:
            changed[place] ^= 1 << chance.randrange(8)
        elif kind < 0.7:
            changed[place] = chance.choice([0, 1, 2, 5, 14, 15, 127, 128, 255])
        elif kind < 0.8:
            changed[place & ~3 : (place & ~3) + 4] = struct.pack(
                "<I", chance.choice([0, 2**31, 2**32 - 1, 2**20])
            )
        elif kind < 0.9:
            del changed[place : place + chance.choice([1, 4, 8, min(100, len(changed) // 2)])]
        else:
            changed[place:place] = changed[: chance.choice([1, 4, 8, 100])]
    return bytes(changed)


def cut(chance: random.Random, content: bytes) -> bytes:
    return content[: chance.randrange(1, len(content))]


def inside_elements(chance: random.Random, content: bytes) -> bytes:
    """Changes the content of a compressed MATLAB element and compresses it again, with a correct checksum."""
    elements, offset = [], 128
    while offset < len(content):
        (size,) = struct.unpack_from("<I", content, offset + 4)
        elements.append(zlib.decompress(content[offset + 8 : offset + 8 + size]))
        offset += 8 + size
    chosen = chance.randrange(len(elements))
    elements[chosen] = some_bytes(chance, elements[chosen])
    packed = map(zlib.compress, elements)
    return content[:128] + b"".join(struct.pack("<II", 15, len(data)) + data for data in packed)


@dataclass(frozen=True)
class Kind:
    """Files of one format, and damage to them."""

    suffix: str
    files: Callable[[], list[bytes]]
    damage: Callable[[random.Random, bytes], bytes]
    covered: bool = True
    """True if checksums of the format cover the damage: it must not change the result."""


KINDS = {
    "mat": Kind("mat", lambda: [_mat(True)], one_bit),
    "mat, cut": Kind("mat", lambda: [_mat(True)], cut, False),
    "mat, inside": Kind("mat", lambda: [_mat(True)], inside_elements, False),
    "mat, plain": Kind("mat", lambda: [_mat(False), _big_endian_mat()], some_bytes, False),
    "mat, version 4": Kind("mat", lambda: [_mat(False, "4"), _big_endian_mat4()], some_bytes, False),
    "mcap": Kind("mcap", _mcap_files, one_bit),
    "mcap, cut": Kind("mcap", _mcap_files, cut),
    "mcap, bytes": Kind("mcap", _mcap_files, some_bytes),
    "parquet": Kind("parquet", lambda: _parquet_files(True), one_bit),
    "parquet, cut": Kind("parquet", lambda: _parquet_files(True), cut),
    "parquet, plain": Kind("parquet", lambda: _parquet_files(False), one_bit, False),
    "xlsx": Kind("xlsx", _xlsx, one_bit),
    "xlsx, cut": Kind("xlsx", _xlsx, cut),
    "ods": Kind("ods", lambda: _workbook(".ods"), one_bit),
    "xls": Kind("xls", lambda: _workbook(".xls"), some_bytes, False),
    "xls, cut": Kind("xls", lambda: _workbook(".xls"), cut, False),
    "npz": Kind("npz", _npz, one_bit),
    "npz, cut": Kind("npz", _npz, cut),
}


# ----------------------------------------------------------------------------------------------- reader


def content_of(path: Path) -> dict[str, str]:
    """Returns the recording in a file, its long parts as fingerprints, or the sentence of its refusal."""
    from palpate import InputError, read_recording
    from palpate.errors import escaped

    try:
        found = read_recording(path)
    except InputError as error:
        if escaped(str(error)) != str(error):
            raise AssertionError("the refusal is not one sentence") from error
        return {"refused": str(error).removeprefix(f"{path}")}
    rows = [found.position, found.force, found.time, found.direction, found.inputs]
    digest = hashlib.sha256()
    for cells in (*rows, *found.columns.values()):
        digest.update(repr(None if cells is None else cells.tolist()).encode())
    return {
        "rows": digest.hexdigest(),
        "names": repr((dict(found.source.columns), found.input_names, list(found.columns))),
        "units": repr((dict(found.units), dict(found.file_units))),
        "metadata": repr(dict(found.metadata)),
        "note": found.notes[0],
    }


def serve() -> None:
    """Reads the files whose names come from standard input; prints a line for each."""
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY_BYTES, MEMORY_BYTES))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    for line in sys.stdin:
        try:
            answer = content_of(Path(line.rstrip("\n")))
        except Exception as error:
            answer = {"exception": f"{type(error).__name__}: {error}"}
        print(json.dumps(answer), flush=True)


class Reader:
    """A process that reads files, started again after a crash."""

    def __init__(self) -> None:
        self._process: subprocess.Popen[bytes] | None = None

    def content(self, path: Path) -> dict[str, str]:
        """Returns the content of a file, or an item "crashed" or "hung"."""
        if self._process is None:
            command = [sys.executable, str(Path(__file__)), "serve"]
            self._process = subprocess.Popen(
                command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL
            )
        process = self._process
        assert process.stdin is not None
        assert process.stdout is not None
        process.stdin.write(f"{path}\n".encode())
        process.stdin.flush()
        if not select.select([process.stdout], [], [], LONGEST_S)[0]:
            self.stop()
            return {"hung": f"{LONGEST_S} s"}
        line = process.stdout.readline()
        if not line:
            self.stop()
            return {"crashed": f"exit status {process.returncode}"}
        return dict(json.loads(line))

    def stop(self) -> None:
        if self._process is not None:
            self._process.kill()
            self._process.communicate()
            self._process = None


# --------------------------------------------------------------------------------------------- campaign


def outcome_of(found: dict[str, str], whole: dict[str, str], covered: bool) -> tuple[str, str]:
    """Returns the outcome of reading a damaged file, and its details; an outcome in capitals is a failure."""
    for failure in ("crashed", "hung", "exception"):
        if failure in found:
            return failure.upper(), found[failure]
    if "refused" in found:
        return "refused", found["refused"]
    changed = [name for name in whole if name != "note" and found[name] != whole[name]]
    if not changed:
        return "equal", ""
    if changed == ["metadata"] and "metadata may be lost" in found["note"]:
        return "noted", found["note"]
    return ("CHANGED" if covered else "changed"), ", ".join(changed)


def damaged(name: str, cases: int, seed: int) -> Iterator[tuple[int, int, bytes]]:
    """Yields number, index of the whole file, and content of each damaged file of a kind."""
    kind, chance = KINDS[name], random.Random(f"{seed} {name}")
    files = kind.files()
    for number in range(cases):
        index = number % len(files)
        yield number, index, kind.damage(chance, files[index]) or b" "


def read_damaged(name: str, cases: int, seed: int, reader: Reader) -> tuple[Counter[str], list[str]]:
    """Reads damaged files of a kind; returns the number of each outcome and a line for each failure."""
    kind = KINDS[name]
    counts: Counter[str] = Counter()
    failures: list[str] = []
    kept = ROOT / "build" / "fuzzing"
    with tempfile.TemporaryDirectory(dir="/dev/shm" if Path("/dev/shm").is_dir() else None) as folder:
        path = Path(folder) / f"case.{kind.suffix}"

        def content(data: bytes) -> dict[str, str]:
            path.write_bytes(data)
            return reader.content(path)

        whole = [content(file) for file in kind.files()]
        if refused := [each for each in whole if "rows" not in each]:
            return counts, [f"{name}: the file without damage: {each}" for each in refused]
        for number, index, data in damaged(name, cases, seed):
            outcome, details = outcome_of(content(data), whole[index], kind.covered)
            counts[outcome] += 1
            if outcome.isupper():
                kept.mkdir(parents=True, exist_ok=True)
                example = kept / f"{re.sub('[ ,]+', '-', name)}-{seed}-{number}.{kind.suffix}"
                example.write_bytes(data)
                failures.append(f"{example}: {outcome}: {details}")
    return counts, failures


def campaign(cases: int, seed: int, names: list[str]) -> list[str]:
    """Reads damaged files of each kind, several kinds at the same time; returns a line for each failure."""
    failures: list[str] = []
    free: SimpleQueue[Reader] = SimpleQueue()
    readers = [Reader() for _ in range(os.cpu_count() or 1)]
    for reader in readers:
        free.put(reader)

    def one(name: str) -> str:
        reader = free.get()
        start = time.monotonic()
        counts, found = read_damaged(name, cases, seed, reader)
        free.put(reader)
        failures.extend(found)
        outcomes = ", ".join(f"{count} {outcome}" for outcome, count in sorted(counts.items()))
        return "\n".join([*found, f"{name}: {outcomes}, {time.monotonic() - start:.0f} s"])

    with ThreadPoolExecutor(len(readers)) as pool:
        for line in pool.map(one, names):
            print(line, flush=True)
    for reader in readers:
        reader.stop()
    return failures


if __name__ == "__main__":
    if sys.argv[1:] == ["serve"]:
        serve()
    else:
        cases, seed = int(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else 1
        sys.exit(bool(campaign(cases, seed, sys.argv[3:] or list(KINDS))))

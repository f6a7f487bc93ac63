# SPDX-License-Identifier: Apache-2.0
"""The C++ and the Python reader of model files accept and refuse the same bytes."""

from __future__ import annotations

import json
import os
import random
import re
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

from control_program import MODEL, PROGRAM, needs_program
from palpate import InputError, load_model

TEXT = MODEL.read_text(encoding="utf-8")
MUTATIONS = 60 * int(os.environ.get("PALPATE_TEST_SCALE", "1"))

NUMBERS = [
    "-0", "-0.0", "0.0", "1e400", "-1e400", "1e-400", "1" + "0" * 400, "9" * 5000, "1E+2", "1e2", "2.0",
    "18446744073709551615", "18446744073709551616", "9223372036854775808", "-9223372036854775809",
    "9007199254740993", "4.9e-324", "1.7976931348623158e308", "1.7976931348623159e308", "01", "+1", ".5",
    "1.", "0x10", "Infinity", "-Infinity", "NaN", "true", "null", '"1"', "[1]", "{}",
]  # fmt: skip
FIELDS = ("bias", "rows", "mass", "n_parameters", "nrmse", "version", "dimension")


def with_notes(notes: str) -> bytes:
    return json.dumps({**json.loads(TEXT), "notes": {"x": "@@"}}).replace('"@@"', notes).encode()


def cases() -> Iterator[tuple[str, bytes]]:
    plain = TEXT.encode()
    word = '"created_by": "'
    yield "unchanged", plain
    yield "byte order mark", b"\xef\xbb\xbf" + plain
    yield "utf-16", TEXT.encode("utf-16")
    yield "empty", b""
    yield "blank", b" \n"
    yield "two objects", plain + plain
    yield "line ends", TEXT.replace("\n", "\r\n").encode()
    for name, tail in {"nul": b"\0", "nul and more": b"\0{}", "comment": b"// x", "form feed": b"\f"}.items():
        yield f"{name} at the end", plain + tail
    for name, inside in {
        "nul": b"\0", "escaped nul": b"\\u0000", "tab": b"\t", "delete": b"\x7f", "high": b"\\ud800",
        "low": b"\\udc00", "pair": b"\\ud83d\\ude00", "raw surrogate": b"\xed\xa0\x80", "latin-1": b"\xe9",
        "overlong": b"\xc0\xaf", "bad escape": b"\\x",
    }.items():  # fmt: skip
        yield f"{name} in a text", TEXT.replace(word, word + "@@").encode().replace(b"@@", inside)
    yield "a key twice", TEXT.replace('"bias"', '"bias": 0, "bias"', 1).encode()
    yield "a key twice, escaped", TEXT.replace('"bias"', '"b\\u0069as": 0, "bias"', 1).encode()
    yield "a key twice in notes", with_notes('{"a": 1, "a": 2}')
    yield "a key once in each of two objects", with_notes('[{"a": 1}, {"a": 2}]')
    for depth in (97, 98, 99, 100, 990, 100_000):
        yield f"{depth} lists", with_notes("[" * depth + "]" * depth)
        yield f"{depth} lists around a number", with_notes("[" * depth + "1" + "]" * depth)
        yield f"{depth} objects", with_notes('{"a":' * depth + "1" + "}" * depth)
    for number in NUMBERS:
        for field in FIELDS:
            changed = re.sub(rf'"{field}": [^,\n}}]+', f'"{field}": {number}', TEXT, count=1)
            yield f"{field} {number[:24]}", changed.encode()
    chance = random.Random(17)
    for k in range(MUTATIONS):
        mutated = bytearray(plain)
        for _ in range(chance.choice([1, 1, 2])):
            place = chance.randrange(len(mutated))
            mutated[place] = (
                chance.choice(b'0123456789-+.eE"{}[],: \\\n\0\xff')
                if chance.random() < 0.8
                else mutated[place] ^ (1 << chance.randrange(8))
            )
        yield f"mutation {k}", bytes(mutated)


def python_accepts(path: Path) -> bool:
    try:
        load_model(path)
    except InputError as error:
        sentence = str(error)
    else:
        return True
    assert "\n" not in sentence
    assert sentence.startswith(str(path))
    return False


def cpp_accepts(path: Path) -> bool:
    """The recording is refused after the model was read, and before anything runs."""
    command = [PROGRAM, path, "--record", "/nowhere/felt.csv"]
    answer = subprocess.run(command, capture_output=True, check=False, timeout=60)
    assert answer.returncode == 2, answer
    said = answer.stderr.decode("utf-8")  # no raw byte of the file
    assert not re.search(r"[\x00-\x09\x0b-\x1f\x7f]", said), said
    if "/nowhere/felt.csv" in said:
        return True
    assert said.startswith(f"error: {path}"), said
    return False


@needs_program
def test_both_readers_accept_and_refuse_the_same_files(tmp_path: Path) -> None:
    path = tmp_path / "m.json"
    accepted, different = [], []
    for name, content in cases():
        path.write_bytes(content)
        python, cpp = python_accepts(path), cpp_accepts(path)
        if python != cpp:
            different.append((name, "Python accepts" if python else "C++ accepts"))
        if python:
            accepted.append(name)
    assert different == []
    assert {"unchanged", "line ends", "pair in a text", "98 lists", "bias -0"} <= set(accepted)
    assert not {"byte order mark", "nul at the end", "high in a text", "a key twice", "99 lists"} & set(
        accepted
    )


@needs_program
def test_a_pipe_without_a_writer_does_not_hang_the_program(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    answer = subprocess.run([PROGRAM, tmp_path / "pipe"], capture_output=True, check=False, timeout=10)
    assert answer.returncode == 2


@pytest.mark.parametrize(
    ("content", "sentence"),
    [
        (b"\xef\xbb\xbf{}", "begins with a byte order mark: save it as UTF-8 without one"),
        (b"{}\0", "holds a NUL byte"),
        (b'{"a": 1, "a": 1}', "the key 'a' stands twice in one object"),
        (b"[" * 101 + b"]" * 101, "nested more than 100 levels deep"),
        (b"[" * 100_000, "nested more than 100 levels deep"),
        (b'{"a": "\\ud800"}', "half of a surrogate pair"),
        (b'{"a": "\xe9"}', "byte 7 is not UTF-8"),
    ],
)
def test_the_refusal_names_the_file_and_the_reason(tmp_path: Path, content: bytes, sentence: str) -> None:
    path = tmp_path / "m.json"
    path.write_bytes(content)
    with pytest.raises(InputError, match=re.escape(sentence)) as refused:
        load_model(path)
    assert str(refused.value).startswith(str(path))

# SPDX-License-Identifier: Apache-2.0
"""Compares the readers of model files on mutated files: tests/fuzz/compare_readers.py CASES [SEED].

The readers are that of C++ (palpate-control, the MuJoCo plugin) and `palpate.load_model`. Both must refuse a
file with the same message, which begins with the path of the field, or read it with the same fingerprint. The
schema `model.schema.json` must accept every file that they read.
"""

from __future__ import annotations

import ctypes
import json
import random
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import jsonschema

import palpate
from palpate import InputError
from palpate._core.model import fingerprint

ROOT = Path(__file__).parents[2]
GOOD = sorted((ROOT / "tests" / "models" / "good").glob("*.json"))
SCHEMA = ROOT / "python" / "palpate" / "model" / "model.schema.json"

LITERALS = r"""
0 -0 -0.0 1 -1 2 3 0.5 1.0 2.0 1e-400 4.9e-324 1e-300 1e300 1.7976931348623157e308 -1e308 1e308 1e400 -1e400
9223372036854775807 9223372036854775808 18446744073709551615 18446744073709551616 -9223372036854775809 1e18
NaN Infinity -Infinity +1 0x10 01 1. .5 1E2 true false null nul "" "1" "direct" "m" "\u0000" "\ud800"
[] {} [[]] [null] [1,2] {"a":1} [1e999]
""".split()  # noqa: SIM905
"""Texts in place of a value: extreme numbers, other types, and texts that are not JSON."""


class Object(list[tuple[str, Any]]):
    """A JSON object as a list of keys and values, in which a key can occur twice."""


class Text(str):
    """A text that is written as it is, in place of a JSON value."""

    __slots__ = ()


def parsed(text: str) -> Any:
    return json.loads(text, object_pairs_hook=Object)


def written(value: Any) -> str:
    if isinstance(value, Object):
        return "{" + ", ".join(f"{json.dumps(key)}: {written(item)}" for key, item in value) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(written, value)) + "]"
    return value if isinstance(value, Text) else json.dumps(value)


def copied(value: Any) -> Any:
    if isinstance(value, Object):
        return Object((key, copied(item)) for key, item in value)
    return [copied(item) for item in value] if isinstance(value, list) else value


Place = tuple[Any, int]
"""A list or object, and the index of one of its values."""


def places_of(content: Any) -> list[Place]:
    """Returns the places of all values in a file."""
    places: list[Place] = []
    todo = [content]
    while todo:
        parent = todo.pop()
        for index, item in enumerate(parent):
            value = item[1] if isinstance(parent, Object) else item
            places.append((parent, index))
            if isinstance(value, list):
                todo.append(value)
    return places


def value_at(place: Place) -> Any:
    parent, index = place
    return parent[index][1] if isinstance(parent, Object) else parent[index]


def put(place: Place, value: Any) -> None:
    parent, index = place
    parent[index] = (parent[index][0], value) if isinstance(parent, Object) else value


def _drop(chance: random.Random, places: list[Place]) -> None:
    parent, index = chance.choice(places)
    del parent[index]


def _repeat(chance: random.Random, places: list[Place]) -> None:
    """Repeats a key or an element."""
    parent, index = chance.choice(places)
    parent.insert(chance.randrange(len(parent) + 1), copied(parent[index : index + 1])[0])


def _rename(chance: random.Random, places: list[Place]) -> None:
    parent, index = chance.choice([place for place in places if isinstance(place[0], Object)])
    names = [name for owner, k in places if isinstance(owner, Object) for name in (owner[k][0],)]
    name = chance.choice([chance.choice(names), "colour", "", parent[index][0].upper(), "a\0b", "\u2028"])
    parent[index] = (name, parent[index][1])


def _replace(chance: random.Random, places: list[Place]) -> None:
    put(chance.choice(places), Text(chance.choice(LITERALS)))


def _scale(chance: random.Random, places: list[Place]) -> None:
    """Changes a number slightly, or by orders of magnitude."""
    numbers = [place for place in places if type(value_at(place)) in (int, float)]
    place = chance.choice(numbers)
    factor = chance.choice([-1.0, 0.0, 1.0 + 1e-12, 1.0 + 1e-8, 1.01, 2.0, 10.0 ** chance.randint(-320, 308)])
    put(place, Text(repr(factor * value_at(place))))


def _nest(chance: random.Random, places: list[Place]) -> None:
    place = chance.choice(places)
    value = value_at(place)
    for _ in range(chance.choice([1, 1, 2, 95, 100])):
        value = [value]
    put(place, value)


def _swap(chance: random.Random, places: list[Place]) -> None:
    one, other = chance.choice(places), chance.choice(places)
    first, second = copied(value_at(one)), copied(value_at(other))
    put(one, second)
    put(other, first)


def _resize(chance: random.Random, places: list[Place]) -> None:
    lists = [value_at(place) for place in places if type(value_at(place)) is list and value_at(place)]
    chosen = chance.choice(lists)
    size = chance.choice([0, 1, len(chosen) - 1, len(chosen) + 1, 3 * len(chosen)])
    chosen[:] = [copied(chosen[k % len(chosen)]) for k in range(size)]


STRUCTURED: tuple[Callable[[random.Random, list[Place]], None], ...] = (
    _drop,
    _repeat,
    _rename,
    _replace,
    _replace,
    _scale,
    _scale,
    _nest,
    _swap,
    _resize,
)


def mutated_bytes(chance: random.Random, text: bytes) -> bytes:
    changed = bytearray(text)
    for _ in range(chance.choice([1, 1, 1, 2, 5])):
        place = chance.randrange(len(changed))
        kind = chance.random()
        if kind < 0.5:
            changed[place] = chance.choice(b'0123456789-+.eE"{}[],: \\\n\0\xff\xed')
        elif kind < 0.7:
            changed[place] ^= 1 << chance.randrange(8)
        elif kind < 0.85:
            del changed[place : place + chance.choice([1, 1, 2, 20])]
        else:
            start = chance.randrange(len(changed))
            changed[place:place] = changed[start : start + chance.choice([1, 2, 20])]
        if not changed:
            break
    return bytes(changed) or b" "


class Cases:
    """Mutated model files; the same seed gives the same files."""

    def __init__(self, seed: int) -> None:
        self._chance = random.Random(seed)
        self._good = [path.read_text(encoding="utf-8") for path in GOOD]

    def next(self) -> tuple[bytes, str]:
        """Returns a file and the name of its mutations."""
        chance = self._chance
        text = chance.choice(self._good)
        if chance.random() < 0.25:
            return mutated_bytes(chance, text.encode()), "bytes"
        content = parsed(text)
        names = []
        for _ in range(chance.choice([1, 1, 1, 2, 3])):
            mutation = chance.choice(STRUCTURED)
            try:
                mutation(chance, places_of(content))
            except IndexError:  # nothing of this kind is left
                continue
            names.append(mutation.__name__.strip("_"))
        return written(content).encode("utf-8", "surrogatepass"), " ".join(names)


class Readers:
    """The readers, each with its result for a file."""

    def __init__(self, folder: Path) -> None:
        compiled, library = folder / "model_reader.o", folder / "model_reader.so"
        include = ROOT / "cpp" / "include"
        flags = ["-std=c++20", "-O1", "-fPIC", "-D_GLIBCXX_ASSERTIONS", f"-I{include}"]
        source = Path(__file__).with_name("model_reader.cpp")
        # Two steps, so that a compiler cache can keep the first one.
        subprocess.run(["g++", *flags, "-c", str(source), "-o", str(compiled)], check=True)
        subprocess.run(["g++", "-shared", str(compiled), "-o", str(library)], check=True)
        self._read = ctypes.CDLL(str(library)).read_model
        self._read.argtypes = [ctypes.c_char_p, ctypes.c_size_t, ctypes.c_char_p, ctypes.c_size_t]
        self._text = ctypes.create_string_buffer(4096)
        self._file = folder / "case.json"
        self.accepted = 0
        schema = json.loads(SCHEMA.read_text(encoding="utf-8"))
        self._schema = jsonschema.validators.validator_for(schema)(schema)

    def in_cpp(self, content: bytes) -> tuple[int, str]:
        """Returns 0 and the fingerprint, 1 and the refusal, or 2 and a wrong exception."""
        code = self._read(content, len(content), self._text, len(self._text))
        return code, self._text.value.decode("utf-8", "replace")

    def in_python(self, content: bytes) -> tuple[int, str]:
        self._file.write_bytes(content)
        try:
            return 0, fingerprint(palpate.load_model(self._file))
        except InputError as error:
            return 1, str(error).removeprefix(f"{self._file}: ")
        except Exception as error:
            return 2, f"{type(error).__name__}: {error}"

    def difference(self, content: bytes) -> str:
        """Returns the difference between the results of the readers; empty if they agree."""
        cpp, python = self.in_cpp(content), self.in_python(content)
        if cpp != python or 2 in (cpp[0], python[0]):
            return f"C++: {cpp}; Python: {python}"
        if cpp[0] == 0:
            self.accepted += 1
            found = next(self._schema.iter_errors(json.loads(content)), None)
            if found is not None:
                return f"accepted, but not by the schema: {found.json_path}: {found.message[:200]}"
        return ""


def compare(cases: int, seed: int) -> list[str]:
    """Compares the readers on mutated files; returns a line for each difference, and keeps its file."""
    differences: list[str] = []
    with tempfile.TemporaryDirectory(dir="/dev/shm" if Path("/dev/shm").is_dir() else None) as folder:
        readers, files = Readers(Path(folder)), Cases(seed)
        start = time.monotonic()
        for number in range(1, cases + 1):
            content, mutations = files.next()
            if difference := readers.difference(content):
                kept = ROOT / "build" / "fuzzing" / f"readers-{seed}-{number}.json"
                kept.parent.mkdir(parents=True, exist_ok=True)
                kept.write_bytes(content)
                differences.append(f"{kept} ({mutations}): {difference}")
                print(differences[-1], flush=True)
            if number % 50_000 == 0 or number == cases:
                seconds = time.monotonic() - start
                counts = f"{readers.accepted} accepted, {len(differences)} differences"
                print(f"{number} files, {counts}, {seconds:.0f} s", flush=True)
    return differences


if __name__ == "__main__":
    given = [int(argument) for argument in sys.argv[1:]]
    sys.exit(bool(compare(given[0], given[1] if len(given) > 1 else 1)))

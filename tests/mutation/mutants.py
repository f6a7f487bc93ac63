# SPDX-License-Identifier: Apache-2.0
"""Mutation tests of the C++ headers: small errors are inserted one at a time, and the tests must find them.

Usage: python tests/mutation/mutants.py [--sample N] [--tests NAME ...] FOLDER ...

FOLDER is a folder or a header of cpp/include/palpate, such as `guard` or `model/memory.hpp`. From each one,
the program draws N mutants. A mutant replaces an operator by its neighbour (``+`` by ``-``, ``<`` by ``<=``,
``&&`` by one of its sides), removes a sign, a negation or a statement, flips a truth value or changes a small
number. A mutant that no test executes counts as not found.

The drawn mutants are compiled at once, into a copy of the sources below build/; the environment variable
PALPATE_MUTANT selects one of them. Constant expressions are not changed. Some mutants are equivalent to the
original; docs/robustness.md explains the survivors.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import re
import subprocess
import sys
import time
from collections import defaultdict
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from clang.cindex import Cursor, CursorKind, Index

ROOT = Path(__file__).resolve().parents[2]
ACTIVE = Path(__file__).with_name("active.hpp")
"""The header that every translation unit of the copy includes first."""
HEADERS = Path("cpp/include/palpate")
WITHOUT_MUTANTS = "detail/hat_kernel.hpp"
"""Header of vector instructions, with which GCC 12 ends in an internal error if a comparison is replaced."""

OPERATORS = {
    "+": ("plus", "-"),
    "-": ("minus", "+"),
    "*": ("times", "/"),
    "/": ("divide", "*"),
    "<": ("less", "<="),
    "<=": ("less_equal", "<"),
    ">": ("greater", ">="),
    ">=": ("greater_equal", ">"),
    "==": ("equal", "!="),
    "!=": ("unequal", "=="),
}
STATEMENTS = {
    CursorKind.CALL_EXPR,
    CursorKind.BINARY_OPERATOR,
    CursorKind.COMPOUND_ASSIGNMENT_OPERATOR,
    CursorKind.UNARY_OPERATOR,
    CursorKind.UNEXPOSED_EXPR,
}
CONSTANTS = {CursorKind.STATIC_ASSERT, CursorKind.FIELD_DECL, CursorKind.ENUM_CONSTANT_DECL}
"""Nodes without mutants: constant expressions, and defaults of members, which Python tests compare."""
WITH_CLOCK = {"realtime"}
"""Folders of tests/cpp whose tests wait for a clock, and can fail without a mutant on a busy machine."""
COUNTS = "Tick.ExecutesABoundedNumberOfInstructions"
"""Test that fails without a mutant, because the copy has more instructions."""
FEW_SECONDS = 5.0
"""Time that a test with a mutant may take beyond ten times its usual duration [s]."""


@dataclass(frozen=True)
class Mutant:
    """One change of a header."""

    header: str
    line: int
    column: int
    change: str
    insertions: tuple[tuple[int, int, int, str], ...]
    """Start and end of the replaced text, the nesting that orders insertions at one place, and the new text.
    ``@`` is replaced by the number of the mutant."""

    def __str__(self) -> str:
        return f"{self.header}:{self.line}:{self.column}: {self.change}"


def operator_between(text: bytes, start: int, end: int) -> tuple[str, int, int] | None:
    """Returns the operator between two operands and its place, without comments."""
    between = text[start:end]
    if b"//" in between or b"/*" in between:
        return None
    word = between.strip()
    at = start + between.index(word) if word else start
    return (word.decode(), at, at + len(word)) if word else None


def mutants_of(cursor: Cursor, text: bytes, header: str, depth: int) -> Iterator[Mutant]:
    """Yields the mutants of one node of the syntax tree."""
    start, end = cursor.extent.start.offset, cursor.extent.end.offset
    line, column = cursor.extent.start.line, cursor.extent.start.column
    children = list(cursor.get_children())

    def mutant(change: str, *insertions: tuple[int, int, int, str]) -> Mutant:
        return Mutant(header, line, column, change, insertions)

    def wrapped(change: str, call: str) -> Mutant:
        opening = (start, start, depth, f"palpate_mutant::{call}(@, ")
        return mutant(change, opening, (end, end, -depth, ")"))

    if cursor.kind == CursorKind.BINARY_OPERATOR and len(children) == 2:
        left, right = children
        found = operator_between(text, left.extent.end.offset, right.extent.start.offset)
        if found is not None:
            symbol, at, behind = found
            if symbol in OPERATORS:
                name, other = OPERATORS[symbol]
                yield mutant(
                    f"{symbol} to {other}",
                    (start, start, depth, f"palpate_mutant::{name}(@, "),
                    (at, behind, 0, ","),
                    (end, end, -depth, ")"),
                )
            elif symbol in ("&&", "||"):
                opening = (
                    "(palpate_mutant::active(@) || ("
                    if symbol == "&&"
                    else "(!palpate_mutant::active(@) && ("
                )
                for side, name in ((left, "left"), (right, "right")):
                    yield mutant(
                        f"{symbol} without its {name} side",
                        (side.extent.start.offset, side.extent.start.offset, depth, opening),
                        (side.extent.end.offset, side.extent.end.offset, -depth, "))"),
                    )
    elif cursor.kind == CursorKind.UNARY_OPERATOR and len(children) == 1:
        symbol = text[start : start + 1].decode()
        if symbol in ("-", "!") and text[start : start + 2] != b"--":
            name = "negative" if symbol == "-" else "negated"
            yield mutant(
                f"without {symbol}",
                (start, start + 1, depth, f"palpate_mutant::{name}(@, "),
                (end, end, -depth, ")"),
            )
    elif cursor.kind == CursorKind.CXX_BOOL_LITERAL_EXPR:
        yield wrapped(f"not {text[start:end].decode()}", "flag")
    elif cursor.kind in (CursorKind.INTEGER_LITERAL, CursorKind.FLOATING_LITERAL):
        literal = text[start:end].decode()
        if re.fullmatch(r"[0-9.]+", literal) and float(literal) <= 10:
            yield wrapped(f"{literal} changed", "number")
    if cursor.kind == CursorKind.COMPOUND_STMT:
        for child in children:
            if (
                child.kind in STATEMENTS
                and text[child.extent.end.offset : child.extent.end.offset + 1] == b";"
            ):
                at = child.extent.start.offset
                statement = text[at : child.extent.end.offset].decode()
                yield Mutant(
                    header,
                    child.extent.start.line,
                    child.extent.start.column,
                    f"without {' '.join(statement.split())[:60]}",
                    ((at, at, depth, "if (!palpate_mutant::active(@)) "),),
                )


def headers_of(folder: str) -> list[str]:
    """Returns the headers of a folder of cpp/include/palpate, or the header itself."""
    path = ROOT / HEADERS / folder
    if not path.exists():
        raise SystemExit(f"{folder}: not in {HEADERS}")
    found = [path] if path.is_file() else sorted(path.rglob("*.hpp"))
    return [each.relative_to(ROOT).as_posix() for each in found if not str(each).endswith(WITHOUT_MUTANTS)]


def is_constant(cursor: Cursor, text: bytes) -> bool:
    """Returns True for a node that the compiler evaluates."""
    if cursor.kind == CursorKind.VAR_DECL:
        start = cursor.extent.start.offset
        return b"constexpr" in text[text.rfind(b"\n", 0, start) + 1 : cursor.location.offset]
    return cursor.kind in CONSTANTS


def find_mutants(folders: list[str]) -> list[Mutant]:
    """Returns the mutants of all headers of the folders."""
    headers = [header for folder in folders for header in headers_of(folder)]
    resources = next((Path(sys.prefix) / "lib").glob("python3*/site-packages/clang_tidy/data/lib/clang/*"))
    unit = "".join(
        f'#include "{header.removeprefix("cpp/include/")}"\n'
        for header in headers
        if "/detail/" not in header
    )
    arguments = ["-std=c++20", "-xc++", f"-I{ROOT}/cpp/include", f"-resource-dir={resources}"]
    tree = Index.create().parse("unit.cpp", args=arguments, unsaved_files=[("unit.cpp", unit)])
    errors = [each for each in tree.diagnostics if each.severity >= 3]
    if errors:
        raise SystemExit(f"the headers are not readable: {errors[0]}")
    wanted = {str(ROOT / header): header for header in headers}
    texts = {path: Path(path).read_bytes() for path in wanted}
    found: dict[tuple[str, str, tuple[tuple[int, int, int, str], ...]], Mutant] = {}

    def walk(cursor: Cursor, depth: int) -> None:
        path = cursor.extent.start.file.name if cursor.extent.start.file else ""
        if path in wanted:
            if is_constant(cursor, texts[path]):
                return
            for mutant in mutants_of(cursor, texts[path], wanted[path], depth):
                found.setdefault((mutant.header, mutant.change, mutant.insertions), mutant)
        elif depth == 1:
            return
        for child in cursor.get_children():
            walk(child, depth + 1)

    walk(tree.cursor, 0)
    return list(found.values())


def write_copy(mutants: dict[int, Mutant], copy: Path) -> None:
    """Copies the sources and inserts the mutants into the copy."""
    command = ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"]
    changed = {mutant.header for mutant in mutants.values()}
    files = subprocess.run(command, cwd=ROOT, check=True, capture_output=True).stdout
    for name in files.decode().split("\0"):
        if (ROOT / name).is_file() and name.startswith(
            ("cpp/", "cmake/", "tests/", "bench/", "CMake", "docs/figures/", "examples/")
        ):
            target = copy / name
            target.parent.mkdir(parents=True, exist_ok=True)
            if name not in changed:
                write_if_different(target, (ROOT / name).read_bytes())
    edits: dict[str, list[tuple[int, int, int, str]]] = defaultdict(list)
    for number, mutant in mutants.items():
        for start, end, order, new in mutant.insertions:
            edits[mutant.header].append((start, end, order, new.replace("@", str(number))))
    for header, changes in edits.items():
        text = (ROOT / header).read_bytes()
        parts = []
        at = 0
        # At one place, nodes end before an operator is replaced, and the outer of two nodes starts first.
        for start, end, _, new in sorted(changes, key=lambda each: (each[0], np.sign(each[2]), each[2])):
            parts += [text[at:start], new.encode()]
            at = end
        parts.append(text[at:])
        write_if_different(copy / header, b"".join(parts))


def write_if_different(path: Path, content: bytes) -> None:
    """Writes a file, unless it has this content: the build tool compiles changed files again."""
    if not path.exists() or path.read_bytes() != content:
        path.write_bytes(content)


def errors_of(*commands: list[str]) -> str:
    """Runs commands until one fails, and returns its output."""
    for command in commands:
        result = subprocess.run(command, capture_output=True, text=True, check=False)
        if result.returncode != 0:
            return result.stdout + result.stderr
    return ""


def compile_errors(copy: Path) -> str:
    """Compiles the headers of the copy without their users; returns the output if this failed."""
    unit = copy / "headers.cpp"
    folder = copy / HEADERS.parent
    headers = sorted(each.relative_to(folder).as_posix() for each in folder.rglob("*.hpp"))
    unit.write_text("".join(f'#include "{each}"\n' for each in headers if "/detail/" not in each))
    options = ["-std=c++20", "-w", "-fsyntax-only", f"-I{folder}", "-include", str(ACTIVE)]
    return errors_of(["c++", *options, str(unit)])


def test_names() -> list[str]:
    """Returns the names of the C++ tests that do not wait for a clock."""
    tests = ROOT / "tests" / "cpp"
    folders = {source.relative_to(tests).parts[0] for source in tests.rglob("test_*.cpp")}
    return [f"test_{folder}" for folder in sorted(folders - WITH_CLOCK)]


def build_errors(copy: Path, build: Path, tests: list[str]) -> str:
    """Builds the C++ tests of the copy; returns the output if this failed."""
    options = ["-DCMAKE_BUILD_TYPE=Debug", "-DCMAKE_CXX_FLAGS_DEBUG=-O1", "-DPALPATE_BUILD_TESTS=ON"]
    options += [f"-DCMAKE_CXX_FLAGS=-w -std=c++20 -include '{ACTIVE}'"]
    return errors_of(
        ["cmake", "-G", "Ninja", "-S", str(copy), "-B", str(build), *options],
        ["cmake", "--build", str(build), "--target", *tests, "--", "-k", "0"],
    )


@dataclass
class TestProgram:
    """A test program with the duration of its run without mutant [s]."""

    path: Path
    duration: float = 0.0

    def run(self, environment: dict[str, str], limit: float | None) -> bool:
        """Returns True if all tests pass in time."""
        command = [str(self.path), "--gtest_fail_fast", "--gtest_brief=1", f"--gtest_filter=-{COUNTS}"]
        try:
            result = subprocess.run(
                command,
                env={**os.environ, **environment},
                cwd=self.path.parent,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
                timeout=limit,
                check=False,
            )
        except subprocess.TimeoutExpired:
            return False
        return result.returncode == 0


def main() -> int:
    """Builds the mutants, runs the tests with a sample of them, and prints the share that the tests found."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folders", nargs="+", metavar="FOLDER")
    parser.add_argument("--sample", type=int, default=100, help="mutants per folder; 0: all")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument(
        "--tests", nargs="+", default=test_names(), metavar="NAME", help="default: all C++ tests"
    )
    parser.add_argument("--to", type=Path, default=ROOT / "build" / "mutation", help="folder of the copy")
    arguments = parser.parse_args()
    copy, build = arguments.to.resolve() / "source", arguments.to.resolve() / "build"

    every = find_mutants(arguments.folders)
    mutants: dict[int, Mutant] = {}
    for folder in arguments.folders:
        members = [n for n, m in enumerate(every) if m.header in headers_of(folder)]
        random.Random(arguments.seed).shuffle(members)
        mutants |= {n: every[n] for n in members[: arguments.sample or None]}
    print(f"{len(mutants)} of {len(every)} mutants", flush=True)
    while True:
        write_copy(mutants, copy)
        errors = compile_errors(copy) or build_errors(copy, build, arguments.tests)
        if not errors:
            break
        lines = set(re.findall(r"(cpp/include/palpate/\S+?):(\d+):\d+: error", errors))
        broken = [n for n, m in mutants.items() if (m.header, str(m.line)) in lines]
        if not broken:
            print(errors[-5000:])
            raise SystemExit("the copy with mutants does not build")
        print(f"{len(broken)} mutants do not compile", flush=True)
        for number in broken:
            del mutants[number]

    executed: dict[int, list[TestProgram]] = defaultdict(list)
    for name in arguments.tests:
        program = TestProgram(build / "tests" / "cpp" / name)
        trace = build / "trace.txt"
        trace.unlink(missing_ok=True)
        start = time.monotonic()
        passed = program.run({"PALPATE_MUTANT_TRACE": str(trace)}, None)
        program.duration = time.monotonic() - start
        state = "" if passed else ", not used: FAILED without mutant"
        print(f"{name}: {program.duration:.1f} s{state}", flush=True)
        if passed and trace.exists():
            for number in {int(word) for word in trace.read_text().split()}:
                executed[number].append(program)

    def survives(number: int) -> bool:
        own = "test_" + Path(mutants[number].header).parent.name
        for program in sorted(executed[number], key=lambda each: (each.path.name != own, each.duration)):
            limit = 10 * program.duration + FEW_SECONDS
            if not program.run({"PALPATE_MUTANT": str(number)}, limit):
                return False
        print(f"  survived: {mutants[number]}" + ("" if executed[number] else ", not executed"), flush=True)
        return True

    with ThreadPoolExecutor(int(os.environ.get("CMAKE_BUILD_PARALLEL_LEVEL", os.cpu_count() or 1))) as pool:
        survived = dict(zip(mutants, pool.map(survives, mutants), strict=True))
    rows = []
    for folder in arguments.folders:
        inside = [n for n in mutants if mutants[n].header in headers_of(folder)]
        found = sum(not survived[n] for n in inside)
        rows.append({"folder": folder, "mutants": len(inside), "found": found})
        print(f"{folder:12} {len(inside)} mutants, {found} found ({100 * found / max(1, len(inside)):.0f} %)")
    survivors = [str(mutants[n]) for n in survived if survived[n]]
    report = {"seed": arguments.seed, "folders": rows, "survivors": survivors}
    (arguments.to / "report.json").write_text(json.dumps(report, indent=1))
    return 0


if __name__ == "__main__":
    sys.exit(main())

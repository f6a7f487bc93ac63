# SPDX-License-Identifier: Apache-2.0
"""The compiled module and palpate-control have the protections of cmake/PalpateHarden.cmake."""

from __future__ import annotations

import json
import platform
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from conftest import ROOT
from control_program import PROGRAM, needs_program
from palpate import _core

MODULE = Path(str(_core.__file__))

pytestmark = pytest.mark.skipif(shutil.which("readelf") is None, reason="needs readelf (Debian: binutils)")

each_binary = pytest.mark.parametrize(
    "binary",
    [pytest.param(PROGRAM, id="palpate-control", marks=needs_program), pytest.param(MODULE, id="module")],
)


def readelf(binary: Path, *options: str) -> str:
    command = ["readelf", "--wide", *options, str(binary)]
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout


@needs_program
def test_the_program_is_loaded_at_a_random_address() -> None:
    header = readelf(PROGRAM, "--file-header")
    assert "DYN" in next(line for line in header.splitlines() if "Type:" in line)
    assert "PIE" in next(line for line in readelf(PROGRAM, "--dynamic").splitlines() if "(FLAGS_1)" in line)


@each_binary
def test_all_functions_are_bound_before_the_start_and_their_table_is_read_only(binary: Path) -> None:
    assert re.search(r"BIND_NOW|Flags: NOW", readelf(binary, "--dynamic"))
    assert "GNU_RELRO" in readelf(binary, "--program-headers")


@each_binary
def test_the_stack_is_not_executable(binary: Path) -> None:
    headers = readelf(binary, "--program-headers")
    stack = next(line for line in headers.splitlines() if "GNU_STACK" in line)
    assert " RW " in stack
    assert " RWE " not in stack


@each_binary
def test_no_part_is_writable_and_executable(binary: Path) -> None:
    loaded = [line for line in readelf(binary, "--program-headers").splitlines() if " LOAD " in line]
    assert loaded
    assert not [line for line in loaded if re.search(r" (RWE|W E|WE) ", line)]


@each_binary
def test_an_overflow_of_stack_or_buffer_ends_the_program(binary: Path) -> None:
    functions = readelf(binary, "--dyn-syms")
    assert "__stack_chk_fail" in functions
    assert re.search(r" __\w+_chk@", functions)


@each_binary
def test_a_wrong_index_into_a_container_ends_the_program(binary: Path) -> None:
    # g++ 12 calls a function of its library; g++ 11 contains the message.
    in_library = "__glibcxx_assert_fail" in readelf(binary, "--dyn-syms")
    assert in_library or b"Assertion '%s' failed" in binary.read_bytes()


@each_binary
def test_the_compiler_protects_large_stacks_and_jumps(binary: Path) -> None:
    """These protections leave no trace that every linker keeps, so the compile commands are read."""
    folder = (
        PROGRAM.parent if binary == PROGRAM else ROOT / "build" / f"python-{sys.implementation.cache_tag}"
    )
    database = folder / "compile_commands.json"
    if not database.exists():
        pytest.skip("the folder of the build is not here")
    commands = [each["command"] for each in json.loads(database.read_text())]
    assert commands
    protections = {"-fstack-protector-strong", "-fstack-clash-protection"} | (
        {"-fcf-protection=full"} if platform.machine() == "x86_64" else {"-mbranch-protection=standard"}
    )
    for command in commands:
        assert not protections - set(command.split())

# SPDX-License-Identifier: Apache-2.0
"""The program palpate-control is built with the protections of cmake/PalpateHarden.cmake."""

from __future__ import annotations

import re
import shutil
import subprocess

import pytest

from control_program import PROGRAM, needs_program

pytestmark = [
    needs_program,
    pytest.mark.skipif(shutil.which("readelf") is None, reason="needs readelf (Debian: binutils)"),
]


def readelf(*options: str) -> str:
    command = ["readelf", "--wide", *options, str(PROGRAM)]
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout


def test_the_program_is_loaded_at_a_random_address() -> None:
    assert "DYN" in next(line for line in readelf("--file-header").splitlines() if "Type:" in line)
    assert "PIE" in next(line for line in readelf("--dynamic").splitlines() if "(FLAGS_1)" in line)


def test_all_functions_are_bound_before_the_start_and_their_table_is_read_only() -> None:
    assert "BIND_NOW" in readelf("--dynamic")
    assert "GNU_RELRO" in readelf("--program-headers")


def test_the_stack_is_not_executable() -> None:
    stack = next(line for line in readelf("--program-headers").splitlines() if "GNU_STACK" in line)
    assert " RW " in stack
    assert " RWE " not in stack


def test_an_overflow_of_stack_or_buffer_ends_the_program() -> None:
    functions = readelf("--dyn-syms")
    assert "__stack_chk_fail" in functions
    assert re.search(r" __\w+_chk@", functions)


def test_a_wrong_index_into_a_container_ends_the_program() -> None:
    # g++ 12 calls a function of its library; g++ 11 contains the message.
    in_library = "__glibcxx_assert_fail" in readelf("--dyn-syms")
    assert in_library or b"Assertion '%s' failed" in PROGRAM.read_bytes()

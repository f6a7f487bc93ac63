# SPDX-License-Identifier: Apache-2.0
"""A C++ project finds and uses the headers: CMake package, pkg-config file, subdirectory and FetchContent.

`make test-full` includes these tests. To run them alone: .venv/bin/python -m pytest tests/install
"""

from __future__ import annotations

import os
import shlex
import subprocess
from pathlib import Path

import pytest

from consumer import PROJECT, ROOT, build_consumer, run


@pytest.fixture(scope="module")
def prefix(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Returns a folder with the installed headers, which was moved after the installation."""
    folder = tmp_path_factory.mktemp("headers")
    run("cmake", "-S", ROOT, "-B", folder / "build", "-G", "Ninja")
    run("cmake", "--install", folder / "build", "--prefix", folder / "first place")
    return (folder / "first place").rename(folder / "moved here")


def test_the_installed_folder_contains_headers_and_two_descriptions(prefix: Path) -> None:
    folders = {path.relative_to(prefix).as_posix() for path in prefix.glob("*/*")}
    assert folders == {"include/palpate", "share/cmake", "share/pkgconfig"}
    headers = ROOT / "cpp" / "include"
    assert {path.relative_to(prefix / "include") for path in prefix.rglob("*.hpp")} == {
        path.relative_to(headers) for path in headers.rglob("*.hpp")
    }


def test_find_package_finds_the_moved_headers(prefix: Path, tmp_path: Path) -> None:
    build_consumer(tmp_path, f"-DCMAKE_PREFIX_PATH={prefix}")


@pytest.mark.parametrize("way", ["subdirectory", "fetch"])
def test_a_project_that_contains_palpate_installs_no_header_of_it(way: str, tmp_path: Path) -> None:
    installed = build_consumer(tmp_path, f"-DPALPATE_BY={way}", f"-DPALPATE_SOURCE={ROOT}")
    assert [path for path in installed.rglob("*") if path.is_file()] == [installed / "bin" / "consumer"]


def test_pkg_config_finds_the_moved_headers(prefix: Path, tmp_path: Path) -> None:
    environment = os.environ | {"PKG_CONFIG_PATH": str(prefix / "share" / "pkgconfig")}
    flags = shlex.split(run("pkg-config", "--cflags", "palpate", env=environment))
    assert len(flags) == 1
    assert Path(flags[0].removeprefix("-I")).resolve() == prefix / "include"
    compiler = os.environ.get("CXX", "g++")
    program = tmp_path / "consumer"
    run(compiler, "-std=c++20", *flags, PROJECT / "main.cpp", PROJECT / "other.cpp", "-o", program)
    run(program)


def test_pkg_config_and_cmake_state_the_version_of_the_headers(prefix: Path, tmp_path: Path) -> None:
    environment = os.environ | {"PKG_CONFIG_PATH": str(prefix / "share" / "pkgconfig")}
    version = run("pkg-config", "--modversion", "palpate", env=environment).strip()
    source = tmp_path / "version.cpp"
    source.write_text(
        "#include <cstdio>\n#include <palpate/version.hpp>\n"
        "int main() { std::puts(palpate::library_version); }\n"
    )
    run(os.environ.get("CXX", "g++"), "-std=c++20", f"-I{prefix}/include", source, "-o", tmp_path / "version")
    assert run(tmp_path / "version").strip() == version
    stated = (prefix / "share" / "cmake" / "palpate" / "palpateConfigVersion.cmake").read_text()
    assert f'set(PACKAGE_VERSION "{version}")' in stated


def test_without_cli11_the_program_is_left_out_with_one_line(tmp_path: Path) -> None:
    definitions = ["-DPALPATE_BUILD_CONTROL=AUTO", "-DCMAKE_DISABLE_FIND_PACKAGE_CLI11=ON"]
    command = ["cmake", "-S", ROOT, "-B", tmp_path, "-G", "Ninja", *definitions]
    completed = subprocess.run(command, capture_output=True, text=True, check=False)
    assert completed.returncode == 0
    line = "palpate-control not built: CLI11 not found, apt install libcli11-dev"
    assert completed.stderr.splitlines() == [line]
    assert "palpate-control" not in run("ninja", "-C", tmp_path, "-t", "targets", "all")


def test_a_debug_build_is_hardened_without_fortify(tmp_path: Path) -> None:
    (tmp_path / "CMakeLists.txt").write_text(
        "cmake_minimum_required(VERSION 3.22)\nproject(hardened LANGUAGES CXX)\n"
        f'include("{ROOT}/cmake/PalpateHarden.cmake")\n'
        "add_executable(hardened main.cpp)\npalpate_harden(hardened)\n"
    )
    (tmp_path / "main.cpp").write_text("int main() {}\n")
    run("cmake", "-S", tmp_path, "-B", tmp_path / "build", "-G", "Ninja", "-DCMAKE_BUILD_TYPE=Debug")
    commands = run("ninja", "-C", tmp_path / "build", "-t", "commands")
    assert "-fstack-protector-strong" in commands
    assert "_FORTIFY_SOURCE" not in commands  # it needs optimization
    run("cmake", "--build", tmp_path / "build")

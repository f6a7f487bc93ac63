# SPDX-License-Identifier: Apache-2.0
"""The Conan recipe and the vcpkg port give a folder with which a project builds.

vcpkg itself does not run: vcpkg_functions.cmake replaces its functions.
"""

from __future__ import annotations

import json
import os
import shutil
import sys
from pathlib import Path

import pytest

from consumer import ROOT, build_consumer, run

PORT = ROOT / "packaging" / "vcpkg" / "ports" / "palpate"
CONAN = shutil.which("conan", path=str(Path(sys.executable).parent))


@pytest.mark.skipif(CONAN is None, reason="needs Conan: make test-packages")
def test_conan_creates_the_package_and_runs_its_test_program(tmp_path: Path) -> None:
    environment = os.environ | {"CONAN_HOME": str(tmp_path / "home")}
    run(CONAN, "profile", "detect", env=environment)
    command = [CONAN, "create", ROOT / "packaging" / "conan", "--no-remote", "--build=missing"]
    outside = f"tools.cmake.cmake_layout:test_folder={tmp_path}"
    settings = ["-s", "compiler.cppstd=20", "-c", outside, "--format=json"]
    output = run(*command, *settings, env=environment)
    nodes = json.loads(output)["graph"]["nodes"].values()
    package = next(node for node in nodes if node["name"] == "palpate" and node["recipe"] == "Cache")
    folder = Path(package["package_folder"])
    assert {path.name for path in folder.iterdir()} == {"include", "licenses"} | {
        "conaninfo.txt",
        "conanmanifest.txt",
    }
    assert package["info"] == {}  # one package for all compilers and settings
    stated = run(CONAN, "inspect", ROOT / "packaging" / "conan", "--format=json", env=environment)
    assert json.loads(stated)["version"] == package["version"]


@pytest.mark.skipif(CONAN is None, reason="needs Conan: make test-packages")
def test_conan_refuses_a_standard_before_cpp_20(tmp_path: Path) -> None:
    environment = os.environ | {"CONAN_HOME": str(tmp_path / "home")}
    run(CONAN, "profile", "detect", env=environment)
    command = [CONAN, "create", ROOT / "packaging" / "conan", "--no-remote", "-s", "compiler.cppstd=17"]
    with pytest.raises(AssertionError, match=r"Current cppstd .17. is lower than the required C"):
        run(*command, env=environment)


def test_the_vcpkg_port_gives_a_folder_that_a_project_finds(tmp_path: Path) -> None:
    packages = tmp_path / "packages" / "palpate_x64-linux"
    definitions = [f"-DPORTFILE={PORT / 'portfile.cmake'}", f"-DCURRENT_PACKAGES_DIR={packages}"]
    functions = Path(__file__).with_name("vcpkg_functions.cmake")
    run("cmake", "-DPORT=palpate", *definitions, "-P", functions)
    assert {path.relative_to(packages).as_posix() for path in packages.glob("*/*")} == {
        "include/palpate",
        "share/palpate",
        "share/pkgconfig",
    }
    assert {"copyright", "usage", "palpateConfig.cmake"} <= {
        path.name for path in (packages / "share" / "palpate").iterdir()
    }
    assert all(any(folder.iterdir()) for folder in packages.rglob("*") if folder.is_dir())
    build_consumer(tmp_path, f"-DCMAKE_PREFIX_PATH={packages}")

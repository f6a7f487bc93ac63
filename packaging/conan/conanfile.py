# SPDX-License-Identifier: Apache-2.0
"""Conan recipe of the C++ headers: conan create packaging/conan."""

import re
from pathlib import Path

from conan import ConanFile
from conan.tools.build import check_min_cppstd
from conan.tools.cmake import CMake, cmake_layout
from conan.tools.files import copy, load, rmdir


class PalpateConan(ConanFile):
    name = "palpate"
    description = "Force-feedback environments identified from recordings"
    license = "Apache-2.0"
    topics = ("haptics", "system-identification", "wavelet-network", "header-only")
    package_type = "header-library"
    settings = "os", "arch", "compiler", "build_type"
    generators = "CMakeToolchain"
    no_copy_source = True

    def set_version(self) -> None:
        text = load(self, Path(self.recipe_folder).parents[1] / "CMakeLists.txt")
        self.version = re.search(r"project\(\s*palpate\s+VERSION ([0-9.]+)", text)[1]

    def export_sources(self) -> None:
        top = Path(self.recipe_folder).parents[1]
        for pattern in ("CMakeLists.txt", "LICENSE", "cmake/*", "cpp/CMakeLists.txt", "cpp/include/*"):
            copy(self, pattern, top, self.export_sources_folder)

    def layout(self) -> None:
        cmake_layout(self)

    def validate(self) -> None:
        check_min_cppstd(self, 20)

    def build(self) -> None:
        CMake(self).configure()

    def package(self) -> None:
        copy(self, "LICENSE", self.source_folder, Path(self.package_folder) / "licenses")
        CMake(self).install()
        # Conan writes the CMake package and the pkg-config file for its users.
        rmdir(self, Path(self.package_folder) / "share")

    def package_id(self) -> None:
        self.info.clear()

    def package_info(self) -> None:
        self.cpp_info.bindirs = []
        self.cpp_info.libdirs = []

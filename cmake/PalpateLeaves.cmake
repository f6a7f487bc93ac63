# SPDX-License-Identifier: Apache-2.0
# Third-party headers of the leaves (Debian: nlohmann-json3-dev, libcli11-dev).

palpate_find_or_fetch(nlohmann_json v3.11.2 https://github.com/nlohmann/json.git 3.9)
if(PALPATE_BUILD_CONTROL)
  palpate_find_or_fetch(CLI11 v2.1.2 https://github.com/CLIUtils/CLI11.git 2.1)
endif()

# Optional: the emulation of a USB device below libusb (Debian: libumockdev-dev).
find_package(PkgConfig QUIET)
if(PkgConfig_FOUND)
  pkg_check_modules(umockdev QUIET IMPORTED_TARGET umockdev-1.0>=0.17)
endif()

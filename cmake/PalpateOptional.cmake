# SPDX-License-Identifier: Apache-2.0
# Third-party libraries of the optional headers and of palpate-control (Debian: nlohmann-json3-dev, libcli11-dev).

palpate_find_or_fetch(
  nlohmann_json https://github.com/nlohmann/json/releases/download/v3.11.2/json.tar.xz
  8c4b26bf4b422252e13f332bc5e388ec0ab5c3443d24399acb675e68278d341f 3.9)
if(PALPATE_BUILD_CONTROL STREQUAL "AUTO" AND NOT CMAKE_SYSTEM_NAME STREQUAL "Linux")
  set(PALPATE_BUILD_CONTROL OFF) # live control needs Linux
endif()
if(PALPATE_BUILD_CONTROL STREQUAL "AUTO")
  find_package(CLI11 2.1 QUIET)
  if(NOT CLI11_FOUND)
    message(NOTICE "palpate-control not built: CLI11 not found, apt install libcli11-dev")
    set(PALPATE_BUILD_CONTROL OFF)
  endif()
elseif(PALPATE_BUILD_CONTROL)
  palpate_find_or_fetch(
    CLI11 https://github.com/CLIUtils/CLI11/archive/refs/tags/v2.1.2.tar.gz
    26291377e892ba0e5b4972cdfd4a2ab3bf53af8dac1f4ea8fe0d1376b625c8cb 2.1)
endif()

# Optional: the emulation of a USB device below libusb (Debian: libumockdev-dev).
find_package(PkgConfig QUIET)
if(PkgConfig_FOUND)
  pkg_check_modules(umockdev QUIET IMPORTED_TARGET umockdev-1.0>=0.17)
endif()

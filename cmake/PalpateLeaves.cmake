# SPDX-License-Identifier: Apache-2.0
# Third-party headers of the leaves: from the system (Debian: nlohmann-json3-dev, libcli11-dev), else fetched.

find_package(nlohmann_json 3.9 QUIET)
if(NOT nlohmann_json_FOUND)
  include(FetchContent)
  FetchContent_Declare(
    nlohmann_json
    GIT_REPOSITORY https://github.com/nlohmann/json.git
    GIT_TAG v3.11.2
    GIT_SHALLOW TRUE)
  FetchContent_MakeAvailable(nlohmann_json)
endif()

if(PALPATE_BUILD_CONTROL)
  find_package(CLI11 2.1 QUIET)
  if(NOT CLI11_FOUND)
    include(FetchContent)
    FetchContent_Declare(
      CLI11
      GIT_REPOSITORY https://github.com/CLIUtils/CLI11.git
      GIT_TAG v2.1.2
      GIT_SHALLOW TRUE)
    FetchContent_MakeAvailable(CLI11)
  endif()
endif()

# What is done without where it is not there: the USB device (Debian: libusb-1.0-0-dev) and its emulation below libusb
# (Debian: libumockdev-dev).
include(cmake/PalpateUsb.cmake)
if(PkgConfig_FOUND)
  pkg_check_modules(umockdev QUIET IMPORTED_TARGET umockdev-1.0>=0.17)
endif()

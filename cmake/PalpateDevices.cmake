# SPDX-License-Identifier: Apache-2.0
# The library of USB devices, libusb (Debian: libusb-1.0-0-dev). Without it a USB device is refused. The target
# palpate_devices links it if it was found.

include_guard()

find_package(PkgConfig QUIET)
if(PkgConfig_FOUND)
  pkg_check_modules(libusb QUIET IMPORTED_TARGET libusb-1.0>=1.0.24)
endif()

add_library(palpate_devices INTERFACE)
if(TARGET PkgConfig::libusb)
  target_link_libraries(palpate_devices INTERFACE PkgConfig::libusb)
  target_compile_definitions(palpate_devices INTERFACE PALPATE_HAS_USB)
else()
  message(STATUS "palpate: built without libusb, no USB device")
endif()

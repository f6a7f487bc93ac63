# SPDX-License-Identifier: Apache-2.0
# libusb (Debian: libusb-1.0-0-dev), without which there is no USB device.

find_package(PkgConfig QUIET)
if(PkgConfig_FOUND)
  pkg_check_modules(libusb QUIET IMPORTED_TARGET libusb-1.0>=1.0.24)
endif()

# SPDX-License-Identifier: Apache-2.0
# Libraries of real devices: libusb (Debian: libusb-1.0-0-dev) for USB; Boost.Beast (libboost-dev) and nlohmann-json for
# an Inverse3. Without a library its device is refused. The target palpate_devices links the libraries that were found.

include_guard()

find_package(PkgConfig QUIET)
if(PkgConfig_FOUND)
  pkg_check_modules(libusb QUIET IMPORTED_TARGET libusb-1.0>=1.0.24)
endif()
find_package(Boost 1.74 QUIET CONFIG)
find_package(nlohmann_json 3.9 QUIET)

add_library(palpate_devices INTERFACE)
if(TARGET PkgConfig::libusb)
  target_link_libraries(palpate_devices INTERFACE PkgConfig::libusb)
  target_compile_definitions(palpate_devices INTERFACE PALPATE_HAS_USB)
else()
  message(STATUS "palpate: built without libusb, no USB device")
endif()
if(TARGET Boost::headers AND TARGET nlohmann_json::nlohmann_json)
  target_link_libraries(palpate_devices INTERFACE Boost::headers nlohmann_json::nlohmann_json)
  target_compile_definitions(palpate_devices INTERFACE PALPATE_HAS_INVERSE3)
endif()

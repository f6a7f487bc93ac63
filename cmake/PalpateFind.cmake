# SPDX-License-Identifier: Apache-2.0
# Uses a package of the system, or downloads its pinned release archive.

include_guard()

if(POLICY CMP0135) # since CMake 3.24: extracted files are as old as the download
  cmake_policy(SET CMP0135 NEW)
endif()

# palpate_find_or_fetch(NAME URL SHA256 [OLDEST]): OLDEST is the oldest version that is accepted. NAME_VERSION is then the
# version of the package of the system, or the version in the URL.
function(palpate_find_or_fetch name url sha256)
  find_package(${name} ${ARGN} QUIET)
  if(NOT ${name}_FOUND)
    include(FetchContent)
    set(CMAKE_POLICY_VERSION_MINIMUM 3.5) # the releases below are older than CMake 4
    FetchContent_Declare(${name} URL "${url}" URL_HASH "SHA256=${sha256}")
    FetchContent_MakeAvailable(${name})
    string(REGEX MATCH "[0-9]+\\.[0-9]+\\.[0-9]+" ${name}_VERSION "${url}")
  endif()
  set(${name}_VERSION "${${name}_VERSION}" PARENT_SCOPE)
endfunction()

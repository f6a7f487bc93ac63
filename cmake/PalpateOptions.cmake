# SPDX-License-Identifier: Apache-2.0
# Compiler options of all programs and modules of this project. Users of palpate::palpate do not receive them.

set(CMAKE_EXPORT_COMPILE_COMMANDS ON)

add_library(palpate_options INTERFACE)

if(MSVC)
  target_compile_options(palpate_options INTERFACE /W4 /utf-8 /bigobj)
  return()
endif()
# Files that are compiled as one share a scope, in which a local name of one file may be a global name of another.
target_compile_options(
  palpate_options INTERFACE -Wall -Wextra -Wpedantic -Wnon-virtual-dtor -Woverloaded-virtual
                            $<$<NOT:$<BOOL:$<TARGET_PROPERTY:UNITY_BUILD>>>:-Wshadow>)
# Before version 13, GCC takes the assignment of a short text for a copy that overlaps (GCC bug 105651).
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND CMAKE_CXX_COMPILER_VERSION VERSION_LESS 13)
  target_compile_options(palpate_options INTERFACE $<$<BOOL:$<TARGET_PROPERTY:UNITY_BUILD>>:-Wno-restrict>)
endif()
if(PALPATE_WARNINGS_AS_ERRORS)
  target_compile_options(palpate_options INTERFACE -Werror)
endif()

if(PALPATE_SANITIZE STREQUAL "realtime")
  include(CheckCXXSourceCompiles)
  set(CMAKE_REQUIRED_FLAGS -fsanitize=realtime)
  check_cxx_source_compiles("int main() noexcept [[clang::nonblocking]] {}" PALPATE_HAS_REALTIME_SANITIZER)
  unset(CMAKE_REQUIRED_FLAGS)
  if(NOT PALPATE_HAS_REALTIME_SANITIZER)
    message(FATAL_ERROR "${CMAKE_CXX_COMPILER} has no real-time sanitizer: set CXX to clang 20 or newer")
  endif()
endif()
if(PALPATE_SANITIZE)
  target_compile_options(
    palpate_options INTERFACE "-fsanitize=${PALPATE_SANITIZE}" -fno-sanitize-recover=all -fno-omit-frame-pointer)
  target_link_options(palpate_options INTERFACE "-fsanitize=${PALPATE_SANITIZE}")
endif()

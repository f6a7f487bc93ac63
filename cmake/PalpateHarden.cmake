# SPDX-License-Identifier: Apache-2.0
# palpate_harden(TARGET) turns on the protections of compiler and linker for a program: overflows of the stack and of
# buffers end the program, addresses are random, and the tables of the linker are read-only. Flags that the compiler
# does not know are left out.

include_guard()
include(CheckCXXCompilerFlag)
include(CheckPIESupported)
check_pie_supported(LANGUAGES CXX)

function(palpate_harden target)
  if(MSVC)
    return() # these are flags of GCC and clang
  endif()
  # The last two protect jumps and returns: the first on x86-64, the second on aarch64. clang only warns of a flag that
  # it does not use on this processor.
  set(CMAKE_REQUIRED_FLAGS -Werror)
  foreach(flag IN ITEMS -fstack-protector-strong -fstack-clash-protection -fcf-protection=full
                        -mbranch-protection=standard)
    string(MAKE_C_IDENTIFIER "palpate_has${flag}" known)
    check_cxx_compiler_flag("${flag}" "${known}")
    if(${known})
      target_compile_options(${target} PRIVATE "${flag}")
    endif()
  endforeach()
  # Level 3 needs optimization; an older C library replaces it by level 2. Some compilers define another level.
  target_compile_options(${target} PRIVATE "$<$<NOT:$<CONFIG:Debug>>:-U_FORTIFY_SOURCE;-D_FORTIFY_SOURCE=3>")
  target_compile_definitions(${target} PRIVATE _GLIBCXX_ASSERTIONS)
  set_target_properties(${target} PROPERTIES POSITION_INDEPENDENT_CODE ON)
  if(CMAKE_SYSTEM_NAME STREQUAL "Linux")
    target_link_options(${target} PRIVATE LINKER:-z,relro LINKER:-z,now LINKER:-z,noexecstack)
  endif()
endfunction()

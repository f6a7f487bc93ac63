# SPDX-License-Identifier: Apache-2.0
# A package from the system if it is there, else from its repository.

include_guard()

# palpate_find_or_fetch(NAME TAG REPOSITORY [VERSION]): VERSION is the oldest that will do.
function(palpate_find_or_fetch name tag repository)
  find_package(${name} ${ARGN} QUIET)
  if(NOT ${name}_FOUND)
    include(FetchContent)
    FetchContent_Declare(
      ${name}
      GIT_REPOSITORY "${repository}"
      GIT_TAG "${tag}"
      GIT_SHALLOW TRUE)
    FetchContent_MakeAvailable(${name})
  endif()
endfunction()

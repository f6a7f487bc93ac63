# SPDX-License-Identifier: Apache-2.0
# Runs a port of vcpkg without vcpkg: cmake -DPORTFILE=... -DPORT=... -DCURRENT_PACKAGES_DIR=... -P vcpkg_functions.cmake
# The functions have the results that the documentation of vcpkg describes, for a port of headers only.

function(vcpkg_cmake_configure)
  cmake_parse_arguments(PARSE_ARGV 0 arg "" "SOURCE_PATH" "OPTIONS")
  execute_process(
    COMMAND "${CMAKE_COMMAND}" -S "${arg_SOURCE_PATH}" -B "${CURRENT_PACKAGES_DIR}.build" -G Ninja ${arg_OPTIONS}
            -DCMAKE_BUILD_TYPE=Release "-DCMAKE_INSTALL_PREFIX=${CURRENT_PACKAGES_DIR}"
            -DCMAKE_INSTALL_LIBDIR:STRING=lib
            COMMAND_ERROR_IS_FATAL ANY)
endfunction()

function(vcpkg_cmake_install)
  execute_process(COMMAND "${CMAKE_COMMAND}" --build "${CURRENT_PACKAGES_DIR}.build" --target install
                          COMMAND_ERROR_IS_FATAL ANY)
endfunction()

# Moves the CMake package to share/PORT, which is one folder higher.
function(vcpkg_cmake_config_fixup)
  cmake_parse_arguments(PARSE_ARGV 0 arg "" "CONFIG_PATH" "")
  file(GLOB files "${CURRENT_PACKAGES_DIR}/${arg_CONFIG_PATH}/*")
  file(COPY ${files} DESTINATION "${CURRENT_PACKAGES_DIR}/share/${PORT}")
  file(REMOVE_RECURSE "${CURRENT_PACKAGES_DIR}/${arg_CONFIG_PATH}")
  get_filename_component(parent "${CURRENT_PACKAGES_DIR}/${arg_CONFIG_PATH}" DIRECTORY)
  file(REMOVE_RECURSE "${parent}")
  file(GLOB files "${CURRENT_PACKAGES_DIR}/share/${PORT}/*.cmake")
  foreach(file IN LISTS files)
    file(READ "${file}" text)
    string(REPLACE "\${CMAKE_CURRENT_LIST_DIR}/../../../" "\${CMAKE_CURRENT_LIST_DIR}/../../" text "${text}")
    string(REGEX REPLACE "(get_filename_component\\(_IMPORT_PREFIX \"\\\${_IMPORT_PREFIX}\" PATH\\)\n)+" "\\1\\1" text
                         "${text}")
    file(WRITE "${file}" "${text}")
  endforeach()
endfunction()

# vcpkg replaces an absolute prefix; that of palpate is relative already.
function(vcpkg_fixup_pkgconfig)
  file(STRINGS "${CURRENT_PACKAGES_DIR}/share/pkgconfig/${PORT}.pc" prefix REGEX "^prefix=")
  if(NOT prefix STREQUAL "prefix=\${pcfiledir}/../..")
    message(FATAL_ERROR "${prefix}: must be relative")
  endif()
endfunction()

function(vcpkg_install_copyright)
  cmake_parse_arguments(PARSE_ARGV 0 arg "" "" "FILE_LIST")
  file(INSTALL ${arg_FILE_LIST} DESTINATION "${CURRENT_PACKAGES_DIR}/share/${PORT}" RENAME copyright)
endfunction()

include("${PORTFILE}")

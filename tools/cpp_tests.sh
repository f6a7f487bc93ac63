#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Builds and runs the C++ tests of one preset: tools/cpp_tests.sh dev|release|asan|tsan
set -euo pipefail

preset=$1
with=()

if [ "$preset" = tsan ]; then
    if ! grep -rqE '#include <(thread|atomic|mutex)>' cpp tests/cpp; then
        echo "The C++ sources start no thread: nothing for the thread sanitizer to see."
        exit 0
    fi
    # The thread sanitizer of older compilers cannot cope with the address randomization of newer kernels.
    if setarch "$(uname -m)" --addr-no-randomize true 2>/dev/null; then
        with=(setarch "$(uname -m)" --addr-no-randomize)
    fi
fi

cmake --preset "$preset" >/dev/null
cmake --build --preset "$preset"
"${with[@]}" ctest --preset "$preset" --parallel "${CMAKE_BUILD_PARALLEL_LEVEL:-1}" --progress

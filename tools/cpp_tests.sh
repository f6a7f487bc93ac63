#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Builds and runs the C++ tests of one preset: tools/cpp_tests.sh dev|release|asan|tsan|rtsan
#
# The sanitizers make a program ten times slower, so they run a tenth of the cases. Below a test scale of 10 the presets
# asan, tsan and release run some tests only: threads, USB and the device side with the sanitizers, numerics with full optimization.
set -euo pipefail

preset=$1
scale=${PALPATE_TEST_SCALE:-1}
built=()
chosen=()
with=()
sample() {
    if [ "$scale" -lt 10 ]; then
        built=(--target "$@")
        chosen=(--label-regex "^($(IFS='|' && echo "$*"))$")
    fi
}

case $preset in
asan | tsan)
    sample test_realtime test_usb_device test_palpate_device
    export PALPATE_TEST_SCALE=$(((scale + 9) / 10))
    ;;
release) sample test_model ;;
# The device on an emulated microcontroller runs in a second program, and the same device in C in this one.
dev) if [ "$scale" -lt 10 ]; then chosen=(--exclude-regex 'on device-m4$'); fi ;;
# A compiler without this sanitizer is refused by CMake.
rtsan) built=(--target test_run) ;;
esac
# The thread sanitizer of older compilers fails with the address randomization of newer kernels.
if [ "$preset" = tsan ] && setarch "$(uname -m)" --addr-no-randomize true 2>/dev/null; then
    with=(setarch "$(uname -m)" --addr-no-randomize)
fi

cmake --preset "$preset" >/dev/null
cmake --build --preset "$preset" "${built[@]}"
if [ "$preset" = rtsan ]; then
    # Only these tests run a tick without a forbidden action.
    exec build/rtsan/tests/cpp/test_run --gtest_brief=1 --gtest_filter='Controller.*:Tick.*:Campaign.*'
fi
# The tests depend on the programs, on files of tests/ and docs/figures/, and on the scale alone. Tests that passed run
# again after one of these has changed; rm build/PRESET/passed runs them anyway.
tested="$scale $({
    find "build/$preset" -type f -perm -u+x
    find tests docs/figures -type f -not -path '*/__pycache__/*' -not -path 'tests/python/*'
} | LC_ALL=C sort | tr '\n' '\0' | xargs -0 sha256sum | sha256sum)"
if [ "$(cat "build/$preset/passed" 2>/dev/null)" = "$tested" ]; then
    echo "$preset: the C++ tests passed with these programs and files"
    exit
fi
"${with[@]}" ctest --preset "$preset" "${chosen[@]}" --parallel "${CMAKE_BUILD_PARALLEL_LEVEL:-1}" --progress
echo "$tested" >"build/$preset/passed"

#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Compiles the C++ tests of the headers that work on every system for Windows, with MinGW, and runs them under Wine:
# tools/windows_tests.sh [FOLDER...]
set -euo pipefail
cd "$(dirname "$0")/.."

folders=("$@")
if [ "${#folders[@]}" -eq 0 ]; then
    folders=(device dynamics fields guard model portable rendering simulation solver stability)
fi
build="$PWD/build/windows"
googletest=/usr/src/googletest/googletest
compile=("$(command -v x86_64-w64-mingw32-g++-posix)" -std=c++20 -O1 -static -Wall -Wextra -Werror
    -isystem "$googletest/include" -I"$googletest")
export WINEPREFIX="$build/wine" WINEDEBUG=-all
mkdir -p "$build/include"
ln -sfn /usr/include/nlohmann "$build/include/nlohmann"
for part in all _main; do
    [ -e "$build/gtest$part.obj" ] ||
        "${compile[@]}" -c "$googletest/src/gtest${part/all/-all}.cc" -o "$build/gtest$part.obj"
done
for folder in "${folders[@]}"; do
    for test in "$PWD/tests/cpp/$folder"/test_*.cpp; do
        # live control and its devices need Linux
        grep --quiet -E '"(palpate/(run/session|device/(can|wheel|web_socket))|emulated_wheel)' "$test" ||
            echo "#include \"$test\""
    done >"$build/$folder.cpp"
    "${compile[@]}" -Icpp/include -Icpp -Itests/cpp -Ibench -isystem "$build/include" \
        "-DPALPATE_SOURCE_DIR=\"$PWD\"" "$build/$folder.cpp" "$build"/gtest*.obj -o "$build/$folder.exe"
    /usr/lib/wine/wine64 "$build/$folder.exe" --gtest_brief=1
done

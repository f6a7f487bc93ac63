#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Runs clang-format on all C++ sources and clang-tidy on the headers and the bindings. clang-tidy checks clean sources
# again only after one of them or the settings have changed. All bindings are one compilation, because most of the time
# is spent on the headers that they include.
set -euo pipefail
export LC_ALL=C

find cpp tests bench examples packaging \( -name '*.hpp' -o -name '*.cpp' \) -print0 |
    xargs -0r .venv/bin/clang-format --dry-run --Werror

export commands cache sources
commands=build/control
cache=build/clang-tidy
sources=$({
    .venv/bin/clang-tidy --version
    find cpp \( -name '*.hpp' -o -path '*/bindings/*.cpp' \) -print0 | sort -z | xargs -0 cat .clang-tidy
} | sha256sum)
mkdir -p "$cache"
find "$PWD/cpp/bindings" -name '*.cpp' | sort | sed 's/.*/#include "&"/' >"$cache/bindings.cpp"

tidy() {
    local source=$1 mark flags=()
    mark="$cache/$(echo "$sources" "$source" | sha256sum | cut -c1-40)"
    [ -e "$mark" ] && return
    case $source in
    *.hpp) flags=(-- -std=c++20 -Icpp/include -x c++ -Wno-pragma-once-outside-header) ;;
    # In the bindings the analyzer would check the code of pybind11. The compiler reports deprecated calls; its options
    # may be those of GCC only.
    *) flags=(-p "$commands" "--checks=-clang-analyzer-*,-bugprone-suspicious-include"
        --extra-arg=-Wno-deprecated-declarations --extra-arg=-Wno-unknown-warning-option) ;;
    esac
    if .venv/bin/clang-tidy --quiet "$source" "${flags[@]}" 2>/dev/null; then
        touch "$mark"
    else
        echo "clang-tidy reports errors in $source" >&2
        return 1
    fi
}
export -f tidy

printf '%s\0' "$cache/bindings.cpp" cpp/include/palpate/palpate.hpp |
    xargs -0r -n 1 -P "${CMAKE_BUILD_PARALLEL_LEVEL:-1}" bash -c 'tidy "$1"' tidy

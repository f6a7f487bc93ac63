#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Prints the share of lines and branches that the tests execute, for each folder of the C++ headers, for palpate-control
# and for identification: tools/coverage.sh
#
# A branch is one of the two values of a condition. The instances of a template count as one: a branch is executed if one
# instance executes it. build/coverage/missed.txt lists the other branches; build/coverage/html/index.html shows the lines.
set -euo pipefail
cd "$(dirname "$0")/.."

build=build/coverage
rm -rf "$build/profiles"
# One file for each program, to which its runs add their counts.
export LLVM_PROFILE_FILE=$PWD/$build/profiles/%4m.profraw
tools/cpp_tests.sh coverage || echo "some C++ tests failed" >&2
PALPATE_CONTROL=$PWD/$build/palpate-control OPENBLAS_NUM_THREADS=1 .venv/bin/python -m pytest --quiet \
    tests/python/control tests/python/devices tests/python/cli/test_any_arguments.py ||
    echo "some tests of palpate-control failed" >&2

programs=("$build/palpate-control")
while IFS= read -r program; do
    programs+=("-object=$program")
done < <(find "$build/tests" -type f -name 'test_*' -perm -u+x)
llvm-profdata merge --sparse --output "$build/all.profdata" "$build"/profiles/*.profraw
sources=("-instr-profile=$build/all.profdata" "-ignore-filename-regex=^/usr/|/(tests|bench|examples|_deps)/")
llvm-cov export "${programs[@]}" "${sources[@]}" -skip-functions >"$build/branches.json"
llvm-cov export "${programs[@]}" "${sources[@]}" -format=lcov >"$build/lines.lcov"
llvm-cov show "${programs[@]}" "${sources[@]}" -show-branches=count -show-instantiations=false -format=html \
    -output-dir="$build/html" >/dev/null
OPENBLAS_NUM_THREADS=1 .venv/bin/python -m pytest --quiet --numprocesses "${CMAKE_BUILD_PARALLEL_LEVEL:-1}" \
    --cov=palpate.identification --cov-branch --cov-report=json:"$build/identification.json" \
    --cov-report=html:"$build/identification" tests/python/identification
.venv/bin/python tools/coverage_table.py "$build"

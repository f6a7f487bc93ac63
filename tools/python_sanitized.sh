#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Runs Python tests with a compiled module under sanitizers: tools/python_sanitized.sh asan|tsan [TESTS...]
#
# The preset asan also reports memory that calls of the module have not freed at the end of Python. Only tests within one
# process use this module: programs that a test starts load the usual one. The tests of the protections that the compiler
# adds are for the usual one.
set -euo pipefail
cd "$(dirname "$0")/.."

preset=$1
shift
build=build/python-$preset
python=.venv/bin/python
tests=("$@")
if [ ${#tests[@]} -eq 0 ]; then
    tests=(tests/python/core tests/python/model tests/python/planning tests/python/verification tests/python/identification/network)
fi

cmake --preset "$preset" -B "$build" -DPALPATE_BUILD_TESTS=OFF -DPALPATE_BUILD_PYTHON=ON \
    -DPALPATE_WARNINGS_AS_ERRORS=OFF \
    -DPython_EXECUTABLE="$PWD/$python" -Dpybind11_DIR="$($python -m pybind11 --cmakedir)" >/dev/null
cmake --build "$build" --target _core
rm -rf "$build/site"
mkdir -p "$build/site"
cp -r python/palpate "$build/site/"
cp "$build"/cpp/_core*.so "$build/site/palpate/"

case $preset in
asan) library=libasan.so ;;
tsan) library=libtsan.so ;;
esac
libraries=$($python -c 'import sysconfig; print(sysconfig.get_path("purelib"))')
rm -f "$build"/report.*
export PYTHONPATH=$PWD/$build/site:$libraries
export PYTHONMALLOC=malloc PYTHONDONTWRITEBYTECODE=1 OPENBLAS_NUM_THREADS=1
export ASAN_OPTIONS=detect_leaks=1:log_path=$build/report UBSAN_OPTIONS=print_stacktrace=1
export LSAN_OPTIONS=exitcode=0 TSAN_OPTIONS=log_path=$build/report
status=0
# -S: the editable package of the environment is not found. libstdc++: its exceptions are intercepted from the start.
LD_PRELOAD="$(${CXX:-c++} -print-file-name=$library) $(${CXX:-c++} -print-file-name=libstdc++.so)" \
    setarch "$(uname -m)" --addr-no-randomize "$PWD/$python" -S -m pytest -p no:cacheprovider \
    --ignore tests/python/core/test_hardening.py "${tests[@]}" || status=$?
# Python and its libraries keep memory until the end, and so do the names that the module registers when it is loaded.
if [ "$preset" = asan ] && awk -v RS= '/_core\.cpython/ && !/PyInit__core/ { print; found = 1 } END { exit !found }' \
    "$build"/report.* /dev/null; then
    echo "calls of the module leaked memory" >&2
    status=1
fi
exit "$status"

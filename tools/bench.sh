#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Builds and runs every study: tools/bench.sh [FOLDER]. Writes one JSON file for each study to build/bench/, and figures
# and tables of the pages to FOLDER (default: build/bench). Fails if a benchmark gives a wrong result.
set -euo pipefail

to=${1:-build/bench}

scale=${PALPATE_BENCH_SCALE:-1}
seconds=$(awk -v scale="$scale" 'BEGIN { print 0.1 * scale }')
repetitions=$(awk -v scale="$scale" 'BEGIN { print scale < 0.1 ? 1 : 5 }')
blocks=$(awk -v scale="$scale" 'BEGIN { print scale < 0.1 ? 1 : 10 }')
governor=$(cat /sys/devices/system/cpu/cpu0/cpufreq/scaling_governor 2>/dev/null || echo unknown)
commit=$(git describe --always --dirty 2>/dev/null || echo unknown)

cmake --preset release >/dev/null
cmake --build --preset release --target benchmarks
mkdir -p build/bench

processor=$(awk -F': ' '/^model name/ { print $2; exit }' /proc/cpuinfo 2>/dev/null || uname -m)
compiler=$(awk -F= '/^CMAKE_CXX_COMPILER:/ { print $2 }' build/release/CMakeCache.txt)
flags=$(awk -F= '/^CMAKE_CXX_FLAGS_RELEASE:/ { print $2 }' build/release/CMakeCache.txt)

for source in bench/solvers/bench_*.cpp; do
    name=$(basename "$source" .cpp)
    "build/release/bench/$name" \
        --benchmark_min_time="$seconds" --benchmark_repetitions="$repetitions" \
        --benchmark_enable_random_interleaving=true --benchmark_display_aggregates_only=true \
        --benchmark_out="build/bench/$name.json" --benchmark_out_format=json \
        --benchmark_context=commit="$commit" --benchmark_context=governor="$governor" \
        --benchmark_context=compiler="$("$compiler" --version | head -1 | tr ', ' '__')" \
        --benchmark_context=flags="${flags// /_}" --benchmark_context=processor="${processor//[ ,]/_}"
    if grep -q '"error_occurred": true' "build/bench/$name.json"; then
        echo "$name: a benchmark gave a wrong result" >&2
        exit 1
    fi
done
study() {
    echo
    .venv/bin/python "bench/$1.py" "${@:2}"
}
study solvers/python_calls build/bench/bench_python_calls.json
study solvers/model_error build/bench/bench_model_error.json
study solvers/ratios build/bench
study solvers/speed build/bench --to "$to/figures"
for name in compare_methods filters parsimony real_data dynamic; do
    study "identification/$name" --json "build/bench/$name.json"
done
study identification/figures build/bench --to "$to"
"build/release/bench/certificate_search" "$(awk -v scale="$scale" 'BEGIN { print int(2 + 63 * scale) }')" |
    tee build/bench/certificate_search.txt
study limits/certificate_table build/bench/certificate_search.txt --to "$to"
study limits/failure_maps --to "$to" --points "$(awk -v scale="$scale" 'BEGIN { print scale < 0.1 ? 2 : 9 }')"
study limits/prediction --to "$to"
study plans/on_device_stiffness --to "$to"
study portable/cost --to "$to" --json build/bench/portable_cost.json
study plans/plan_against_trial --to "$to" --grid "$(awk -v scale="$scale" 'BEGIN { print scale < 0.1 ? 0 : 4 }')"
echo "Results: build/bench/*.json; compare two runs with compare.py of Google Benchmark. Figures: $to/figures"

echo "Lateness of the real-time loop compared with cyclictest"
cmake --preset control >/dev/null
cmake --build --preset control >/dev/null
if command -v cyclictest >/dev/null; then
    .venv/bin/python tools/lateness.py build/control/palpate-control tests/models/good/position.json \
        build/bench/lateness.json --seconds "$(awk -v scale="$scale" 'BEGIN { print 20 * scale }')" --blocks "$blocks"
else
    echo "skipped: needs cyclictest (Debian: rt-tests)"
fi

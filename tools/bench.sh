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

for source in bench/solvers/bench_*.cpp bench/admittance/bench_admittance.cpp; do
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
"build/release/bench/certificate_search" "$(awk -v scale="$scale" 'BEGIN { print int(2 + 63 * scale) }')" |
    tee build/bench/certificate_search.txt
build/release/bench/cogging_search "$(awk -v scale="$scale" 'BEGIN { print scale < 0.1 ? 30 : 10000 * scale }')" |
    tee build/bench/cogging_search.txt

# Runs the studies of its input, one a line. A short run only tests them, two at a time; times are measured alone.
at_once=$(awk -v scale="$scale" 'BEGIN { print scale < 0.1 ? 2 : 1 }')
if [ "$at_once" -gt 1 ]; then export OPENBLAS_NUM_THREADS=1; fi # as for the tests
studies() { xargs -P "$at_once" -I STUDY bash -c 'echo; .venv/bin/python bench/STUDY'; }
studies <<END
solvers/python_calls.py build/bench/bench_python_calls.json
solvers/model_error.py build/bench/bench_model_error.json
identification/compare_methods.py --json build/bench/compare_methods.json
identification/several_inputs.py --json build/bench/several_inputs.json
identification/filters.py --json build/bench/filters.json
identification/parsimony.py --json build/bench/parsimony.json
identification/noise.py --json build/bench/noise.json
identification/force_lag.py --json build/bench/force_lag.json
identification/real_data.py --json build/bench/real_data.json
identification/dynamic.py --json build/bench/dynamic.json
identification/repeats.py --json build/bench/repeats.json
identification/memory.py
identification/ordinary.py --jobs 1 --json build/bench/ordinary.json
identification/invariances.py --jobs 1 --json build/bench/invariances.json
limits/certificate_table.py build/bench/certificate_search.txt --to $to
limits/failure_maps.py --to $to --points $(awk -v scale="$scale" 'BEGIN { print scale < 0.1 ? 2 : 9 }')
limits/prediction.py --to $to
rivals/rivals.py --to $to
plans/on_device_stiffness.py --to $to
plans/held_lines.py --to $to $([ "$at_once" -gt 1 ] && echo --devices 1)
plans/held_objects.py --to $to $([ "$at_once" -gt 1 ] && echo --every 1000)
admittance/admittance.py --to $to
portable/cost.py --to $to --json build/bench/portable_cost.json
plans/plan_against_trial.py --to $to --grid $(awk -v scale="$scale" 'BEGIN { print scale < 0.1 ? 0 : 4 }')
END
# These draw the results of the others.
studies <<END
solvers/ratios.py build/bench
solvers/speed.py build/bench --to $to/figures
identification/figures.py build/bench --to $to
END
echo "Results: build/bench/*.json; compare two runs with compare.py of Google Benchmark. Figures: $to/figures"

echo "Lateness of the real-time loop compared with cyclictest"
if command -v cyclictest >/dev/null; then
    .venv/bin/python tools/lateness.py build/control/palpate-control tests/models/good/position.json \
        build/bench/lateness.json --seconds "$(awk -v scale="$scale" 'BEGIN { print 20 * scale }')" --blocks "$blocks"
else
    echo "skipped: needs cyclictest (Debian: rt-tests)"
fi

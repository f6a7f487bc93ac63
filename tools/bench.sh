#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Builds and runs every study: tools/bench.sh [FOLDER]. Writes one JSON file for each study to build/bench/, and figures
# and tables of the pages to FOLDER (default: build/bench). Fails if a benchmark gives a wrong result.
#
# tools/bench.sh --sample is the run of every change: one study of each folder at a hundredth of its size. These are the
# programs in `sample` and the lines marked + below.
set -euo pipefail

sample=()
if [ "${1:-}" = --sample ]; then
    sample=(bench_structures bench_admittance rivals)
    export PALPATE_BENCH_SCALE=0.01
    shift
fi
in_sample() { [ ${#sample[@]} = 0 ] || [[ " ${sample[*]} " = *" $1 "* ]]; }

to=${1:-build/bench}
scale=${PALPATE_BENCH_SCALE:-1}
seconds=$(awk -v scale="$scale" 'BEGIN { print 0.1 * scale }')
# A short run only tests the studies. Its programs are those of the C++ tests, which compile in half the time.
is_short=$(awk -v scale="$scale" 'BEGIN { print (scale < 0.1) }')
full_or_short() { if [ "$is_short" = 1 ]; then echo "$2"; else echo "$1"; fi; }
preset=$(full_or_short release dev)
programs=build/$preset/bench
governor=$(cat /sys/devices/system/cpu/cpu0/cpufreq/scaling_governor 2>/dev/null || echo unknown)
commit=$(git describe --always --dirty 2>/dev/null || echo unknown)

cmake --preset "$preset" >/dev/null
cmake --build --preset "$preset" --target "${sample[@]:-benchmarks}"
mkdir -p build/bench

processor=$(awk -F': ' '/^model name/ { print $2; exit }' /proc/cpuinfo 2>/dev/null || uname -m)
compiler=$(awk -F= '/^CMAKE_CXX_COMPILER:/ { print $2 }' "build/$preset/CMakeCache.txt")
flags=$(awk -F= "/^CMAKE_CXX_FLAGS_$(full_or_short RELEASE DEBUG):/ { print \$2 }" "build/$preset/CMakeCache.txt")

for source in bench/solvers/bench_*.cpp bench/admittance/bench_admittance.cpp; do
    name=$(basename "$source" .cpp)
    in_sample "$name" || continue
    "$programs/$name" \
        --benchmark_filter="${sample:+16$}" --benchmark_min_time="$seconds" --benchmark_repetitions="$(full_or_short 5 1)" \
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
if in_sample certificate_search; then
    "$programs/certificate_search" "$(awk -v scale="$scale" 'BEGIN { print int(1 + 64 * scale) }')" |
        tee build/bench/certificate_search.txt
fi
if in_sample cogging_search; then
    "$programs/cogging_search" "$(awk -v scale="$scale" 'BEGIN { print scale < 0.1 ? 30 : 10000 * scale }')" |
        tee build/bench/cogging_search.txt
fi

# Runs the studies of its input, one a line; a sample runs those marked +. A short run runs two at a time; times are
# measured alone.
if [ "$is_short" = 1 ]; then export OPENBLAS_NUM_THREADS=1; fi # as for the tests
chosen() { if [ ${#sample[@]} = 0 ]; then sed 's/^[+ ] //'; else sed -n 's/^+ //p'; fi; }
studies() { chosen | xargs -P "$(full_or_short 1 2)" -I STUDY bash -c 'echo; .venv/bin/python bench/STUDY'; }
studies <<END
+ solvers/python_calls.py build/bench/bench_python_calls.json
  solvers/model_error.py build/bench/bench_model_error.json
+ identification/compare_methods.py --json build/bench/compare_methods.json
  identification/several_inputs.py --json build/bench/several_inputs.json
  identification/filters.py --json build/bench/filters.json
  identification/parsimony.py --json build/bench/parsimony.json
  identification/noise.py --json build/bench/noise.json
  identification/real_data.py --json build/bench/real_data.json
  identification/dynamic.py --json build/bench/dynamic.json
  identification/repeats.py --json build/bench/repeats.json
  identification/memory.py
  identification/growing_loops.py
  identification/joints.py --json build/bench/joints.json
  identification/ordinary.py --jobs 1 --json build/bench/ordinary.json
  identification/invariances.py $(full_or_short "" "half_the_rate repeated_rows --draws 1") --jobs 1 --json build/bench/invariances.json
  limits/certificate_table.py build/bench/certificate_search.txt --to $to
  limits/failure_maps.py --to $to --points $(full_or_short 9 2)
+ limits/prediction.py --to $to
+ rivals/rivals.py --to $to
  plans/on_device_stiffness.py --to $to
  plans/held_lines.py --to $to $(full_or_short "" "--devices 1")
  plans/held_objects.py --to $to $(full_or_short "" "--every 1000")
  admittance/admittance.py --to $to
+ portable/cost.py --to $to --json build/bench/portable_cost.json
+ plans/plan_against_trial.py --to $to --grid $(full_or_short 4 0)
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
        build/bench/lateness.json --seconds "$(awk -v scale="$scale" 'BEGIN { print 20 * scale }')" --blocks "$(full_or_short 10 1)"
else
    echo "skipped: needs cyclictest (Debian: rt-tests)"
fi

#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Builds and runs the fuzz targets in tests/fuzz one after the other: tools/fuzz.sh SECONDS [TARGET...], for example
# tools/fuzz.sh 3600 firmware. Each target runs for SECONDS and prints one line.
#
# Fails at the first crash, broken promise, leak, hang or use of too much memory, and names the file with the input:
# build/fuzz/tests/fuzz/fuzz_TARGET FILE runs it again. Inputs that reach new code are kept in build/fuzzing/TARGET.
set -euo pipefail

seconds=$1
shift
hang_s=20
memory_mb=1024

declare -A longest=([packets]=192 [firmware]=160 [exported_model]=96 [device_profile]=1024 [inverse3]=1024
    [web_socket]=1024)
targets=("$@")
if [ "${#targets[@]}" -eq 0 ]; then
    for source in tests/fuzz/fuzz_*.cpp; do
        name=$(basename "$source" .cpp)
        targets+=("${name#fuzz_}")
    done
fi

cmake --preset fuzz >/dev/null
cmake --build --preset fuzz --target "${targets[@]/#/fuzz_}"
export UBSAN_OPTIONS=print_stacktrace=1

for target in "${targets[@]}"; do
    found=build/fuzzing/$target
    log=build/fuzzing/$target.log
    options=(-max_total_time="$seconds" -timeout="$hang_s" -rss_limit_mb="$memory_mb" -print_final_stats=1
        -max_len="${longest[$target]:-8192}" -artifact_prefix="build/fuzzing/$target-")
    [ -e "tests/fuzz/$target.dict" ] && options+=(-dict="tests/fuzz/$target.dict")
    mkdir -p "$found"
    if ! "build/fuzz/tests/fuzz/fuzz_$target" "${options[@]}" "$found" "tests/fuzz/seeds/$target/" >"$log" 2>&1; then
        grep -E '^(broken promise|SUMMARY|==[0-9]+== ?ERROR|.*Test unit written)' "$log" >&2 || tail -20 "$log" >&2
        echo "$target: failed; the whole output is in $log" >&2
        exit 1
    fi
    awk -v target="$target" '
        /^#/ { for (k = 1; k < NF; ++k) { if ($k == "cov:") edges = $(k + 1); if ($k == "ft:") features = $(k + 1) } }
        /^Done / { runs = $2; time = $5 }
        END { printf "%-16s %11d executions, %5d edges, %6d features, %5d s, nothing found\n", target, runs, edges, features, time }
    ' "$log"
done

#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Prints the share of lines and branches that the tests execute, for each folder of the C++ headers, of palpate-control
# and of identification: tools/coverage.sh
#
# Branches of exceptions that the compiler adds are not counted. build/coverage/index.html shows the lines.
set -euo pipefail
cd "$(dirname "$0")/.."

build=build/coverage
find "$build" -name '*.gcda' -delete 2>/dev/null || true
tools/cpp_tests.sh coverage || echo "some C++ tests failed" >&2
PALPATE_CONTROL=$PWD/$build/palpate-control \
    .venv/bin/python -m pytest --quiet tests/python/control tests/python/devices tests/python/cli/test_any_arguments.py ||
    echo "some tests of palpate-control failed" >&2
.venv/bin/gcovr --root . --filter 'cpp/(include|control)/' --exclude-throw-branches --exclude-unreachable-branches \
    --gcov-ignore-parse-errors --merge-mode-functions separate --object-directory "$build" \
    --json-summary "$build/summary.json" --html-details "$build/index.html" "$build"
OPENBLAS_NUM_THREADS=1 .venv/bin/python -m pytest --quiet --numprocesses "${CMAKE_BUILD_PARALLEL_LEVEL:-1}" \
    --cov=palpate.identification --cov-branch --cov-report=json:"$build/identification.json" \
    --cov-report=html:"$build/identification" tests/python/identification
.venv/bin/python - "$build/summary.json" "$build/identification.json" <<'PYTHON'
import collections, json, sys
from pathlib import Path

counts = collections.defaultdict(lambda: [0, 0, 0, 0])
for file in json.loads(Path(sys.argv[1]).read_text())["files"]:
    parts = Path(file["filename"]).parts
    folder = parts[3] if parts[1] == "include" and len(parts) > 4 else "control" if parts[1] == "control" else "."
    for k, name in enumerate(("line_covered", "line_total", "branch_covered", "branch_total")):
        counts[folder][k] += file[name]
python = json.loads(Path(sys.argv[2]).read_text())["totals"]
counts["identification"] = [
    python[name] for name in ("covered_lines", "num_statements", "covered_branches", "num_branches")
]
for folder, (lines, all_lines, branches, all_branches) in sorted(counts.items()):
    print(f"{folder:14} lines {100 * lines / all_lines:5.1f} %   branches {100 * branches / max(all_branches, 1):5.1f} %")
PYTHON

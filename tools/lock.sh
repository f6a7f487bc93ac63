#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Writes tools/locked/GROUP.txt for each dependency group of pyproject.toml: exact versions with their SHA-256, for all
# supported versions of Python and all architectures. `make` installs nothing else from the internet with pip.
#
#   tools/lock.sh             adds missing packages of pyproject.toml and keeps all other versions; needs `pip install uv`
#   tools/lock.sh --upgrade   takes the newest versions
set -euo pipefail
cd "$(dirname "$0")/.."

groups=(build test lint package simulators docs coverage)
export UV_PYTHON_DOWNLOADS=never
everything=$(mktemp)
trap 'rm -f "$everything"' EXIT
oldest=$(sed -n 's/^requires-python = ">=\(.*\)"/\1/p' pyproject.toml)
lock() {
    uv pip compile --quiet --universal --python-version "$oldest" --no-annotate --no-header "$@"
}

# One version of a package in all files: first all groups together, then each with these versions.
cat tools/locked/*.txt >"$everything" 2>/dev/null || true
lock pyproject.toml --output-file "$everything" "${groups[@]/#/--group=}" "$@"
for group in "${groups[@]}"; do
    file=tools/locked/$group.txt
    packages=()
    if [ "$group" = build ]; then packages=(pyproject.toml); fi # with the packages that palpate imports
    {
        echo "# SPDX-License-Identifier: Apache-2.0"
        echo "# Written by tools/lock.sh."
        lock "${packages[@]}" --generate-hashes --group "$group" --constraint "$everything" --upgrade
    } >"$file.new"
    mv "$file.new" "$file"
done

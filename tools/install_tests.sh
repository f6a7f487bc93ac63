#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Installs and uses the package like a user: the headers with find_package, the wheel of `pip install .` in an
# environment that is independent of this folder.
set -euo pipefail

place=build/install
rm -rf "$place"
mkdir -p "$place"

echo "find_package(palpate)"
cmake -S . -B "$place/palpate" -G Ninja >/dev/null
cmake --install "$place/palpate" --prefix "$place/prefix" >/dev/null
cmake -S tests/install -B "$place/consumer" -G Ninja "-DCMAKE_PREFIX_PATH=$PWD/$place/prefix" >/dev/null
cmake --build "$place/consumer"
"$place/consumer/consumer"

echo "pip install ."
dependencies=$(.venv/bin/python -c 'import sysconfig; print(sysconfig.get_path("purelib"))')
.venv/bin/python -m venv --without-pip "$place/venv"
# Uses numpy and the other dependencies of .venv. The editable installation, a .pth file there, is not visible.
"$place/venv/bin/python" - "$dependencies" <<'PYTHON'
import sys, sysconfig
with open(sysconfig.get_path("purelib") + "/dependencies.pth", "w") as file:
    file.write(sys.argv[1] + "\n")
PYTHON
# The options are those of the editable installation, so that its compiled module is used again.
.venv/bin/python -m pip --python "$place/venv/bin/python" install --quiet --no-deps --ignore-installed \
    --no-build-isolation --config-settings cmake.define.PALPATE_WARNINGS_AS_ERRORS=ON .
cd "$place"
venv/bin/python -c '
import importlib.metadata, palpate, palpate._core
assert "install" in palpate.__file__ and "install" in palpate._core.__file__, palpate.__file__
top = {file.parts[0] for file in importlib.metadata.files("palpate")}
assert all(name.startswith(("palpate", "..")) for name in top), top
names = {file.name for file in importlib.metadata.files("palpate")}
assert "py.typed" in names and any(name.endswith(".pyi") for name in names), names
'
venv/bin/palpate --version

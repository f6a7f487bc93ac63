# SPDX-License-Identifier: Apache-2.0
# The front door. `make demo` and `make test` need a Debian or Ubuntu machine with Python >= 3.10, and nothing else.
#
#   make demo         identify, verify and render the sample scene; pictures in demo/
#   make test         build, C++ tests, Python tests, lint                        (minutes)
#   make control      build palpate-control, the real-time program: build/control/palpate-control
#   make test-full    the same tests with long counts, under the sanitizers, and as installed  (an hour)
#   make bench        all studies, JSON and figures in build/bench/
#   make figures      the same studies, figures and generated pages in docs/
#   make lint | format | stubs | output | clean
#
# Paths are relative on purpose: the folder may have a space in its name.

SHELL := /bin/bash
.SHELLFLAGS := -euo pipefail -c
.DELETE_ON_ERROR:
.DEFAULT_GOAL := help

PYTHON ?= python3

# How many random cases a test draws: 1 for every change, 100 for the long run. How long a benchmark runs: 1 for
# numbers that are published, 0.01 to see that all run and that their answers are right. Both can be set from outside.
# The sanitizers slow a program ten times and get a tenth of the cases.
test test-cpp test-python: export PALPATE_TEST_SCALE ?= 1
test-full test-full-native: export PALPATE_TEST_SCALE ?= 100
bench figures: export PALPATE_BENCH_SCALE ?= 1

export CMAKE_BUILD_PARALLEL_LEVEL ?= $(shell nproc)
# Nothing outside this folder is touched: no download cache and no font cache in the home directory.
export PIP_NO_CACHE_DIR ?= 1
export PIP_DISABLE_PIP_VERSION_CHECK := 1
export PIP_CONSTRAINT := tools/constraints.txt
export MPLCONFIGDIR ?= $(CURDIR)/build/matplotlib

python := .venv/bin/python
stamps := .venv/stamps

core_sources := CMakeLists.txt $(shell find cpp cmake -type f)
# A virtual environment and a build tree hold absolute paths: in a folder that was moved, start again.
moved := $(shell [ "$$(cat .venv/folder 2>/dev/null)" = "$$(pwd -P)" ] || echo moved)

.PHONY: help demo control test test-full test-full-native test-cpp test-python bench figures lint lint-python lint-cpp lint-stubs format stubs output \
        setup clean moved

help:
	@sed -n 's/^#   //p' Makefile

# ---------------------------------------------------------------------------------------------------------- set-up

$(stamps)/build: pyproject.toml tools/constraints.txt tools/system_packages.sh $(moved)
	tools/system_packages.sh "$(PYTHON)" build
	if [ "$$(cat .venv/folder 2>/dev/null)" != "$$(pwd -P)" ]; then rm -rf .venv build; "$(PYTHON)" -m venv .venv; fi
	$(python) -m pip install --quiet --upgrade pip
	$(python) -m pip install --quiet --group build
	mkdir -p $(stamps) && pwd -P > .venv/folder
	touch $@

# The compiled module, and the package in place: Python sources are live, C++ sources bring us here again.
$(stamps)/core: $(stamps)/build $(core_sources)
	$(python) -m pip install --quiet --no-build-isolation -C cmake.define.PALPATE_WARNINGS_AS_ERRORS=ON --editable .
	touch $@

# After core, because two pips must not work in one environment at the same time.
$(stamps)/develop: $(stamps)/build | $(stamps)/core
	tools/system_packages.sh "$(PYTHON)" test
	$(python) -m pip install --quiet --group test --group lint
	touch $@

setup: $(stamps)/core $(stamps)/develop

# ------------------------------------------------------------------------------------------------------------- use

demo: $(stamps)/core
	.venv/bin/palpate demo

# Python's summary stands last, where it is looked for.
test: lint test-cpp | setup
	$(MAKE) --no-print-directory test-python

# One process more than there are processors, since many tests wait for a clock; files in their order, since the
# longest ones hold few tests and would begin last.
test-python: setup control
	$(python) -m pytest --numprocesses "$$(($(CMAKE_BUILD_PARALLEL_LEVEL) + 1))" --dist loadfile --no-loadscope-reorder

# The real-time program; the build tool knows what is up to date.
control: $(stamps)/develop
	cmake --preset control >/dev/null
	cmake --build --preset control

test-cpp: setup
	tools/cpp_tests.sh dev

test-full: test-full-native
	$(MAKE) --no-print-directory test-python

# What `make test` does not do at any size: sanitizers, the package as installed, a USB device below a kernel.
test-full-native: setup control
	tools/cpp_tests.sh release
	for preset in asan tsan; do tools/cpp_tests.sh $$preset; done
	tools/install_tests.sh
	$(python) -m pytest tests/usb

bench: setup
	tools/bench.sh

figures: setup
	tools/bench.sh docs

# ------------------------------------------------------------------------------------------------------------ lint

lint: lint-python lint-cpp lint-stubs

lint-python: setup
	$(python) -m ruff check .
	$(python) -m ruff format --check .
	if $(python) -c "import sys; sys.exit(sys.version_info < (3, 11))"; then $(python) -m mypy; \
	else echo "mypy: skipped, the stubs of NumPy and pandas need Python 3.11"; fi

lint-cpp: setup
	tools/cpp_lint.sh

lint-stubs: setup
	$(python) tools/stubs.py --check

format: setup
	$(python) -m ruff check --fix .
	$(python) -m ruff format .
	git ls-files -z --cached --others --exclude-standard '*.hpp' '*.cpp' | xargs -0 .venv/bin/clang-format -i

stubs: setup
	$(python) tools/stubs.py

# The example output in README.md and docs/.
output: setup
	$(python) tools/example_output.py

clean:
	rm -rf build dist demo .venv .pytest_cache .mypy_cache .ruff_cache

# SPDX-License-Identifier: Apache-2.0
# All commands of the project. `make demo` and `make test` need only a Debian or Ubuntu machine with Python >= 3.10.
#
#   make demo         identify, verify and render the sample scene; pictures in demo/
#   make test         build, C++ tests, Python tests, lint                        (minutes)
#   make control      build palpate-control, the real-time program: build/control/palpate-control
#   make fuzz         fuzz targets of the C++ readers, FUZZ_SECONDS each: make fuzz FUZZ_SECONDS=3600
#   make test-full    all tests: long counts, sanitizers, fuzzing, real time, the installed package     (hours)
#   make coverage     lines and branches that the tests execute                        (an hour)
#   make mutants      share of small errors in the C++ headers that the tests find      (hours)
#   make bench        all studies, JSON and figures in build/bench/; make bench-sample: one study of each folder, short
#   make figures      the same studies, figures and generated pages in docs/
#   make docs         the documentation site: build/docs/html/index.html; every example and command of it is run
#   make lint | format | stubs | output | clean
#
# Paths are relative on purpose: the folder may have a space in its name.

SHELL := /bin/bash
.SHELLFLAGS := -euo pipefail -c
.DELETE_ON_ERROR:
.DEFAULT_GOAL := help

PYTHON ?= python3

# PALPATE_TEST_SCALE multiplies the random cases of a test: 1 for every change, 100 for the long run.
# PALPATE_BENCH_SCALE multiplies the duration of a benchmark: 1 for published numbers, 0.01 to test that all run and
# give correct results. The environment can set both. The sanitizers make a program ten times slower and get a tenth
# of the cases. tools/bench.sh lists the studies that are run for every change.
test test-cpp test-python: export PALPATE_TEST_SCALE ?= 1
test-full: export PALPATE_TEST_SCALE ?= 100
bench figures: export PALPATE_BENCH_SCALE ?= 1
# Test processes share the processors: with more threads, matrix products of one test take up to forty times as long.
test-python docs: export OPENBLAS_NUM_THREADS ?= 1
FUZZ_SECONDS ?= 120

export CMAKE_BUILD_PARALLEL_LEVEL ?= $(shell nproc)
# A compiler cache, where one is installed.
export CMAKE_C_COMPILER_LAUNCHER ?= $(shell command -v ccache)
export CMAKE_CXX_COMPILER_LAUNCHER ?= $(shell command -v ccache)
# Writes only below this folder: no download cache and no font cache in the home directory.
export PIP_NO_CACHE_DIR ?= 1
export PIP_DISABLE_PIP_VERSION_CHECK := 1
export MPLCONFIGDIR ?= $(CURDIR)/build/matplotlib
# The tests start many Python programs, which start faster with stored bytecode.
unexport PYTHONDONTWRITEBYTECODE

python := .venv/bin/python
# Two runs of pip must not change one environment at the same time, nor two builds the folder build/control.
alone := flock .venv/pip.lock
pip := $(alone) $(python) -m pip
# Exact versions with their SHA-256, and no package that runs its own build; tools/lock.sh writes the files.
# Python compiles a module when it is first imported, and most modules of these packages never are.
install_locked := $(pip) install --quiet --no-compile --require-hashes --only-binary :all: --requirement
# Two runs of apt-get must not overlap either.
system_packages := flock Makefile tools/system_packages.sh "$(PYTHON)"
stamps := .venv/stamps

core_sources := CMakeLists.txt $(shell find cpp cmake -type f)
# A virtual environment and a build tree contain absolute paths: they are created again after the folder was moved.
moved := $(shell [ "$$(cat .venv/folder 2>/dev/null)" = "$$(pwd -P)" ] || echo moved)
# The editable package finds only the files that it had when it was installed.
module_names := find python -name '*.py' | LC_ALL=C sort
renamed := $(shell $(module_names) | cmp -s - $(stamps)/modules 2>/dev/null || echo renamed)

.PHONY: help demo control test test-full test-cpp test-python fuzz examples test-packages coverage mutants bench bench-sample figures docs lint lint-python lint-cpp lint-stubs lint-language format stubs output \
        setup clean moved renamed

help:
	@sed -n 's/^#   //p' Makefile

# ---------------------------------------------------------------------------------------------------------- set-up

$(stamps)/build: tools/locked/build.txt tools/system_packages.sh $(moved)
	$(system_packages) build
	if [ "$$(cat .venv/folder 2>/dev/null)" != "$$(pwd -P)" ]; then rm -rf .venv build; "$(PYTHON)" -m venv .venv; fi
	$(install_locked) tools/locked/build.txt
	mkdir -p $(stamps) && pwd -P > .venv/folder
	touch $@

# The compiled module and the editable package: a change of a C++ source builds the module again. palpate-control is
# built in the same folder, because it consists of the same libraries.
$(stamps)/core: $(stamps)/build $(core_sources) $(renamed)
	@echo "Compiling palpate: two to three minutes on two cores"
	CMAKE_EXECUTABLE="$$(command -v cmake)" $(pip) install --quiet --no-deps --no-build-isolation -C build-dir=build/control \
	    -C cmake.define.PALPATE_WARNINGS_AS_ERRORS=ON -C cmake.define.PALPATE_BUILD_CONTROL=OFF --editable .
	$(module_names) > $(stamps)/modules
	touch $@

# The libraries of palpate-control and of the C++ tests; clang for the fuzz targets.
$(stamps)/control $(stamps)/test-cpp $(stamps)/fuzz: $(stamps)/build
	$(system_packages) "$(@F)"
	touch $@

# Tools by their group in pyproject.toml: tests, linters, tests of the packages and of the MuJoCo plugin.
$(stamps)/test $(stamps)/lint $(stamps)/package $(stamps)/simulators: $(stamps)/%: tools/locked/%.txt $(stamps)/build
	$(install_locked) "$<"
	touch $@

# The programs that build the documentation site, and those that count executed lines and branches.
$(stamps)/docs $(stamps)/coverage: $(stamps)/%: tools/locked/%.txt $(stamps)/build
	$(system_packages) "$(@F)"
	$(install_locked) "$<"
	touch $@

setup: $(stamps)/core $(stamps)/control $(stamps)/test-cpp $(stamps)/test $(stamps)/lint

# ------------------------------------------------------------------------------------------------------------- use

demo: $(stamps)/core
	.venv/bin/palpate demo
	@echo "The pictures are in demo/. Now type:  . .venv/bin/activate"
	@echo "and then:  palpate identify demo/sample-1.csv -o knob.json --plot knob.png"

# The linters use one processor, so the C++ tests run at the same time. The Python tests run last, so that their summary
# is at the end of the output.
test: | setup
	$(MAKE) --no-print-directory --jobs=2 --output-sync=line lint control test-cpp
	$(MAKE) --no-print-directory test-python

# Each process starts with a part of the files in their order, so that the tests of a file share its fixtures. One process
# more than processors, because tests wait for programs that they start.
parallel_pytest = $(python) -m pytest --numprocesses "$$(($(CMAKE_BUILD_PARALLEL_LEVEL) + 1))" --dist worksteal
test-python: setup control
	$(parallel_pytest)

# The real-time program; the build tool detects changed sources.
control: $(stamps)/control
	$(alone) cmake --preset control >/dev/null
	$(alone) cmake --build --preset control
	ln -sf ../../build/control/palpate-control .venv/bin/

# The examples in C++, which the Python tests run.
examples: setup
	cmake --preset dev >/dev/null
	cmake --build --preset dev --target example_programs

test-cpp: setup
	tools/cpp_tests.sh dev

# Random and mutated inputs for the readers and the state machines, with sanitizers.
fuzz: $(stamps)/core $(stamps)/fuzz
	tools/fuzz.sh $(FUZZ_SECONDS)

# All tests: with long counts, sanitizers, fuzzing, the packages, a USB device below a kernel, reports in a browser and
# exported models on a microcontroller. A line states how long each part took.
part = start=$$SECONDS && $(1) && echo "$$((SECONDS - start)) s: $(1)"
test-full: setup control examples $(stamps)/simulators
	$(call part,tools/cpp_tests.sh release)
	for preset in asan tsan; do \
	    $(call part,tools/cpp_tests.sh $$preset) && $(call part,tools/python_sanitized.sh $$preset) || exit; done
	$(call part,$(MAKE) --no-print-directory fuzz)
	$(call part,$(MAKE) --no-print-directory test-packages)
	$(system_packages) guest
	$(call part,$(python) -m pytest tests/usb tests/simulators)
	$(call part,PALPATE_BENCH_SCALE=0.01 tools/bench.sh)
	$(system_packages) windows
	$(call part,tools/windows_tests.sh)
	$(system_packages) browser
	$(system_packages) portable
	$(call part,$(parallel_pytest) -m "")

# Lines and branches that the tests execute, and small errors in the C++ headers that they find. For a change of
# tests: both take an hour or more.
coverage: setup $(stamps)/coverage
	tools/coverage.sh

mutants: setup $(stamps)/coverage
	$(python) tests/mutation/mutants.py model solver rendering stability guard run

# The packages as users install them.
test-packages: $(stamps)/core $(stamps)/control $(stamps)/test $(stamps)/package
	$(python) -m pytest tests/install

bench: setup control
	tools/bench.sh

bench-sample: setup control
	tools/bench.sh --sample

figures: setup control
	tools/bench.sh docs

# The documentation site, with the code of its pages, the examples and the README, which are executed. A warning is an
# error, and so is a broken link between pages.
docs: $(stamps)/core control $(stamps)/test $(stamps)/docs
	$(python) -m sphinx --nitpicky --fail-on-warning --keep-going --quiet --jobs auto docs build/docs/html
	$(python) -m pytest --quiet -m "docs and not full" tests/docs tests/python/test_readme.py

# ------------------------------------------------------------------------------------------------------------ lint

lint: lint-python lint-cpp lint-stubs lint-language

lint-python: setup
	$(python) -m ruff check .
	$(python) -m ruff format --check .
	if $(python) -c "import sys; sys.exit(sys.version_info < (3, 11))"; then $(python) -m mypy; \
	else echo "mypy: skipped, the stubs of NumPy and pandas need Python 3.11"; fi

lint-cpp: setup control
	tools/cpp_lint.sh

# The stubs are compared with the compiled module again after one of both, or the tool, has changed.
lint-stubs: setup $(stamps)/stubs

$(stamps)/stubs: $(stamps)/core $(stamps)/lint $(wildcard tools/stub*) $(shell find python/palpate -name '*.pyi' -o -name '*.schema.json')
	$(python) tools/stubs.py --check
	touch $@

# The texts are checked again after a file, or the list of files, has changed.
lint-language: setup $(stamps)/language

$(stamps)/language: $(stamps)/lint $(wildcard .git/index $(shell git ls-files 2>/dev/null))
	$(python) tools/plain_english.py
	touch $@

format: setup
	$(python) -m ruff check --fix .
	$(python) -m ruff format .
	git ls-files -z --cached --others --exclude-standard '*.hpp' '*.cpp' | xargs -0 .venv/bin/clang-format -i

stubs: setup
	$(python) tools/stubs.py

# The example output in README.md and docs/, the figure of README.md, and that of the app, which needs Chromium.
output: setup
	$(python) tools/example_output.py
	$(python) tools/readme_figure.py
	$(python) tools/app_figure.py

clean:
	rm -rf build dist demo docs/gallery docs/generated .venv .pytest_cache .mypy_cache .ruff_cache

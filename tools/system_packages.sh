#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Installs the missing Debian or Ubuntu packages, or prints one line with the packages to install.
#
#   tools/system_packages.sh PYTHON build|control|test-cpp|docs|guest|browser|portable|windows|fuzz|coverage
set -euo pipefail

python=$1
purpose=$2

compiles() { echo "$1" | "${CXX:-g++}" -std=c++20 -fsyntax-only -x c++ - 2>/dev/null; }
python_says() { "$python" -c "$1" >/dev/null 2>&1; }

fuzzes() { echo 'extern "C" int LLVMFuzzerTestOneInput(const char*, unsigned long) { return 0; }' |
    clang++ -fsanitize=fuzzer,address,undefined -o /dev/null -x c++ - 2>/dev/null; }
counts() { echo 'int main() {}' | clang++ -fprofile-instr-generate -o /dev/null -x c++ - 2>/dev/null; }
# The version of clang, also before it is installed.
clang_version() { clang -dumpversion 2>/dev/null | cut -d. -f1 | grep . ||
    apt-cache depends clang 2>/dev/null | sed -n 's/.*Depends: clang-\([0-9]*\)$/\1/p' | head -1; }
# clang with its runtime library, whose package has the version of clang in its name on some systems; the argument is a
# function that tries the library.
missing_clang() {
    command -v clang >/dev/null || echo clang
    "$1" || apt-cache pkgnames 2>/dev/null | grep -x "libclang-rt-$(clang_version)-dev" || true
}

missing_packages() {
    command -v "${CXX:-g++}" >/dev/null || echo g++
    command -v cmake >/dev/null || echo cmake
    command -v ninja >/dev/null || echo ninja-build
    python_says 'import sys' || echo python3
    python_says 'import venv, ensurepip' || echo python3-venv
    python_says 'import os, sysconfig
assert os.path.exists(os.path.join(sysconfig.get_path("include"), "Python.h"))' || echo python3-dev
    # The build of the compiled module needs the libraries for model files and USB. If they are installed later, the module
    # lacks these functions.
    command -v pkg-config >/dev/null || echo pkg-config
    compiles '#include <nlohmann/json.hpp>' || echo nlohmann-json3-dev
    compiles '#include <libusb-1.0/libusb.h>' || echo libusb-1.0-0-dev
    if [ "$purpose" = control ]; then
        compiles '#include <CLI/CLI.hpp>' || echo libcli11-dev
    fi
    if [ "$purpose" = test-cpp ]; then
        compiles '#include <gtest/gtest.h>' || echo libgtest-dev
        compiles '#include <benchmark/benchmark.h>' || echo libbenchmark-dev
        # for the emulated USB device of the tests
        [ -e /usr/include/umockdev-1.0/umockdev.h ] || echo libumockdev-dev
        command -v umockdev-run >/dev/null || echo umockdev
    fi
    if [ "$purpose" = docs ]; then
        command -v doxygen >/dev/null || echo doxygen
    fi
    if [ "$purpose" = guest ]; then
        # for the small Linux that runs palpate-control with the USB drivers of a real kernel
        command -v qemu-system-x86_64 >/dev/null || echo qemu-system-x86
        command -v busybox >/dev/null || echo busybox-static
        command -v cpio >/dev/null || echo cpio
    fi
    if [ "$purpose" = portable ]; then
        # for the tests that run exported models as machine code of a microcontroller
        command -v arm-none-eabi-gcc >/dev/null || echo gcc-arm-none-eabi
        [ -e /usr/include/newlib ] || echo libnewlib-arm-none-eabi
        command -v qemu-system-arm >/dev/null || echo qemu-system-arm
        command -v clang >/dev/null || echo clang
    fi
    if [ "$purpose" = windows ]; then
        # for the tests that are compiled for Windows and run under Wine
        command -v x86_64-w64-mingw32-g++-posix >/dev/null || echo g++-mingw-w64-x86-64-posix
        [ -e /usr/lib/wine/wine64 ] || echo wine64
        [ -e /usr/src/googletest ] || echo googletest
    fi
    if [ "$purpose" = fuzz ]; then
        missing_clang fuzzes
        compiles '#include <CLI/CLI.hpp>' || echo libcli11-dev
    fi
    if [ "$purpose" = coverage ]; then
        missing_clang counts
        # for the programs that print the counts of executed lines and branches
        command -v llvm-cov >/dev/null || echo llvm
    fi
    if [ "$purpose" = browser ]; then
        # for the tests that open a report
        command -v chromium >/dev/null || command -v chromium-browser >/dev/null ||
            command -v google-chrome >/dev/null || echo chromium
    fi
}

refuse() {
    echo "$1" >&2
    exit 1
}

install() {
    local as_root=()
    if [ "$(id -u)" -ne 0 ]; then
        as_root=(sudo -n)
    fi
    local get=("${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get -qq -o Dpkg::Use-Pty=0 -o DPkg::Lock::Timeout=300)
    # Updates the package lists only if the installation with the present ones fails.
    "${get[@]}" install --yes --no-install-recommends "$@" >/dev/null 2>&1 ||
        { "${get[@]}" update >/dev/null && "${get[@]}" install --yes --no-install-recommends "$@" >/dev/null; }
}

mapfile -t missing < <(missing_packages)
if [ "${#missing[@]}" -gt 0 ]; then
    wanted="sudo apt-get install ${missing[*]}"
    command -v apt-get >/dev/null ||
        refuse "palpate needs these packages (names of Debian and Ubuntu): ${missing[*]}; install them, then call make again."
    [ "$(id -u)" -eq 0 ] || sudo -n true 2>/dev/null ||
        refuse "palpate needs system packages: run '$wanted', then call make again."
    echo "Installing system packages: ${missing[*]}"
    install "${missing[@]}" || refuse "The system packages could not be installed: run '$wanted', then call make again."
    mapfile -t missing < <(missing_packages)
    [ "${#missing[@]}" -eq 0 ] ||
        refuse "Still missing after the installation: ${missing[*]}; $python may not be the system's Python (make PYTHON=/usr/bin/python3)."
fi

python_says 'import sys; assert sys.version_info >= (3, 10)' ||
    refuse "$python is $("$python" --version 2>&1), palpate needs Python 3.10 or later: make PYTHON=python3.12, for instance."
compiles '#include <concepts>
static_assert(std::same_as<int, int>);' ||
    refuse "${CXX:-g++} does not support C++20, palpate needs g++ 11 or clang 14 or later: make CXX=g++-12, for instance."

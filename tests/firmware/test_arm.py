# SPDX-License-Identifier: Apache-2.0
"""Device side in C99: warnings of four compilers, cost on a Cortex-M4F, MPS2 port and TinyUSB driver."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parents[2]
HERE = Path(__file__).parent
FIRMWARE = ROOT / "cpp" / "firmware"
PORT = FIRMWARE / "mps2"
MOST_FLASH = 2048
MOST_RAM = 128
MOST_TICK_INSTRUCTIONS = 100
CALLS = 1000

GCC = "-Wall -Wextra -Wpedantic -Wconversion -Wsign-conversion -Wshadow -Wcast-qual -Wcast-align=strict"
C_GCC = f"{GCC} -Wstrict-prototypes -Wmissing-prototypes -Wold-style-definition"
CLANG = "-Weverything -Wno-padded -Wno-declaration-after-statement -Wno-switch-default"
WARNINGS = {
    ("gcc", "c99"): C_GCC,
    ("g++", "c++11"): GCC,
    ("clang", "c99"): CLANG,
    ("clang++", "c++11"): f"{CLANG} -Wno-c++98-compat-pedantic -Wno-old-style-cast",
}


def needs(*programs: str) -> pytest.MarkDecorator:
    missing = [program for program in programs if shutil.which(program) is None]
    return pytest.mark.skipif(bool(missing), reason=f"needs {' '.join(missing)}")


needs_arm = needs("arm-none-eabi-gcc", "make")
needs_qemu = needs("arm-none-eabi-gcc", "make", "qemu-system-arm")


def run(*command: Any, **options: Any) -> subprocess.CompletedProcess[str]:
    words = [str(word) for word in command]
    completed = subprocess.run(words, capture_output=True, text=True, check=False, timeout=120, **options)
    assert completed.returncode == 0, completed.stdout + completed.stderr
    return completed


@pytest.mark.parametrize(("compiler", "standard"), WARNINGS)
@pytest.mark.parametrize("optimization", ["-O0", "-O2"])
def test_no_compiler_warns(compiler: str, standard: str, optimization: str, tmp_path: Path) -> None:
    if shutil.which(compiler) is None:
        pytest.skip(f"needs {compiler}")
    language = "c" if standard == "c99" else "c++"
    flags = [f"-std={standard}", *WARNINGS[compiler, standard].split(), "-Werror", optimization]
    source = FIRMWARE / "palpate_device.c"
    folders = ["-I", FIRMWARE, "-I", HERE]
    run(compiler, *flags, *folders, "-x", language, "-c", source, "-o", tmp_path / "device.o")


def built(folder: Path, main: Path, name: str, flags: str = "") -> Path:
    """Builds a program for the MPS2 board with a Cortex-M4F."""
    run("make", "-C", PORT, f"OUT={folder}", f"MAIN={main}", f"NAME={name}", "CPUS=m4", f"CFLAGS={flags}")
    return folder / f"{name}-m4.elf"


@pytest.mark.skipif(not Path("/usr/include/newlib").exists(), reason="needs libnewlib-arm-none-eabi")
@needs("clang")
@pytest.mark.parametrize("source", ["main.c", "startup.c", "../palpate_device.c"])
def test_clang_compiles_the_port_without_a_warning(source: str, tmp_path: Path) -> None:
    target = ["--target=arm-none-eabi", "-mcpu=cortex-m4", "-mfpu=fpv4-sp-d16", "-mfloat-abi=hard"]
    warnings = [*GCC.replace("-Wcast-align=strict", "").split(), "-Werror"]
    folders = ["-isystem", "/usr/include/newlib", "-I", FIRMWARE, "-I", PORT]
    run(
        "clang",
        "-std=c99",
        "-O2",
        *target,
        *warnings,
        *folders,
        "-c",
        PORT / source,
        "-o",
        tmp_path / "port.o",
    )


@needs_arm
def test_flash_and_memory_are_within_the_marks(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    flags = [
        "-std=c99",
        "-O2",
        "-mthumb",
        "-mcpu=cortex-m4",
        "-mfpu=fpv4-sp-d16",
        "-mfloat-abi=hard",
        "-ffp-contract=off",
    ]
    folders = ["-I", FIRMWARE, "-I", PORT]
    module, state = tmp_path / "device.o", tmp_path / "state.o"
    run("arm-none-eabi-gcc", *flags, *folders, "-c", FIRMWARE / "palpate_device.c", "-o", module)
    text, data, bss = map(int, run("arm-none-eabi-size", module).stdout.splitlines()[1].split()[:3])
    source = tmp_path / "state.c"
    source.write_text('#include "palpate_device.h"\npalpate_device device;\n', encoding="utf-8")
    run("arm-none-eabi-gcc", *flags, *folders, "-c", source, "-o", state)
    ram = data + bss + int(run("arm-none-eabi-nm", "-S", state).stdout.split()[1], 16)
    with capsys.disabled():
        print(f"\ndevice side: {text} B of flash, {ram} B of RAM")
    assert text + data <= MOST_FLASH
    assert ram <= MOST_RAM
    undefined = run("arm-none-eabi-nm", "-u", module).stdout.split()
    assert set(undefined) <= {"U", "memset", "memcpy"}, "the device side needs no library"


@pytest.fixture(scope="module")
def counter(tmp_path_factory: pytest.TempPathFactory) -> Path:
    plugin = tmp_path_factory.mktemp("plugin") / "libcount.so"
    command = [os.environ.get("CC", "gcc"), "-O2", "-Wall", "-Wextra", "-shared", "-fPIC"]
    run(*command, HERE / "count_instructions.c", "-o", plugin)
    return plugin


def in_qemu(program: Path, *words: Any, **options: Any) -> subprocess.CompletedProcess[str]:
    board = "mps2-an500" if "m7" in program.name else "mps2-an386"
    quiet = ["-display", "none", "-monitor", "none", "-serial", "none"]
    files = ["-semihosting-config", "enable=on,target=native"]
    return run("qemu-system-arm", "-M", board, *quiet, *files, "-kernel", program, *words, **options)


def instructions(program: Path, counter: Path) -> int:
    lines = in_qemu(program, "-plugin", counter).stderr.splitlines()
    counts = dict(line.rsplit(" ", 1) for line in lines if re.fullmatch(r"\S+ \d+", line))
    assert int(counts["main"]) > 0
    return sum(int(count) for name, count in counts.items() if name != "main")


@needs_qemu
@pytest.mark.parametrize(
    ("case", "most"),
    [
        ("HOST_TICK", MOST_TICK_INSTRUCTIONS),
        ("MODEL_TICK", MOST_TICK_INSTRUCTIONS),
        ("RAMP_TICK", MOST_TICK_INSTRUCTIONS),
        ("START_TICK", MOST_TICK_INSTRUCTIONS),
        ("EXPIRED_TICK", MOST_TICK_INSTRUCTIONS),
        ("OUT", 100),
        ("IN", 150),
    ],
)
def test_instructions_are_within_the_marks(
    case: str, most: int, counter: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    counts = [
        instructions(
            built(tmp_path, HERE / "cost.c", f"calls{calls}", f"-DCASE={case} -DCALLS={calls}"), counter
        )
        for calls in (CALLS, 2 * CALLS)
    ]
    each = (counts[1] - counts[0]) / CALLS
    with capsys.disabled():
        print(f"\n{case}: {each:.1f} instructions")
    assert 10 < each <= most


@needs_qemu
@pytest.mark.parametrize("cpu", ["m4", "m7"])
def test_the_port_runs_a_device_on_both_boards(cpu: str, tmp_path: Path) -> None:
    run("make", "-C", PORT, f"OUT={tmp_path}", f"CPUS={cpu}")
    # Power-up, a request GET_INFO, then the end of the input.
    start = b"S" + bytes(7) + (0x0102).to_bytes(8, "little") + (65536).to_bytes(4, "little")
    info = b"C" + bytes(7) + bytes([0xC1, 1, 0, 0, 0, 0, 64, 0])
    (tmp_path / "requests").write_bytes(start.ljust(80, b"\0") + info.ljust(80, b"\0"))
    in_qemu(tmp_path / f"device-{cpu}.elf", cwd=tmp_path)
    answers = (tmp_path / "answers").read_bytes()
    assert len(answers) == 2 * 48
    assert int.from_bytes(answers[56:60], "little") == 32
    assert answers[60:62] == b"I\x01"
    assert answers[84:92] == (0x0102).to_bytes(8, "little")


@pytest.mark.parametrize(("compiler", "standard"), [("gcc", "c99"), ("clang", "c99")])
def test_the_tinyusb_driver_works_with_the_declarations_of_tinyusb(
    compiler: str, standard: str, tmp_path: Path
) -> None:
    if shutil.which(compiler) is None:
        pytest.skip(f"needs {compiler}")
    sources = [
        FIRMWARE / "tinyusb" / "palpate_tinyusb.c",
        FIRMWARE / "palpate_device.c",
        HERE / "tinyusb_host.c",
    ]
    folders = [FIRMWARE, FIRMWARE / "tinyusb", HERE, HERE / "tinyusb_declarations"]
    flags = [f"-std={standard}", *GCC.replace("-Wcast-align=strict", "").split(), "-Werror"]
    run(compiler, *flags, *(f"-I{folder}" for folder in folders), *sources, "-o", tmp_path / "host")
    run(tmp_path / "host")

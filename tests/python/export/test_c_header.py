# SPDX-License-Identifier: Apache-2.0
"""Tests the C header of an exported model: compilers, bits, refusals of the preprocessor."""

import os
import re
import shutil
import subprocess
from itertools import cycle
from pathlib import Path

import numpy as np
import pytest
from bench.portable.programs import BOARDS, compile_arm, missing, run_arm, run_here

import palpate
from conftest import sampled
from exports import EXPORTED, KINDS, flags_of, header_of, random_model, tables_of
from palpate._core.portable import ExportedModel
from palpate._typing import Float2D
from palpate.export import Request, c_header

SCALE = max(1, int(os.environ.get("PALPATE_TEST_SCALE", "1")))

COMPILERS = {"gcc": "c99", "clang": "c99", "g++": "c++11", "clang++": "c++11"}
"""Compiler -> oldest standard of its language in which the header must compile without warnings."""

CPU = Path("/proc/cpuinfo").read_text(encoding="utf-8") if Path("/proc/cpuinfo").exists() else ""

EVERY_CASE = [(kind, precision) for kind in KINDS for precision in ("single", "double")]
PARTS = {"predicted", "hysteresis", "massless", "periodic", "memory"}
"""Kinds that are a part of another kind"""

CASES = sampled(
    EVERY_CASE,
    *zip((kind for kind in KINDS if kind not in PARTS), cycle(("single", "double"))),
    ("predicted_hysteresis", "single"),
)
"""Kinds and precisions; `make test` runs each kind with all parts in one precision, and one kind in both."""

VALUES = """\
#include "knob.h"
#include <stdio.h>
#include <string.h>
static const int32_t counts[] = {COUNTS};
static void show(knob_real number) { printf("%.17g\\n", (double)number); }
int main(void) {
    knob_state s, t;
    unsigned k;
    knob_start(&s, counts[0]);
    knob_start(&t, counts[0]);
    for (k = 0; k < sizeof counts / sizeof counts[0]; ++k) {
        knob_real slope;
        show(knob_force(&s, counts[k]));
        show(knob_force_slope(&s, counts[k], &slope));
        show(slope);
        show(knob_energy(&s, counts[k]));
        show(knob_step(&t, counts[k]));
        knob_advance(&s, counts[k]);
    }
    return 0;
}
"""
"""Program that prints all results along a motion; the play operator of s follows the motion."""


def compilers() -> list[str]:
    """Returns the compilers that are installed."""
    return [name for name in COMPILERS if shutil.which(name)]


def motion(first: int, last: int) -> list[int]:
    """Returns counts: both ends of the domain and of the integers, a random walk, and jumps."""
    random = np.random.default_rng(5)
    walk = np.clip(np.cumsum(random.integers(-200, 201, 300)) + (first + last) // 2, first - 900, last + 900)
    jumps = random.integers(first - 3000, last + 3000, 100)
    ends = [first - 1, first, first + 1, last - 1, last, last + 1, 2**31 - 1, -(2**31), 0]
    return [*ends, *walk.tolist(), *jumps.tolist()]


def values_of(tables: ExportedModel, counts: list[int], folder: Path, *flags: str) -> Float2D:
    """Returns force, force with slope, slope, energy and step (n, 5) of knob.h at counts."""
    source = folder / "values.c"
    # -2147483648 is not an int in C
    literals = ", ".join("INT32_MIN" if count == -(2**31) else str(count) for count in counts)
    source.write_text(VALUES.replace("COUNTS", literals), encoding="utf-8")
    return np.array(run_here(source, folder, flags).split(), dtype=float).reshape(-1, 5)


@pytest.mark.parametrize(("kind", "precision"), CASES)
def test_header_gives_the_bits_of_the_tested_arithmetic(kind: str, precision: str, tmp_path: Path) -> None:
    model, tables = tables_of(kind, precision=precision)
    header_of(model, tables, tmp_path)
    counts = motion(tables.law.grid.first_count, tables.law.grid.last_count)
    found = values_of(tables, counts, tmp_path)
    array = np.array(counts, dtype=np.int32)
    force, slope, energy = tables.samples(array)
    for name, values, right in (
        ("force", found[:, 0], force),
        ("force with slope", found[:, 1], force),
        ("slope", found[:, 2], slope),
        ("energy", found[:, 3], energy),
        ("step", found[:, 4], tables.steps(array)),
    ):
        np.testing.assert_array_equal(values, right, err_msg=name)


@pytest.mark.skipif(" fma " not in CPU, reason="needs a processor with contracted products and sums")
@pytest.mark.parametrize("precision", sampled(["single", "double"], "single"))
def test_contracted_header_is_within_its_proved_bounds(precision: str, tmp_path: Path) -> None:
    model, tables = tables_of("position", precision=precision)
    header_of(model, tables, tmp_path)
    counts = list(range(tables.law.grid.first_count, tables.law.grid.last_count + 1, 7))
    x = np.array(counts) * tables.encoder_step
    plain = values_of(tables, counts, tmp_path)
    contracted = values_of(tables, counts, tmp_path, "-mfma", "-ffp-contract=fast")
    assert np.any(plain[:, 0] != contracted[:, 0])  # the compiler did contract
    assert np.abs(contracted[:, 0] - model.force(x)).max() <= tables.force_error
    assert np.abs(contracted[:, 2] - model.slope(x)).max() <= tables.slope_error


@pytest.mark.parametrize("kind", sampled(KINDS, "massless", "periodic_predicted_hysteresis"))
def test_any_position_has_defined_behaviour(kind: str, tmp_path: Path) -> None:
    model, tables = tables_of(kind, precision="double")
    header_of(model, tables, tmp_path)
    sanitizer = ["-fsanitize=undefined,float-cast-overflow", "-fno-sanitize-recover=all"]
    run_here(Path(__file__).with_name("any_position.c"), tmp_path, sanitizer)


@pytest.mark.parametrize(
    ("kind", "precision"),
    sampled(EVERY_CASE, ("predicted_hysteresis", "single"), ("massless", "double")),
)
def test_header_compiles_without_warnings_as_c99_and_cpp11(kind: str, precision: str, tmp_path: Path) -> None:
    header = header_of(*tables_of(kind, precision=precision), tmp_path)
    chosen = compilers() if SCALE > 1 or kind == "predicted_hysteresis" else ["gcc", "clang++"]
    hashes = {
        run_here(EXPORTED, tmp_path, flags_of(header), compiler=compiler, standard=COMPILERS[compiler])
        for compiler in chosen
        if compiler in compilers()
    }
    assert len(hashes) == 1


@pytest.mark.skipif(bool(missing()), reason="needs arm-none-eabi-gcc and qemu-system-arm")
@pytest.mark.parametrize(("kind", "precision"), CASES)
def test_cortex_m_gives_the_bits_of_this_computer(kind: str, precision: str, tmp_path: Path) -> None:
    header = header_of(*tables_of(kind, precision=precision), tmp_path)
    here = run_here(EXPORTED, tmp_path, flags_of(header)).strip()
    cross = ["gcc", "clang"] if SCALE > 1 and shutil.which("clang") else ["gcc"]
    for processor in BOARDS:
        for compiler in cross:
            program = compile_arm(
                EXPORTED, tmp_path, flags_of(header), processor=processor, compiler=compiler
            )
            output, _ = run_arm(program, processor=processor)
            assert output.strip() == here, (processor, compiler)


@pytest.mark.parametrize("flag", ["-ffast-math", "-DFLT_EVAL_METHOD=2"])
def test_header_refuses_another_arithmetic(flag: str, tmp_path: Path) -> None:
    header_of(*tables_of("position"), tmp_path)
    source = tmp_path / "program.c"
    text = "#include <float.h>\n#undef FLT_EVAL_METHOD\n#define FLT_EVAL_METHOD 2\n" if "FLT" in flag else ""
    source.write_text(f'{text}#include "knob.h"\nint main(void) {{ return 0; }}\n', encoding="utf-8")
    with pytest.raises(RuntimeError, match="#error"):
        run_here(source, tmp_path, [flag] if "math" in flag else [])


@pytest.mark.parametrize("precision", ["single", "double"])
def test_torque_is_minus_the_force_in_micronewtonmetres(precision: str, tmp_path: Path) -> None:
    header_of(*tables_of("position", precision=precision), tmp_path)
    source = tmp_path / "torque.c"
    source.write_text(
        '#include "knob.h"\n#include <stdio.h>\n'
        "int main(void) {\n    knob_state s;\n    int32_t count;\n    knob_start_of(&s, 0);\n"
        "    for (count = -200000; count < 200000; count += 997) {\n"
        '        printf("%d %.17g\\n", (int)knob_torque_uNm(&s, count), (double)knob_step(&s, count));\n'
        "    }\n    return 0;\n}\n",
        encoding="utf-8",
    )
    lines = run_here(source, tmp_path, []).splitlines()
    torque, force = np.array([line.split() for line in lines], dtype=float).T
    assert np.abs(force).max() == 2.5  # the force limit is reached
    np.testing.assert_allclose(torque, -1e6 * force, rtol=0, atol=0.7 if precision == "single" else 0.5)


def test_unused_functions_take_no_memory(tmp_path: Path) -> None:
    if shutil.which("size") is None:
        pytest.skip("needs size of binutils")
    model, tables = tables_of("position")
    header_of(model, tables, tmp_path)
    source = tmp_path / "tick.c"
    source.write_text(
        '#include "knob.h"\nfloat tick(knob_state *s, int32_t count);\n'
        "float tick(knob_state *s, int32_t count) { return knob_step(s, count); }\n",
        encoding="utf-8",
    )
    part = tmp_path / "tick.o"
    subprocess.run(["gcc", "-std=c99", "-O2", "-c", str(source), "-o", str(part)], check=True)
    sizes = subprocess.run(["size", str(part)], capture_output=True, text=True, check=True).stdout
    text, data, bss = map(int, sizes.splitlines()[1].split()[:3])
    assert data == bss == 0
    assert text < tables.law.bytes + 600


@pytest.mark.parametrize(
    ("defined", "accepted"),
    [
        ("-DPALPATE_RATE_HZ=1000 -DPALPATE_PROFILE={right}", True),
        ("-DPALPATE_RATE_HZ=1000", False),
        ("-DPALPATE_RATE_HZ=10000 -DPALPATE_PROFILE={right}", False),
        ("-DPALPATE_RATE_HZ=1000 -DPALPATE_PROFILE=1", False),
        ("", False),
    ],
)
def test_certified_header_compiles_for_its_rate_and_device_only(
    defined: str, accepted: bool, tmp_path: Path
) -> None:
    model = palpate.Model.from_network(
        units={"position": "rad", "force": "N*m"}, alpha=[[5.0]], beta=[[0.3]], weight=[0.02], linear=[1.0],
        lower=[0.0], upper=[0.5],
    )  # fmt: skip
    path = palpate.plan(model, "bench-knob").stored().save(tmp_path / "knob.json")
    header = tmp_path / "knob.h"
    written = c_header.write(Request(header, path))
    flags = defined.format(right=hex(written.record["profile"])).split()
    if accepted:
        assert run_here(EXPORTED, tmp_path, [*flags_of(header), *flags])
    else:
        with pytest.raises(RuntimeError, match="the certificate holds for"):
            run_here(EXPORTED, tmp_path, [*flags_of(header), *flags])


HOSTILE = (
    "*/", "/*", "/*/", "//", "??/", "??", "\\", "\\\n", '"', "'", "%s%n", "//@ end", "#include <x>", "}{;",
    "\x01\x1b[31m", "\u2028", "é", "é/", " ", "x",
    "NAME", " DEVICE", " PROFILE", " RATE_HZ", " STRUCTURE ", "TABLE",
)  # fmt: skip
"""Parts of names that end a string, a comment or a line of C, or that the template of a header contains."""


@pytest.mark.parametrize("seed", range(1 if SCALE == 1 else 6 * SCALE))
def test_names_of_model_file_and_device_cannot_change_the_program(seed: int, tmp_path: Path) -> None:
    random = np.random.default_rng(seed)
    name = "".join(HOSTILE) if seed == 0 else "".join(random.choice(HOSTILE, 12))
    hashes = set()
    for shown in ("plain", name):
        device = palpate.DeviceProfile(id=shown, coulomb_friction=0.02)
        plan = palpate.plan(random_model(1), device, accept_force_error=1.0)
        folder = tmp_path / f"of {len(shown)}"
        folder.mkdir()
        path = plan.stored().save(folder / f"{shown.replace('/', '_')}.json")
        written = c_header.write(Request(folder / "knob.h", path))
        defined = ["-DPALPATE_RATE_HZ=1000", f"-DPALPATE_PROFILE={written.record['profile']:#x}"]
        flags = [*flags_of(folder / "knob.h"), *defined]
        hashes |= {
            run_here(EXPORTED, folder, flags, compiler=compiler, standard=COMPILERS[compiler])
            for compiler in (("gcc", "g++") if shown == name or SCALE > 1 else ("gcc",))
        }
    assert len(hashes) == 1


def test_words_of_the_template_are_kept_in_names(tmp_path: Path) -> None:
    name = "NAME of DEVICE RATE_HZ PROFILE STRUCTURE TABLE"
    plan = palpate.plan(random_model(1), palpate.DeviceProfile(id=name, coulomb_friction=0.02))
    path = plan.stored().save(tmp_path / f"{name}.json")
    c_header.write(Request(tmp_path / "knob.h", path))
    text = (tmp_path / "knob.h").read_text(encoding="utf-8")
    assert f"Force of the model {name}.json, exported" in text
    assert f'if its profile is {name}"' in text
    certificate = "".join(re.findall(r'^    "(.*)"', text, re.MULTILINE))
    assert f" on {name} at 1000 Hz" in certificate


@pytest.mark.parametrize("name", sampled(["TABLE", "NAME", "PROFILE", "DEVICE", "STRUCTURE"], "TABLE"))
def test_a_word_of_the_template_can_be_the_name_of_a_model(name: str, tmp_path: Path) -> None:
    model, tables = tables_of("predicted_hysteresis")
    header = header_of(model, tables, tmp_path, name)
    plain = header_of(model, tables, tmp_path, "knob")
    assert run_here(EXPORTED, tmp_path, flags_of(header)) == run_here(EXPORTED, tmp_path, flags_of(plain))

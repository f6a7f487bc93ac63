# SPDX-License-Identifier: Apache-2.0
"""Counts the instructions of exported models on Cortex-M, with their errors and the size of their tables.

python bench/portable/cost.py [--to docs] [--json FILE]

The same table contains the sum of all wavelets in floats with expf, and hand-written detents. Needs
gcc-arm-none-eabi, libnewlib-arm-none-eabi and qemu-system-arm; without them the study is skipped.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from pathlib import Path
from typing import NamedTuple

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2]))

from bench.portable.programs import BOARDS, FOLDER, compile_arm, missing, run_arm
from bench.studies import fill_tables, markdown_table, write_results

import palpate
from palpate._core.model import fingerprint
from palpate._core.portable import ExportedModel
from palpate._core.rendering import Scheme
from palpate.export import Exported
from palpate.export.c_header import header_text
from palpate.export.exported import units_of

WAVELETS = (8, 16, 32, 64, 128)

TRAVEL = 0.5
"""Length of the domain [rad]"""

STEP = 2.0 * np.pi / 65536.0
"""Encoder step [rad]: 16 bits for each turn"""

DETENTS = {
    "WIDTH": 0.05,
    "DETENTS": 11,
    "STIFFNESS": 20.0,
    "DEAD_ZONE": 0.004,
    "DAMPING": 0.002,
    "LIMIT": 2.0,
}
"""Constants of the hand-written detents"""


class Row(NamedTuple):
    """Cost and error of one function."""

    name: str
    m4: int
    m7: int
    table_bytes: int
    proved: float | None
    seen: float


def network(wavelets: int, *, hysteresis: bool = False) -> palpate.Model:
    """Returns a random model whose wavelets are 1/90 to 1/1 of the domain wide."""
    random = np.random.default_rng(wavelets)
    weight = random.uniform(-0.3, 0.3, wavelets)
    alpha = np.exp(random.uniform(0.0, 4.5, wavelets)) / TRAVEL
    more = {
        "weight_hysteresis": (0.05 * np.abs(weight)).tolist(),
        "linear_hysteresis": [0.0],
        "bias_hysteresis": 0.5,
        "play_radius": 0.01 * TRAVEL,
    }
    return palpate.Model.from_network(
        units={"position": "rad", "force": "N*m"},
        alpha=alpha[:, None].tolist(),
        beta=random.uniform(0.0, TRAVEL, wavelets)[:, None].tolist(),
        weight=weight.tolist(),
        linear=[4.0],
        lower=[0.0],
        upper=[TRAVEL],
        **(more if hysteresis else {}),
    )


def counted(source: Path, folder: Path, flags: list[str]) -> dict[str, tuple[int, int]]:
    """Returns the most instructions of each measured function on Cortex-M4F and M7."""
    most = []
    for processor in BOARDS:
        program = compile_arm(source, folder, flags, processor=processor)
        _, counts = run_arm(program, processor=processor, counted_in=folder)
        most.append({name: count.most for name, count in counts.items()})
    return {name: (most[0][name], most[1][name]) for name in most[0]}


def exported_rows(name: str, model: palpate.Model, scheme: Scheme, folder: Path) -> list[Row]:
    """Returns the rows of one model: force, force with slope, and a step of the structure."""
    tables = ExportedModel(model, scheme, encoder_step=STEP, period_s=1e-3, force_limit=1e3)
    check = tables.check(20_000)
    assert check.passed
    exported = Exported("knob", "", tables, check, fingerprint(model), None, units_of(model))
    (folder / "knob.h").write_text(header_text(exported), encoding="utf-8")
    counts = counted(FOLDER / "exported.c", folder, ['-DMODEL="knob.h"', "-DNAME=knob"])
    force, slope = tables.largest_force, tables.largest_slope
    used = tables.law if tables.response is None else tables.response
    law, step = tables.law.bytes, used.bytes
    force_errors = (tables.force_error / force, check.force * tables.force_error / force)
    slope_errors = (tables.slope_error / slope, check.slope * tables.slope_error / slope)
    step_errors = (tables.step_error / force, check.step * tables.step_error / force)
    return [
        Row(f"{name}: force", *counts["force"], law, *force_errors),
        Row(f"{name}: force with slope", *counts["force_slope"], law, *slope_errors),
        Row(f"{name}: tick, {scheme.structure}", *counts["step"], step, *step_errors),
    ]


def exact_detents(count: np.ndarray, before: np.ndarray) -> np.ndarray:
    """Returns the force of the detents in double precision."""
    d = DETENTS
    x, speed = count * STEP, (count - before) * STEP * 1000.0
    nearest = np.trunc(x / d["WIDTH"] + np.where(x < 0.0, -0.5, 0.5))
    distance = x - nearest * d["WIDTH"]
    inside = np.sign(distance) * np.maximum(np.abs(distance) - d["DEAD_ZONE"], 0.0)
    stop = 4.0 * np.where(nearest < 0.0, x, x - (d["DETENTS"] - 1) * d["WIDTH"])
    outside = (nearest < 0.0) | (nearest > d["DETENTS"] - 1)
    force = d["STIFFNESS"] * np.where(outside, stop, inside) + d["DAMPING"] * speed
    return np.clip(force, -d["LIMIT"], d["LIMIT"])


def rival_rows(wavelets: int, folder: Path) -> list[Row]:
    """Returns the rows of the float sum of a model, and of the detents."""
    model = network(wavelets)

    def literals(numbers: np.ndarray) -> str:
        return ", ".join(f"{number!r}f" for number in np.ravel(numbers).tolist())

    first, last, every = 3, int(TRAVEL / STEP), 7
    numbers = {"STEP": STEP, "LINEAR": model.linear[0], "BIAS": model.bias, **DETENTS}
    lines = [
        f"#define {name} {value}{'' if isinstance(value, int) else 'f'}" for name, value in numbers.items()
    ]
    lines += [f"#define {name} {value}" for name, value in
              (("N", wavelets), ("FIRST", first), ("LAST", last), ("EVERY", every))]  # fmt: skip
    lines += [f"static const float {name}[N] = {{{literals(getattr(model, name))}}};"
              for name in ("alpha", "beta", "weight")]  # fmt: skip
    (folder / "rivals.h").write_text("\n".join([*lines, ""]), encoding="utf-8")
    source = FOLDER / "rivals.c"
    counts = counted(source, folder, [])
    output, _ = run_arm(compile_arm(source, folder, []))
    bits = np.array([int(line, 16) for line in output.split()], dtype=np.uint32)
    found = bits.view(np.float32).astype(float).reshape(-1, 2)
    count = np.arange(first, last + 1, every)
    right = np.column_stack([
        model.force(count * STEP), exact_detents(count, np.concatenate([[first], count[:-1]]))
    ])  # fmt: skip
    error = np.abs(found - right).max(axis=0) / np.abs(right).max(axis=0)
    return [
        Row(
            f"sum of {wavelets} wavelets with floats and expf", *counts["sum"], 12 * wavelets, None, error[0]
        ),
        Row("hand-written detents", *counts["detents"], 0, None, error[1]),
    ]


def measured_rows(folder: Path) -> list[Row]:
    """Returns the rows of all studied models."""
    rows = []
    direct = Scheme(structure="direct")
    rivals = {wavelets: rival_rows(wavelets, folder) for wavelets in (8, 32, 128)}
    rows.append(rivals[8][1])
    rows += [rivals[wavelets][0] for wavelets in rivals]
    for wavelets in WAVELETS:
        rows += exported_rows(f"{wavelets} wavelets", network(wavelets), direct, folder)[:2]
    predicted = exported_rows("32 wavelets", network(32), Scheme(structure="direct", predict=4), folder)
    rows.append(predicted[2]._replace(name="32 wavelets: tick, direct with prediction"))
    massless = Scheme(structure="massless", coupling_stiffness=2000.0, coupling_damping=1.0)
    rows.append(exported_rows("32 wavelets", network(32), massless, folder)[2])
    rows += exported_rows("26 wavelets, hysteresis", network(26, hysteresis=True), direct, folder)
    return rows


def page_table(rows: list[Row]) -> str:
    """Returns the rows as a table of the page."""
    header = ["function", "instructions, M4F", "M7", "tables [kB]", "error, proved", "error, seen"]
    return markdown_table(
        header,
        [
            [row.name, str(row.m4), str(row.m7), f"{row.table_bytes / 1e3:.1f}",
             "none" if row.proved is None else f"{row.proved:.1e}", f"{row.seen:.1e}"]
            for row in rows
        ],
    )  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--to", type=Path, help="folder of the pages whose table is filled")
    parser.add_argument("--json", type=Path, help="file for the results")
    options = parser.parse_args()
    if missing():
        print(f"skipped: needs {', '.join(missing())}")
        return
    with tempfile.TemporaryDirectory() as folder:
        rows = measured_rows(Path(folder))
    print(page_table(rows), end="")
    write_results(options.json, [row._asdict() for row in rows])
    if options.to is not None:
        fill_tables(options.to / "how-to" / "microcontroller.md", {"portable cost": page_table(rows)})


if __name__ == "__main__":
    main()

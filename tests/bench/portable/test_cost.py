# SPDX-License-Identifier: Apache-2.0
"""Tests the study of the cost on a microcontroller: instructions, tables, errors, and the page."""

from pathlib import Path

import pytest
from bench.portable import cost
from bench.portable.programs import missing

from palpate._core.rendering import Scheme

PAGE = Path(__file__).parents[3] / "docs" / "how-to" / "microcontroller.md"

pytestmark = pytest.mark.skipif(bool(missing()), reason="needs arm-none-eabi-gcc and qemu-system-arm")


def test_position_force_needs_few_instructions_and_little_memory(tmp_path: Path) -> None:
    for wavelets, most_bytes in ((8, 6e3), (128, 24e3)):
        model = cost.network(wavelets)
        force, slope, _ = cost.exported_rows("", model, Scheme(structure="direct"), tmp_path)
        assert force.m4 <= 65
        assert slope.m4 <= 90
        assert force.table_bytes <= most_bytes
        assert force.seen <= force.proved <= 1e-6
        assert slope.seen <= slope.proved <= 3e-5


def test_hysteresis_and_massless_ticks_need_few_instructions(tmp_path: Path) -> None:
    hysteretic = cost.network(26, hysteresis=True)
    force, slope, tick = cost.exported_rows("", hysteretic, Scheme(structure="direct"), tmp_path)
    assert max(force.m4, tick.m4) <= 110
    assert slope.m4 <= 160
    massless = Scheme(structure="massless", coupling_stiffness=2000.0, coupling_damping=1.0)
    assert cost.exported_rows("", cost.network(32), massless, tmp_path)[2].m4 <= 100


def test_page_has_the_instructions_of_the_present_header(tmp_path: Path) -> None:
    row = cost.exported_rows("8 wavelets", cost.network(8), Scheme(structure="direct"), tmp_path)[0]
    line = next(
        line for line in PAGE.read_text(encoding="utf-8").splitlines() if line.startswith(f"| {row.name} |")
    )
    # Another release of the compiler may need a few instructions more or less
    assert int(line.split("|")[2]) == pytest.approx(row.m4, rel=0.1)

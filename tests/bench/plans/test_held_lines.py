# SPDX-License-Identifier: Apache-2.0
"""Tests the page about held lines against its numbers, and the study."""

import json
from pathlib import Path

import pytest
from bench.plans import held_lines

from palpate._core.stability import stiffest_line_wall

ROOT = Path(__file__).parents[3]
PAGE = ROOT / "docs" / "held-lines.md"
NUMBERS = PAGE.parent / "figures" / "held-lines.json"


def test_page_shows_the_stored_numbers() -> None:
    content = json.loads(NUMBERS.read_text(encoding="utf-8"))
    errors = {name: {int(k): v for k, v in by.items()} for name, by in content["errors"].items()}
    tables = held_lines.tables([held_lines.Walls(**row) for row in content["walls"]], errors)
    text = PAGE.read_text(encoding="utf-8")
    assert all(table in text for table in tables.values())


@pytest.mark.parametrize("which", [pytest.param("damiao-4310", marks=pytest.mark.full), "hid-wheel"])
def test_the_stored_walls_follow_from_the_profiles(which: str) -> None:
    content = json.loads(NUMBERS.read_text(encoding="utf-8"))
    stored = {row["device"]: row for row in content["walls"]}
    name, device = next(each for each in held_lines.devices() if each[0] == which)
    width, speed = held_lines.WALLS[0]
    stiffest = stiffest_line_wall(device, width, speed * device.period_s)
    assert stiffest == pytest.approx(stored[name]["by_width"]["0.01 rad, 3 rad/s"], rel=1e-3)


def test_a_line_has_less_force_error_than_hold_at_every_delay() -> None:
    errors = json.loads(NUMBERS.read_text(encoding="utf-8"))["errors"]
    for delay in ("0", "1", "2"):
        assert errors["held line, 3 rad/s"][delay] < 0.25 * errors["hold"][delay]

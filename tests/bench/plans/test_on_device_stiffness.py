# SPDX-License-Identifier: Apache-2.0
"""Tests the study of certified stiffness from the host and on the motor controller."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]
PAGE = ROOT / "docs" / "certificate.md"
NUMBERS = PAGE.parent / "figures" / "on-device.json"


@pytest.mark.full
def test_writes_figure_numbers_and_tables(tmp_path: Path) -> None:
    page = tmp_path / PAGE.name
    page.write_text(PAGE.read_text(encoding="utf-8"), encoding="utf-8")
    completed = subprocess.run(
        [sys.executable, str(ROOT / "bench" / "plans" / "on_device_stiffness.py"), "--to", str(tmp_path)],
        capture_output=True,
        text=True,
        env={**os.environ, "PALPATE_BENCH_SCALE": "0.01"},
        check=False,
    )
    assert completed.returncode == 0, completed.stderr
    assert (tmp_path / "figures" / "on-device.png").read_bytes().startswith(b"\x89PNG")
    stored = json.loads(NUMBERS.read_text(encoding="utf-8"))
    for found, expected in zip(
        json.loads((tmp_path / "figures" / NUMBERS.name).read_text(encoding="utf-8")), stored, strict=True
    ):
        assert found["device"] == expected["device"]
        assert found["host"] == pytest.approx(expected["host"], rel=1e-6)
    assert page.read_text(encoding="utf-8") == PAGE.read_text(encoding="utf-8")


def test_the_damping_limit_scales_with_the_rate_and_the_friction_limit_does_not() -> None:
    rows = {row["device"]: row for row in json.loads(NUMBERS.read_text(encoding="utf-8"))}
    for row in rows.values():
        slow, fast = row["ideal"]["10000"], row["ideal"]["40000"]
        assert fast["damping"] == pytest.approx(4.0 * slow["damping"], rel=1e-4)
        assert fast["friction"] == pytest.approx(row["host"]["friction"], rel=1e-4)
        assert fast["certified"] == pytest.approx(min(fast["damping"], fast["friction"]), rel=0.02)
    gain = {
        name: [
            rows[name]["ideal"][rate]["certified"] / rows[name]["host"]["certified"]
            for rate in ("10000", "40000")
        ]
        for name in ("phantom-premium-1.0", "touch", "bench-knob")
    }
    # Without jitter of the host these gains are 10 and 40, 30 and 120, and 1.7.
    assert gain["phantom-premium-1.0"] == pytest.approx([11.0, 44.0], rel=0.01)
    assert gain["touch"] == pytest.approx([33.0, 132.0], rel=0.01)
    assert gain["bench-knob"] == pytest.approx([2.09, 2.09], rel=0.01)

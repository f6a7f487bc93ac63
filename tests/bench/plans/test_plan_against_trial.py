# SPDX-License-Identifier: Apache-2.0
"""Tests the comparison of plans with the best of many simulated structures: page and command."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]
PAGE = ROOT / "docs" / "plan-against-trial.md"
NUMBERS = PAGE.parent / "figures" / "plan-against-trial.json"


@pytest.mark.full
def test_runs_without_measured_data_and_names_the_omitted_objects(tmp_path: Path) -> None:
    page = tmp_path / PAGE.name
    page.write_text(PAGE.read_text(encoding="utf-8"), encoding="utf-8")
    (tmp_path / "figures").mkdir()
    environment = {key: value for key, value in os.environ.items() if key != "PALPATE_DATA"}
    command = [
        sys.executable,
        str(ROOT / "bench" / "plans" / "plan_against_trial.py"),
        "--to",
        str(tmp_path),
    ]
    options = ["--grid", "0", "--seconds", "1"]
    completed = subprocess.run(
        [*command, *options], capture_output=True, text=True, env=environment, check=False
    )
    assert completed.returncode == 0, completed.stderr
    assert "Omitted: the measured switches" in page.read_text(encoding="utf-8")
    rows = json.loads((tmp_path / "figures" / NUMBERS.name).read_text(encoding="utf-8"))
    assert {row["object"] for row in rows} == {"spring and wall", "snap-through"}
    assert not any(row["oscillates"] for row in rows)


def test_page_shows_seven_objects_on_three_devices_each() -> None:
    rows = json.loads(NUMBERS.read_text(encoding="utf-8"))
    assert len(rows) == 21
    text = PAGE.read_text(encoding="utf-8")
    for row in rows:
        assert f"| {row['object']} | {row['device']} | {row['plan']} |" in text


def test_on_a_weak_device_the_plan_comes_to_rest_and_direct_rendering_oscillates() -> None:
    weak_device_rows = [
        row for row in json.loads(NUMBERS.read_text(encoding="utf-8")) if "weak" in row["device"]
    ]
    assert len(weak_device_rows) == 7
    for row in weak_device_rows:
        assert not row["oscillates"]
        assert row["direct_oscillates"], row

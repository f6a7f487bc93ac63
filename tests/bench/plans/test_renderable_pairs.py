# SPDX-License-Identifier: Apache-2.0
"""Tests the count of renderable pairs of objects and devices: page and command."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]
PROGRAM = ROOT / "bench" / "plans" / "renderable_pairs.py"
PAGE = ROOT / "docs" / "renderable-pairs.md"
NUMBERS = PAGE.parent / "figures" / "renderable-pairs.json"


def test_without_measured_data_the_study_is_skipped(tmp_path: Path) -> None:
    environment = {key: value for key, value in os.environ.items() if key != "PALPATE_DATA"}
    command = [sys.executable, str(PROGRAM), "--to", str(tmp_path)]
    completed = subprocess.run(command, capture_output=True, text=True, env=environment, check=False)
    assert completed.returncode == 0, completed.stderr
    assert completed.stdout.startswith("skipped: needs measured data")
    assert not list(tmp_path.iterdir())


def test_page_shows_every_pair_with_its_word_and_counts_them() -> None:
    pairs = json.loads(NUMBERS.read_text(encoding="utf-8"))
    text = PAGE.read_text(encoding="utf-8")
    assert len(pairs) >= 4 * 50
    for pair in pairs:
        row = next(
            line for line in text.splitlines() if line.startswith(f"| {pair['kind']} {pair['object']} |")
        )
        assert f"{pair['word']}" in row
    words = [pair["word"] for pair in pairs]
    counts = " | ".join(str(words.count(word)) for word in ("proved", "by account", "near rest", "no"))
    assert f"| all | all | {counts} | {len(pairs)} |" in text


def test_the_account_holds_a_pair_only_with_an_accepted_error_and_few_limited_ticks() -> None:
    for pair in json.loads(NUMBERS.read_text(encoding="utf-8")):
        if pair["word"] == "by account":
            assert pair["force_error"] <= 0.1
            assert pair["acting"] < 0.01
            assert 1.0 < pair["ratio"] < 4.2


@pytest.mark.full
def test_one_measured_switch_is_planned_on_every_linear_device(tmp_path: Path) -> None:
    data = Path(os.environ.get("PALPATE_DATA", ROOT.parent / "shared" / "data"))
    if not data.is_dir():
        pytest.skip("needs measured data, set PALPATE_DATA")
    command = [sys.executable, str(PROGRAM), "--to", str(tmp_path), "--every", "1000"]
    environment = {**os.environ, "PALPATE_DATA": str(data)}
    completed = subprocess.run(command, capture_output=True, text=True, env=environment, check=False)
    assert completed.returncode == 0, completed.stderr
    pairs = json.loads((tmp_path / "figures" / NUMBERS.name).read_text(encoding="utf-8"))
    assert {pair["device"] for pair in pairs} >= {"voice-coil", "touch"}

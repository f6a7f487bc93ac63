# SPDX-License-Identifier: Apache-2.0
"""Tests the study of predicted rendering: it simulates a few cases, draws them and fills its page."""

import json
from pathlib import Path

import pytest
from bench.limits import prediction
from bench.limits.certificate_table import table_of


@pytest.mark.full
def test_measures_draws_and_fills_both_tables(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(prediction, "PREDICTIONS", (0, 4))
    monkeypatch.setattr(prediction, "RANDOM_OBJECTS", 1)
    monkeypatch.setattr(prediction, "HANDS", ((1.0, 30.0),))
    page = tmp_path / "certificate.md"
    page.write_text(
        "<!-- prediction -->\nold\n<!-- end -->\n<!-- prediction-gain -->\nold\n<!-- end -->\n",
        encoding="utf-8",
    )
    gains = prediction.measure()
    prediction.write(gains, tmp_path)
    without_prediction, with_four_samples = gains
    assert without_prediction.ratio["mean"].tolist() == [1.0, 1.0, 1.0]
    assert with_four_samples.ratio["mean"].min() > 1.0
    assert with_four_samples.ratio["mean"].max() > 2.0
    assert with_four_samples.damping[1] > with_four_samples.damping[0] > 0.0
    assert without_prediction.friction == pytest.approx(1.0)
    assert (tmp_path / "figures" / "prediction.png").read_bytes().startswith(b"\x89PNG")
    numbers = json.loads((tmp_path / "figures" / "prediction.json").read_text())
    assert [each["samples"] for each in numbers["predictions"]] == [0, 4]
    text = page.read_text(encoding="utf-8")
    assert "old" not in text
    assert text.count("| none | ") == 2


def test_certificate_table_has_one_row_for_each_line() -> None:
    row = "damping-hold      random networks                   {}      65    {}     65 (t)         0\n"
    search_output = (
        row.format("0.00", "0.998    1.000") + row.format("0.50", "0.991    0.999") + "0 give energy\n"
    )
    table = table_of(search_output)
    assert "| `damping-hold` | random networks | 0.998 / 1.000 | – | 0.991 / 0.999 |" in table
    assert "| 65 of 65 |" in table
    assert "Of 130 certified scenes, 0 give energy." in table

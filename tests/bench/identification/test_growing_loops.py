# SPDX-License-Identifier: Apache-2.0
"""Objects whose loops grow with the distance moved: the verdict names what no model class describes."""

import pytest
from bench.identification import growing_loops


def test_loops_that_narrow_at_their_middle_are_called_pinched(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(growing_loops, "ROWS_PER_TRAVEL", 100.0)
    found = growing_loops.measured("Bouc-Wen, pinched", 4)
    assert found["verdict"] == "usable"
    assert found["nrmse"] < 0.25  # 0.38 without the largest play radius
    assert "such as earlier motion" in found["reason"]
    assert "pinching" in found["reason"]

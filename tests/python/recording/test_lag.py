# SPDX-License-Identifier: Apache-2.0
"""Tests the lag of a recorded force: estimate, interval, and recordings that do not determine it."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from bench.identification.force_lag import CASES, estimated, simulated, summary

from conftest import sampled
from palpate import InputError, Recording, read_recording
from palpate.recording.lag import LARGEST_ERROR_S, lag_of

NAMES = list(CASES)
N = len(NAMES)


def draw_of(name: str, draw: int = 0) -> int:
    return NAMES.index(name) + N * draw


@pytest.mark.parametrize(
    "name", sampled([name for name in NAMES if name != "soft spring"], "switch", "viscous, detents")
)
def test_interval_contains_the_true_lag_of_a_simulated_object(name: str) -> None:
    found = estimated(draw_of(name))
    assert found.known
    assert found.lower_s <= found.true_s <= found.upper_s
    assert found.late_s == pytest.approx(found.true_s, abs=0.002)
    assert found.upper_s - found.lower_s < 0.01


def test_correlated_noise_widens_the_interval() -> None:
    white, correlated = (estimated(draw_of("spring with detents", 3 * level + 2)) for level in (0, 1))
    assert (white.noise, correlated.noise) == (0.02, 0.02)
    assert correlated.upper_s - correlated.lower_s > 1.5 * (white.upper_s - white.lower_s)


def test_lag_of_a_smooth_spring_is_not_known() -> None:
    _, _, _, recording = simulated(draw_of("soft spring", 2))
    found = lag_of([recording])
    assert not found.known
    assert not found.is_late
    assert str(found).startswith("not known: ")
    assert found.record()["late_s"] is None


def test_lag_needs_time_one_input_and_motion() -> None:
    x = np.linspace(0.0, 1.0, 400)
    still = np.full(400, 0.5)
    time = 0.01 * np.arange(400)
    for recording, reason in (
        (Recording.from_arrays(x, x), "no time"),
        (Recording.from_arrays(x, x, time, inputs={"load": x}), "further inputs"),
        (Recording.from_arrays(still, x, time), "constant"),
        (Recording.from_arrays(x, x, time), "no turn is recorded"),
        (Recording.from_arrays(x[:9], x[:9], time[:9]), "too short"),
    ):
        assert reason in str(recording.force_lag)


def test_wide_interval_counts_as_unknown() -> None:
    estimates = [estimated(draw_of("hysteretic switch, one speed", draw)) for draw in range(9)]
    widths = {each.known: each.upper_s - each.lower_s for each in estimates}
    assert widths[True] <= 2.0 * LARGEST_ERROR_S


def test_auto_corrects_a_late_force(tmp_path: Path) -> None:
    _, _, late, recording = simulated(draw_of("switch", 0))
    file = recording.write(tmp_path / "late.csv")
    corrected = read_recording(file, force_late_s="auto")
    assert corrected.corrected_lag_s == pytest.approx(late, abs=5e-4)
    assert len(corrected) < len(recording)
    assert any(" ms late (95 %: " in note for note in corrected.notes)
    assert abs(corrected.force_lag.late_s) < 5e-4
    twice = corrected.with_force_earlier("auto")
    assert twice.corrected_lag_s == corrected.corrected_lag_s
    assert twice.notes[-1].endswith("not corrected")


def test_auto_refuses_a_recording_that_does_not_determine_the_lag(tmp_path: Path) -> None:
    _, _, _, recording = simulated(draw_of("soft spring", 2))
    file = recording.write(tmp_path / "spring.csv")
    with pytest.raises(InputError, match=r"spring.csv: the lag of the force is not known: .*; record slow"):
        read_recording(file, force_late_s="auto")
    with pytest.raises(InputError, match="column of time"):
        replace(recording, time=None).with_force_earlier("auto")
    with pytest.raises(InputError, match="a number of seconds or 'auto'"):
        recording.with_force_earlier("fast")  # type: ignore[arg-type]


def test_summary_counts_known_lags_and_those_inside_the_interval() -> None:
    estimates = [estimated(draw_of(name, 2)) for name in ("soft spring", "viscous, detents")]
    of_both = summary(estimates)
    assert (of_both["recordings"], of_both["known"], of_both["inside"]) == (2, 1, 1)
    assert abs(of_both["bias_ms"]) < 0.5
    assert math.isnan(summary(estimates[:1])["bias_ms"])

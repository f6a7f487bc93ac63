# SPDX-License-Identifier: Apache-2.0
"""Tests that noise on a straight line is not taken for structure, on a small sample of the study."""

import os

import numpy as np
import pytest
from bench.identification.noise import CASES, coarse_force, held_force, identified, measure, repeated_rows

UNEVEN = "noise that grows with position"

SAMPLED = ("white noise", UNEVEN)

DRAWS = 2 if os.environ.get("PALPATE_TEST_SCALE", "1") == "1" else 4


@pytest.mark.parametrize(
    "case",
    [case if case in SAMPLED else pytest.param(case, marks=pytest.mark.full) for case in CASES],
)
def test_noise_on_a_line_adds_no_wavelet_and_no_hysteresis(case: str) -> None:
    found = measure(case, DRAWS, jobs=1)
    assert (found["no_wavelet"], found["no_hysteresis"], found["draws"]) == (DRAWS, DRAWS, DRAWS)
    if not case.startswith("force held"):
        assert found["no_velocity"] >= DRAWS - 1  # one of 100 draws of correlated noise has damping


def test_cases_have_repeated_rows_held_forces_and_few_levels() -> None:
    for recording in (repeated_rows(1), held_force(1)):
        assert np.mean(np.diff(recording.force) == 0.0) > 0.75
    coarse = coarse_force(1)
    assert coarse.time is None
    assert len(np.unique(coarse.force)) < 512


def test_draw_with_larger_noise_where_the_force_is_large_needs_no_wavelet() -> None:
    """With one noise level for all rows, the criterion would add wavelets in these draws."""
    for draw in (2, 20, 25):
        assert identified(UNEVEN, draw)[0]

# SPDX-License-Identifier: Apache-2.0
"""A model of corrupted recordings whose reported error is far below its true error has no good verdict."""

import os

import pytest

from corruptions import KINDS, base_names, case_of, clean_outcome, described, outcome_of, table

COUNT = 30 if int(os.environ.get("PALPATE_TEST_SCALE", "1")) == 1 else 300


@pytest.mark.parametrize("kind", KINDS)
def test_a_corrupted_recording_gives_a_correct_error_or_a_warning_that_names_a_cause(kind: str) -> None:
    first = list(KINDS).index(kind)
    outcomes = [outcome_of(case_of(seed)) for seed in range(first, COUNT, len(KINDS))]
    print(table(outcomes))
    assert [described(each) for each in outcomes if each.unreported] == []


@pytest.mark.parametrize("name", base_names())
def test_a_clean_recording_gets_the_verdict_good(name: str) -> None:
    found = clean_outcome(name)
    assert found.level == "good", described(found)
    assert found.correct_error, described(found)

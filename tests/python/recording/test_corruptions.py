# SPDX-License-Identifier: Apache-2.0
"""A model of corrupted recordings whose reported error is far below its true error has no good verdict."""

import pytest

from any_input import SCALE
from conftest import sampled
from corruptions import KINDS, base_names, case_of, clean_outcome, described, outcome_of, table

SEEDS = range(27, 36) if SCALE == 1 else range(300)


@pytest.mark.parametrize("kind", KINDS)
def test_a_corrupted_recording_gives_a_correct_error_or_a_warning_that_names_a_cause(kind: str) -> None:
    outcomes = [outcome_of(case_of(seed)) for seed in SEEDS if list(KINDS)[seed % len(KINDS)] == kind]
    print(table(outcomes))
    assert [described(each) for each in outcomes if each.unreported] == []


RELAXING = {"switch_springs/linear_housing_tx_short_45g.csv": "relaxation"}
"""Clean recordings whose force changes while the tool waits, by 2 gf, and the cause to be named"""


@pytest.mark.parametrize(
    "name",
    sampled(
        base_names(),
        "sample",
        "P1",
        "sweeps",
        "keyswitches/clicky__cherry_mx_blue.csv",
    ),
)
def test_a_clean_recording_gets_the_verdict_good_unless_its_force_changes_in_a_wait(name: str) -> None:
    found = clean_outcome(name)
    if name in RELAXING:
        assert found.level == "usable", described(found)
        assert [RELAXING[name] in reason for reason in found.reasons] == [True]
    else:
        assert found.level == "good", described(found)
    assert found.correct_error, described(found)

# SPDX-License-Identifier: Apache-2.0
"""A model of corrupted recordings whose reported error is far below its true error has no good verdict."""

from collections.abc import Sequence

import pytest

from any_input import SCALE
from conftest import sampled
from corruptions import KINDS, base_names, case_of, clean_outcome, described, outcome_of, table

FEW_SECONDS = (27, 19, 29, 30, 85, 23, 276, 79, 44)
"""One seed of each kind whose recording is identified fast"""

OTHERS = range(27, 36) if SCALE == 1 else range(300)


@pytest.mark.parametrize("seeds", sampled([FEW_SECONDS, OTHERS], FEW_SECONDS), ids=["fast", "others"])
@pytest.mark.parametrize("kind", KINDS)
def test_a_corrupted_recording_gives_a_correct_error_or_a_warning_that_names_a_cause(
    kind: str, seeds: Sequence[int]
) -> None:
    outcomes = [outcome_of(case_of(seed)) for seed in seeds if list(KINDS)[seed % len(KINDS)] == kind]
    assert outcomes
    print(table(outcomes))
    assert [described(each) for each in outcomes if each.unreported] == []


RELAXING = {"switch_springs/linear_housing_tx_short_45g.csv": "relaxation"}
"""Clean recordings whose force changes while the tool waits, by 2 gf, and the cause to be named"""


@pytest.mark.parametrize(
    "name",
    sampled(base_names(), "sample", "sweeps"),
)
def test_a_clean_recording_gets_the_verdict_good_unless_its_force_changes_in_a_wait(name: str) -> None:
    found = clean_outcome(name)
    if name in RELAXING:
        assert found.level == "usable", described(found)
        assert [RELAXING[name] in reason for reason in found.reasons] == [True]
    else:
        assert found.level == "good", described(found)
    assert found.correct_error, described(found)

# SPDX-License-Identifier: Apache-2.0
"""Settings of identification: texts of a command line; refusals with the field, its value and the cure."""

from typing import Any

import pytest

from palpate import InputError
from palpate.identification import IdentifyOptions
from palpate.identification.options import SearchOptions, described_fields, options_from


def test_settings_of_the_search_are_read_from_texts_by_the_type_of_their_default() -> None:
    given = {
        "patience": "5",
        "frame_scale": "1.5",
        "play_radius": "0.01,0.02",
    }
    read = SearchOptions.parsed(given)
    assert read == SearchOptions(patience=5, frame_scale=1.5, play_radius=(0.01, 0.02))
    assert isinstance(read.patience, int)


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        ({"patiense": "5"}, "search has no setting 'patiense'"),
        ({"xyz": "5"}, "its settings are evidence, patience"),
        ({"patience": "5.5"}, "patience is '5.5': must be a whole number"),
        ({"frame_scale": "wide"}, "frame_scale is 'wide': must be a number"),
        ({"play_radius": "0.1;0.2"}, "play_radius is '0.1;0.2': must be numbers joined by commas"),
        ({"selection": "backward"}, "search has no setting 'selection'; its settings are evidence"),
    ],
)
def test_texts_without_a_setting_or_a_value_are_refused(given: dict[str, str], sentence: str) -> None:
    with pytest.raises(InputError) as refused:
        SearchOptions.parsed(given)
    assert sentence in str(refused.value)


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        ({"patience": 0}, "patience is 0: must be a whole number >= 1"),
        ({"patience": True}, "patience is True: must be a whole number >= 1"),
        ({"frame_scale": 1.0}, "frame_scale is 1.0: must be a finite number > 1"),
        ({"evidence": float("nan")}, "evidence is nan: must be a finite number"),
        ({"play_radius": ()}, "play_radius is (): must be a tuple of shares of the travel"),
        ({"play_radius": 0.1}, "play_radius is 0.1: must be a tuple of shares of the travel"),
        ({"play_radius": (0.1, 0.0)}, "play_radius is 0.0: must be a finite number > 0"),
    ],
)
def test_values_outside_their_range_are_refused(given: dict[str, Any], sentence: str) -> None:
    with pytest.raises(InputError) as refused:
        SearchOptions(**given)
    assert sentence in str(refused.value)


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        ({"inputs": 2}, 'inputs is 2: must be "auto" or a tuple of names'),
        ({"inputs": ("velocity",)}, "inputs is 'velocity'; use \"auto\", or position and the further inputs"),
        ({"search": "backward"}, "must be a SearchOptions"),
        ({"inputs": ("position", 2)}, 'must be "auto" or a tuple of names'),
        ({"fixed_force": (0.1,)}, "fixed_force is (0.1,): must be (position, force)"),
        ({"fixed_force": (0.1, float("inf"))}, "must be (position, force)"),
        ({"slope_bounds": (3.0, 1.0)}, "slope_bounds is (3.0, 1.0): must be (min, max) with min < max"),
        ({"slope_bounds": (-3.0, -1.0), "monotone": True}, "a slope of at least 0 and at most -1"),
    ],
)
def test_impossible_options_are_refused(given: dict[str, Any], sentence: str) -> None:
    with pytest.raises(InputError) as refused:
        IdentifyOptions(**given)
    assert sentence in str(refused.value)


def test_every_field_of_the_options_is_described() -> None:
    text = described_fields(SearchOptions)
    for name in ("frame_scale", "play_radius", "contact_share"):
        assert name in text


def test_an_unknown_option_is_refused_with_a_similar_name() -> None:
    with pytest.raises(InputError, match="monotone"):
        options_from({"monoton": True})

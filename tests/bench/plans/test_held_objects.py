# SPDX-License-Identifier: Apache-2.0
"""Tests the tables of measured objects with held lines against their numbers, and the study."""

import json
from pathlib import Path

import numpy as np
import pytest
from bench.plans import held_objects

from palpate import DeviceProfile, Model
from palpate.planning import example_profiles

ROOT = Path(__file__).parents[3]
PAGE = ROOT / "docs" / "held-lines.md"
NUMBERS = PAGE.parent / "figures" / "held-objects.json"


def key_by_hand() -> Model:
    """Returns a tactile switch of 4 mm travel whose press is 0.1 N above its release."""
    return Model.from_network(
        units={"position": "m", "force": "N"},
        alpha=[[2000.0]],
        beta=[[0.002]],
        weight=[-0.2],
        linear=[100.0],
        bias=0.3,
        weight_hysteresis=[0.0],
        linear_hysteresis=[0.0],
        bias_hysteresis=0.05,
        lower=[0.0],
        upper=[0.004],
        below="free",
    )


def test_page_shows_the_stored_numbers() -> None:
    content = json.loads(NUMBERS.read_text(encoding="utf-8"))
    pairs = [held_objects.Pair(**row) for row in content["pairs"]]
    curves = [held_objects.Curve(**row) for row in content["curves"]]
    text = PAGE.read_text(encoding="utf-8")
    assert all(table in text for table in held_objects.tables(pairs, curves).values())
    assert all(pair.line for pair in pairs if pair.hold)


def test_an_object_on_a_lever_has_its_torque() -> None:
    key = key_by_hand()
    turned = held_objects.on_lever(key)
    x = np.linspace(0.0, 0.004, 50)
    r = held_objects.LEVER_M
    for side in (1.0, -1.0):
        assert turned.force(x / r, direction=side) == pytest.approx(r * key.force(x, direction=side))
    assert turned.units == {"position": "rad", "force": "N*m"}


def test_a_press_curve_is_that_of_the_press() -> None:
    key = key_by_hand()
    x = np.linspace(0.0, 0.004, 50)
    assert held_objects.press_curve(key, 2.0).force(x) == pytest.approx(2.0 * key.force(x, direction=1.0))


@pytest.mark.full
def test_a_held_line_certifies_steeper_multiples_of_a_press_curve() -> None:
    moteus = DeviceProfile.load(example_profiles()["moteus-r4"][0])
    found = held_objects.curve_on(key_by_hand(), moteus)
    assert 1.5 * found.hold < found.any_speed <= 1.01 * found.line < found.inner

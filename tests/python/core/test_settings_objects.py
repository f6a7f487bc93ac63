# SPDX-License-Identifier: Apache-2.0
"""Settings of a rendering as values: pickled, copied and compared by one list of fields."""

from __future__ import annotations

import copy
import pickle
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import palpate
from conftest import ROOT
from models_by_hand import model_by_hand
from palpate import load_model
from palpate._core.device import DeviceProfile
from palpate._core.rendering import Scheme
from palpate._core.simulation import Hand
from palpate._core.stability import ForceBounds, Inequality, certify
from palpate.planning import Plan, rig_for

GOOD = ROOT / "tests" / "models" / "good"

CHANGED: dict[str, Any] = {
    "Scheme": Scheme(structure="implicit", coupling_stiffness=1 / 3, mass=1e-7, play_radius=0.1),
    "Hand": Hand(stiffness=1 / 3, damping=0.1, lower=-1e-9, upper=2.0, frequency_hz=0.7),
    "DeviceProfile": DeviceProfile(id="it's", encoder_step=1e-7, delay_s=3e-4, position_unit="m"),
    "ForceBounds": ForceBounds(
        slope_min=-0.1, slope_max=1 / 3, steepest=2.0, sliding=1.0, loss_max=1e-9, hysteresis=True
    ),
    "Inequality": Inequality(
        id="i", name="a", formula="b > c", left=1 / 3, right=0.1, basis="linear", source="s", strict=True
    ),
    "TestRig": rig_for(model_by_hand()),
    "Certificate": certify(model_by_hand(), Scheme(structure="direct"), DeviceProfile()),
}
COPIES: list[Callable[[Any], Any]] = [
    lambda value: pickle.loads(pickle.dumps(value)),
    lambda value: pickle.loads(pickle.dumps(value, protocol=2)),
    copy.copy,
    copy.deepcopy,
]


@pytest.mark.parametrize("copied", COPIES, ids=["pickle", "pickle 2", "copy", "deepcopy"])
@pytest.mark.parametrize("name", CHANGED)
def test_a_copy_equals_the_original(name: str, copied: Callable[[Any], Any]) -> None:
    value = CHANGED[name]
    again = copied(value)
    assert type(again) is type(value)
    assert again == value
    assert hash(again) == hash(value)
    assert repr(again) == repr(value)


@pytest.mark.parametrize("name", CHANGED)
def test_the_fields_of_a_copy_are_the_arguments_of_the_constructor(name: str) -> None:
    """A field in the constructor but not in the list would be lost in a copy."""
    value = CHANGED[name]
    rebuild, arguments = value.__reduce__()
    assert arguments == ()
    assert set(rebuild.keywords) == set(
        re.findall(r"(\w+): ", type(value).__init__.__doc__.split("self: ")[1])
    ) - {"palpate"}


def test_values_that_differ_in_one_field_are_not_equal() -> None:
    for name, value in CHANGED.items():
        if name in ("TestRig", "Certificate", "Inequality", "ForceBounds"):
            continue
        fields = value.__reduce__()[0].keywords
        for field, content in fields.items():
            if isinstance(content, float):
                assert type(value)(**{**fields, field: content + 1e-3}) != value, field
    assert Scheme() != Hand()
    assert Scheme() != 1


def test_numbers_of_a_repr_are_exact() -> None:
    assert "encoder_step=1e-07" in repr(CHANGED["DeviceProfile"])
    assert eval(repr(CHANGED["Scheme"]), {"Scheme": Scheme}) == CHANGED["Scheme"]


@pytest.mark.parametrize("copied", COPIES, ids=["pickle", "pickle 2", "copy", "deepcopy"])
def test_a_device_profile_of_python_stays_one(copied: Callable[[Any], Any]) -> None:
    profile = palpate.DeviceProfile(id="mine", inertia=1 / 3)
    again = copied(profile)
    assert type(again) is palpate.DeviceProfile
    assert again == profile
    assert again.id == "mine"


@pytest.mark.parametrize("copied", COPIES, ids=["pickle", "pickle 2", "copy", "deepcopy"])
@pytest.mark.parametrize(
    "name", ["plan_and_certificate", "certificate_massless", "certificate_hysteresis", "certificate_velocity"]
)
def test_a_plan_with_its_certificate_is_copied(
    name: str, copied: Callable[[Any], Any], tmp_path: Path
) -> None:
    plan = Plan.of(load_model(GOOD / f"{name}.json"))
    assert plan.certificate is not None
    again = copied(plan)
    assert again.scheme == plan.scheme
    assert again.certificate == plan.certificate
    assert again.record() == plan.record()
    assert again.refused == plan.refused
    assert again.force_error == plan.force_error
    assert again.verdict == plan.verdict
    assert again.model.to_dict() == plan.model.to_dict()
    plan.stored().save(tmp_path / "one.json")
    again.stored().save(tmp_path / "two.json")
    assert (tmp_path / "one.json").read_bytes() == (tmp_path / "two.json").read_bytes()

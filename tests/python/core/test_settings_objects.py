# SPDX-License-Identifier: Apache-2.0
"""Settings of a rendering are pickled, copied and compared by their one list of fields."""

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

SETTINGS: dict[str, Any] = {
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
COPY_FUNCTIONS: list[Callable[[Any], Any]] = [
    lambda value: pickle.loads(pickle.dumps(value)),
    lambda value: pickle.loads(pickle.dumps(value, protocol=2)),
    copy.copy,
    copy.deepcopy,
]


@pytest.mark.parametrize("make_copy", COPY_FUNCTIONS, ids=["pickle", "pickle 2", "copy", "deepcopy"])
@pytest.mark.parametrize("name", SETTINGS)
def test_a_copy_equals_the_original(name: str, make_copy: Callable[[Any], Any]) -> None:
    value = SETTINGS[name]
    copied = make_copy(value)
    assert type(copied) is type(value)
    assert copied == value
    assert hash(copied) == hash(value)
    assert repr(copied) == repr(value)


@pytest.mark.parametrize("name", SETTINGS)
def test_a_copy_has_every_argument_of_the_constructor(name: str) -> None:
    """A field that the constructor takes but the list of fields leaves out would be lost in a copy."""
    value = SETTINGS[name]
    constructor, arguments = value.__reduce__()
    assert arguments == ()
    assert set(constructor.keywords) == set(
        re.findall(r"(\w+): ", type(value).__init__.__doc__.split("self: ")[1])
    ) - {"palpate"}


def test_values_that_differ_in_one_field_are_not_equal() -> None:
    for name, value in SETTINGS.items():
        if name in ("TestRig", "Certificate", "Inequality", "ForceBounds"):
            continue
        fields = value.__reduce__()[0].keywords
        for field, field_value in fields.items():
            if isinstance(field_value, float):
                assert type(value)(**{**fields, field: field_value + 1e-3}) != value, field
    assert Scheme() != Hand()
    assert Scheme() != 1


def test_numbers_of_a_repr_are_exact() -> None:
    assert "encoder_step=1e-07" in repr(SETTINGS["DeviceProfile"])
    assert eval(repr(SETTINGS["Scheme"]), {"Scheme": Scheme}) == SETTINGS["Scheme"]


@pytest.mark.parametrize("make_copy", COPY_FUNCTIONS, ids=["pickle", "pickle 2", "copy", "deepcopy"])
def test_a_copy_of_a_python_device_profile_is_a_python_device_profile(
    make_copy: Callable[[Any], Any],
) -> None:
    profile = palpate.DeviceProfile(id="mine", inertia=1 / 3)
    copied = make_copy(profile)
    assert type(copied) is palpate.DeviceProfile
    assert copied == profile
    assert copied.id == "mine"


@pytest.mark.parametrize("make_copy", COPY_FUNCTIONS, ids=["pickle", "pickle 2", "copy", "deepcopy"])
@pytest.mark.parametrize(
    "name", ["plan_and_certificate", "certificate_massless", "certificate_hysteresis", "certificate_velocity"]
)
def test_a_copied_plan_has_the_same_certificate_and_file(
    name: str, make_copy: Callable[[Any], Any], tmp_path: Path
) -> None:
    plan = Plan.of(load_model(GOOD / f"{name}.json"))
    assert plan.certificate is not None
    copied = make_copy(plan)
    assert copied.scheme == plan.scheme
    assert copied.certificate == plan.certificate
    assert copied.record() == plan.record()
    assert copied.refused == plan.refused
    assert copied.force_error == plan.force_error
    assert copied.verdict == plan.verdict
    assert copied.model.to_dict() == plan.model.to_dict()
    plan.stored().save(tmp_path / "one.json")
    copied.stored().save(tmp_path / "two.json")
    assert (tmp_path / "one.json").read_bytes() == (tmp_path / "two.json").read_bytes()

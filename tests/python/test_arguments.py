# SPDX-License-Identifier: Apache-2.0
"""Every public callable refuses an argument of a wrong type by an InputError that names the argument."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

import palpate
from palpate import (
    DeviceProfile,
    Finding,
    Hand,
    IdentifyOptions,
    InputError,
    Model,
    Plan,
    Recording,
    Scheme,
    Verdict,
    WaveletNetworkRegressor,
    frame_bounds,
    identify,
    identify_files,
    load_model,
    plan,
    read_recording,
    simulate,
    verify,
)

X = np.linspace(0.0, 0.4, 60)
RECORDING = Recording.from_arrays(X, 5.0 * X, units={"position": "rad", "force": "N*m"})
MODEL = identify(RECORDING)
DEVICE = DeviceProfile()
PLAN = plan(MODEL, DEVICE)

WRONG_VALUES: dict[str, Any] = {
    "none": None,
    "int": 3,
    "nan": float("nan"),
    "str": "\0",
    "bytes": b"press.csv",
    "dict": {"a": 1},
    "object": object(),
    "function": len,
    "empty_list": [],
    "list_with_none": [None, 1.0],
    "empty_array": np.array([]),
    "two_dimensional": np.zeros((2, 2)),
    "text_array": np.array(["a", "b"]),
    "object_text_array": X.astype(str).astype(object),
    "complex_array": X * 1j,
    "masked_array": np.ma.masked_array(X, X > 0.2),
    "frame": pd.DataFrame({"a": [1, 2]}),
}

NUMBERS = {"int", "nan", "empty_list", "empty_array", "two_dimensional", "frame"}
"""Names of test values that are wrong for most arguments but right as arrays of numbers."""

REFUSED_AS_TYPE = {"object", "function", "none", "dict"}
"""Names of test values for which scikit-learn requires a TypeError instead of an InputError."""


def model_with(**changes: Any) -> Model:
    """Returns a new model with the arguments of the given model, some of them changed."""
    names = ("kind", "inputs", "units", "alpha", "beta", "weight", "linear", "bias", "lower", "upper")
    arguments = {name: getattr(MODEL, name) for name in (*names, "fit", "data")}
    return Model(**{**arguments, **changes})


Call = Callable[[Any], object]

# Calls of every public callable with one test value as one argument; some test values are right for it.
CALLS: dict[str, tuple[Call, str, set[str]]] = {
    # name: (call with one test value, argument that the error message names, valid test values)
    "identify": (identify, "recording|frame", set()),
    "identify in a list": (lambda v: identify([RECORDING, v]), "recording|frame", set()),
    "identify objects": (lambda v: identify(objects=v), "objects|recording", set()),
    "identify position": (lambda v: identify(v, X), "position|force", set()),
    "identify force": (lambda v: identify(X, v), "force|recording", set()),
    "identify time": (lambda v: identify(X, X, time=v), "time", {"none"}),
    "identify direction": (lambda v: identify(X, X, direction=v), "direction", {"none"}),
    "identify max_wavelets": (lambda v: identify(RECORDING, max_wavelets=v), "max_wavelets", {"int"}),
    "verify model": (lambda v: verify(v, RECORDING), "model", set()),
    "verify recording": (lambda v: verify(MODEL, v), "recording|frame", set()),
    "verify position": (lambda v: verify(MODEL, v, X), "position|force", set()),
    "verify force": (lambda v: verify(MODEL, X, v), "force|recording", set()),
    "from_arrays position": (lambda v: Recording.from_arrays(v, X), "position|force", set()),
    "from_arrays force": (lambda v: Recording.from_arrays(X, v), "force", set()),
    "from_arrays inputs": (
        lambda v: Recording.from_arrays(X, X, inputs=v),
        "inputs|a has",
        {"none", "frame"},
    ),
    "from_arrays units": (lambda v: Recording.from_arrays(X, X, units=v), "units", {"none", "dict"}),
    "from_frame": (Recording.from_frame, "frame", set()),
    "from_frame invalid": (lambda v: Recording.from_frame(pd.DataFrame(), invalid=v), "invalid", set()),
    "split": (RECORDING.split, "every", {"int"}),
    "with_force_earlier": (
        lambda v: Recording.from_arrays(X, X, time=X).with_force_earlier(v),
        "late_s|late by",
        set(),
    ),
    "write": (RECORDING.write, "path", set()),
    "read_recording": (read_recording, "path", set()),
    "load_model": (load_model, "path", set()),
    "save": (MODEL.save, "path", set()),
    "identify_files": (identify_files, "file", set()),
    "profile load": (DeviceProfile.load, "path", set()),
    "profile save": (DEVICE.save, "path", set()),
    "plan model": (lambda v: plan(v, DEVICE), "model", set()),
    "simulate plan": (lambda v: simulate(v, DEVICE, Hand(), 0.1), "plan", set()),
    "simulate device": (lambda v: simulate(PLAN, v, Hand(), 0.1), "device", set()),
    "simulate hand": (lambda v: simulate(PLAN, DEVICE, v, 0.1), "hand", set()),
    "simulate duration": (lambda v: simulate(PLAN, DEVICE, Hand(), v), "duration", {"int"}),
    "Plan model": (lambda v: Plan(v, Scheme()), "model", set()),
    "Plan scheme": (lambda v: Plan(MODEL, v), "scheme", set()),
    "Plan.of": (Plan.of, "model", set()),
    "frame_bounds a0": (lambda v: frame_bounds(v, 0.5), "a0", {"int"}),
    "frame_bounds b0": (lambda v: frame_bounds(2.0, v), "b0", {"int"}),
    "frame_bounds voices": (lambda v: frame_bounds(2.0, 0.5, v), "voices", {"int"}),
    "Hand": (lambda v: Hand(stiffness=v), "stiffness", {"int", "nan"}),
    "Hand by position": (Hand, "Hand", set()),
    "Scheme number": (lambda v: Scheme(coupling_stiffness=v), "coupling_stiffness", {"int", "nan"}),
    "Scheme structure": (lambda v: Scheme(structure=v), "structure", set()),
    "Scheme compensated": (lambda v: Scheme(compensated=v), "compensated", {"none", "int", "nan"}),
    "DeviceProfile id": (lambda v: DeviceProfile(id=v), "id", {"str", "bytes"}),
    "DeviceProfile number": (lambda v: DeviceProfile(inertia=v), "inertia", {"int"}),
    "Scheme whole number": (lambda v: Scheme(structure="direct", predict=v), "predict", {"int"}),
    "Finding level": (lambda v: Finding(v, "sentence"), "level", set()),
    "Finding sentence": (lambda v: Finding("usable", v), "sentence", {"str"}),
    "Verdict": (Verdict, "findings", set()),
    "Model alpha": (lambda v: model_with(alpha=v), "alpha", {"empty_list", "empty_array"}),
    "Model bias": (lambda v: model_with(bias=v), "bias", {"int"}),
    "Model period": (lambda v: model_with(period=v), "period", {"none", "int"}),
    "Model fit": (lambda v: model_with(fit=v), "fit", set()),
    "Model data": (lambda v: model_with(data=v), "data", set()),
    "Model units": (lambda v: model_with(units=v), "units|position", set()),
    "Model kind": (lambda v: model_with(kind=v), "kind", set()),
    "Model inputs": (lambda v: model_with(inputs=v), "inputs", set()),
    "Model": (lambda v: Model.from_dict(v), "", set()),
    "force position": (
        MODEL.force,
        "position",
        NUMBERS,
    ),
    "force direction": (lambda v: MODEL.force(0.1, direction=v), "direction", {"none", "int", "nan"}),
    "slope": (MODEL.slope, "position", NUMBERS),
    "energy": (MODEL.energy, "position", NUMBERS),
    "predict": (MODEL.predict, "X", {"frame"}),
    "extrapolated": (
        MODEL.extrapolated,
        "position",
        NUMBERS,
    ),
    "regressor X": (lambda v: WaveletNetworkRegressor().fit(v, X), "X", REFUSED_AS_TYPE),
    "regressor y": (
        lambda v: WaveletNetworkRegressor().fit(X[:, None], v),
        "y",
        {"object", "function", "frame", "object_text_array"},  # scikit-learn converts text
    ),
    "regressor weight": (
        lambda v: WaveletNetworkRegressor().fit(X[:, None], X, sample_weight=v),
        "sample_weight",
        {"none"},
    ),
}

OPTIONS: dict[str, set[str]] = {
    name: {"int"} if isinstance(default, (int, float)) and not isinstance(default, bool) else set()
    for name, default in (
        (each, getattr(IdentifyOptions(), each)) for each in IdentifyOptions.__annotations__
    )
}
"""Fields of IdentifyOptions, and the names of the test values that are right for each field."""

OPTIONAL = ("search", "slope_bounds", "fixed_force", "coupling_stiffness", "period")


def message_of(call: Call, wrong_value: str) -> str:
    """Returns the message of the InputError of a call; fails if another or no error is raised."""
    try:
        call(WRONG_VALUES[wrong_value])
    except InputError as error:
        return str(error)
    except Exception as error:
        pytest.fail(f"{wrong_value} raises {error!r}")
    pytest.fail(f"{wrong_value} is not refused")


@pytest.mark.parametrize("call", CALLS)
def test_a_wrong_type_is_an_input_error_that_names_the_argument(
    call: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    function, names, accepted = CALLS[call]
    for wrong_value in (each for each in WRONG_VALUES if each not in accepted):
        message = message_of(function, wrong_value)
        assert any(name in message for name in names.split("|")), (wrong_value, message)
        assert "\n" not in message, wrong_value
        assert len(message) < 500, wrong_value


@pytest.mark.parametrize("field", OPTIONS)
def test_an_option_of_a_wrong_type_is_refused_by_its_name(field: str) -> None:
    accepted = OPTIONS[field] | ({"none", "int"} if field in OPTIONAL[3:] else set())
    accepted |= {"none"} if field in OPTIONAL else set()
    for wrong_value in (each for each in WRONG_VALUES if each not in accepted):
        message = message_of(lambda value: IdentifyOptions(**{field: value}), wrong_value)
        assert field in message, (wrong_value, message)


def test_every_public_callable_is_in_the_table() -> None:
    """The classes Verification and InputError are not in the table, because users do not construct them."""
    tested_in_other_files = {"Verification", "InputError", "Recording", "IdentifyOptions", "SearchOptions"}
    tested = {name.split()[0].split(".")[0] for name in CALLS}
    public = {name for name in palpate.__all__ if callable(getattr(palpate, name))}
    missing = public - tested - tested_in_other_files
    assert missing == {"WaveletNetworkRegressor"}, "its entries are named regressor"
